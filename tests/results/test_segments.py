"""Samples and crossings in one list: order, limits, jumps."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from nonsmooth.flow.simulate import with_crossings


def merged(crossing: list[float], before: list[float], after: list[float], samples: list[float], segment: list[int]):
    n, count = len(samples), len(crossing)
    log = SimpleNamespace(
        sample_u=np.array(samples)[:, None],
        sample_mode=np.array(segment) % 2,
        sample_segment=np.array(segment),
        crossing_time=np.array(crossing),
        u_before=np.array(before)[:, None],
        u_after=np.array(after)[:, None],
    )
    return with_crossings(np.array(samples), log, np.arange(count) % 2, (np.arange(count) + 1) % 2), n


def test_each_crossing_stands_twice_between_the_samples() -> None:
    result, n = merged([1.5, 2.5], [1.0, 2.0], [-1.0, -2.0], [0.0, 1.0, 2.0, 3.0], [0, 0, 1, 2])
    np.testing.assert_array_equal(result.time, [0, 1, 1.5, 1.5, 2, 2.5, 2.5, 3])
    np.testing.assert_array_equal(result.u[:, 0], [0, 1, 1.0, -1.0, 2, 2.0, -2.0, 3])
    np.testing.assert_array_equal(result.segment, [0, 0, 0, 1, 1, 1, 2, 2])
    np.testing.assert_array_equal(result.mode, [0, 0, 0, 1, 1, 1, 0, 0])
    assert len(result.time) == n + 4


def test_a_sample_at_a_crossing_and_a_chain_at_one_instant_keep_their_order() -> None:
    result, _ = merged([1.0, 1.0], [5.0, 6.0], [6.0, 7.0], [0.0, 1.0, 2.0], [0, 2, 2])
    np.testing.assert_array_equal(result.segment, [0, 0, 1, 1, 2, 2, 2])
    np.testing.assert_array_equal(result.u[:, 0], [0, 5, 6, 6, 7, 1, 2])


def test_without_crossings_the_samples_are_unchanged() -> None:
    result, _ = merged([], [], [], [0.0, 1.0, 2.0], [0, 0, 0])
    np.testing.assert_array_equal(result.time, [0, 1, 2])
    assert result.u.shape == (3, 1)
