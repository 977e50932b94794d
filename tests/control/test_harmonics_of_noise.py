"""Harmonics fitted to noise of known size: their stated uncertainties are those of least squares."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.control.holding import fitted, mean_square, values_at


def test_uncertainties_of_white_noise() -> None:
    """Of N samples with standard deviation s: s / sqrt N for the mean, s sqrt(2 / N) for each part of a harmonic."""
    s, turns, per_turn = 0.3, 40, 50
    phase = np.arange(turns * per_turn) / per_turn
    found = []
    true = np.array([1.0, 0.5 - 0.2j, 0.1j, 0.0])
    for seed in range(60):
        noise = s * np.random.default_rng(seed).standard_normal(len(phase))
        found.append(fitted(phase, values_at(true, phase) + noise, 3))
    stated = np.sqrt(np.mean([one.u**2 for one in found], axis=0))
    expected = s / np.sqrt(len(phase)) * np.sqrt([1.0, 2.0, 2.0, 2.0])
    assert stated == pytest.approx(expected, rel=0.05)
    off = np.array([one.c - true for one in found])
    assert np.sqrt(np.mean(off.real**2, axis=0)) == pytest.approx(expected, rel=0.25)
    assert np.sqrt(np.mean(off.imag[:, 1:] ** 2, axis=0)) == pytest.approx(expected[1:], rel=0.25)
    assert np.mean([one.seen[3] == 0 for one in found]) > 0.98


def test_values_and_mean_square_of_a_series() -> None:
    """1 + 2 cos a - sin 3 a, with a = 2 pi phase: second derivative -2 cos a + 9 sin 3 a, mean square 3.5."""
    c = np.array([1.0, 2.0, 0.0, 1.0j])
    phase = np.linspace(0, 1, 7)
    a = 2 * np.pi * phase
    assert values_at(c, phase) == pytest.approx(1 + 2 * np.cos(a) - np.sin(3 * a), abs=1e-14)
    assert values_at(c, phase, 2) == pytest.approx(-2 * np.cos(a) + 9 * np.sin(3 * a), abs=1e-13)
    assert mean_square(c) == pytest.approx(3.5)
