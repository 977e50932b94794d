"""Attractors at one parameter value and the next: which is which.

Each attractor is carried over: a run that begins on it, at the new value, ends on one of the new attractors, which
takes its number. Where several end on one, the nearest keeps the number; where none does, an attractor that lies near
one of the earlier values takes the number of that one, and else a new number.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nonsmooth.analysis.attractors import Settler
from nonsmooth.analysis.basins_attractors import Attractor, Patience, find_attractors
from nonsmooth.flow.engine import FloatArray

__all__ = ["distance", "numbered"]

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
    settler: Settler, point: FloatArray, found: list[Attractor], last: Mapping[int, Attractor],
    seen: Mapping[int, Attractor],
) -> list[int]:  # fmt: skip
    """The number of each attractor found at ``point``.

    Parameters
    ----------
    last : mapping
        Attractors of the value before, by number.
    seen : mapping
        All attractors so far, each as it was met last.
    """
    numbers: dict[int, int] = {}
    landed: list[tuple[float, int, int]] = []
    if last and found:
        carried = list(last.items())
        starts = np.stack([item.points[0] for _, item in carried])
        modes = [item.mode for _, item in carried]
        runs = settler.run(
            point, np.zeros(len(carried), dtype=np.int64), starts, modes=modes, begin=settler.section_phase
        )
        after, labels = find_attractors(settler, point, runs, Patience(), found)
        found.extend(after[len(found) :])  # met only by a carried run: its basin is small
        ends = [(number, item, int(k)) for (number, item), k in zip(carried, labels, strict=True) if k >= 0]
        landed = sorted((distance(item, found[k]), number, k) for number, item, k in ends)
    for _, number, k in landed:
        if k not in numbers and number not in numbers.values():
            numbers[k] = number
    others = sorted(
        (distance(item, found[k]), number, k)
        for k in range(len(found)) if k not in numbers
        for number, item in seen.items() if number not in numbers.values()
    )  # fmt: skip
    for gap, number, k in others:
        if gap <= CLOSE and k not in numbers and number not in numbers.values():
            numbers[k] = number
    new = max([-1, *seen, *numbers.values()]) + 1
    for k in range(len(found)):
        if k not in numbers:
            numbers[k] = new
            new += 1
    return [numbers[k] for k in range(len(found))]
