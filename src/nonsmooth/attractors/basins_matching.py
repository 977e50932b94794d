"""Attractors at one parameter value and the next: which is which.

Each attractor is carried over: a run that begins on it, at the new value, ends on one of the new attractors, which
takes its number if a run carried back from there ends on the old one again. Where a branch ends, at a fold, the run
that is carried over jumps to another attractor, and is not carried back; then the number is taken only by one that
lies near. Where several end on one, the nearest keeps the number. An attractor that no number came to takes that of
one that lay near it at an earlier value, and else a new one.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nonsmooth.attractors.basins_attractors import Attractor, Patience, find_attractors
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray

CLOSE = 0.1  # of the motion's size: attractors nearer than this are one, where a carried run does not tell


def distance(a: Attractor, b: Attractor) -> float:
    """Mean distance from the section points of each to the other's nearest, in units of the larger motion's size."""
    from scipy.spatial import cKDTree

    size = np.maximum(a.size, b.size)
    first, second = a.points[:500] / size, b.points[:500] / size
    there, _ = cKDTree(second).query(first)
    back, _ = cKDTree(first).query(second)
    return float(0.5 * (there.mean() + back.mean()))


def numbered(
    settler: Settler,
    point: FloatArray,
    found: list[Attractor],
    before: FloatArray,
    last: Mapping[int, Attractor],
    seen: Mapping[int, Attractor],
) -> list[int]:
    """The number of each attractor found at ``point``; attractors that only a carried run meets are added to ``found``.

    Parameters
    ----------
    before : array (1, n_parameters)
        The point before.
    last : mapping
        Attractors there, by number.
    seen : mapping
        All attractors so far, each as it was met last.
    """
    numbers: dict[int, int] = {}
    landed: list[tuple[bool, float, int, int]] = []
    if last and found:
        old = list(last.items())
        there = _carried(settler, point, [item for _, item in old], found)
        ends = sorted({k for k in there if k >= 0})
        earlier = [item for _, item in old]
        back = dict(zip(ends, _carried(settler, before, [found[k] for k in ends], earlier), strict=True))
        for j, ((number, item), k) in enumerate(zip(old, there, strict=True)):
            if k >= 0:
                gap = distance(item, found[k])
                landed.append((back[k] != j, gap, number, k))
    for jumped, gap, number, k in sorted(landed):
        if k not in numbers and number not in numbers.values() and (not jumped or gap <= CLOSE):
            numbers[k] = number
    others = sorted(
        (distance(item, found[k]), number, k)
        for k in range(len(found))
        if k not in numbers
        for number, item in seen.items()
        if number not in numbers.values()
    )
    for gap, number, k in others:
        if gap <= CLOSE and k not in numbers and number not in numbers.values():
            numbers[k] = number
    new = max([-1, *seen, *numbers.values()]) + 1
    for k in range(len(found)):
        if k not in numbers:
            numbers[k] = new
            new += 1
    return [numbers[k] for k in range(len(found))]


def _carried(settler: Settler, point: FloatArray, begin: list[Attractor], found: list[Attractor]) -> list[int]:
    """Ends of runs that begin on attractors at another point, as places in ``found``, which may grow."""
    if not begin:
        return []
    runs = settler.run(
        point,
        np.zeros(len(begin), dtype=np.int64),
        np.stack([item.end for item in begin]),
        modes=[item.mode for item in begin],
        begin=settler.section_phase,
    )
    after, labels, _ = find_attractors(settler, point, runs, Patience(), found)
    found.extend(after[len(found) :])
    return [int(k) for k in labels]
