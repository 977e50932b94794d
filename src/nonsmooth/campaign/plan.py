"""What a work would take, from a small random sample of its chunks."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from nonsmooth.campaign.threads import cores
from nonsmooth.campaign.work import Work

__all__ = ["Plan", "plan"]

SECONDS = 5.0  # of sampling
LEAST = 8  # chunks, where there are so many


@dataclass(frozen=True)
class Plan:
    """An estimate: core-seconds with their standard error, and bytes."""

    places: int
    chunks: int
    sampled: int
    core_seconds: float
    error: float
    result_bytes: int

    def seconds(self, workers: int) -> float:
        """Seconds on so many cores of this kind."""
        return self.core_seconds / max(min(workers, self.chunks), 1)

    def text(self, workers: int | None = None) -> str:
        """A few lines for a person."""
        here = cores()
        lines = [
            f"{self.places} points in {self.chunks} chunks; sampled {self.sampled} chunks",
            f"work        {_time(self.core_seconds)} of one core (+- {_time(self.error)})",
            f"here        {_time(self.seconds(here))} on {here} cores",
        ]
        if workers is not None:
            lines.append(f"cluster     {_time(self.seconds(workers))} on {workers} cores of this kind")
        lines.append(f"memory      {_size(self.result_bytes)} for the result, and below 50 MB per thread")
        lines.append(f"store       at most {_size(self.result_bytes)} (less after compression)")
        return "\n".join(lines)


def plan(work: Work, *, seconds: float = SECONDS, seed: int = 0) -> Plan:
    """Run random chunks for some seconds, one after the other, and scale up.

    The first chunk is run once before the clock: it compiles and loads what all need.
    """
    n = work.n_chunks()
    order = np.random.default_rng(seed).permutation(n)
    work.compute(int(order[0]))
    per_place = []
    began = time.perf_counter()
    for k, chunk in enumerate(order):
        if k >= min(LEAST, n) and time.perf_counter() - began > seconds:
            break
        first, last = work.bounds(int(chunk))
        start = time.thread_time()  # other users of the machine do not lengthen it
        work.compute(int(chunk))
        per_place.append((time.thread_time() - start) / (last - first))
    places = work.bounds(n - 1)[1]
    width = sum(np.dtype(item.dtype).itemsize * int(np.prod(item.shape)) for item in work.columns().values())
    rest = 1.0 - len(per_place) / n
    error = places * float(np.std(per_place)) / max(len(per_place) - 1, 1) ** 0.5 * rest**0.5
    return Plan(places, n, len(per_place), places * float(np.mean(per_place)), error, places * width)


def _time(seconds: float) -> str:
    for unit, length in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"


def _size(n: int) -> str:
    for unit, length in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n >= length:
            return f"{n / length:.3g} {unit}"
    return f"{n} B"
