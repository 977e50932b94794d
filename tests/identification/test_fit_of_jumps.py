"""Fits to readings that jump at a transition: a reading beside it may lie on the other side of the model's own."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.identification.driven_mass import driven
from tests.identification.fit_cases import cell

import nonsmooth as ns

pytestmark = pytest.mark.physics


def spikes(t: np.ndarray, start: float, current: float, tau: float, rest: float) -> np.ndarray:
    """Its closed form."""
    first = tau * np.log((current - start) / (current - 1))
    again = tau * np.log((current - rest) / (current - 1))
    since = np.where(t < first, t, (t - first) % again)
    return current - (current - np.where(t < first, start, rest)) * np.exp(-since / tau)


def drops(t: np.ndarray, speed: float, gravity: float, restitution: float) -> np.ndarray:
    """Speed of a ball that leaves the floor upward with this one at t = 0."""
    ends = np.cumsum(2 * speed / gravity * restitution ** np.arange(30))
    k = np.searchsorted(ends, t, "right")
    return speed * restitution**k - gravity * (t - np.append(0.0, ends)[k])


def ball() -> ns.System:
    return ns.mechanical(
        1.0,
        0.0,
        0.0,
        coordinates=["z"],
        parameters={"gravity": 10.0, "e": 0.9},
        forcing={"z": lambda t, p: -p.gravity},
        elements={"floor": ns.elements.Stop(at="z", side=-1, restitution="e")},
    )


@pytest.mark.parametrize("off", [-0.06, 0.0, 0.05])
def test_a_state_that_fires(off: float) -> None:
    """From the truth itself I was found as 0.67, with an anomaly."""
    truth, t = {"I": 1.3, "tau": 1.0, "rest": 0.1}, np.arange(0.0, 12.0, 0.05)
    y = spikes(t, 0.3, *truth.values()) + 0.01 * np.random.default_rng(1).normal(size=len(t))
    guess = {name: value * (1 + off) for name, value in truth.items()}
    found = ns.fit(cell().with_parameters(**guess), {"v": (t, y)}, list(truth), progress=False)
    for name, value in truth.items():
        assert abs(found[name] - value) < 3 * found.uncertainty[name] < 0.3 * value
    assert not found.anomalies, found.anomalies
    assert found.extra["v.noise"].value == pytest.approx(0.01, rel=0.15)


@pytest.mark.parametrize(("noise", "off"), [(1e-6, 0.0), (0.02, 0.04)])
def test_a_measured_speed_that_an_impact_turns(noise: float, off: float) -> None:
    """Impacts 0.9 s apart and less, 0.02 s between readings, and none of them at an impact."""
    t = np.arange(0.0, 4.0, 0.02)
    y = drops(t, 4.5, 10.0, 0.9) + noise * np.random.default_rng(2).normal(size=len(t))
    guess = ball().with_parameters(gravity=10.0 * (1 + off), e=0.9 * (1 - off))
    found = ns.fit(guess, {"v_z": (t, y)}, ["gravity", "e"], start={"z": 1e-3, "v_z": 4.5}, progress=False)
    assert abs(found["e"] - 0.9) < 3 * found.uncertainty["e"] < 0.05 * noise
    assert abs(found["gravity"] - 10.0) < 3 * found.uncertainty["gravity"] < noise
    assert not found.anomalies


def test_several_readings_on_the_wrong_side_of_an_impact() -> None:
    """Four more readings about the first impact at 0.9, 0.1 ms apart: several may lie on one wrong side of it."""
    rng, t = np.random.default_rng(5), np.arange(0.0, 4.0, 0.02)
    t = np.sort(np.append(t, 0.9 + np.array([-2e-4, -1e-4, 1e-4, 2e-4])))
    y = drops(t, 4.5, 10.0, 0.9) + 0.02 * rng.normal(size=len(t))
    for off in (-0.02, 0.0, 0.02):
        guess = ball().with_parameters(gravity=10.0 * (1 + off), e=0.9)
        found = ns.fit(guess, {"v_z": (t, y)}, ["gravity", "e"], start={"z": 1e-3, "v_z": 4.5}, progress=False)
        assert abs(found["e"] - 0.9) < 3 * found.uncertainty["e"] < 1e-3
        assert abs(found["gravity"] - 10.0) < 3 * found.uncertainty["gravity"] < 0.02
        assert not found.anomalies, found.anomalies


@pytest.mark.parametrize("off", [-0.05, 0.05])
def test_a_speed_with_impacts_under_a_measured_force(off: float) -> None:
    """The force changes at every reading; it took 33 s and ended short of its minimum."""
    rng, t = np.random.default_rng(4), np.arange(0.0, 20.0, 0.02)
    force = 6 * np.convolve(rng.normal(size=len(t)), np.ones(12) / 12, "same")
    motion, hits = driven(t, force, 0.2, 4.0, 0.25, 0.7)
    assert hits == 8
    mass = ns.mechanical(
        1.0,
        0.2,
        "k",
        coordinates=["q"],
        parameters={"e": 0.7 * (1 + off), "k": 4.0 * (1 - off)},
        inputs={"force": "N"},
        forcing={"q": lambda t, p: p.force},
        elements={"wall": ns.elements.Stop(at="q", position=0.25, restitution="e")},
    )
    speed = motion[:, 1] + 0.01 * rng.normal(size=len(t))
    found = ns.fit(
        mass,
        {"v_q": (t, speed)},
        ["e", "k"],
        inputs={"force": (t, force)},
        start={"q": 0.0, "v_q": 0.0},
        progress=False,
    )
    assert abs(found["e"] - 0.7) < 3 * found.uncertainty["e"] < 0.004
    assert abs(found["k"] - 4.0) < 3 * found.uncertainty["k"] < 0.01
    assert not found.anomalies, found.anomalies


RISES = {"k": 9.0, "c": 0.04, "a": 2.0}


def written(t: np.ndarray) -> np.ndarray:
    """Place under a force that follows the speed of the last rise through 0: from rise to rise all is the same, but
    for a factor."""
    k, c, a = RISES.values()
    w, first = np.sqrt(k - c * c / 4), 0.3

    def swing(t: np.ndarray, at: float) -> tuple[np.ndarray, np.ndarray]:
        """Place and speed from 0 with speed 1, about a place."""
        fade, of_sine = np.exp(-c / 2 * t), (1.0 - c / 2 * at) / w
        x = fade * (of_sine * np.sin(w * t) - at * np.cos(w * t))
        return at + x, -c / 2 * x + fade * w * (of_sine * np.cos(w * t) + at * np.sin(w * t))

    span = brentq(lambda t: swing(t, a / k)[0], 1.6, 2.4)
    rises = np.floor((t - first) / span)
    x = swing(t - first - rises * span, a / k)[0] * swing(span, a / k)[1] ** rises
    return np.where(t < first, swing(t - first, 0.0)[0], x)


@pytest.mark.parametrize("asked", [{"window": 5.0}, {}, {"leave_out": True}])
def test_what_was_written_before_a_window_is_found(asked: dict[str, Any]) -> None:
    """The guess writes other speeds than the record, and nobody knows what was written last before a knock is over."""
    system = ns.System(
        states=["x", "v"],
        parameters={"k": 9.2, "c": 0.05, "a": 1.7},
        memory=["m"],
        modes=dict.fromkeys(("below", "above"), lambda t, u, p: (u.v, p.a * p.m - p.k * u.x - p.c * u.v)),
        indicators={"side": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("below", "above", when="side > 0", write={"m": lambda t, u, p: u.v}),
            ns.Transition("above", "below", when="side < 0"),
        ],
    )
    t = np.arange(0.0, 16.0, 0.04)
    knock = 0.3 * np.sin(40 * t) * ((t > 8.6) & (t < 9.1)) * ("leave_out" in asked)
    read = {"x": (t, written(t) + knock + 1e-3 * np.random.default_rng(0).standard_normal(len(t)))}
    found = ns.fit(system, read, list(RISES), mode="below", tries=1, progress=False, **asked)
    for name, value in RISES.items():
        assert abs(found[name] - value) < 4 * found.uncertainty[name] < 4e-3 * (9 if asked else 4), name
    assert not found.anomalies


@pytest.mark.parametrize("seed", [0, 1])
def test_a_speed_that_turns_where_its_sensor_ends(seed: int) -> None:
    """A ball dropped on a table, its speed read up to 1.5 m/s: at the limit a reading is beside 1.5 or beyond, and so
    before the impact, however much nearer the limit is to the speed behind it."""
    g, e = 9.81, 0.5
    t, falls = np.arange(0.0, 1.05, 0.03), np.sqrt(4.0 / g)
    spans = falls * np.append(1.0, 2 * e ** np.arange(1.0, 4.0))
    begins = np.cumsum(np.append(0.0, spans))
    k = np.searchsorted(begins, t, "right") - 1
    speed = g * (t - begins[k]) - np.where(k > 0, g * falls * e**k, 0.0)
    read = np.minimum(speed + 0.01 * np.random.default_rng(seed).standard_normal(len(t)), 1.5)
    ball = ns.System(
        states=["x", "v"],
        parameters={"e": 0.45},
        modes={"fly": lambda t, u, p: (u.v, g)},
        indicators={"hit": lambda t, u, p: u.x},
        transitions=[ns.Transition("fly", "fly", when="hit > 0", reset=lambda t, u, p: (0.0, -p.e * u.v))],
    )
    sensor = {"v": ns.Sensor(noise=0.01, range=(-np.inf, 1.5))}
    known = {"start": {"x": -2.0, "v": 0.0}, "free_start": False}
    found = ns.fit(ball, {"v": (t, read)}, ["e"], measured=sensor, **known, tries=1, progress=False)
    assert abs(found["e"] - e) < 4 * found.uncertainty["e"] < 4e-3 and not found.anomalies
