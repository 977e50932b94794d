"""Time that a chart would take on the GPU of this machine: a sample of its points, spread over the plane, run there.

Nothing is reckoned from operations and peaks: the part of its peak that a GPU reaches is what nobody knows before it is
measured. A sample fills the GPU as a launch of the chart itself does, because a GPU that is half empty is no faster,
and its threads stand beside those of neighbouring points, as they do there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from nonsmooth.campaign.plan import GOLDEN, duration, scaled_up
from nonsmooth.diagrams.chart_work import ChartWork
from nonsmooth.flow.engines.devices import batch_size, gpu_name
from nonsmooth.flow.engines.engine import IntArray

BLOCK = 64  # neighbouring points that stay together
POINTS = 16  # of each carried row


@dataclass(frozen=True)
class GpuPlan:
    """Seconds on the wall for all points of a chart on one GPU, with their standard error.

    The error is 0 where all points were run, NaN where it is not known."""

    name: str
    places: int
    sampled: int
    seconds: float
    error: float

    def text(self) -> str:
        """A line for a person."""
        if self.sampled == self.places:
            how = f"all {self.places} points were run"
        else:
            error = "" if np.isnan(self.error) else f"+- {duration(self.error)}; "
            how = f"{error}sampled {self.sampled} points"
        return f"gpu         {duration(self.seconds)} on {self.name} ({how})"


def plan_on_gpu(work: ChartWork, *, seconds: float = 5.0) -> GpuPlan:
    """Run some of a chart's points on the GPU for some seconds, and scale up.

    Parameters
    ----------
    work : ChartWork
        With ``device="cuda"``, over the whole plane.
    """
    n = work.bounds(work.n_chunks() - 1)[1]
    if work.carried:
        return _carried(work, n)
    size = min(max(batch_size() // len(work.starts), 1), n)
    blocks, begin = -(-n // BLOCK), float(np.random.default_rng(0).random())
    _took(work, _sample(n, begin, range(1)))  # compiles and loads what all need
    count, spent, sampled = -(-size // BLOCK), 0.0, 0
    per_place: list[float] = []
    for first in range(0, blocks, count):
        if len(per_place) >= 2 and spent > seconds:
            break
        places = np.arange(n) if size == n else _sample(n, begin, range(first, first + count))
        took = _took(work, places)
        per_place.append(took / len(places))
        spent, sampled = spent + took, sampled + len(places)
    return GpuPlan(gpu_name(), n, min(sampled, n), *scaled_up(per_place, n, max(1.0 - sampled / n, 0.0)))


def _carried(work: ChartWork, n: int) -> GpuPlan:
    """The rows of one chunk over a few of their points."""
    (outer, rows), (inner, values) = work.grid.items()
    few = values[np.unique(np.linspace(0, len(values) - 1, POINTS).astype(int))]
    at_once = work.bounds(0)[1] // len(values)
    _took(replace(work, grid={outer: rows[:1], inner: few[:1]}), None)
    took = _took(replace(work, grid={outer: rows[:at_once], inner: few}), None)
    sampled = min(at_once, len(rows)) * len(few)
    seconds = took * len(values) / len(few) * work.n_chunks()
    return GpuPlan(gpu_name(), n, sampled, seconds, np.nan if sampled < n else 0.0)


def _sample(n: int, begin: float, which: range) -> IntArray:
    """Places of some blocks out of n places; every beginning of the blocks' order lies evenly over the whole."""
    blocks = -(-n // BLOCK)
    chosen = np.unique(((begin + GOLDEN * np.asarray(which)) % 1.0 * blocks).astype(np.int64))
    places = (chosen[:, None] * BLOCK + np.arange(BLOCK)).ravel()
    return places[places < n]


def _took(work: ChartWork, places: IntArray | None) -> float:
    """Seconds on the wall for some places (None: all) in one chunk."""
    sample = work if places is None else replace(work, where=places, chunk=len(places) * len(work.starts))
    began = time.perf_counter()
    sample.compute(0)
    return time.perf_counter() - began
