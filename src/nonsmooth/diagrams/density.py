"""Histograms of a sweep's section points in place of the points: what a density diagram is made of.

The points of a few parameter values at a time are run into one small buffer, counted there and forgotten, so that
memory does not grow with the number of returns kept.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settle import Attractors
from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import real_number, whole_number
from nonsmooth.flow.engines.engine import Chain, FloatArray, IntArray

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["CountedSlot", "Counter", "bin_edges", "coarse_values", "given_ranges"]

POINTS = 200_000  # section points of one buffer, at most (but one parameter value's)
VALUES = 64  # parameter values of one buffer, at most
COARSE = 48  # parameter values of the run that finds the ranges
MARGIN = 0.05  # of the range found, added on either side


def given_ranges(system: System, density: Any, bins: Any) -> tuple[dict[str, tuple[float, float]], int]:
    """The ranges named by ``density`` (True: none), and the number of bins.

    Raises
    ------
    ValueError, TypeError
        Neither True nor a mapping, a name that is no state, limits that are none.
    """
    number = whole_number(bins, "bins", 1)
    if density is True:
        return {}, number
    first = next(iter(system.states))
    form = f'density=True, or density={{"{first}": (lowest, highest)}}'
    if not isinstance(density, Mapping):
        raise TypeError(f"density = {shortened(density)}; allowed: {form}")
    ranges = {}
    for name, limits in density.items():
        if name not in system.states:
            raise ValueError(f"density names {name!r}, which is not a state; states: {', '.join(system.states)}")
        if not isinstance(limits, Sequence | np.ndarray) or isinstance(limits, str) or len(limits) != 2:
            raise ValueError(f"density of {name!r} is {shortened(limits)}; write {form}")
        low, high = (real_number(one, f"a limit of {name!r}") for one in limits)
        if not (np.isfinite([low, high]).all() and low < high):
            raise ValueError(f"density of {name!r} from {low} to {high}: the first limit must be less than the second")
        ranges[name] = (low, high)
    return ranges, number


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

    def count(self, section: FloatArray, row: int, i: int) -> None:
        """Add the points of one row of a buffer (rows, keep, n) to the histogram of parameter value i."""
        from nonsmooth.kernels.histogram import count

        count(section, row, self.edges, self.counts[i], self.outside[i])


class CountedSlot:
    """One direction and start of a sweep of which no section points are kept: ``chain`` has all but these."""

    def __init__(
        self, attractors: Attractors, points: FloatArray, sizes: tuple[int, int, int], edges: FloatArray
    ) -> None:
        self.attractors, self.points, self.sizes = attractors, points, sizes
        self.chain = Chain.empty(len(points), 0, *sizes)
        self.counter = Counter(len(points), edges)

    def places(self, order: Sequence[int]) -> Iterator[tuple[int, int, Attractors, Chain]]:
        """For each parameter value of ``order``: its number, its row in a buffer, what runs it, that buffer.

        A buffer is emptied into the histograms when its last row has been run."""
        keep = self.attractors.keep
        size = max(1, min(VALUES, POINTS // keep))
        for first in range(0, len(order), size):
            part = list(order[first : first + size])
            buffer = Chain.empty(len(part), keep, *self.sizes)
            tables = self.attractors.engine.prepare(np.ascontiguousarray(self.points[part]))
            attractors = self.attractors.over(tables)
            for row, i in enumerate(part):
                yield i, row, attractors, buffer
            self._empty(part, buffer)

    def _empty(self, part: Sequence[int], buffer: Chain) -> None:
        for name in (
            "maximum", "minimum", "indicator_max", "indicator_min", "output_max", "output_min", "crossings", "contacts",
            "elapsed", "status",
        ):  # fmt: skip
            getattr(self.chain, name)[part] = getattr(buffer, name)

    def count(self, i: int, row: int, buffer: Chain) -> None:
        """Count the points of a run that came to its end."""
        self.counter.count(buffer.section, row, i)
