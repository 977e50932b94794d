"""Corners of two transitions: at one instant the orbit takes another way from the mode before to the mode after.

Where two surfaces meet, their order changes: a visit between two crossings shrinks to nothing, and beyond it the second
one comes first. Or a crossing reaches the surface of another transition, and beyond the corner that one fires first.
At the corner itself all these ways take no time and lead to the same state, so each is tried as the common orbit of a
new signature; what is admissible beside it is the branch (``resuming.resumed``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.signature import Visit

if TYPE_CHECKING:
    from nonsmooth.continuation.arclength import Curve, Point

__all__ = ["other_ways", "short_run"]

FloatArray = NDArray[np.float64]
Way = tuple[list[Visit], list[FloatArray], int]  # visits, states after their ends, indicator of the first new crossing
SHORT = 1e-7  # of the period: visits that have shrunk to nothing
ZERO = 1e-7  # of an indicator's size: it vanishes
LONGEST = 3  # transitions of a way
MOST = 24  # ways


def short_run(point: Point, i: int) -> tuple[int, int]:
    """(first, last + 1) of the crossings about visit i that happen at one instant."""
    tau, end = point.path.tau, float(point.solved.times[-1])
    first, last = i, i
    while first > 1 and abs(tau[first - 1]) < SHORT * end:
        first -= 1
    while last < len(tau) - 2 and abs(tau[last + 1]) < SHORT * end:
        last += 1
    return first - 1, last + 1


def other_ways(curve: Curve, point: Point, first: int, last: int) -> list[Way]:
    """Ways from the mode before crossing ``first`` to that behind ``last - 1`` through surfaces met at this instant."""
    shooting, values = curve.shooting, point.solved.values
    traced = shooting.system.traced
    visits = shooting.signature.visits
    t, target = float(point.solved.times[first + 1]), visits[last].mode
    phases = {traced.transitions[v.transition].at: v.turn for v in visits[first:last] if v.transition >= 0}
    phases.pop(None, None)
    known = [(v.mode, v.transition, v.row) for v in visits[first:last]]
    found: list[Way] = []

    def go(mode: int, z: FloatArray, way: list[Visit], states: list[FloatArray]) -> None:
        if way and mode == target and [(v.mode, v.transition, v.row) for v in way] != known:
            found.append((list(way), list(states), _indicator(way)))
        if len(way) == LONGEST or len(found) >= MOST:
            return
        for k, jump in enumerate(traced.transitions):
            if jump.source != mode:
                continue
            if jump.at is not None:
                if jump.at in phases and all(v.transition != k for v in way):
                    after = shooting.flow.jump(values, k, t, z, -1).z_after
                    go(jump.target, after, [*way, Visit(mode, k, -1, phases[jump.at])], [*states, after])
                continue
            rows = [shooting.flow.jump(values, k, t, z, r) for r in range(len(jump.rows))]
            sizes = [float(np.abs(one.h_z * curve.size).sum()) or 1.0 for one in rows]
            signed = [row.sign * one.h / size for row, one, size in zip(jump.rows, rows, sizes, strict=True)]
            if min(signed) < -ZERO:
                continue
            for r, (value, one) in enumerate(zip(signed, rows, strict=True)):
                if abs(value) <= ZERO:
                    go(jump.target, one.z_after, [*way, Visit(mode, k, r)], [*states, one.z_after])

    def _indicator(way: list[Visit]) -> int:
        rows = [traced.transitions[v.transition].rows[v.row].indicator for v in way if v.row >= 0]
        return rows[0] if rows else -1

    go(visits[first].mode, point.solved.segments.z[first], [], [])
    return sorted(found, key=lambda way: len(way[0]))
