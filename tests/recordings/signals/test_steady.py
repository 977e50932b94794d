"""A steady response and a slow decay, of known frequency, rate and noise."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from nonsmooth.recordings.signals.steady import steady_response


def record(rate: float, seed: int, *, duration: float = 4.0, noise: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * 500)) / 500
    x = np.exp(-rate * t) * (np.cos(2 * np.pi * 20.123 * t - 1) + 0.1 * np.cos(2 * np.pi * 40.246 * t))
    return t, x + noise * rng.standard_normal(len(t))


def test_frequency_and_rate_lie_within_their_errors() -> None:
    z = []
    for seed in range(20):
        t, x = record(0.0, seed)
        found = steady_response(t, x)
        assert not found.decays and "cannot be identified" in found.statement
        assert found.frequency_error < 2e-4  # the grid of a transform is 0.25 Hz
        z.append([(found.frequency - 20.123) / found.frequency_error, found.rate / found.rate_error])
    rms = np.sqrt(np.mean(np.square(z), axis=0))
    assert np.all((0.4 < rms) & (rms < 1.6)), rms
    first, *methods, statement = str(found).splitlines()
    assert first.endswith(f": {found.frequency:.5f} ± {found.frequency_error:.5f} Hz") and found.statement in statement
    told = [f"  by {name}: {value:.5f} ± {error:.5f} Hz" for name, (value, error) in found.by_method.items()]
    assert methods == told and len(told) > 1


def test_a_slow_decay_is_seen_and_a_growth_is_no_steady_response() -> None:
    t, x = record(0.02, 1)
    found = steady_response(t, x)
    assert found.decays and found.rate == pytest.approx(0.02, abs=4 * found.rate_error)
    assert "it decays" in found.statement
    t, x = record(-0.02, 1)
    found = steady_response(t, x)
    assert not found.decays and "still grows" in found.statement


def test_the_bound_bounds() -> None:
    """A free decay slower than the bound is missed, one three times as fast is not."""
    t, x = record(0.0, 4)
    bound = steady_response(t, x).rate_bound
    assert bound > 0
    t, x = record(4 * bound, 5)
    assert steady_response(t, x).decays


def test_too_short_says_whose_and_what_to_do() -> None:
    t, x = record(0.0, 0, duration=0.5)
    signal = xr.DataArray(x, {"time": t}, ("time",), "Strain", {"run": "Run #3", "long_name": "Strain"})
    expected = r"run 'Run #3', channel 'Strain': holds 10 periods; at least 15 .* record longer"
    with pytest.raises(ValueError, match=expected):
        steady_response(t, signal)
