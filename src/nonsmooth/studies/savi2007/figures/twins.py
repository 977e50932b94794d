"""Neighbouring starts on an attractor: how fast they part tells chaos from a long period."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth import poincare
from nonsmooth.studies.savi2007.flows import EXACT, Flow

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth import System

__all__ = ["twins"]

PAIRS = 400
RETURNS = 12
APART = {"exact": 1e-9, "smoothed": 1e-6}  # m; above what rounding (exact) or rtol 1e-6 (smoothed) does by itself


def twins(flow: Flow, system: System, attractor: xr.Dataset) -> xr.Dataset:
    """Sections from points of an ``attractor`` (the first half of the starts) and from their twins (the second).

    A twin begins 1e-9 m beside its point in x (1e-6 m for the smoothed switch).
    """
    points = attractor["section"].transpose("iterate", "state").values
    chosen = points[np.linspace(0, len(points) - 1, PAIRS).astype(int)]
    beside = chosen + np.array([APART[flow.key], 0.0])
    options = flow.options if flow is EXACT else {**flow.options, "rtol": 1e-9}
    return poincare(system, start=[list(map(float, u)) for u in (*chosen, *beside)], n=RETURNS, **options)
