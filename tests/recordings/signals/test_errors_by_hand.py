"""Section points, rates and impacts whose values and errors are known without the package."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.signal
import xarray as xr
from motions import bounces, rms

from nonsmooth.recordings.signals.contacts import impacts, intervals
from nonsmooth.recordings.signals.phase import DrivePhase
from nonsmooth.recordings.signals.sections import poincare, stroboscopic
from nonsmooth.recordings.signals.steady import steady_response


def test_a_section_point_within_the_step_of_an_impact() -> None:
    """A ball leaves the floor at t = 0.33, between two samples: either side of it x = v s - g s^2 / 2 by its own v."""
    g, hit, v_in, v_out = 9.81, 0.33, -1.6, 1.0

    def ball(t: Any) -> Any:
        s = t - hit
        speed = np.where(t < hit, v_in, v_out)
        return np.column_stack([speed * s - 0.5 * g * s * s, speed - g * s])

    t = np.arange(0.30, 0.37, 0.02)
    at = np.array([0.324, 0.3295, 0.3301, 0.338])
    x, v = ball(t).T
    phase = DrivePhase(2 * np.pi, 0.0, 0.0, 0.0, 0.0, "fit", at, np.arange(4), (0.3, 0.36))
    found = stroboscopic(t, x, v, phase, a=np.full_like(t, -g), impacts=[hit])
    assert found["time"].values == pytest.approx(at)
    assert found["section"].values == pytest.approx(ball(at), abs=1e-12)


def test_without_accelerations_each_side_of_an_impact_is_continued_straight() -> None:
    """A puck comes with 1.5 and leaves with -0.5 at t = 0.33, between two samples: straight on either side."""
    t, at = np.arange(0.30, 0.37, 0.02), np.array([0.324, 0.3295, 0.3301, 0.338])

    def puck(t: Any) -> Any:
        speed = np.where(t < 0.33, 1.5, -0.5)
        return np.column_stack([speed * (t - 0.33), speed])

    phase = DrivePhase(2 * np.pi, 0.0, 0.0, 0.0, 0.0, "fit", at, np.arange(4), (0.3, 0.36))
    found = stroboscopic(t, *puck(t).T, phase, impacts=[0.33])
    assert found["section"].values == pytest.approx(puck(at), abs=1e-12)


def test_the_error_of_v_on_a_surface_of_x_needs_none_of_x() -> None:
    """x = t passes 1.5; how far off v is does not hang on the instant, which nobody knows."""
    t = np.arange(4.0)
    found = poincare(t, t - 1.5, np.ones(4), v_error=np.full(4, 0.03))
    assert found["section_error"].values[0] == pytest.approx([0.0, 0.03])
    assert np.isnan(found["time_error"].values).all()


def test_between_two_samples_the_larger_error_holds() -> None:
    """x = t passes 0.5 between a good and a bad sample: whichever comes first, the error is the bad one's."""
    t = np.arange(4.0)
    for errors in ([0.1, 0.3, 0.1, 0.1], [0.1, 0.1, 0.3, 0.1]):
        found = poincare(t, t - 1.5, np.ones(4), x_error=np.array(errors), v_error=np.array(errors) / 10, a=np.zeros(4))
        assert found["time"].values == pytest.approx([1.5])
        assert found["time_error"].values == pytest.approx([0.3])  # over a speed of 1
        assert found["section_error"].values[0] == pytest.approx([0.0, 0.03])


def test_an_amplitude_that_wanders_slowly_is_no_decay() -> None:
    """The amplitude follows a noise that is alike over some blocks: the stated error of the rate covers it."""
    t, z = np.arange(4000) / 200, []
    for seed in range(20):
        noise = np.random.default_rng(seed).standard_normal(len(t) + 4000)
        slow = scipy.signal.lfilter([1.0], [1.0, -np.exp(-1 / 140)], noise)[4000:]  # alike over 0.7 s
        x = (1.0 + 0.002 * slow / slow.std()) * np.cos(2 * np.pi * 10.0 * t)
        found = steady_response(t, x, 2 * np.pi * 10.0, blocks=24)
        z.append(found.rate / found.rate_error)
    assert 0.7 < rms(np.array(z)) < 1.35


def test_the_noise_that_is_given_is_in_the_error_of_an_impacts_instant() -> None:
    """Over thirty records the instants scatter about the truth as the errors say."""
    z, known = [], 2e-4
    motion, when, _ = bounces(0.7, 2.0, 4)
    for seed in range(30):
        x = motion.x + known * np.random.default_rng(seed).standard_normal(len(motion.t))
        found = impacts(motion.t, x, resolution=1e-9, noise=known)
        assert len(found["impact_time"]) == len(when)
        z.append((found["impact_time"].values - when) / found["impact_time_error"].values)
    assert 0.6 < rms(np.ravel(z)) < 1.4


@pytest.mark.parametrize(
    ("first", "last", "expected"), [(0.0, 12.4, [1, 0, 1]), (2.0, 12.4, [0, 1]), (0.0, 10.0, [1, 0])]
)
def test_contacts_that_the_record_cuts_off(first: float, last: float, expected: list[int]) -> None:
    """cos t exceeds 1/2 within pi / 3 of each multiple of 2 pi."""
    t = np.arange(first, last, 0.01)
    found = xr.Dataset({"time": t, "x": ("time", np.cos(t)), "v": ("time", -np.sin(t))})
    begin, end, cut = intervals(found, 0.5)
    middle = (
        2 * np.pi * np.array([k for k in (0, 1, 2) if first < 2 * np.pi * k + np.pi / 3 and 2 * np.pi * k < last + 1])
    )
    assert begin == pytest.approx(np.maximum(middle - np.pi / 3, t[0]), abs=1e-8)
    assert end == pytest.approx(np.minimum(middle + np.pi / 3, t[-1]), abs=1e-8)
    assert cut.tolist() == [bool(one) for one in expected]
