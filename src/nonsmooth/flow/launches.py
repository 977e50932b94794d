"""Work for a GPU cut up: jobs in batches, one thread for each job of a launch."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from nonsmooth.flow.engine import FloatArray, IntArray

__all__ = ["batches", "launch"]


def batches(points: FloatArray, rows: IntArray, size: int) -> Iterator[tuple[slice, FloatArray, IntArray]]:
    """Jobs in batches: which, the parameter points that they need, and their rows among these."""
    for first in range(0, len(rows), size):
        some = slice(first, first + size)
        needed, own = np.unique(rows[some], return_inverse=True)
        yield some, points[needed], own.astype(np.int64)


def launch(entry: Any, threads: int, jobs: Any, *arguments: Any) -> None:
    """One thread for each job, in blocks of ``threads``; waits for nothing."""
    from numba.core.errors import NumbaPerformanceWarning

    with warnings.catch_warnings():  # a few threads on a large GPU: Numba warns of it
        warnings.simplefilter("ignore", NumbaPerformanceWarning)
        configured = entry[-(-len(jobs) // threads), threads]
    configured(jobs, *arguments)
