"""Tolerances of judgement, and the longest period number asked for."""

from __future__ import annotations

from nonsmooth.flow.arguments import whole_number
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import RTOL

__all__ = ["longest_period", "tolerance_of"]

LONGEST = 16  # period number looked for where none is given and as many points are kept
TOLERANCE = 1e-9  # of a return, in units of the motion's size


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
