"""Sampling read off a time axis: the rate, gaps, a change of rate, times printed with too few digits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray

_BLOCK = 16  # steps per block; means over a block see a change of rate through jitter and rounding of the times
_CHANGE = 0.05  # of the rate, between blocks
_GAP = 1.5  # steps; a longer one is a gap


@dataclass(frozen=True)
class Sampling:
    """``rate`` in Hz (NaN for fewer than two distinct times); ``gaps`` as (index before, samples missing)."""

    rate: float
    regular: bool
    repeated: int
    gaps: tuple[tuple[int, int], ...]
    change: tuple[int, float, float] | None  # index, rate before, rate after


def examine(time: FloatArray) -> Sampling:
    """Judge times that do not decrease, in seconds."""
    steps = np.diff(time)
    repeated = int(np.count_nonzero(steps == 0))
    if len(steps) == 0 or time[-1] == time[0]:
        return Sampling(float("nan"), True, repeated, (), None)
    change = _change_of_rate(steps)
    typical = float(np.median(steps))
    if typical == 0 or repeated > len(steps) // 10:
        # Rounded times: only their mean says anything.
        return Sampling(float(len(steps) / (time[-1] - time[0])), False, repeated, (), change)
    # The lengths of a rate's own steps, not its gaps; a step within rounding of typical counts once.
    counts = np.maximum(np.rint(np.minimum(steps / typical, 1e15)), 1)
    wide = np.flatnonzero(steps > _GAP * typical)
    if change is None and len(wide) <= max(3, len(steps) // 20):
        gaps = tuple((int(i), int(counts[i]) - 1) for i in wide if counts[i] > 1)
        rate = float(counts.sum() / (time[-1] - time[0]))
    else:
        gaps, rate = (), 1.0 / typical
    expected = time[0] + np.concatenate([[0.0], np.cumsum(counts if gaps else np.ones(len(steps)))]) / rate
    regular = change is None and not gaps and bool(np.max(np.abs(time - expected)) * rate < 0.5)
    return Sampling(rate, regular, repeated, gaps, change)


def missing_runs(values: FloatArray) -> tuple[int, int, int]:
    """Number of values that are not finite, and the first index and length of the longest run of them."""
    bad = ~np.isfinite(values)
    total = int(np.count_nonzero(bad))
    if total == 0:
        return 0, 0, 0
    start, end = max(runs_of(bad), key=lambda run: run[1] - run[0])
    return total, start, end - start


def runs_of(mask: BoolArray) -> list[tuple[int, int]]:
    """First place of each run of True, and the place behind its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _change_of_rate(steps: FloatArray) -> tuple[int, float, float] | None:
    """The first place where the mean step of whole blocks leaves that of the blocks before it, and stays away."""
    block = _BLOCK if len(steps) >= 4 * _BLOCK else 4
    threshold = _CHANGE if block == _BLOCK else 5 * _CHANGE
    count = len(steps) // block
    if count < 2:
        return None
    blocks = steps[: count * block].reshape(count, block)
    # The median of a block passes over a gap; its mean, clipped, passes over rounding of the times.
    middle = np.median(blocks, axis=1, keepdims=True)
    means = np.where(middle > 0, np.minimum(blocks, 2 * middle), blocks).mean(axis=1)
    positive = np.maximum(means, np.finfo(float).tiny)
    reference = float(np.median(positive[: max(1, min(4, count // 2))]))
    away = np.abs(positive / reference - 1) > threshold
    # One block is jitter, a gap, or the change itself inside a block: two in a row, or all of the rest, are a change.
    for i in np.flatnonzero(away):
        rest = away[i:]
        if len(rest) >= 2 and bool(rest[:2].all()):
            after = float(np.median(positive[i + 1 : i + 5]))
            if abs(after / reference - 1) > threshold:
                # The block only says about where; the first of its steps that is nearer to the new one says it.
                near = steps[int(i) * block : (int(i) + 2) * block]
                offset = int(np.argmax(np.abs(near - after) < np.abs(near - reference)))
                return int(i) * block + offset, 1.0 / reference, 1.0 / after
    return None
