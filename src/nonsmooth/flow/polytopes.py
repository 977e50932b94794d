"""Polytopes of equilibria: their extreme points, what they hold, and how far they are apart, by linear programming."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

TOUCHING = 1e-8  # of the states' scales: polytopes nearer than this are one set
CORNERS = 500  # of a linear programme, at most: beyond them a solver is asked
FLAT = 1e-9  # a determinant of unit rows, a share of the cost: zero


@dataclass(frozen=True)
class Extreme:
    """The point of a set where a state is least or greatest (``side``: the state, -1 or 1), and the conditions
    (indicator, sign) of its mode that vanish there."""

    u: FloatArray
    mode: int
    side: tuple[int, int] = (0, 0)
    keys: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Polytope:
    """Equilibria of one mode: ``origin + ways @ z`` with ``slopes @ z <= room``; all in units of the scales."""

    mode: int
    scale: FloatArray
    origin: FloatArray
    ways: FloatArray  # (n, d)
    slopes: FloatArray
    room: FloatArray
    lower: FloatArray
    upper: FloatArray
    extremes: tuple[Extreme, ...]
    edge: bool  # a condition vanishes on all of it, as the speed of what slips no more

    def holds(self, u: FloatArray, tolerance: Any) -> NDArray[np.bool_]:
        """Marks of the states (J, n) that lie in it, or nearer than a distance."""
        off = u / self.scale - self.origin
        z = off @ self.ways
        apart = np.abs(off - z @ self.ways.T).max(axis=1, initial=0.0)
        return np.asarray(np.maximum(apart, (z @ self.slopes.T - self.room).max(axis=1, initial=0.0)) <= tolerance)

    def distance(self, other: Polytope | FloatArray) -> float:
        """The distance to another polytope, or to a state, in the largest of all states."""
        if isinstance(other, Polytope):
            origin, ways, slopes, room = other.origin, other.ways, other.slopes, other.room
        else:
            origin, ways = other / self.scale, np.zeros((len(other), 0))
            slopes, room = np.zeros((0, 0)), np.zeros(0)
        d, e = self.ways.shape[1], ways.shape[1]
        gap = np.hstack([self.ways, -ways])
        if not d + e:
            return float(np.abs(self.origin - origin).max())
        one = np.ones((len(gap), 1))
        both = np.zeros((len(slopes) + len(self.slopes), d + e))
        both[: len(self.slopes), :d], both[len(self.slopes) :, d:] = self.slopes, slopes
        rows = np.vstack([np.hstack([gap, -one]), np.hstack([-gap, -one]), np.pad(both, ((0, 0), (0, 1)))])
        off = origin - self.origin
        z = best(np.append(np.zeros(d + e), 1.0), rows, np.concatenate([off, -off, self.room, room]))
        return np.inf if z is None else float(z[-1])


def best(cost: FloatArray, slopes: FloatArray, room: FloatArray) -> FloatArray | None:
    """Minimise cost @ z where slopes @ z <= room; infinite where it has no bound, None where nothing fulfils that."""
    n, d = slopes.shape
    if cost.any() and n >= d and comb(n, d) <= CORNERS:
        # every corner at once: the best is held by d conditions that all push against the cost
        corners = np.array(list(combinations(range(n), d)))
        corners = corners[np.abs(np.linalg.det(slopes[corners])) > FLAT]
        if len(corners):
            z = np.linalg.solve(slopes[corners], room[corners][..., None])[..., 0]
            pushes = np.linalg.solve(slopes[corners].swapaxes(1, 2), -cost[:, None])[..., 0]
            beyond = (z @ slopes.T - room).max(axis=1)
            if beyond.min() > TOUCHING:
                return None
            beyond[pushes.min(axis=1) < -FLAT * np.abs(cost).max()] = np.inf
            i = int(beyond.argmin())
            return z[i] if beyond[i] <= TOUCHING else np.full(d, np.inf)
    from scipy.optimize import linprog

    exact = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    found = linprog(cost, slopes, room, bounds=(None, None), method="highs-ds", options=exact)
    if found.status == 0:
        return np.asarray(found.x)
    # the solver does not always tell an unbounded problem from an empty one: is there any solution?
    some = linprog(np.zeros(len(cost)), slopes, room, bounds=(None, None), method="highs-ds", options=exact)
    return np.full(len(cost), np.inf) if some.status == 0 else None
