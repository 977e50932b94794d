"""A cycle on which a run has settled, confirmed by Newton's method on the section's return map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray, IntArray

MOST = 8  # Newton steps
STEP = 1e-5  # of the differences that give the map's derivative, in units of the motion's size
ROUNDING = 1e-8  # multipliers below this, or as near to 1, are differences of rounding errors
NEAR = 5e-6  # of the motion's size: farther from the run's end than this lies another orbit


@dataclass(frozen=True)
class Cycle:
    """A stable cycle through the section: its points, the largest modulus of its multipliers, and the time it takes."""

    points: FloatArray  # (p, n)
    modes: IntArray  # (p,)
    multiplier: float
    duration: float
    end: FloatArray  # a place on it
    mode: int


def exponent_on(cycle: Cycle) -> float:
    """The largest exponent per unit time; NaN where the multiplier is lost in rounding, but not zero."""
    if 0.0 < cycle.multiplier < ROUNDING:
        return np.nan
    with np.errstate(divide="ignore"):
        return float(np.log(cycle.multiplier) / cycle.duration)


def confirmed_cycle(
    settler: Settler, point: FloatArray, place: FloatArray, mode: int, p: int, size: FloatArray
) -> Cycle | None:
    """The stable cycle of p returns at ``place``; None where Newton's method does not confirm one there.

    Central differences of the p-th return map give its derivative, at every step. On a Poincare section a neighbour
    may meet the surface once more or less; it is compared at the return whose time is nearest to the cycle's.
    """
    n = len(size)
    base = settler.trace(point, place, mode, 0, p)
    if not len(base.points):
        return None
    duration = float(base.times[-1])
    forced = settler.plan.indicator < 0

    def image(u: FloatArray) -> FloatArray:
        start = place.copy()
        start[:n] = u
        run = settler.trace(point, start, mode, 0, p if forced else p + 1)
        if not len(run.points):
            return np.full(n, np.nan)
        return np.asarray(run.points[-1 if forced else int(np.argmin(np.abs(run.times - duration)))])

    u = place[:n].copy()
    moved, left = 0.0, np.inf
    for _ in range(MOST):
        gap = image(u) - u
        derivative = np.empty((n, n))
        for j in range(n):
            nudge = np.zeros(n)
            nudge[j] = STEP * size[j]
            derivative[:, j] = (image(u + nudge) - image(u - nudge)) / (2.0 * nudge[j])
        if not (np.isfinite(gap).all() and np.isfinite(derivative).all()):
            return None
        before, left = left, float(np.abs(gap / size).max())
        if left >= 0.5 * before:  # down to rounding
            break
        try:
            step = np.linalg.solve(np.eye(n) - derivative, gap)
        except np.linalg.LinAlgError:
            return None
        u = u + step
        moved = float(np.abs((u - place[:n]) / size).max())
        if moved > NEAR:
            return None
    scaled = derivative * size[None, :] / size[:, None]
    multiplier = float(np.abs(np.linalg.eigvals(scaled)).max())
    if not (multiplier < 1.0 - ROUNDING and min(before, left) <= settler.tolerance):
        return None
    start = place.copy()
    start[:n] = u
    once = settler.trace(point, start, mode, 0, p)
    if not len(once.points):
        return None
    return Cycle(once.points, once.modes, multiplier, float(once.times[-1]), once.end, once.mode)
