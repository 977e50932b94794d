"""A sweep cut into pieces of independent work: their buffers, and how they are run."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from nonsmooth.attractors.mapper import Mapper
from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.attractors.settler import Settler
from nonsmooth.campaign.threads import cores, over_items
from nonsmooth.diagrams.density import Counter
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar

__all__ = ["Report", "Slot", "ended", "largest_of", "pieces_of", "run_on_gpu", "run_pieces"]

PIECE = 16  # points of one piece of independent work


class Slot:
    """One direction and start: kept returns of all parameter values (histograms in place of points), the verdicts, and
    loads by the names of those that are wanted."""

    def __init__(self, settler: Settler, at: FloatArray, edges: FloatArray | None, loads: Iterable[str]) -> None:
        self.settler, self.at, points = settler, at, len(at)
        self.loads = {name: np.full(points, np.nan) for name in loads}
        self.counter = None if edges is None else Counter(points, edges)
        self.kept = settler.engine.kept(points, settler.keep if edges is None else 0)
        self.period_number = np.zeros(points, dtype=np.int64)
        self.residual = np.full(points, np.nan)
        self.status = np.full(points, codes.INTERRUPTED, dtype=np.int8)

    def march(self, tables: Any, order: Sequence[int], start: FloatArray, carried: bool, report: Report) -> None:
        """Run some parameter values from a start, the state carried from each to the next or not."""
        rows, n = np.array(order, dtype=np.int64), len(order)
        room: dict[str, Any] = {"kept": self.kept, "into": rows} if self.counter is None else {}
        mapper = Mapper(self.settler, tables, rows, np.tile(start, (n, 1)), **room)
        run = mapper.settle(self.settler.rules(), 2 * carried, False)
        for j, i in enumerate(order):
            if report.stop.is_set():
                return
            run(j + 1)
            if self.counter is not None:
                for part, own in zip(self.kept[1:6], mapper.kept[1:6], strict=True):
                    part[i] = own[0]
                if usable(mapper.jobs.status[j]):
                    self.counter.count(mapper.kept.section, i)
            report.advance(1)
        self.put(rows, mapper.settled())

    def put(self, rows: Any, found: Settled) -> None:
        """Take the verdicts on some parameter values."""
        for name in ("period_number", "residual", "status"):
            getattr(self, name)[rows] = getattr(found, name)
        if self.loads:
            for name, values in self.settler.loads(self.at, np.arange(len(self.at))[rows], found).items():
                self.loads[name][rows] = values

    def extremes(self) -> tuple[FloatArray, ...]:
        """Maxima and minima of states, indicators, outputs."""
        n, n_i = self.kept.section.shape[2], len(self.settler.system.indicators)
        both = self.kept.high, self.kept.low
        return tuple(part for whole in both for part in np.split(whole, [n, n + n_i], axis=1))


class Report:
    """Messages that the pieces of work give the thread that waits for them, and it them."""

    def __init__(self, advance: Callable[..., None]) -> None:
        self.advance = advance
        self.stop = threading.Event()


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


def run_pieces(
    march: Callable[..., None],
    pieces: Sequence[tuple[tuple[int, int], list[int]]],
    threads: int | None,
    progress: Progress,
    label: str,
) -> None:
    """All pieces on a pool of threads (the kernels release the lock); Ctrl-C stops them after their present point."""
    workers = min(threads or cores(), len(pieces))
    total = sum(len(order) for _, order in pieces)
    with progress_bar(total, f"sweep over {label}", progress) as advance:
        report = Report(advance)
        over_items(pieces, lambda piece: march(*piece, report), lambda *_: None, workers, report.stop)


def run_on_gpu(
    points: FloatArray, starts: FloatArray, slots: Mapping[tuple[int, int], Slot], progress: Progress, label: str
) -> None:
    """All points from each start, on the GPU."""
    from nonsmooth.attractors.settle_cuda import sweep_on_gpu

    with progress_bar(len(points) * len(starts), f"sweep over {label}", progress) as advance:
        for k, start in enumerate(starts):
            slot = slots[0, k]
            slot.put(slice(None), sweep_on_gpu(slot.settler, points, start, slot.kept, advance))


def largest_of(starts: FloatArray, slots: Iterable[Slot], extremes: bool) -> FloatArray:
    """The largest size of each state, of the starts and of all runs that came to their end; without their extremes
    that of their section points."""
    sizes = [np.abs(starts)]
    for slot in slots:
        there = ended(slot)
        ends = slot.extremes()[::3] if extremes else (np.abs(slot.kept.section).max(axis=1),)
        sizes += [np.abs(end[there]) for end in ends]
    return np.nan_to_num(np.vstack(sizes)).max(axis=0)


def ended(slot: Slot) -> np.ndarray:
    """Marks of runs that came to their end."""
    return usable(slot.status)
