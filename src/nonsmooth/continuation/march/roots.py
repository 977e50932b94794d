"""Zeros of a number along a curve, by Brent's method on points of the curve itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

__all__ = ["zero_on"]

T = TypeVar("T")


def zero_on(at: Callable[[float], T | None], end: float, number: Callable[[T], float]) -> tuple[float, T] | None:
    """The zero of ``number`` between the distances 0 and ``end``: its distance, and the point ``at`` it.

    None where there is no change of sign, or where a trial has no point (``at`` gives None) or no number (NaN).
    """
    from scipy.optimize import brentq

    known: dict[float, T] = {}

    def value(s: float) -> float:
        point = at(s)
        if point is None:
            raise ArithmeticError
        known[s] = point
        x = number(point)
        if x != x:
            raise ArithmeticError
        return x

    try:
        s = float(brentq(value, 0.0, end, xtol=1e-16, rtol=1e-15))
        if s not in known:
            value(s)
    except (ArithmeticError, ValueError, RuntimeError):
        return None
    return s, known[s]
