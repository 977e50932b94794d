"""Motion without a short period: when it is an attractor, and when it is only on its way, or drawn in by nothing.

A candidate is followed for a long time. It must neither settle nor leave the places it has visited (recurrence), and
it must attract: runs that begin beside it come back to it. Motion without damping is recurrent too, but neighbours stay
on orbits of their own, or (in a chaotic sea) keep the area between them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from nonsmooth.attractors.basins_found import Attractor, Patience
from nonsmooth.attractors.basins_newton import confirmed_cycle, exponent_on
from nonsmooth.attractors.settled import SectionTrace, half_ranges
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.kernels.hybrid import codes

MOSTLY = 0.95
NEARLY_THERE = 0.02  # of the section's extent: points nearer than this have come back
SPREAD = 3.0  # and those nearer than this many times the distance that nearly all points keep from each other
FARTHEST = 0.1
LEAST_EXPONENT = 1e-3  # per return: contraction faster than this ends on a cycle, expansion is chaos
LONGEST = 1024  # period number looked for where the exponent says that there is a cycle
LONG_RETURN = 1e-8
ON_CYCLE = 1e-3  # of the size: runs nearer than this to a long cycle are on it
BESIDE = 0.02  # of the size: how far beside the candidate runs begin that must come back, at least
CLEARLY = 3.0  # and in units of what counts as near
NEIGHBOURS = 12
COME_BACK = 1.0 / 3.0  # of them at least: some may lie in other basins
AREAS = 40  # returns over which the shrinking of areas is measured
TRIES = 3  # candidates in one round


def among(points: FloatArray, found: list[Attractor]) -> int | None:
    """The attractor without a short period on which nearly all these points lie."""
    for number, attractor in enumerate(found):
        if attractor.tree is None or not len(points):
            continue
        gap, _ = attractor.tree.query(points / attractor.size, p=np.inf)
        if (gap < attractor.near).mean() >= MOSTLY:
            return number
    return None


@dataclass
class CandidateSearch:
    """Candidates at one parameter point (1, n_parameters); ``found`` is the list of attractors, which grows."""

    settler: Settler
    point: FloatArray
    patience: Patience
    found: list[Attractor]
    tried: int = 0  # candidates that were none, in this round
    repelled: int = 0  # candidates that are recurrent but attract nothing

    @property
    def hopeless(self) -> bool:
        return self.repelled >= TRIES and not any(item.tree is not None for item in self.found)

    def candidate(self, place: FloatArray, mode: int) -> Attractor | None:
        """A long run from a place as an attractor, where it is one."""
        if self.tried >= TRIES or self.hopeless:
            return None
        found = self._long_run(place, mode)
        self.tried += found is None
        return found

    def _long_run(self, place: FloatArray, mode: int) -> Attractor | None:
        from scipy.spatial import cKDTree

        settler, point = self.settler, self.point
        long = settler.trace(point, place, mode, 0, self.patience.candidate)
        if not len(long.points):
            return None
        wide = replace(settler, keep=max(settler.keep, self.patience.more))  # extremes over many returns
        checked = wide.run(point, [0], long.end[None], modes=[long.mode], begin=settler.section_phase)
        if checked.status[0] != codes.NOT_PERIODIC or not _recurrent(long.points):
            return None
        maximum = np.maximum(checked.maximum[0], long.points.max(axis=0))
        minimum = np.minimum(checked.minimum[0], long.points.min(axis=0))
        exponents, errors = settler.exponents(
            point, [0], long.end[None], np.array([long.mode]), self.patience.exponent, maximum[None], minimum[None]
        )
        exponent, error = float(exponents[0]), float(errors[0])
        least = settler.least_at(maximum, minimum)
        size = half_ranges(maximum, minimum, least)
        end, last = long.end, long.mode
        doubt = 3.0 * error + LEAST_EXPONENT * len(long.points) / long.times[-1]
        if exponent < -doubt:
            p = _long_period(long.points, size)
            if not p:
                return None
            points, modes, multiplier = long.points[-p:], long.modes[-p:], np.nan
            cycle = confirmed_cycle(settler, point, end, last, p, size)
            if cycle is not None:
                points, modes, multiplier = cycle.points, cycle.modes, cycle.multiplier
                exponent, error = exponent_on(cycle), 0.0
            return Attractor(
                p,
                points,
                modes,
                end,
                last,
                maximum,
                minimum,
                multiplier,
                exponent,
                error,
                least,
                cycle is not None,
                near=ON_CYCLE,
                tree=cKDTree(points / size),
            )
        half = len(long.points) // 2
        points, tree = long.points[half:], cKDTree(long.points[half:] / size)
        gap, _ = tree.query(long.points[:half] / size, p=np.inf)
        spread = float(np.quantile(gap, MOSTLY))
        if spread > 2.0 * FARTHEST:
            return None  # so many points do not show where it is
        near = float(np.clip(SPREAD * spread, 1e-9, 2.0 * FARTHEST))
        item = Attractor(
            0,
            points,
            long.modes[half:],
            end,
            last,
            maximum,
            minimum,
            np.nan,
            exponent,
            error,
            least,
            chaotic=exponent > doubt,
            near=near,
            tree=tree,
        )
        if not self._attracts(item) or (item.chaotic and self._keeps_areas(item)):
            self.repelled += 1
            return None
        return item

    def _attracts(self, item: Attractor) -> bool:
        """Return whether runs that begin beside it, here and there, come back to it."""
        rng = np.random.default_rng(0)
        n, back, came = len(item.size), 0, 0
        place, mode = item.end, item.mode
        for _ in range(NEIGHBOURS):
            here = self._on(place, mode, 17, 1)
            if not len(here.points):
                return False
            place, mode = here.end, here.mode
            beside = place.copy()
            way = rng.normal(size=n)
            beside[:n] += max(BESIDE, CLEARLY * item.near) * item.size * way / np.abs(way).max()
            run = self._on(beside, mode, max(self.patience.more, self.settler.transient), self.patience.window)
            came += len(run.points) > 0
            back += among(run.points, [item]) == 0
        return back >= max(2.0, COME_BACK * came)

    def _keeps_areas(self, item: Attractor) -> bool:
        """Return whether the section's map keeps areas (volumes) on the average."""
        if self.settler.plan.indicator >= 0:
            return False  # a map of the surface: the states are no coordinates on it
        n, total = len(item.size), 0.0
        place, mode = item.end, item.mode
        for _ in range(AREAS):
            here = self._on(place, mode, 0, 1)
            columns = []
            for j in range(n):
                sides = []
                for sign in (1.0, -1.0):
                    beside = place.copy()
                    beside[j] += sign * 1e-6 * item.size[j]
                    sides.append(self._on(beside, mode, 0, 1).points)
                if not all(len(side) for side in sides):
                    return False
                columns.append((sides[0][0] - sides[1][0]) / (2e-6 * item.size[j]))
            if not len(here.points):
                return False
            with np.errstate(divide="ignore"):
                total += float(np.log(np.abs(np.linalg.det(np.array(columns)))))
            place, mode = here.end, here.mode
        return abs(total) / AREAS < LEAST_EXPONENT

    def _on(self, place: FloatArray, mode: int, transient: int, keep: int) -> SectionTrace:
        return self.settler.trace(self.point, place, mode, transient, keep)


def _recurrent(points: FloatArray) -> bool:
    """Return whether either half of a run comes nearly always near to where the other half has been.

    Near is a small part of the range, or as near as a half comes to itself: in many dimensions that is farther off."""
    from scipy.spatial import cKDTree

    half = len(points) // 2
    scaled = points / np.maximum(np.ptp(points, axis=0), 1e-300)
    first, second = scaled[:half], scaled[half:]
    for one, other in ((first, second), (second, first)):
        tree = cKDTree(one)
        own = np.quantile(tree.query(one, k=2, p=np.inf)[0][:, 1], MOSTLY)
        near = np.clip(SPREAD * own, NEARLY_THERE, FARTHEST)
        if (tree.query(other, p=np.inf, distance_upper_bound=2 * near)[0] <= near).mean() < MOSTLY:
            return False
    return True


def _long_period(points: FloatArray, size: FloatArray) -> int:
    """The least period number up to LONGEST of the last points, 0: none."""
    scaled = points / size
    for p in range(1, min(LONGEST, len(points) // 2)):
        if np.abs(scaled[-p:] - scaled[-2 * p : -p]).max() <= LONG_RETURN:
            return p
    return 0
