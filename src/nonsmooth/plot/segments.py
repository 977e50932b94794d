"""Curves of a trajectory: cut where the state jumps, and told apart by mode."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["pieces_by_mode", "with_gaps"]


def with_gaps(result: xr.Dataset, *curves: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The curves with NaN between the two limits of every crossing at which the state jumped."""
    segment, u = result["segment"].values, result["u"].values
    jump = (np.diff(segment) != 0) & np.any(np.abs(np.diff(u, axis=0)) > 0, axis=1)
    at = np.flatnonzero(jump) + 1
    return [np.insert(curve.astype(float), at, np.nan) for curve in curves]


def pieces_by_mode(mode: NDArray[np.integer], *curves: NDArray[np.float64]) -> list[list[NDArray[np.float64]]]:
    """For each mode the curves, NaN where another mode rules; entry k belongs to mode k."""
    return [[np.where(mode == k, curve, np.nan) for curve in curves] for k in range(int(mode.max(initial=0)) + 1)]
