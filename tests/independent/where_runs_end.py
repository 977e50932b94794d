"""Ends of brute-force runs, and how many of them end where a result of ``basins`` says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

RETURN = 1e-6  # a return closer than this part of the motion's size closes a cycle


@dataclass(frozen=True)
class End:
    """End of a run: its period number (0: none up to 24) and its last section points."""

    period_number: int
    points: NDArray[np.float64]


def end_of(points: NDArray[np.float64], longest: int = 24) -> End:
    """The end of a run from its last section points."""
    size = np.maximum(np.ptp(points, axis=0), 1e-3 * np.abs(points).max(axis=0))
    scaled = points / size
    for p in range(1, longest + 1):
        if np.abs(scaled[p:] - scaled[:-p])[-p:].max() < RETURN:
            return End(p, points)
    return End(0, points)


def agreement(result: Any, found: list[End]) -> float:
    """Share of starts (in the order of the grid, flat) that end where their label says.

    A cycle: equal period number, and the last point within 1e-5 of the attractor's size of one of its points. No
    cycle: no period, and nearly all points within a twentieth of its size of its cloud.
    """
    from scipy.spatial import cKDTree

    trees = []
    for k in range(result.sizes["attractor"]):
        points = result["section_points"].values[result["point_attractor"].values == k]
        size = (result["maximum"] - result["minimum"]).values[k]
        trees.append((cKDTree(points / size), size, int(result["period_number"][k])))
    right = 0
    for label, end in zip(result["label"].values.ravel(), found, strict=True):
        if label < 0:
            continue
        tree, size, period = trees[int(label)]
        gap = tree.query(end.points / size)[0]
        if period == end.period_number:
            right += bool(gap[-1] < 1e-5) if period else bool((gap < 0.05).mean() > 0.9)
    return right / len(found)
