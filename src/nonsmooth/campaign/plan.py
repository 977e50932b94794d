"""Estimate of what a work takes, from a small sample of its chunks, spread over the whole from a random place on."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from nonsmooth.campaign.run import cores
from nonsmooth.campaign.work import ChunkedWork, places_of, width_of
from nonsmooth.errors import not_installed

SECONDS = 5.0  # of sampling
LEAST = 8  # chunks, where there are so many
PATIENCE = 4  # times the seconds, on a machine that is busy otherwise
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


@dataclass(frozen=True)
class Plan:
    """An estimate: core-seconds with their standard error, and bytes.

    ``process_bytes``: of this process as it is now, with all that is loaded (0: not known on this system);
    ``stored_bytes``: of a store, compressed; None where the package zarr is not installed.
    """

    places: int
    chunks: int
    sampled: int
    core_seconds: float
    error: float
    result_bytes: int
    stored_bytes: int | None
    process_bytes: int

    @property
    def memory_bytes(self) -> int:
        """Of the whole process with the result in it."""
        return self.process_bytes + self.result_bytes

    def seconds(self, workers: int) -> float:
        """Seconds on so many cores of this kind."""
        return self.core_seconds / max(min(workers, self.chunks), 1)

    def text(self, workers: int | None = None) -> str:
        """A few lines for a person."""
        here = cores()
        lines = [
            f"{self.places} points in {self.chunks} chunks; sampled {self.sampled} chunks",
            f"work        {duration(self.core_seconds)} of one core (+- {duration(self.error)})",
            f"here        {duration(self.seconds(here))} on {here} cores",
        ]
        if workers is not None:
            lines.append(f"cluster     {duration(self.seconds(workers))} on {workers} cores of this kind")
        process = f"{_size(self.memory_bytes)} for the process, " if self.process_bytes else ""
        lines.append(f"memory      {process}{_size(self.result_bytes)} of it for the result")
        if self.stored_bytes is None:
            lines.append(f"store       not measured: it needs {not_installed('zarr', 'zarr')}")
        else:
            lines.append(f"store       {_size(self.stored_bytes)}, compressed")
        return "\n".join(lines)


def plan(work: ChunkedWork, *, seconds: float = SECONDS, kept: int | None = None) -> Plan:
    """Run some chunks for some seconds of processor time, one after the other, and scale up.

    The first chunk is run once before the clock: it compiles and loads what all need.

    Parameters
    ----------
    kept : int, optional
        Places of a chunk of the store; those of the work's own chunks where not given.
    """
    from nonsmooth.campaign.store import stored_bytes

    n = work.n_chunks()
    # an order whose every beginning lies evenly over the whole, by multiples of the golden ratio from a random place on
    order = np.argsort((np.random.default_rng(0).random() + GOLDEN * np.arange(n)) % 1.0)
    work.compute(int(order[0]))
    per_place, samples = [], {}
    began, spent = time.perf_counter(), 0.0
    for k, chunk in enumerate(order):
        if k >= min(LEAST, n) and (spent > seconds or time.perf_counter() - began > PATIENCE * seconds):
            break
        first, last = work.bounds(int(chunk))
        start = time.thread_time()  # other users of the machine do not lengthen it
        samples[int(chunk)] = work.compute(int(chunk))
        took = time.thread_time() - start
        per_place.append(took / (last - first))
        spent += took
    places = places_of(work)
    first, last = work.bounds(0)
    together = [samples[chunk] for chunk in sorted(samples)]
    return Plan(
        places,
        n,
        len(per_place),
        *scaled_up(per_place, places, 1.0 - len(per_place) / n),
        places * width_of(work),
        stored_bytes(work, together, kept or last - first) if find_spec("zarr") else None,
        _resident(),
    )


def scaled_up(per_place: Sequence[float], places: int, rest: float) -> tuple[float, float]:
    """Seconds of all places, and their standard error, from samples; ``rest`` is the part that was not sampled."""
    error = float(np.std(per_place)) / max(len(per_place) - 1, 1) ** 0.5 * rest**0.5
    return places * float(np.mean(per_place)), places * error


def _resident() -> int:
    """Bytes of memory that this process has needed at most, so far."""
    try:
        import resource
    except ImportError:  # not on Windows
        return 0
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(most) * (1 if sys.platform == "darwin" else 1024)


def duration(seconds: float) -> str:
    """Seconds in the unit that a person would use."""
    for unit, length in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"


def _size(n: int) -> str:
    for unit, length in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n >= length:
            return f"{n / length:.3g} {unit}"
    return f"{n} B"
