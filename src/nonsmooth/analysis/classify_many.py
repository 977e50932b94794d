"""The rules of ``classify`` for many jobs at once, as one array operation each: for devices that run many.

One job through these costs more than through ``classify.judge``; ``tests/analysis/test_classify.py`` holds them equal.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nonsmooth.analysis.classify import APART, MARGIN, NEARLY, SHRINKING, STRETCH
from nonsmooth.flow.engine import FloatArray, IntArray
from nonsmooth.kernels import codes

__all__ = ["candidates", "certain"]


def residuals(points: FloatArray, size: FloatArray, max_period: int) -> FloatArray:
    """Largest scaled return r_p over the last p points, p = 1 ... max_period (those that fit), in the max norm.

    points (J, keep, n) and size (J, n) give (J, longest)."""
    scaled, keep = points / size[:, None, :], points.shape[1]
    longest = min(max_period, keep - 1)
    result = np.full((len(points), longest), np.inf)
    for p in range(1, longest + 1):
        last = scaled[:, -p:] if 2 * p <= keep else scaled[:, p:]
        before = scaled[:, keep - p - last.shape[1] : keep - p]
        result[:, p - 1] = np.abs(last - before).max(axis=(1, 2))
    return result


def shrinks(points: FloatArray, size: FloatArray, max_period: int) -> NDArray[np.bool_]:
    """Whether for some p every one of the last scaled returns |s_{k+p} - s_k| is small and less than that p before.

    points (J, keep, n) and size (J, n) give (J,)."""
    scaled = points / size[:, None, :]
    found = np.zeros(len(points), dtype=bool)
    for p in range(1, min(max_period, points.shape[1] - 1) + 1):
        last = np.abs(scaled[:, -1] - scaled[:, -1 - p]).max(axis=1)
        some = np.flatnonzero(~found & (last < SHRINKING))  # few in chaos
        returns = np.abs(scaled[some, p:] - scaled[some, :-p]).max(axis=2)[:, -STRETCH - p :]
        if returns.shape[1] >= 2 * p + 8:
            small = returns.max(axis=1) < SHRINKING
            found[some] = small & (returns[:, p:] < returns[:, :-p]).all(axis=1)
    return found


def candidates(
    points: FloatArray, size: FloatArray, max_period: int, tolerance: float
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """What the section points (J, keep, n) alone say: period number, status, residual and returns (J, longest).

    The status is OK where there is a period whose multipliers are still to be seen; elsewhere the period number is 0.
    """
    returns = residuals(points, size, max_period)
    period, residual = np.zeros(len(points), dtype=np.int64), np.full(len(points), np.nan)
    status = np.full(len(points), codes.SLOW, dtype=np.int64)
    finite = np.isfinite(returns).all(axis=1) & (returns.shape[1] > 0)
    close = returns <= tolerance
    there = finite & close.any(axis=1)
    first = close[there].argmax(axis=1)
    period[there], status[there] = first + 1, codes.OK
    residual[there] = returns[there, first]
    others = np.flatnonzero(finite & ~there)
    if len(others):
        residual[others] = returns[others].min(axis=1)
        wide = others[residual[others] >= NEARLY]
        status[wide[~shrinks(points[wide], size[wide], max_period)]] = codes.NOT_PERIODIC
    return period, status, residual, returns


def certain(period: IntArray, mu: FloatArray, residual: FloatArray, returns: FloatArray) -> NDArray[np.bool_]:
    """Whether period numbers (J,) stand with the multipliers mu: the orbit contracts, and no shorter period is as near.
    """
    stands = mu < 1.0 - MARGIN
    away = residual / (1.0 - np.where(stands, mu, 0.0))
    for d in range(1, returns.shape[1] + 1):
        stands &= ~((d < period) & (period % d == 0) & (returns[:, d - 1] <= APART * away))
    return stands
