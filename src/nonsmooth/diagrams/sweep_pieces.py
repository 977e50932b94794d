"""A sweep cut into pieces of independent work: their buffers, and how they are run."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from nonsmooth.attractors.settle import Attractors, Verdict
from nonsmooth.attractors.settled import usable
from nonsmooth.campaign.threads import cores, over_items
from nonsmooth.diagrams.density import CountedSlot, Counter
from nonsmooth.flow.engines.engine import Chain, FloatArray
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.results.progress import progress as progress_bar

__all__ = ["Report", "Slot", "ended", "largest_of", "pieces_of", "run_on_gpu", "run_pieces"]

PIECE = 16  # points of one piece of independent work


class Slot:
    """One direction and start: the kernel's buffers over all points (histograms in place of points), the verdicts."""

    def __init__(
        self, attractors: Attractors, points: FloatArray, sizes: tuple[int, int, int], edges: FloatArray | None
    ) -> None:
        n_points = len(points)
        self.attractors = attractors
        self.counted = None if edges is None else CountedSlot(attractors, points, sizes, edges)
        self.chain = Chain.empty(n_points, attractors.keep, *sizes) if self.counted is None else self.counted.chain
        self.period_number = np.zeros(n_points, dtype=np.int64)
        self.residual = np.full(n_points, np.nan)
        self.status = np.full(n_points, codes.INTERRUPTED, dtype=np.int8)

    @property
    def counter(self) -> Counter:
        """The histograms of a sweep with ``density``."""
        assert self.counted is not None
        return self.counted.counter

    def places(self, order: Sequence[int]) -> Iterable[tuple[int, int, Attractors, Chain]]:
        """For each point of ``order``: its number, its row in a buffer, what runs it, that buffer."""
        if self.counted is not None:
            return self.counted.places(order)
        return ((i, i, self.attractors, self.chain) for i in order)

    def keep(self, i: int, row: int, verdict: Verdict, chain: Chain) -> None:
        """The verdict on parameter value i, whose run stands in a row of a buffer."""
        self.period_number[i] = verdict.period_number
        self.residual[i] = verdict.residual
        self.status[i] = verdict.status
        if self.counted is not None and usable(verdict.status):
            self.counted.count(i, row, chain)


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
    points: FloatArray, starts: FloatArray, memory: FloatArray, rules: Attractors,
    slots: Mapping[tuple[int, int], Slot], progress: Progress, label: str,
) -> None:  # fmt: skip
    """All points from each start, on the GPU."""
    from nonsmooth.attractors.settle_cuda import sweep_on_gpu

    with progress_bar(len(points) * len(starts), f"sweep over {label}", progress) as advance:
        for k, start in enumerate(starts):
            slot = slots[0, k]
            found = sweep_on_gpu(points, start, memory, rules, slot.chain, advance)
            slot.period_number[:], slot.residual[:], slot.status[:] = found.period_number, found.residual, found.status


def largest_of(starts: FloatArray, slots: Iterable[Slot], extremes: bool) -> FloatArray:
    """The largest size of each state, of the starts and of all runs that came to their end; without their extremes
    that of their section points."""
    sizes = [np.abs(starts)]
    for slot in slots:
        there = ended(slot)
        ends = (slot.chain.maximum, slot.chain.minimum) if extremes else (np.abs(slot.chain.section).max(axis=1),)
        sizes += [np.abs(end[there]) for end in ends]
    return np.nan_to_num(np.vstack(sizes)).max(axis=0)


def ended(slot: Slot) -> np.ndarray:
    """Marks of runs that came to their end."""
    return usable(slot.status)
