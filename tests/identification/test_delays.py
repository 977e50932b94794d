"""Delays of sensors with what else moves the time of a motion: a clock, a phase, a known start. Closed forms."""

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
K, C, W = 9.0, 0.2, 2.0
ONE = {"progress": False, "tries": 1}


def rung() -> ns.System:
    return ns.mechanical(
        1.0,
        "c",
        "k",
        coordinates=["q"],
        parameters={"c": C, "k": K},
        forcing={"q": lambda t, p: np.cos(W * t)},
    )


def steady(t: np.ndarray) -> np.ndarray:
    """Place of the mass under its force, for all times."""
    return (np.exp(1j * W * t) / (K - W**2 + 1j * C * W)).real


def speed(t: np.ndarray) -> np.ndarray:
    return (1j * W * np.exp(1j * W * t) / (K - W**2 + 1j * C * W)).real


def noise(t: np.ndarray, seed: int) -> np.ndarray:
    return 1e-3 * np.random.default_rng(seed).standard_normal(len(t))


def test_a_slow_clock_beside_a_known_delay() -> None:
    """Readings of a sensor with a delay are of a motion that begins before them, whatever the clock."""
    t = 1.0 + np.arange(0.0, 30.0, 0.05)
    for clock in (0.997, 1.003):
        read = {"q": (t, steady(clock * t - 0.05) + noise(t, 0))}
        found = ns.fit(rung(), read, ["clock"], measured={"q": ns.Sensor(delay=0.05)}, **ONE)
        estimate = found.estimate("clock")
        assert abs(estimate.value - clock) < 4 * estimate.uncertainty < 1e-3
        assert not found.anomalies


def test_a_motion_begins_with_what_the_first_sample_of_the_longest_delay_shows() -> None:
    """Two sensors of a mass that swings freely, one of them late by a time that is to be found."""
    swing = ns.mechanical(1.0, 0.0, "k", coordinates=["q"], parameters={"k": K})
    t = 2.0 + np.arange(0.0, 10.0, 0.05)
    for first in (0.02, 0.3):
        read = {"q": (t, np.sin(3 * t) + noise(t, 1)), "v_q": (t, 3 * np.cos(3 * (t - 0.12)) + noise(t, 2))}
        sensors = {"q": ns.Sensor(), "v_q": ns.Sensor(delay=first)}
        found = ns.fit(swing, read, ["v_q.delay"], measured=sensors, **ONE)
        assert found.estimate("v_q.delay").value == pytest.approx(0.12, abs=1e-3)
        for state, value in (("q", np.sin(3 * 1.88)), ("v_q", 3 * np.cos(3 * 1.88))):
            estimate = found.estimate(f"{state}(0)")
            assert abs(estimate.value - value) < 4 * estimate.uncertainty < 0.01


def test_a_known_start_is_what_the_first_sample_shows_of_an_unknown_delay() -> None:
    """Begun at 2, and read half a second later: the delay follows from the phase of the force."""
    t = 2.0 + np.arange(0.0, 12.0, 0.02)
    begun = {"q": steady(t)[0], "v_q": speed(t)[0]}
    read = {"q": (t + 0.5, steady(t) + noise(t, 3))}
    for first in (0.4, 0.6):
        sensor = {"q": ns.Sensor(delay=first)}
        found = ns.fit(rung(), read, ["q.delay"], measured=sensor, start=begun, free_start=False, **ONE)
        estimate = found.estimate("q.delay")
        assert abs(estimate.value - 0.5) < 4 * estimate.uncertainty < 4e-3
