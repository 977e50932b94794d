"""Medians of repeated, interleaved timings: peers take turns, so that a slow minute of the machine hits all.

One-core work is measured in processor time of the process, which other users of the machine do not lengthen; all
peers here keep the core busy, so it is their wall time on an idle machine. The ratio of two peers is the median of
the ratios within one turn.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import prod
from statistics import median
from time import process_time
from typing import Any

REPEATS = 5

Times = dict[str, list[float]]


def interleaved(
    peers: Mapping[str, Callable[[], Any]], clock: Callable[[], float] = process_time, repeats: int = REPEATS
) -> Times:
    """Seconds of each repeat of each peer, after one untimed call of each."""
    for peer in peers.values():
        peer()
    times: Times = {name: [] for name in peers}
    for _ in range(repeats):
        for name, peer in peers.items():
            begin = clock()
            peer()
            times[name].append(clock() - begin)
    return times


def per_unit(times: Times, counts: Mapping[str, int]) -> Times:
    """Microseconds per period or return."""
    return {name: [1e6 * t / counts[name] for t in values] for name, values in times.items()}


def ratio(times: Times, a: str, b: str) -> float:
    """Return the time that `a` takes over that of `b`."""
    return median(x / y for x, y in zip(times[a], times[b], strict=True))


def geometric_mean(values: list[float]) -> float:
    return prod(values) ** (1 / len(values))
