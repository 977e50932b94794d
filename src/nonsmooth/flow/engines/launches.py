"""Work for a GPU cut up: jobs in batches, one thread for each job of a launch."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.kernels.hybrid.kept import Kept


@dataclass
class StatesOnGpu:
    """Places of N trajectories, on the GPU: states, memory, clocks, modes, and the parameter row of each."""

    u: Any  # (N, n)
    memory: Any  # (N, n_memory), at least one column
    clock: Any  # (N, 3)
    counters: Any  # (N, 4)
    rows: Any  # (N,)

    @classmethod
    def of(
        cls, cuda: Any, rows: IntArray, u: FloatArray, memory: FloatArray, modes: Any, clock: FloatArray
    ) -> StatesOnGpu:
        """Those of N trajectories with their clocks (:class:`.engine.State`), which have no transition behind them."""
        counters, room = np.zeros((len(rows), 4), dtype=np.int64), np.zeros((len(rows), max(memory.shape[1], 1)))
        counters[:, 0], counters[:, 1], room[:, : memory.shape[1]] = modes, -1, memory
        parts = (np.array(u, dtype=float), room, np.array(clock, dtype=float), counters, np.asarray(rows))
        return cls(*map(cuda.to_device, parts))

    def room(self, cuda: Any, times: int) -> StatesOnGpu:
        """Room for so many states at the parameter rows of each of these."""
        shapes = [(times * len(part), *part.shape[1:]) for part in self.all()]
        rows = np.tile(self.rows.copy_to_host(), times)
        arrays = (cuda.device_array(shape, part.dtype) for shape, part in zip(shapes, self.all(), strict=True))
        return StatesOnGpu(*[*arrays, cuda.to_device(rows)])

    def all(self) -> tuple[Any, ...]:
        return self.u, self.memory, self.clock, self.counters

    def place(self) -> tuple[Any, ...]:
        """Without memory, as the linear kernels take it."""
        return self.u, self.clock, self.counters


def batches(points: FloatArray, rows: IntArray, size: int) -> Iterator[tuple[slice, FloatArray, IntArray]]:
    """Jobs in batches: which, the parameter points that they need, and their rows among these."""
    for first in range(0, len(rows), size):
        some = slice(first, first + size)
        needed, own = np.unique(rows[some], return_inverse=True)
        yield some, points[needed], own.astype(np.int64)


class OnGpu:
    """Launches, and room for what they leave, of an engine on a GPU; ``n`` states, ``rows`` whose extremes are kept."""

    cuda: Any
    threads: int
    n: int
    rows: int

    def launch(self, entry: Any, jobs: IntArray, *arguments: Any) -> None:
        """One thread for each job, in blocks of ``threads``; waits for nothing."""
        with warnings.catch_warnings():  # a few threads on a large GPU: Numba warns of it, in a class of its own
            warnings.filterwarnings("ignore", message=".*low occupancy")
            configured = entry[-(-len(jobs) // self.threads), self.threads]
        configured(self.cuda.to_device(jobs), *arguments)

    def buffers(self, n: int, keep: int) -> Kept:
        """Room for ``keep`` section points of each of n trajectories."""
        array, whole, keep = self.cuda.device_array, np.int64, max(keep, 1)
        return Kept(
            array((n, keep, self.n)),
            array((n, self.rows)),
            array((n, self.rows)),
            array(n, whole),
            array(n, whole),
            array(n),
            array((n, keep)),
            array((n, keep), whole),
            array(n, whole),
        )
