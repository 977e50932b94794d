"""Distances of clouds against closed forms and SciPy's one-dimensional ones."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from nonsmooth.identification.compare.orbits import block_length, cloud_distance, energy_distance, wasserstein


def normal(n: int, seed: int, mean: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 2)) + mean


def test_one_dimension_is_scipys() -> None:
    a, b = normal(130, 1)[:, 0], 1.3 * normal(90, 2)[:, 0] + 0.4
    assert energy_distance(a, b) == pytest.approx(scipy.stats.energy_distance(a, b), rel=1e-12)
    size = min(len(a), len(b))
    assert wasserstein(a[:size], b[:size]) == pytest.approx(
        scipy.stats.wasserstein_distance(a[:size], b[:size]), rel=1e-12
    )


def test_a_line_in_the_plane_is_one_dimension() -> None:
    """Distances are those along the line, whatever its slope."""
    a, b = normal(80, 3)[:, 0], normal(80, 4)[:, 0] - 0.7
    along = np.array([np.cos(0.4), np.sin(0.4)])
    assert energy_distance(np.outer(a, along), np.outer(b, along)) == pytest.approx(
        scipy.stats.energy_distance(a, b), rel=1e-10
    )


def test_two_points_apart() -> None:
    """E^2 = 2 |d| for two single points; the Wasserstein distance is |d|."""
    assert energy_distance([[0.0, 0.0]], [[3.0, 4.0]]) == pytest.approx(np.sqrt(10.0), rel=1e-14)
    assert wasserstein([[0.0, 0.0]], [[3.0, 4.0]]) == pytest.approx(5.0, rel=1e-14)


def test_plane_normals_against_the_closed_form() -> None:
    r"""|X - Y| of unit normals whose means are d apart is Rice's law: E = sqrt(pi) 1F1(-1/2; 1; -d^2/4)."""
    from scipy.special import hyp1f1

    d = 0.8
    exact = np.sqrt(2 * np.sqrt(np.pi) * (hyp1f1(-0.5, 1.0, -(d**2) / 4) - 1.0))
    got = energy_distance(normal(3000, 5), normal(3000, 6, (d, 0.0)))
    # Finite clouds add (1/n + 1/m) E|X - X'| to the square; the rest is chance, seeded.
    expected = np.sqrt(exact**2 + 2 / 3000 * np.sqrt(np.pi))
    assert got == pytest.approx(expected, rel=0.05)


def test_joint_wasserstein_against_scipys_linear_programme() -> None:
    a, b = normal(40, 7), normal(40, 8, (0.5, -0.2))
    assert wasserstein(a, b) == pytest.approx(scipy.stats.wasserstein_distance_nd(a, b), rel=1e-8)


def test_a_shifted_cloud_is_moved_by_the_shift() -> None:
    a = normal(300, 9)
    assert wasserstein(a, a + np.array([0.3, 0.4])) == pytest.approx(0.5, rel=1e-12)


def test_halves_of_one_law_and_of_two() -> None:
    """Two records of one law are as far apart as halves of one; of another law, much farther."""
    a = normal(600, 10)
    same = cloud_distance(a, normal(900, 11), splits=200, seed=1)
    other = cloud_distance(a, normal(900, 12, (0.5, 0.0)), splits=200, seed=1)
    assert same.block == 1 and same.points == 300
    assert np.quantile(same.halves, 0.02) < same.matched < np.quantile(same.halves, 0.98)
    assert same.ratio < 1.0
    assert other.ratio > 2.0
    # Halves of n points each: E^2 has the mean 2/n' E|X - X'| in size, n' = 300 here, and E|X - X'| = sqrt(pi).
    assert np.mean(same.halves**2) == pytest.approx(2 / 300 * np.sqrt(np.pi), rel=0.15)


def test_the_reference_is_right_as_often_as_it_says() -> None:
    """For records of one law, `matched` passes the 95th percentile of the halves in few cases of many."""
    passed = sum(
        cloud_distance(normal(200, 100 + i), normal(400, 200 + i), splits=60, seed=i).ratio > 1 for i in range(40)
    )
    assert passed <= 6


def test_serial_correlation_is_seen_and_kept_together() -> None:
    """An autoregressive record: s' = r s + noise forgets by r per point; halves of single points are too close."""
    rng = np.random.default_rng(13)
    r, n = 0.8, 2000
    s = np.zeros((n, 2))
    for i in range(1, n):
        s[i] = r * s[i - 1] + np.sqrt(1 - r**2) * rng.normal(size=2)
    length = block_length(s)
    # Mean distance at lag l is sqrt(1 - r^l) of that of any two points: within 10 % where r^l = 0.19, l = 7.4.
    assert 6 <= length <= 10
    blocks, singles = cloud_distance(s, s[::-1], splits=200), cloud_distance(s, s[::-1], splits=200, block=1)
    assert np.median(blocks.halves) > 1.5 * np.median(singles.halves)
    assert block_length(rng.normal(size=(2000, 2))) == 1


def test_same_seed_same_numbers() -> None:
    a, b = normal(100, 1), normal(120, 2)
    one, two = (cloud_distance(a, b, splits=30, seed=4) for _ in range(2))
    assert one.matched == two.matched and (one.halves == two.halves).all()


def test_states_that_a_mode_lacks_are_refused() -> None:
    with pytest.raises(ValueError, match="finite"):
        energy_distance([[np.nan, 0.0]], [[0.0, 0.0]])
