"""Orbit distances and folding against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.identification.compare.orbits import common_length, fold, mean_orbit, orbit_distance


def harmonic(phase: np.ndarray, lead: float = 0.0, size: float = 1.0) -> np.ndarray:
    at = 2 * np.pi * (phase + lead)
    return size * np.column_stack([np.cos(at), -3.0 * np.sin(at)])


GRID = np.arange(128) / 128


@pytest.mark.parametrize("lead", [0.0, 0.013, 0.21, -0.37, 0.5])
def test_two_harmonic_orbits(lead: float) -> None:
    """2 |sin(delta/2)| with the phase known; nothing modulo phase, and the lead is found between grid points."""
    found = orbit_distance(harmonic(GRID), harmonic(GRID, lead), 1)
    assert found.distance == pytest.approx(2 * abs(np.sin(np.pi * lead)), abs=1e-9)
    assert found.any_phase == pytest.approx(0.0, abs=1e-7)
    assert abs((found.phase_shift - lead + 0.5) % 1.0 - 0.5) < 1e-7


@pytest.mark.parametrize("ratio", [0.5, 0.98, 1.3])
def test_other_size(ratio: float) -> None:
    """|1 - r| over the root mean square of both sizes; the unit of a state has no influence."""
    exact = abs(1 - ratio) / np.sqrt((1 + ratio**2) / 2)
    a, b = harmonic(GRID), harmonic(GRID, size=ratio)
    assert orbit_distance(a, b, 1).distance == pytest.approx(exact, rel=1e-9)
    assert orbit_distance(a * [1.0, 1e3], b * [1.0, 1e3], 1).distance == pytest.approx(exact, rel=1e-9)


def test_which_of_two_passes_is_first_does_not_matter() -> None:
    phase = np.arange(256) / 128
    orbit = np.column_stack([np.cos(2 * np.pi * phase) + 0.3 * np.cos(np.pi * phase), np.sin(np.pi * phase)])
    later = np.roll(orbit, 128, axis=0)
    found = orbit_distance(orbit, later, 2)
    assert found.distance == pytest.approx(0.0, abs=1e-7)
    assert found.whole_shift == 1
    assert orbit_distance(orbit, np.roll(orbit, 40, axis=0), 2).distance > 0.1


def test_a_period_one_orbit_beside_a_period_two_orbit() -> None:
    """x = cos + a cos(half) against cos: the distance is that of the subharmonic."""
    phase = np.arange(256) / 128
    a = 0.4
    double = (np.cos(2 * np.pi * phase) + a * np.cos(np.pi * phase))[:, None]
    single = common_length(np.cos(2 * np.pi * GRID)[:, None], 1, 2)
    expected = np.sqrt((a**2 / 2) / (0.5 * ((1 + a**2) / 2 + 0.5)))
    assert orbit_distance(double, single, 2).distance == pytest.approx(expected, rel=1e-9)


def test_folding_a_smooth_motion() -> None:
    """Samples anywhere in the period; the grid begins at phase 0."""
    phase = 0.37 + np.arange(2000) * 0.01791
    folded = fold(phase, harmonic(phase), 64)
    assert folded.shape == (35, 64, 2)
    # The cubic through four samples h apart is off by at most 3/128 h^4 of the fourth derivative, of 3 here.
    bound = 3 * 3 / 128 * (2 * np.pi * 0.01791) ** 4
    assert bound / 30 < np.abs(folded - harmonic(np.arange(64) / 64)).max() < bound
    orbit, _ = mean_orbit(folded, 1)
    assert np.abs(orbit - harmonic(np.arange(64) / 64)).max() < bound


def test_a_jump_reaches_two_samples() -> None:
    phase = np.arange(0.0, 3.0, 0.02)
    u = np.where(phase % 1 < 0.5, 1.0, -1.0)[:, None]
    folded = fold(phase, u, 100)
    at = np.arange(100) / 100
    far = (np.abs(at - 0.5) > 0.041) & (at > 0.041) & (at < 0.959)
    assert np.abs(folded[1, far, 0] - np.where(at < 0.5, 1.0, -1.0)[far]).max() < 1e-12


def test_noise_of_a_mean_orbit_falls_with_its_passes() -> None:
    rng = np.random.default_rng(0)
    phase = np.arange(64 * 400) / 64
    noisy = harmonic(phase) + 0.01 * rng.normal(size=(len(phase), 2))
    orbit, scatter = mean_orbit(fold(phase, noisy, 64), 1)
    assert np.median(scatter) == pytest.approx(0.01, rel=0.1)
    assert np.std(orbit - harmonic(np.arange(64) / 64)) == pytest.approx(0.01 / np.sqrt(399), rel=0.2)


def test_missing_samples_leave_their_periods_out() -> None:
    phase = np.arange(64 * 10 + 1) / 64
    u = harmonic(phase)
    u[64 * 3 + 5] = np.nan
    folded = fold(phase, u, 32)
    assert np.isnan(folded[3]).all() and np.isfinite(np.delete(folded, 3, axis=0)).all()


@pytest.mark.parametrize(
    ("phase", "message"),
    [
        (np.array([0.0, 0.1, 0.05, 2.0]), "goes back from 0.1 to 0.05"),
        (np.linspace(0.1, 0.9, 50), "at least one whole one"),
        (np.linspace(0.0, 9.0, 30), "too few; at least 8"),
    ],
)
def test_what_cannot_be_folded(phase: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fold(phase, harmonic(phase), 16)


def test_an_interval_without_samples_leaves_its_periods_out() -> None:
    phase = np.arange(64 * 10 + 1) / 64
    kept = (phase < 3.2) | (phase > 5.7)
    folded = fold(phase[kept], harmonic(phase[kept]), 32)
    assert np.isnan(folded[3:6]).all() and np.isfinite(np.delete(folded, [3, 4, 5], axis=0)).all()


def test_samples_side_by_side_do_not_magnify_noise() -> None:
    """Beside each third sample there is one 1e-5 of a step away: no folded point is further off than five errors."""
    rng = np.random.default_rng(0)
    even = np.arange(64 * 40 + 1) / 64
    phase = np.sort(np.concatenate([even, even[:-1:3] + 1e-5 / 64]))
    u = harmonic(phase) + 1e-3 * rng.standard_normal((len(phase), harmonic(phase).shape[1]))
    grid = np.arange(128) / 128
    assert np.abs(fold(phase, u, 128) - harmonic(grid)).max() < 5e-3
