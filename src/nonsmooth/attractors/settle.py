"""Tolerance of judgement."""

from __future__ import annotations

from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import RTOL

__all__ = ["tolerance_of"]

TOLERANCE = 1e-9  # of a return, in units of the motion's size


def tolerance_of(engine: Engine) -> float:
    """Tolerance of a return, in units of the motion's size: no less than the engine's own tolerance shows."""
    return TOLERANCE if engine.name == "exact" else max(TOLERANCE, 10.0 * getattr(engine, "rtol", RTOL))
