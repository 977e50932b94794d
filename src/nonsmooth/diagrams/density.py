"""Histograms of a sweep's section points in place of the points: what a density diagram is made of.

The points of one parameter value at a time are run into a buffer, counted there and forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray

if TYPE_CHECKING:
    from nonsmooth.system.system import System

COARSE = 48  # parameter values of the run that finds the ranges
MARGIN = 0.05  # of the range found, added on either side


def given_ranges(system: System, density: Any) -> dict[str, tuple[float, float]]:
    """The ranges named by ``density``; True: none.

    Raises
    ------
    ValueError
        A name that is no state.
    """
    if density is True:
        return {}
    for name in density:
        if name not in system.states:
            raise ValueError(f"density names {name!r}, which is not a state; states: {', '.join(system.states)}")
    return dict(density)


def coarse_values(numbers: FloatArray) -> FloatArray:
    """At most ``COARSE`` of a parameter's values, both ends among them."""
    rising = np.sort(numbers)
    return rising[np.unique(np.linspace(0, len(rising) - 1, COARSE).round().astype(int))]


def bin_edges(
    system: System, ranges: Mapping[str, tuple[float, float]], bins: int, section: FloatArray | None
) -> FloatArray:
    """Edges (n, bins + 1): of the ranges given, for other states of the section points (..., n) of a coarse run.

    Raises
    ------
    ValueError
        No run of the coarse one came to its end.
    """
    edges = np.zeros((len(system.states), bins + 1))
    for j, name in enumerate(system.states):
        if name in ranges:
            low, high = ranges[name]
        else:
            found = np.empty(0) if section is None else section[..., j]
            found = found[np.isfinite(found)]
            if not len(found):
                raise ValueError(
                    f"no run of a coarse sweep came to its end, so the range of {name!r} is not known; "
                    f'give it: density={{"{name}": (lowest, highest)}}'
                )
            low, high = float(found.min()), float(found.max())
            room = max(MARGIN * (high - low), 1e-6 * float(system.scale_vector()[j]), 1e-12 * max(abs(low), abs(high)))
            low, high = low - room, high + room
        edges[j] = np.linspace(low, high, bins + 1)
    return edges


class Counter:
    """Counts of section points: one histogram per parameter value and state."""

    def __init__(self, n_points: int, edges: FloatArray) -> None:
        self.edges = edges
        self.counts = np.zeros((n_points, edges.shape[0], edges.shape[1] - 1), dtype=np.int32)
        self.outside: IntArray = np.zeros((n_points, edges.shape[0]), dtype=np.int64)

    def count(self, section: FloatArray, i: int) -> None:
        """Add points (1, keep, n) to the histogram of parameter value i."""
        from nonsmooth.kernels.histogram import count

        count(section, 0, self.edges, self.counts[i], self.outside[i])
