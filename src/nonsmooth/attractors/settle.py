"""Tolerances of judgement, the longest period number asked for, and a warning of motions that are too small."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.attractors.settled import LEAST
from nonsmooth.flow.arguments import whole_number
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import RTOL

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["longest_period", "tolerance_of", "warn_if_small"]

RESTING = 5e-7  # in units of the scales: smaller values of a state are rounding beside the others
NOTHING = 1e-15  # and beside none
LONGEST = 16  # period number looked for where none is given and as many points are kept
TOLERANCE = 1e-9  # of a return, in units of the motion's size


def warn_if_small(system: System, *sizes: FloatArray) -> None:
    """Warn of states that never leave the size below which a motion counts as rest.

    Parameters
    ----------
    *sizes : array (..., n)
        Values of the states: starts, extremes.
    """
    scale = system.scale_vector()
    largest = np.max([np.nanmax(np.abs(one).reshape(-1, len(scale)), axis=0, initial=0.0) for one in sizes], axis=0)
    small = np.flatnonzero((largest > RESTING * scale) & (largest < LEAST * scale))
    if not small.size and (largest < LEAST * scale).all():  # nothing moves much: not at rest beside a motion
        small = np.flatnonzero(largest > NOTHING * scale)
    if small.size:
        names = list(system.states)
        told = ", ".join(f"{names[j]!r}: {largest[j]:.2g}" for j in small)
        warnings.warn(
            f"{system.name!r}: these states stay below {LEAST:g} of their scale, where a motion counts as rest, so "
            f"attractors may not be told apart or found; give System(scale={{{told}}})",
            stacklevel=3,
        )


def tolerance_of(engine: Engine, rtol: float | None) -> float:
    """Tolerance of a return, in units of the motion's size: no less than the engine's own tolerance shows."""
    return TOLERANCE if engine.name == "exact" else max(TOLERANCE, 10.0 * getattr(engine, "rtol", RTOL))


def longest_period(keep: int, max_period: object) -> int:
    """``max_period`` as a whole number that ``keep`` section points can show; where None, up to 16.

    Raises
    ------
    ValueError, TypeError
        One that is not, or not a whole number from 1.
    """
    if max_period is None:
        return min(LONGEST, keep - 1)
    longest = whole_number(max_period, "max_period", 1)
    if longest >= keep:
        raise ValueError(
            f"max_period = {longest}: {keep} kept section points show periods up to {keep - 1} only; raise keep above "
            "max_period, or lower max_period"
        )
    return longest
