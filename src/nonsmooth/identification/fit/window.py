"""A window of a record, with a free start of its own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.fit.records import Record
from nonsmooth.recordings.signals.spectrum import correlation_times


@dataclass(frozen=True, eq=False)
class Window:
    """A window of a record.

    Attributes
    ----------
    record : int
    first, last : int
        Its samples: ``first <= k < last``.
    begin : float
        Time of its first sample: the motion begins with what this shows, the longest delay before it.
    start : array (n,)
        States and memory at its start.
    spread : array (n,)
        How far each of them may move; 0: not at all.
    mode : int
    which : array of int
        Places of its unknowns.
    time, values : array (N,), (N, c)
        Its samples.
    """

    record: int
    first: int
    last: int
    begin: float
    start: FloatArray
    spread: FloatArray
    mode: int
    which: NDArray[np.intp]
    time: FloatArray
    values: FloatArray

    def cut(self, record: Record, last: int, **changes: Any) -> Window:
        """The window up to another sample of its record."""
        here = slice(self.first, last)
        return replace(self, last=last, time=record.time[here], values=record.values[here], **changes)

    @cached_property
    def readings(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Sample and quantity of each reading, in the order of time."""
        k, c = np.nonzero(np.isfinite(self.values))
        return k, c

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """States of the start that are not known."""
        return np.flatnonzero(self.spread > 0)

    @property
    def n_free(self) -> int:
        return len(self.free)

    def by_instant(self, rows: FloatArray) -> FloatArray:
        """Sums of rows over the readings of each instant; the rows of the start are left out."""
        k, _ = self.readings
        return np.add.reduceat(rows[: len(k)], np.flatnonzero(np.diff(k, prepend=-1)), axis=0)

    def correlation(self, r: FloatArray) -> float:
        """Samples that share one independent error: of the quantity for which they are the most."""
        _, c = self.readings
        return max(correlation_times(r[: len(c)][c == one]) for one in np.unique(c))
