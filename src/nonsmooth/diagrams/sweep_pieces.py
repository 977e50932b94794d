"""A sweep cut into pieces of independent work, and their buffers; histograms in place of its section points.

The points of one parameter value at a time are run into a buffer, counted there and forgotten.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.mapper import Mapper
from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar

if TYPE_CHECKING:
    from nonsmooth.system.system import System


COARSE = 48  # parameter values of the run that finds the ranges
MARGIN = 0.05  # of the range found, added on either side


def given_ranges(system: System, density: Any) -> dict[str, tuple[float, float]]:
    """The ranges named by ``density``; True: none. ValueError: a name that is no state."""
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

    ValueError: no run of the coarse one came to its end."""
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


PIECE = 16  # points of one piece of independent work


class Slot:
    """One direction and start: kept returns of all parameter values (histograms in place of points), the verdicts, and
    loads by the names of those that are wanted."""

    def __init__(self, settler: Settler, at: FloatArray, edges: FloatArray | None, loads: Iterable[str]) -> None:
        self.settler, self.at, self.edges, points = settler, at, edges, len(at)
        self.loads = {name: np.full(points, np.nan) for name in loads}
        if edges is not None:  # of one histogram for each parameter value and state
            self.counts = np.zeros((points, len(edges), edges.shape[1] - 1), dtype=np.int32)
            self.outside = np.zeros((points, len(edges)), dtype=np.int64)
        self.kept = settler.engine.kept(points, settler.keep if edges is None else 0)
        self.period_number = np.zeros(points, dtype=np.int64)
        self.residual, self.crossings, self.contacts = np.full((3, points), np.nan)
        self.status = np.full(points, codes.INTERRUPTED, dtype=np.int8)
        self.last = np.full((points, settler.width), np.nan)

    def march(
        self,
        tables: Any,
        order: Sequence[int],
        start: State,
        carried: bool,
        advance: Callable[[int], None],
        stop: threading.Event,
    ) -> None:
        """Run some parameter values from a start, the state carried from each to the next or not, until ``stop``."""
        from nonsmooth.kernels.histogram import count

        rows = np.array(order, dtype=np.int64)
        places, modes = np.tile(start.place, (len(rows), 1)), np.tile(start.counters[0], len(rows))
        fit = self.settler.admissible(self.at[rows], places, carried=carried)
        self.status[np.delete(rows, fit)] = codes.NO_CONVERGENCE
        advance(len(rows) - len(fit))
        rows, n = rows[fit], len(fit)
        room: dict[str, Any] = {"kept": self.kept, "into": rows} if self.edges is None else {}
        mapper = Mapper(self.settler, tables, rows, places[fit], modes[fit], **room)
        run, done = mapper.settle(self.settler.rules(), 2 * carried, False), 0
        try:
            for j, i in enumerate(rows):
                if stop.is_set():
                    return
                run(j + 1)
                if self.edges is not None:
                    for part, own in zip(self.kept[1:6], mapper.kept[1:6], strict=True):
                        part[i] = own[0]
                    if usable(mapper.jobs.status[j]):
                        self.settler.engine.hide(mapper.kept.section, mapper.kept.section_mode)
                        count(mapper.kept.section, 0, self.edges, self.counts[i], self.outside[i])
                done = j + 1
                advance(1)
        finally:
            self.put(rows[:done], mapper.settled()[:done], loaded=done == n)

    def put(self, rows: Any, found: Settled, loaded: bool = True) -> None:
        """Take the verdicts on some parameter values; the loads too."""
        for name in ("period_number", "residual", "crossings", "contacts", "status", "last"):
            getattr(self, name)[rows] = getattr(found, name)
        if self.loads and loaded:
            for name, values in self.settler.loads(self.at, np.arange(len(self.at))[rows], found).items():
                self.loads[name][rows] = values


def pieces_of(directions: Sequence[str], n_starts: int, numbers: FloatArray) -> list[tuple[tuple[int, int], list[int]]]:
    """Independent pieces of work: a whole chain where the state is carried along, else a few points."""
    rising = np.argsort(numbers, kind="stable")
    pieces = []
    for d, direction in enumerate(directions):
        order = [int(i) for i in (rising[::-1] if direction == "down" else rising)]
        size = PIECE if direction == "none" else len(order)
        for k in range(n_starts):
            pieces += [((d, k), order[i : i + size]) for i in range(0, len(order), size)]
    return pieces


def run_on_gpu(
    points: FloatArray, starts: Sequence[State], slots: Mapping[tuple[int, int], Slot], progress: Progress, label: str
) -> None:
    """All points from each start, on the GPU."""
    from nonsmooth.attractors.settle_cuda import sweep_on_gpu

    with progress_bar(len(points) * len(starts), f"sweep over {label}", progress) as advance:
        for k, start in enumerate(starts):
            slot = slots[0, k]
            slot.put(slice(None), sweep_on_gpu(slot.settler, points, start, slot.kept, advance))
            beyond = np.delete(
                np.arange(len(points)), slot.settler.admissible(points, np.tile(start.u, (len(points), 1)))
            )
            slot.status[beyond], slot.period_number[beyond] = codes.NO_CONVERGENCE, 0
