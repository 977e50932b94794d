"""Distances and means of orbits whose every sample is written down, and period numbers of points that drift."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.identification.compare.orbits import _cubic, common_length, fold, mean_orbit, orbit_distance
from nonsmooth.identification.compare.periods import flips, measured_period

ANGLE = 2 * np.pi * np.arange(64) / 64


def test_a_constant_difference_counts_once() -> None:
    """cos and cos + b: the distance is b over the root mean square of cos about its mean, 1 / sqrt 2; between states
    that stand still it is in their own unit."""
    a = np.cos(ANGLE)[:, None]
    found = orbit_distance(a, a + 0.3, 1)
    assert found.distance == pytest.approx(0.3 * np.sqrt(2), rel=1e-12)
    assert found.any_phase == pytest.approx(0.3 * np.sqrt(2), rel=1e-6)
    assert orbit_distance(0 * a + 1.0, 0 * a + 1.3, 1).distance == pytest.approx(0.3, rel=1e-12)


def test_a_difference_at_half_the_sample_rate_counts_once() -> None:
    a = np.cos(ANGLE)[:, None]
    b = a + 0.2 * np.where(np.arange(64) % 2, -1.0, 1.0)[:, None]
    size = np.sqrt(0.5 * (0.5 + 0.5 + 0.04))
    assert orbit_distance(a, b, 1).distance == pytest.approx(0.2 / size, rel=1e-12)


@pytest.mark.parametrize("periods", [1, 2, 3])
def test_two_states_are_averaged_and_whole_shifts_are_free(periods: int) -> None:
    """Of a motion over p periods that is rolled by k whole ones the distance is 0 and the shift k; of one that leads by
    a fraction besides, ``phase_shift`` is that fraction."""
    t = 2 * np.pi * np.arange(64 * periods) / 64
    a = np.column_stack([np.cos(t) + 0.5 * np.cos(t / periods), np.sin(t / periods)])
    for k in range(periods):
        found = orbit_distance(a, np.roll(a, -64 * k, axis=0), periods)
        assert found.distance == pytest.approx(0.0, abs=1e-7) and found.whole_shift == k
    s = t + 2 * np.pi * 0.2
    led = np.column_stack([np.cos(s) + 0.5 * np.cos(s / periods), np.sin(s / periods)])
    found = orbit_distance(a, np.roll(led, -64 * (periods - 1), axis=0), periods)
    assert found.any_phase == pytest.approx(0.0, abs=1e-4)
    assert found.phase_shift == pytest.approx(0.2, abs=1e-5)
    assert len(common_length(a, periods, 2 * periods)) == 2 * len(a)


def test_the_mean_of_three_passes_and_their_scatter() -> None:
    """Passes 1, 2, 6: mean 3, standard deviation sqrt(((-2)^2 + (-1)^2 + 3^2) / 2) = sqrt 7; part of a pass is none."""
    folded = np.repeat([1.0, 2.0, 6.0], 2)[:, None, None] * np.ones((6, 4, 1))
    orbit, scatter = mean_orbit(np.concatenate([folded, np.full((1, 4, 1), 99.0)]), 2)
    assert orbit == pytest.approx(np.full((8, 1), 3.0)) and scatter == pytest.approx(np.full((8, 1), np.sqrt(7)))


def test_whole_periods_begin_at_phase_zero() -> None:
    """From phase 0.3 to 3.6: the periods from 1 to 3, the first sample of each at a whole phase."""
    phase = np.arange(0.3, 3.6, 1 / 40)
    found = fold(phase, np.column_stack([phase, phase**3]), 16)
    at = 1 + np.arange(32) / 16
    assert found.shape == (2, 16, 2)
    assert found.reshape(32, 2) == pytest.approx(np.column_stack([at, at**3]), abs=1e-11)
    cubes = np.where((phase > 2.4) & (phase < 2.6), np.nan, phase**3)
    told = np.isfinite(fold(phase, np.column_stack([phase, cubes]), 16)).all(axis=(1, 2))
    assert told.tolist() == [True, False]  # the period in which readings are lost


@pytest.mark.parametrize(("drift", "drifting"), [(0.0, False), (5.0, True)])
def test_returns_of_white_noise_are_one(drift: float, drifting: bool) -> None:
    """First differences have twice the variance of a point, second ones six times; an even drift has none."""
    n = 4000
    points = drift * np.arange(n)[:, None] + 0.1 * np.random.default_rng(0).standard_normal((n, 1))
    found = measured_period(points, [0.1], max_period=4, drifting=drifting)
    assert found.number == 1
    assert found.returns == pytest.approx(1.0, abs=0.05)


def test_a_flip_lies_in_the_middle_of_what_nothing_tells() -> None:
    """2 up to 3.0, nothing at 4.0 to 6.0, 1 from 7.0 on: 5.0; with a stray on each side the same."""
    values = np.arange(12.0)
    assert flips(values, [2, 2, 2, 2, 0, 0, 0, 1, 1, 1, 1, 1]) == [("1-2", False, 5.0)]
    assert flips(values, [2, 1, 2, 2, 0, 0, 0, 1, 1, 2, 1, 1]) == [("1-2", False, 5.0)]
    assert flips(values, [1, 1, 1, 1, 0, 0, 0, 2, 2, 2, 4, 4]) == [("1-2", True, 5.0), ("2-4", True, 9.5)]


def test_a_motion_that_is_doubled_in_the_middle_flips_twice() -> None:
    """And one stray is no flip there and back, however many points the record has; two values are."""
    values = np.arange(12.0)
    assert flips(values, [1, 1, 1, 2, 2, 2, 2, 0, 1, 1, 1, 1]) == [("1-2", True, 2.5), ("1-2", False, 7.0)]
    assert flips(values, [1, 1, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1]) == []
    assert flips(values, [1, 1, 1, 1, 2, 2, 1, 1, 1, 1, 1, 1]) == [("1-2", True, 3.5), ("1-2", False, 5.5)]
    assert flips(values, [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2]) == [("1-2", True, 10.5)]
    assert flips(values, [1, 1, 1, 1, 2, 2, 1, 1, 1, 1, 1, 1], least=3) == []


def test_between_samples_stands_the_cubic_of_the_four_about_a_place() -> None:
    """Of x^4 it is off by the product of the distances: 9/16 in the middle of four, 15/16 at the ends of the record."""
    x = np.arange(8.0)
    at = x[:-1] + 0.5
    off = at**4 - _cubic(x, x[:, None] ** 4, at)[:, 0]
    assert off == pytest.approx([-15 / 16, *[9 / 16] * 5, -15 / 16], abs=1e-10)
