"""A trajectory is a list of segments: put the two limits of every crossing between the samples."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Segmented(NamedTuple):
    """``source[i]`` tells where row i comes from: k >= 0 the sample k; -1 a limit at a crossing."""

    time: NDArray[np.float64]
    u: NDArray[np.float64]
    mode: NDArray[np.int64]
    segment: NDArray[np.int64]
    source: NDArray[np.int64]


def with_crossings(
    sample_time: NDArray[np.float64],
    sample_u: NDArray[np.float64],
    sample_mode: NDArray[np.int64],
    sample_segment: NDArray[np.int64],
    crossing_time: NDArray[np.float64],
    u_before: NDArray[np.float64],
    u_after: NDArray[np.float64],
    mode_before: NDArray[Any],
    mode_after: NDArray[Any],
) -> Segmented:
    """Samples and crossings in one list in which every crossing stands twice.

    The limit before crossing k ends segment k, the limit after it begins segment k + 1; samples lie within
    their segment in the order given. A sample exactly at a crossing is kept beside the limits.
    """
    n, count = len(sample_time), len(crossing_time)
    index = np.arange(count)
    segment = np.concatenate([sample_segment, index, index + 1]).astype(np.int64)
    # Within a segment: the limit after the crossing that opened it, the samples, the limit before the next.
    place = np.concatenate([np.ones(n), np.full(count, 2.0), np.zeros(count)])
    inner = np.concatenate([np.arange(n), np.zeros(2 * count)])
    order = np.lexsort((inner, place, segment))
    return Segmented(
        np.concatenate([sample_time, crossing_time, crossing_time])[order],
        np.concatenate([sample_u, u_before, u_after])[order],
        np.concatenate([sample_mode, mode_before, mode_after]).astype(np.int64)[order],
        segment[order],
        np.concatenate([np.arange(n), np.full(2 * count, -1)])[order],
    )
