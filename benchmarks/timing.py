"""Medians of repeated, interleaved timings: peers take turns, so that a slow minute of the machine hits all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from time import perf_counter
from typing import Any

REPEATS = 5


def interleaved(peers: Mapping[str, Callable[[], Any]], repeats: int = REPEATS) -> dict[str, list[float]]:
    """Seconds of each repeat of each peer, after one untimed call of each."""
    for peer in peers.values():
        peer()
    times: dict[str, list[float]] = {name: [] for name in peers}
    for _ in range(repeats):
        for name, peer in peers.items():
            begin = perf_counter()
            peer()
            times[name].append(perf_counter() - begin)
    return times


def medians(times: Mapping[str, list[float]]) -> dict[str, float]:
    return {name: median(values) for name, values in times.items()}


def geometric_mean(values: list[float]) -> float:
    product = 1.0
    for value in values:
        product *= value
    return product ** (1 / len(values))
