"""Peaks between lines on sinusoids of known frequency: within the bias and the error that are stated."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from motions import rms

from nonsmooth.recordings.signals.spectrum import peak, spectrum

RATE, N = 100.0, 1000
WINDOWS = ["boxcar", "hann", "hamming", "blackman", ("kaiser", 8.6)]


def tones(noise: float, n: int = 40, seed: int = 1) -> list[tuple[float, np.ndarray]]:
    rng = np.random.default_rng(seed)
    t = np.arange(N) / RATE
    found = []
    for _ in range(n):
        f, phase = 1.5 + rng.uniform(-0.05, 0.05), rng.uniform(0, 2 * np.pi)
        found.append(
            (
                f,
                0.3 * np.cos(2 * np.pi * f * t + phase) + rng.normal(0, noise, N)
                if noise
                else 0.3 * np.cos(2 * np.pi * f * t + phase),
            )
        )
    return found


@pytest.mark.parametrize("window", WINDOWS, ids=str)
@pytest.mark.parametrize("interpolation", ["window", "parabola", "none"])
@pytest.mark.parametrize("padding", [1, 4])
def test_the_bias_stays_below_its_bound(window: object, interpolation: str, padding: int) -> None:
    for f, x in tones(0.0, 16):
        spectra = spectrum(x, RATE, window=window, padding=padding)
        found = peak(spectra, interpolation=interpolation)
        assert abs(found.frequency - f) <= found.bias * 1.001 + 1e-9
        assert found.grid_step == pytest.approx(0.1)
        if interpolation == "window":
            assert found.amplitude == pytest.approx(0.3, rel=0.02)


def test_the_bounds_are_of_use() -> None:
    lines = spectrum(tones(0.0)[0][1], RATE)
    # The largest line is off by half a step, a parabola over a Hann window by 1.6 %, the window's shape by nothing.
    bounds = {kind: peak(lines, interpolation=kind).bias / 0.1 for kind in ("none", "parabola", "window")}
    assert bounds["none"] == pytest.approx(0.5, abs=0.01)
    assert bounds["parabola"] == pytest.approx(0.016, abs=0.002)
    assert bounds["window"] < 1e-4


@pytest.mark.parametrize("window", ["hann", "blackman"])
@pytest.mark.parametrize("padding", [1, 4])
def test_errors_are_as_stated_and_no_better_than_they_can_be(window: str, padding: int) -> None:
    noise, z, stated = 0.01, [], []
    for f, x in tones(noise, 50):
        found = peak(spectrum(x, RATE, window=window, padding=padding))
        z.append((found.frequency - f) / found.error)
        stated.append(found.error)
    assert 0.75 < rms(np.array(z)) < 1.25
    least = np.sqrt(6.0) * noise / (np.pi * 0.3 * (N / RATE) * np.sqrt(N))  # Rife and Boorstyn (1974)
    assert least < np.mean(stated) < 2.5 * least


def test_amplitude_phase_and_power_of_a_line() -> None:
    t = np.arange(N) / RATE
    x = 2.0 + 0.5 * np.cos(2 * np.pi * 3.0 * t + 0.7)
    for window in WINDOWS:
        lines = spectrum(x, RATE, window=window, detrend=None)
        at = lines.sel(frequency=3.0, method="nearest")
        assert float(at.amplitude) == pytest.approx(0.5, rel=1e-3) and float(at.phase) == pytest.approx(0.7, abs=1e-3)
        assert float(lines.amplitude[0]) == pytest.approx(2.0, rel=1e-3)
    rng = np.random.default_rng(2)
    white = spectrum(rng.normal(0, 0.3, 100_000), RATE)
    assert float(white.density.mean()) * RATE / 2 == pytest.approx(0.09, rel=0.02)


@pytest.mark.parametrize("n", [256, 257])
@pytest.mark.parametrize("padding", [1, 2, 3])
def test_the_density_is_that_of_scipy_up_to_half_the_sample_rate(n: int, padding: int) -> None:
    from scipy.signal import periodogram

    x = np.random.default_rng(n).normal(size=n)
    frequency, density = periodogram(x, RATE, window="hann", nfft=n * padding, detrend="constant")
    lines = spectrum(x, RATE, padding=padding)
    np.testing.assert_allclose(lines.frequency, frequency, rtol=1e-12)
    np.testing.assert_allclose(lines.density, density, rtol=1e-10, atol=1e-18)


def test_a_signal_at_half_the_sample_rate_has_its_amplitude() -> None:
    x = 0.3 * (-1.0) ** np.arange(64)
    assert float(spectrum(x, RATE, window="boxcar").amplitude[-1]) == pytest.approx(0.3, rel=1e-12)


def test_rate_from_the_signals_own_times() -> None:
    t = np.arange(400) / 50
    x = xr.DataArray(np.cos(2 * np.pi * 2 * t), {"time": t}, ("time",), name="Angle", attrs={"units": "rad"})
    found = peak(spectrum(x))
    assert found.frequency == pytest.approx(2.0, abs=1e-4) and spectrum(x).amplitude.attrs["units"] == "rad"
    assert found.omega == pytest.approx(2 * np.pi * found.frequency)


def test_what_is_refused() -> None:
    x = np.cos(np.arange(400))
    with pytest.raises(ValueError, match="rate is needed"):
        spectrum(x)
    with pytest.raises(ValueError, match="holds 1 lines of this spectrum"):
        peak(spectrum(x, 100.0), low=10, high=10.2)
    with pytest.raises(ValueError, match="stands at its edge, 14 Hz: no peak inside"):
        peak(spectrum(x, 100.0), low=4, high=14)
    with pytest.raises(ValueError, match="interpolation = .*; allowed: 'window', 'parabola', 'none'"):
        peak(spectrum(x, 100.0), interpolation="best")


@pytest.mark.parametrize(("interpolation", "slope"), [("parabola", 0.5 / np.log(2.0)), ("window", 2.0 / 3.0)])
def test_the_error_of_a_peak_on_a_line_under_a_hann_window(interpolation: str, slope: float) -> None:
    """Lines 1/2, 1, 1/2 times A: d place = slope (d right - d left) / A; an impulse is noise of one level everywhere.

    A line's noise has the variance 2 sigma^2 sum w^2 / (sum w)^2 = 3 sigma^2 / N, of which lines two apart share 1/6.
    The level is read as a median, which is ln 2 of the mean where the density is exponential.
    """
    amplitude, impulse = 0.3, 1e-4
    x = amplitude * np.cos(2 * np.pi * 1.5 * np.arange(N) / RATE)
    x[N // 2] += impulse
    variance = impulse**2 / (3 * N / 8 * np.log(2.0))
    error = slope / amplitude * np.sqrt(2 * (1 - 1 / 6) * 3 * variance / N)
    found = peak(spectrum(x, RATE), interpolation=interpolation)
    assert found.error == pytest.approx(error * RATE / N, rel=2e-3)
    assert (found.omega, found.omega_error) == pytest.approx((2 * np.pi * 1.5, 2 * np.pi * found.error), rel=1e-4)
    assert peak(spectrum(x, RATE), interpolation="none").error == pytest.approx(RATE / N / np.sqrt(12.0))
