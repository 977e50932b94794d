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

from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.system.system import System

__all__ = ["sliding_bifurcation"]


class _Stay(NamedTuple):
    """A visit: its mode, how long it lasts, and whether the transition that ends it moves the state."""

    mode: int
    length: float
    moves: bool


def sliding_bifurcation(curve: Orbits, point: OrbitPoint, fresh: Orbits, first: OrbitPoint) -> str:
    """The name of the sliding bifurcation between an orbit and the ``first`` one beyond it, on a curve of its own.

    Empty where another event changes the signature, or events of different names at one instant."""
    long, short = sorted([_round(curve, point), _round(fresh, first)], key=len, reverse=True)
    end = [stay.mode for stay in short]
    names = set()
    while len(long) > len(end):
        i = min(range(len(long)), key=lambda i: long[i].length)
        names.add(_name(curve.shooting.system, long[i - 1], long[i], long[(i + 1) % len(long)]))
        long = _without(long, i)
    modes = [stay.mode for stay in long]
    same = any(modes[i:] + modes[:i] == end for i in range(len(modes)))
    return names.pop() if same and len(names) == 1 else ""


def _round(curve: Orbits, point: OrbitPoint) -> list[_Stay]:
    """The visits once round; the first and the last one are one."""
    visits, lengths = curve.shooting.signature.visits, np.diff(point.solved.times)
    if len(visits) == 1:
        return [_Stay(visits[0].mode, float(lengths[0]), False)]
    lengths[0] += lengths[-1]
    jumps = curve.shooting.system.traced.transitions
    return [_Stay(v.mode, float(length), jumps[v.transition].reset is not None)
            for v, length in zip(visits[:-1], lengths, strict=False)]  # fmt: skip


def _without(stays: list[_Stay], i: int) -> list[_Stay]:
    """Without visit i; those beside it are one where their modes are the same."""
    rest = [*stays[i + 1 :], *stays[:i]]
    if len(rest) > 1 and rest[0].mode == rest[-1].mode:
        rest = [rest[0]._replace(length=rest[0].length + rest[-1].length), *rest[1:-1]]
    return rest


def _name(system: System, before: _Stay, gone: _Stay, after: _Stay) -> str:
    """The name by the visit that is gone and those beside it."""
    slides = [len(system.declared.mode_names) <= stay.mode for stay in (before, gone, after)]
    if before.moves or gone.moves:
        return ""
    if slides == [False, True, False]:
        return "grazing_sliding" if before.mode == after.mode else "crossing_sliding"
    if slides == [False, False, True]:
        return "switching_sliding"
    return "adding_sliding" if slides == [True, False, True] and before.mode == after.mode else ""
