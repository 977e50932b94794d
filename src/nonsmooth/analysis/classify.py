"""Period numbers that are known, not assumed.

Section points s_0, s_1, ... after a transient look periodic long before they are, most of all near a flip, where
they approach like |mu|^k with mu close to -1. Here period p is granted only with a certificate: the return after
p sections is small, r_p = |s_{k+p} - s_k| <= tolerance; the multipliers of the p-th return map, by finite
differences at the last point, lie inside |mu| < 1 - MARGIN; and the orbit, which is then at most r_p / (1 - |mu|)
away, is farther from each shorter period than that. What does not qualify but is nearly periodic is slow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nonsmooth.flow.arguments import whole_number
from nonsmooth.flow.engine import FloatArray
from nonsmooth.kernels import codes

__all__ = ["TOLERANCE", "Verdict", "judge", "longest_period", "residuals"]

LONGEST = 16  # period number looked for where none is given and as many points are kept
TOLERANCE = 1e-9  # of the return, in units of the motion's size
NEARLY = 1e-3  # a smallest return below this is a motion that may still settle
SHRINKING = 3e-2  # and so is one below this whose returns all shrink: near a flip they do so ever more slowly
STRETCH = 32  # returns looked at for that: chaos comes near a cycle, but not steadily
MARGIN = 2e-3  # multipliers nearer to the unit circle than this settle nothing within a transient
APART = 10.0  # how much farther a shorter period must be than the orbit is uncertain


@dataclass(frozen=True)
class Verdict:
    """Period number (0: none), the scaled return it rests on, status, and whether the orbit is certainly unstable.

    ``multiplier`` is the largest modulus of the multipliers (NaN: not looked at, or unknown)."""

    period_number: int
    residual: float
    status: int
    unstable: bool = False
    multiplier: float = np.nan


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


def residuals(points: FloatArray, size: FloatArray, max_period: int) -> FloatArray:
    """Largest scaled return r_p over the last p points, p = 1 ... max_period (those that fit), in the max norm."""
    scaled = points / size
    longest = min(max_period, len(points) - 1)
    result = np.full(longest, np.inf)
    for p in range(1, longest + 1):
        last = scaled[-p:] if 2 * p <= len(points) else scaled[p:]
        result[p - 1] = np.abs(last - scaled[-p - len(last) : len(points) - p]).max()
    return result


def shrinks(points: FloatArray, size: FloatArray, max_period: int) -> bool:
    """Whether for some p every one of the last scaled returns |s_{k+p} - s_k| is small and less than that p before."""
    scaled = points / size
    for p in range(1, max_period + 1):
        returns = np.abs(scaled[p:] - scaled[:-p]).max(axis=1)[-STRETCH - p :]
        if len(returns) >= 2 * p + 8 and returns.max() < SHRINKING and (returns[p:] < returns[:-p]).all():
            return True
    return False


def judge(
    points: FloatArray,
    size: FloatArray,
    max_period: int,
    multiplier: Callable[[int], float],
    tolerance: float = TOLERANCE,
) -> Verdict:
    """Judge the kept section points of one parameter value.

    Parameters
    ----------
    points : array (keep, n)
    size : array (n,)
        Size of the motion in each state.
    multiplier : callable
        ``multiplier(p)``: modulus of the largest multiplier of the p-th return map at the last point (NaN: unknown).
    tolerance : float
        What counts as a return.
    """
    returns = residuals(points, size, max_period)
    if not len(returns) or not np.isfinite(returns).all():
        return Verdict(0, np.nan, codes.SLOW)
    close = np.flatnonzero(returns <= tolerance)
    if not len(close):
        least = float(returns.min())
        settling = least < NEARLY or shrinks(points, size, max_period)
        return Verdict(0, least, codes.SLOW if settling else codes.NOT_PERIODIC)
    p = int(close[0]) + 1
    residual = float(returns[p - 1])
    mu = multiplier(p)
    if not mu < 1.0 - MARGIN:
        return Verdict(0, residual, codes.SLOW, unstable=bool(mu > 1.0 + MARGIN), multiplier=mu)
    away = residual / (1.0 - mu)
    shorter = [returns[d - 1] for d in range(1, p) if p % d == 0]
    if any(one <= APART * away for one in shorter):
        return Verdict(0, residual, codes.SLOW, multiplier=mu)
    return Verdict(p, residual, codes.OK, multiplier=mu)
