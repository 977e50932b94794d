"""Smoothed counts against motions in closed form: stated errors are those found, and nothing crosses an impact."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from motions import COUNT, Motion, bounces, decay, rms, sine

from nonsmooth.recordings import RecordingWarning
from nonsmooth.recordings.signals.smoothing import savitzky_golay, smooth

MOTIONS = {
    "20 mm at 3.7 rad/s": sine(0.02, 3.7, 0.4),
    "5 mm at 11 rad/s": sine(0.005, 11.15, 1.0),
    "3 mm at 40 rad/s": sine(0.003, 40.0, 2.0),
    "half a millimetre": sine(0.0005, 6.0, 0.7),
    "decay": decay(0.02, 4.46, 0.52, 8.0),
}


def normalised(result: xr.Dataset, motion: Motion, name: str) -> float:
    error = result[name].values - getattr(motion, name)
    return rms((error / result[f"{name}_error"].values)[3:-3])


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("model", ["white_jerk", "white_snap"])
def test_stated_errors_are_those_found(name: str, model: str) -> None:
    motion = MOTIONS[name]
    result = smooth(motion.t, motion.counted, resolution=COUNT, model=model)
    # A sinusoid is smoother than a shaken polynomial: the errors of derivatives are stated somewhat too large.
    assert 0.6 < normalised(result, motion, "x") < 1.2
    assert 0.45 < normalised(result, motion, "v") < 1.2
    assert rms(result.x.values - motion.x) < 0.9 * COUNT / np.sqrt(12)


def test_what_is_known_to_be_smooth_is_known_better() -> None:
    motion = MOTIONS["20 mm at 3.7 rad/s"]
    careful = smooth(motion.t, motion.counted, resolution=COUNT)
    free = smooth(motion.t, motion.counted, resolution=COUNT, contacts=((), ()))
    assert careful.model == "white_jerk" and free.model == "white_snap"
    assert rms(free.v.values - motion.v) < 0.6 * rms(careful.v.values - motion.v)


def test_a_motion_of_one_count_is_seen_by_its_edges() -> None:
    # 50 micrometres of amplitude, counts of 55: three different values in all. Each change of the count is a position.
    motion = sine(5e-5, 4.5, 0.3)
    assert len(np.unique(motion.counted)) == 3
    result = smooth(motion.t, motion.counted, resolution=COUNT)
    assert rms(result.x.values - motion.x) < COUNT / 20
    assert rms(result.v.values - motion.v) < 0.1 * 5e-5 * 4.5
    assert normalised(result, motion, "x") < 1.2


def test_at_rest_the_error_is_that_of_one_count() -> None:
    result = smooth(np.arange(500) / 100, np.full(500, 3 * COUNT), resolution=COUNT)
    # 500 equal counts say as much as one; in the middle of a parabola an error is 3/2 of that of their mean.
    np.testing.assert_allclose(result.x, 3 * COUNT, rtol=0, atol=1e-12)
    assert result.x_error.values[250] == pytest.approx(1.5 * COUNT / np.sqrt(12), rel=0.01)


def test_velocity_on_both_sides_of_an_impact() -> None:
    motion, times, speeds = bounces(0.8, 3.0, 5)
    step = 1e-3
    counted = np.round(motion.x / step) * step
    result = smooth(motion.t, counted, resolution=step, impacts=times)
    error = (result.v_before.values + speeds) / result.v_before_error.values
    after = (result.v_after.values - 0.8 * speeds) / result.v_after_error.values
    assert rms(np.concatenate([error, after])) < 1.5
    np.testing.assert_allclose(result.v_after / -result.v_before, 0.8, atol=0.01)
    # Near impacts the errors are as stated too, and the velocity found there is of its own side.
    near = np.min(np.abs(motion.t[:, None] - times), axis=1) < 0.03
    assert rms(((result.v.values - motion.v) / result.v_error.values)[near]) < 1.3
    assert result.segment.values[np.searchsorted(motion.t, times[1]) + 1] == 2


def test_nothing_crosses_an_impact() -> None:
    motion, times, _ = bounces(0.8, 3.0, 1)
    after = motion.t > times[0]
    s = motion.t[after] - times[0]
    changed = motion.x.copy()
    changed[after] += 0.7 * s + 2.0 * s * s  # another velocity and acceleration from the impact on
    first, second = (smooth(motion.t, x, resolution=1e-3, impacts=times, intensity=1.0) for x in (motion.x, changed))
    moved = second.v.values - first.v.values
    # What comes before is the same, but for how free "free" is: a variance some 1e4 times that of the states.
    assert np.max(np.abs(moved[~after])) < 1e-3 * first.v_error.values.min()
    np.testing.assert_allclose(moved[after], 0.7 + 4.0 * s, rtol=0, atol=1e-5)
    blurred = smooth(motion.t, motion.x, resolution=1e-3, intensity=1.0)
    assert np.max(np.abs(blurred.v.values - motion.v)) > 1.0


def test_contacts_have_an_intensity_of_their_own() -> None:
    # Free flight at 4.5 rad/s, a half-sine of 40 rad/s while in contact: the pieces in closed form, speeds equal.
    free, stiff, speed, t = 4.5, 40.0, 0.1, np.arange(4000) / 100
    pieces = np.array([np.pi / free, np.pi / stiff])
    cycle = pieces.sum()
    s = np.mod(t, cycle)
    inside = s >= pieces[0]
    x = np.where(inside, speed / stiff * np.sin(stiff * (s - pieces[0])), -speed / free * np.sin(free * s))
    v = np.where(inside, speed * np.cos(stiff * (s - pieces[0])), -speed * np.cos(free * s))
    begin = np.arange(int(t[-1] / cycle)) * cycle + pieces[0]
    motion = Motion(t, x, v, v)
    blind = smooth(t, motion.counted, resolution=COUNT)
    told = smooth(t, motion.counted, resolution=COUNT, contacts=(begin, begin + pieces[1]))
    assert told.intensity < 1e-2 * told.intensity_in_contact
    assert rms(told.v.values - v) < 0.5 * rms(blind.v.values - v)
    for result in (blind, told):
        assert 0.6 < normalised(result, motion, "x") < 1.2 and 0.5 < normalised(result, motion, "v") < 1.2


def test_uneven_times_and_missing_samples() -> None:
    rng = np.random.default_rng(5)
    t = np.sort(rng.uniform(0, 30, 2400))
    t = t[np.concatenate([[True], np.diff(t) > 1e-6])]
    x = 0.02 * np.cos(3.7 * t)
    counted = np.round(x / COUNT) * COUNT
    counted[500:520] = np.nan
    given = xr.DataArray(counted, {"time": t}, ("time",), name="Angle", attrs={"run": "Run #2"})
    with pytest.warns(RecordingWarning, match=r"run 'Run #2', channel 'Angle': 20 of \d+ values are not finite"):
        result = smooth(t, given, resolution=COUNT)
    assert rms((result.x.values - x) / result.x_error.values) == pytest.approx(1.0, abs=0.25)
    assert result.x_error.values[510] > 3 * np.median(result.x_error.values)
    assert abs(result.x.values[510] - x[510]) < 3 * result.x_error.values[510]


def test_without_a_resolution_the_noise_is_found() -> None:
    rng = np.random.default_rng(7)
    motion = sine(0.02, 3.7)
    result = smooth(motion.t, motion.x + rng.normal(0, 2e-4, len(motion.t)), resolution=None)
    assert result.sample_error == pytest.approx(2e-4, rel=0.03)
    assert rms((result.x.values - motion.x) / result.x_error.values) == pytest.approx(1.0, abs=0.15)


def test_noise_beside_the_counts() -> None:
    rng = np.random.default_rng(8)
    motion = sine(0.02, 3.7)
    seen = np.round((motion.x + rng.normal(0, 1e-4, len(motion.t))) / COUNT) * COUNT
    result = smooth(motion.t, seen, resolution=COUNT, noise=1e-4)
    assert 0.8 < normalised(result, motion, "x") < 1.2


def test_a_given_intensity_is_used() -> None:
    motion = sine(0.02, 3.7, duration=20)
    found = smooth(motion.t, motion.counted, resolution=COUNT)
    again = smooth(motion.t, motion.counted, resolution=COUNT, intensity=found.intensity)
    np.testing.assert_allclose(again.v, found.v, rtol=0, atol=1e-12)


def test_savitzky_golay_is_exact_for_its_own_polynomials() -> None:
    t = np.arange(60) / 50
    p = np.polynomial.Polynomial([0.1, -0.4, 0.3, 0.2, -0.15])
    result = savitzky_golay(t, p(t), resolution=1e-6)
    for name, k in (("x", 0), ("v", 1), ("a", 2)):
        np.testing.assert_allclose(result[name], p.deriv(k)(t) if k else p(t), atol=1e-9)


def test_savitzky_golay_states_noise_and_bias() -> None:
    # Noise alone: the signal is a constant to the filter. In the middle and at the ends the errors are as stated.
    rng = np.random.default_rng(9)
    x = rng.uniform(-COUNT / 2, COUNT / 2, (200, 60))
    results = [savitzky_golay(np.arange(60) / 100, row, resolution=COUNT) for row in x]
    for name in ("x", "v", "a"):
        for k in (0, 2, 30, 59):
            z = np.array([r[name].values[k] / r[f"{name}_error"].values[k] for r in results])
            assert rms(z) == pytest.approx(1.0, abs=0.12)
    # Bias alone: a sinusoid that a parabola over 21 samples cannot follow.
    motion = sine(0.02, 20.0, duration=5)
    result = savitzky_golay(motion.t, motion.x, resolution=1e-9, window=21, order=2)
    middle = slice(10, -10)
    assert result.x_bias == pytest.approx(rms((result.x.values - motion.x)[middle]), rel=0.1)


def test_savitzky_golay_stops_at_an_impact() -> None:
    motion, times, speeds = bounces(0.8, 3.0, 1)
    result = savitzky_golay(motion.t, motion.x, resolution=1e-6, impacts=times)
    np.testing.assert_allclose(result.v, motion.v, atol=1e-8)
    assert len(speeds) == 1
    with pytest.raises(ValueError, match="only 2 samples between impacts from t = 0 s on, and the window has 9"):
        savitzky_golay(motion.t, motion.x, resolution=1e-6, impacts=[0.015])


def test_what_is_refused() -> None:
    motion = sine(0.02, 3.7, duration=3)
    with pytest.raises(ValueError, match="model = .*; allowed: 'white_acceleration', 'white_jerk', 'white_snap'"):
        smooth(motion.t, motion.x, resolution=COUNT, model="cubic")
    with pytest.raises(ValueError, match="resolution = .* must be positive"):
        smooth(motion.t, motion.x, resolution=0.0)
    with pytest.raises(ValueError, match="impacts must lie inside the record, 0 to 2.99 s"):
        smooth(motion.t, motion.x, resolution=COUNT, impacts=[3.5])
    with pytest.raises(ValueError, match="contacts must be a begin and an end each"):
        smooth(motion.t, motion.x, resolution=COUNT, contacts=([1.0, 0.5], [1.5, 2.0]))
    with pytest.raises(ValueError, match=r"window must be odd and order from 2 to window - 3"):
        savitzky_golay(motion.t, motion.x, resolution=COUNT, window=8)
