"""Sliding bifurcations by their names (di Bernardo, Budd, Champneys, Kowalczyk 2008, Chapter 8).

Where the signature of an orbit changes, visits have shrunk to nothing on the side that has more of them. With A and B
for motion on the two sides of a surface and S for sliding along it, the one that is gone tells which bifurcation it is:

======================  ===========  =========  =======================================================
name                    with it      without    at the bifurcation
======================  ===========  =========  =======================================================
``grazing_sliding``     A **S** A    A          an orbit on one side touches the surface
``crossing_sliding``    A **S** B    A B        a crossing lies on the edge of the sliding region
``switching_sliding``   A **B** S    A S        sliding begins on the edge of the sliding region
``adding_sliding``      S **A** S    S          a sliding segment touches the edge of the sliding region
======================  ===========  =========  =======================================================
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.orbits import OrbitPoint

TOUCHES = ("grazing_sliding", "adding_sliding")  # motion is tangent to a surface or an edge; else a crossing moves over
NOTHING = 1e-9  # of a derivative: zero


class _Stay(NamedTuple):
    """A visit: its mode, how long it lasts, and the transition that ends it with its row and the state before it."""

    mode: int
    length: float
    transition: int = -1
    row: int = -1
    t: float = 0.0
    z: FloatArray = np.empty(0)


def sliding_bifurcation(point: OrbitPoint, first: OrbitPoint) -> str:
    """The name of the sliding bifurcation between an orbit and the ``first`` one beyond it, on a curve of its own.

    Empty where another event changes the signature, or events of different names at one instant."""
    (_, short), (point, long) = sorted(((one, _round(one)) for one in (point, first)), key=lambda side: len(side[1]))
    end, names = [stay.mode for stay in short], set()
    while len(long) > len(end):
        i = min(range(len(long)), key=lambda i: long[i].length)
        names.add(_name(point, long[i - 1], long[i], long[(i + 1) % len(long)]))
        long = _without(long, i)
    modes = [stay.mode for stay in long]
    same = any(modes[i:] + modes[:i] == end for i in range(len(modes)))
    return names.pop() if same and len(names) == 1 else ""


def _round(point: OrbitPoint) -> list[_Stay]:
    """The visits once round; the first and the last one are one."""
    visits, times, before = point.signature.visits, point.solved.times, point.solved.segments.z
    lengths = np.diff(times)
    if len(visits) == 1:
        return [_Stay(visits[0].mode, float(lengths[0]))]
    lengths[0] += lengths[-1]
    return [
        _Stay(v.mode, float(length), v.transition, v.row, float(t), z)
        for v, length, t, z in zip(visits[:-1], lengths, times[1:], before, strict=False)
    ]


def _without(stays: list[_Stay], i: int) -> list[_Stay]:
    """Without visit i; those beside it are one where their modes are the same."""
    rest = [*stays[i + 1 :], *stays[:i]]
    if len(rest) > 1 and rest[0].mode == rest[-1].mode:
        rest = [rest[0]._replace(length=rest[0].length + rest[-1].length), *rest[1:-1]]
    return rest


def _name(point: OrbitPoint, before: _Stay, gone: _Stay, after: _Stay) -> str:
    """The name by the visit that is gone and those beside it, which slide along the surface at its begin or its end."""
    for ends in (before, gone):
        if ends.row < 0 or _moves(point, before) or _moves(point, gone):
            continue
        slides = [_slides(point, ends, stay.mode) for stay in (before, gone, after)]
        if slides == [False, True, False]:
            return "grazing_sliding" if before.mode == after.mode else "crossing_sliding"
        if slides == [False, False, True]:
            return "switching_sliding"
        if slides == [True, False, True] and before.mode == after.mode:
            return "adding_sliding"
    return ""


def _moves(point: OrbitPoint, ends: _Stay) -> bool:
    """Return whether the transition that ends a visit moves states that lie on its surface, as an impact does."""
    jump = point.shooting.flow.jump(point.values, ends.transition, ends.t, ends.z, ends.row)
    change, h_z = jump.R_z - np.eye(jump.n), jump.h_z
    along = change - np.outer(change @ h_z, h_z) / max(float(h_z @ h_z), 1e-300)
    return bool(np.abs(along).max() > NOTHING)


def _slides(point: OrbitPoint, ends: _Stay, mode: int) -> bool:
    """Return whether motion in a mode stays on the surface at which another visit ends.

    Its rate vanishes there, whatever the state: the rate's gradient is a multiple of the surface's. Of patterns, whose
    elements have no condition where they hold, those that hold say so."""
    traced = point.shooting.system.traced
    indicator, patterns = traced.transitions[ends.transition].rows[ends.row].indicator, traced.patterns
    if patterns is not None:
        return patterns.owners[indicator] in patterns.make.held(patterns.visited[mode])
    at = point.shooting.flow.indicator(point.values, indicator, mode, ends.t, ends.z)
    h, rate = np.append(at.h_z, at.h_t), np.append(at.L_z, at.L_t)
    along = rate - h * float(rate @ h) / max(float(h @ h), 1e-300)
    return bool(h.any() and np.abs(along).max() <= NOTHING * max(float(np.abs(rate).max()), 1.0))
