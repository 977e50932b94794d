"""Flips in a slow rise: those of the logistic map are known exactly, 3 and 1 + sqrt(6)."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.identification.compare.periods import delayed_flips, period_numbers

NOISE = np.array([1e-3])


def logistic(first: float, last: float, n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """x' = r x (1 - x) with r drifting evenly; measured with noise."""
    rng = np.random.default_rng(seed)
    r = np.linspace(first, last, n)
    x = 0.5
    for _ in range(300):
        x = first * x * (1 - x)
    points = np.empty((n, 1))
    for i in range(n):
        x = r[i] * x * (1 - x) + 1e-7 * rng.standard_normal()
        points[i] = x
    return r, points + NOISE * rng.standard_normal(points.shape)


@pytest.mark.parametrize(
    ("first", "last", "word", "flip"),
    [
        (3.3, 2.8, "1-2", 3.0),
        (3.53, 3.3, "2-4", 1 + np.sqrt(6)),
    ],
)
def test_the_delay_is_taken_out(first: float, last: float, word: str, flip: float) -> None:
    late = []
    for n in (300, 1000):
        r, points = logistic(first, last, n)
        every = delayed_flips(r, points, NOISE, period_numbers(points, NOISE))
        (found,) = (one for one in every if one.read.word == word)
        assert abs(found.value - flip) < 3 * found.error < 0.1
        assert found.read.value < flip  # r falls: the record itself is late
        assert abs(found.value - flip) < 0.35 * (flip - found.read.value)
        late.append(flip - found.read.value)
    assert late[0] > 1.5 * late[1]


def test_the_amplitude_equation_itself_is_solved() -> None:
    """Its steady amplitude for parameters that stand still, and its exponential decay beyond the flip."""
    from nonsmooth.identification.compare.periods import _amplitude

    still = _amplitude(np.full(400, 0.2), np.full(400, 0.05), 0.0)  # w' = -0.2 w + 0.05: w = 1/4, A = 2
    assert still[0] == 1.0 and still[-1] == pytest.approx(2.0, rel=1e-12)
    decay = _amplitude(np.full(50, -0.4), np.zeros(50), 0.0)
    np.testing.assert_allclose(decay, np.exp(-0.2 * np.arange(50)), rtol=1e-12)


def test_a_record_without_a_flip_has_none() -> None:
    r, points = logistic(3.05, 3.3, 300)
    assert delayed_flips(r, points, NOISE, period_numbers(points, NOISE)) == []


def henon(first: float, last: float, n: int, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(1 - a x^2 + y, 0.3 x) with a drifting evenly; measured with noise. The flip is at a = 3 (1 - 0.3)^2 / 4."""
    rng, a = np.random.default_rng(seed), np.linspace(first, last, n)
    x = y = 0.1
    for _ in range(500):
        x, y = 1 - first * x * x + y, 0.3 * x
    points = np.empty((n, 2))
    for i in range(n):
        points[i] = x, y = 1 - a[i] * x * x + y + 1e-9 * rng.standard_normal(), 0.3 * x
    return a, points + noise * rng.standard_normal(points.shape)


@pytest.mark.parametrize("noise", [1e-3, pytest.param(1.5e-2, marks=pytest.mark.slow)])
def test_errors_hold_in_closings_and_openings(noise: float) -> None:
    """An opening is seen when it is nearly as wide as the doubled motion: mostly nothing says where it began."""
    off = []
    for first, last in ((0.55, 0.25), (0.25, 0.55)):
        for n, seed in ((300, 0), (600, 1), (1500, 2)):
            a, points = henon(first, last, n, noise, seed)
            scale = np.full(2, noise)
            found = delayed_flips(a, points, scale, period_numbers(points, scale, max_period=4))
            off += [(one.value - 0.3675) / one.error for one in found if one.read.word == "1-2"]
    assert np.isfinite(off).sum() >= 2 and np.nanmax(np.abs(off)) < 3.5
