"""Harmonic fits against signals in closed form; their errors against many of them."""

from __future__ import annotations

import numpy as np
import pytest
from motions import COUNT, rms, sine

from nonsmooth.recordings.signals.displacement import found_resolution
from nonsmooth.recordings.signals.harmonics import fit


def test_a_signal_of_harmonics_is_found_exactly() -> None:
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(3, 23, 900))
    w, amplitudes, phases = 3.7, np.array([1.0, 0.2, 0.05]), np.array([1.0, 2.0, 5.5])
    x = 0.1 + np.cos(np.multiply.outer(t, w * np.arange(1, 4)) - phases) @ amplitudes
    for omega, refine in ((w, False), (w * 1.01, True)):
        found = fit(t, x, omega, 3, refine=refine)
        np.testing.assert_allclose([found.omega, found.mean], [w, 0.1], rtol=1e-10)
        np.testing.assert_allclose(found.amplitudes, amplitudes, atol=1e-10)
        np.testing.assert_allclose(found.phases, phases, atol=1e-9)
        np.testing.assert_allclose(found.evaluate(t), x, atol=1e-9)


@pytest.mark.parametrize("colour", ["white", "correlated"])
def test_errors_are_as_stated(colour: str) -> None:
    z: dict[str, list[float]] = {"omega": [], "mean": [], "amplitude": [], "phase": []}
    rng = np.random.default_rng(2)
    t = 7 + np.arange(1500) / 75
    for _ in range(150):
        w, phase = rng.uniform(3.6, 3.8), rng.uniform(0.5, 5.5)
        noise = rng.normal(0, 0.05, len(t) + 200)
        if colour == "correlated":  # an average over 8 samples
            noise = np.convolve(noise, np.ones(8) / 8, mode="same")
        x = 0.1 + np.cos(w * t - phase) + 0.2 * np.cos(2 * w * t - 2) + noise[100:-100]
        found = fit(t, x, 3.7, 2, refine=True)
        z["omega"].append((found.omega - w) / found.omega_error)
        z["mean"].append((found.mean - 0.1) / found.mean_error)
        z["amplitude"] += list((found.amplitudes - [1.0, 0.2]) / found.amplitude_errors)
        z["phase"].append((found.phases[0] - phase) / found.phase_errors[0])
    low, high = (0.85, 1.15) if colour == "white" else (0.7, 1.3)
    assert all(low < rms(np.array(values)) < high for values in z.values()), {k: rms(np.array(v)) for k, v in z.items()}
    assert found.correlation == pytest.approx(1.0 if colour == "white" else 8.0, rel=0.35)


def test_subharmonics_count_parts_of_the_drive() -> None:
    t = np.arange(3000) / 100
    found = fit(t, 0.5 * np.cos(2.5 * t - 1) + 0.2 * np.cos(5 * t - 2), 5.0, 2, subharmonic=2)
    np.testing.assert_allclose(found.amplitudes, [0.5, 0.2], atol=1e-12)
    assert found.omega == 5.0


def test_errors_with_a_subharmonic_are_as_stated() -> None:
    z: dict[str, list[float]] = {"omega": [], "amplitude": [], "phase": []}
    rng = np.random.default_rng(3)
    t = 2 + np.arange(1200) / 60
    for _ in range(150):
        w, phase = rng.uniform(7.3, 7.5), rng.uniform(0.5, 5.5)
        x = np.cos(w / 3 * t - phase) + 0.3 * np.cos(w * t - 2) + rng.normal(0, 0.05, len(t))
        found = fit(t, x, 7.4, 3, refine=True, subharmonic=3)
        z["omega"].append((found.omega - w) / found.omega_error)
        z["amplitude"] += list((found.amplitudes[[0, 2]] - [1.0, 0.3]) / found.amplitude_errors[[0, 2]])
        z["phase"] += list((found.phases[[0, 2]] - [phase, 2.0]) / found.phase_errors[[0, 2]])
    assert all(0.85 < rms(np.array(v)) < 1.15 for v in z.values()), {k: rms(np.array(v)) for k, v in z.items()}


def test_a_line_in_noise_has_the_least_error_that_is_possible() -> None:
    # Rife and Boorstyn: var(omega) = 24 s^2 / (A^2 N T^2) for a long record
    t = np.arange(2000) / 100
    x = np.cos(5.0 * t - 1.0) + np.random.default_rng(0).normal(0, 0.1, len(t))
    found = fit(t, x, 5.0, 1, refine=True)
    assert found.omega_error == pytest.approx(np.sqrt(24 / 2000) * 0.1 / 20, rel=0.1)
    assert found.mean_error == pytest.approx(0.1 / np.sqrt(2000), rel=0.1)


def test_refused_fits() -> None:
    t = np.arange(100) / 100
    with pytest.raises(ValueError, match="lasts 0.99 s, less than one period of 1.257 s"):
        fit(t, t, 5.0)
    with pytest.raises(ValueError, match="harmonic 3 lies at 60 Hz, above half the sample rate"):
        fit(t, t, 2 * np.pi * 20, 3)
    with pytest.raises(ValueError, match="omega = .* must be positive"):
        fit(t, t, -1.0)


def test_the_step_is_read_off_the_values() -> None:
    assert found_resolution(sine(0.02, 4.5).counted) == pytest.approx(COUNT, rel=1e-6)
    # Written with few digits, as in a file: 54.8 micrometres at 8 decimals.
    assert found_resolution(np.round(sine(0.02, 4.5).counted, 8)) == pytest.approx(COUNT, rel=1e-4)
    with pytest.raises(ValueError, match="all its values are the same"):
        found_resolution(np.ones(10))
    with pytest.raises(ValueError, match="not multiples of one step"):
        found_resolution(np.random.default_rng(1).normal(size=100))
