"""Fits of systems with a measured input: data by SciPy and by the exact flow of a system without inputs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
TRUTH = {"k": 40.0, "c": 0.6, "e": 0.8, "late": 0.03}


def rig(**values: float) -> ns.System:
    return ns.System(
        states={"x": "m", "v": "m/s"},
        parameters=TRUTH | values,
        inputs={"f": "N"},
        modes={"one": lambda t, u, p: [u.v, -p.k * u.x - p.c * u.v + p.f]},
        indicators={"gap": lambda t, u, p: u.x - 0.05},
        transitions=[ns.Transition("one", "one", when="gap > 0", reset=lambda t, u, p: [u.x, -p.e * u.v])],
    )


def motion(t: np.ndarray, force: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The rig under a force that is held between its samples, in steps of .1 ms by the trapezoidal rule."""
    h = 1e-4
    A = np.array([[0.0, 1.0], [-TRUTH["k"], -TRUTH["c"]]])
    left, right = np.eye(2) - h / 2 * A, np.eye(2) + h / 2 * A
    whole, pushed = np.linalg.solve(left, right), np.linalg.solve(left, [0.0, h])
    x, found, n = np.array([0.01, 0.0]), [], int(np.ceil(at[-1] / h)) + 1
    now = force[np.maximum(np.searchsorted(t + TRUTH["late"], (np.arange(n) + 0.5) * h, "right") - 1, 0)]
    for k in range(n):
        found.append(x[0])
        x = whole @ x + pushed * now[k]
        if x[0] > 0.05 and x[1] > 0:
            x = np.array([0.1 - x[0], -TRUTH["e"] * x[1]])
    return np.interp(at, np.arange(n) * h, found)


@pytest.fixture(scope="module")
def recording() -> dict[str, Any]:
    rng = np.random.default_rng(0)
    t = np.arange(0.0, 12.0, 0.02)
    force = 2 * np.interp(t, np.arange(0, 13, 0.15), rng.standard_normal(87))
    at = np.arange(0.0, 11.9, 0.01)
    return {"x": (at, motion(t, force, at) + 1e-3 * rng.standard_normal(len(at))), "motor": (t, force)}


def test_parameters_and_the_delay_of_a_measured_force(recording: dict[str, Any]) -> None:
    first = rig(k=44.0, c=0.4, e=0.7, late=0.02)
    drive = {"f": ns.Input("motor", between="steps", delay="late")}
    found = ns.fit(first, recording, list(TRUTH), inputs=drive, progress=False)
    for name, value in TRUTH.items():
        assert abs(found[name] - value) < 4 * found.uncertainty[name], name
    assert found.uncertainty["late"] < 1e-3


def test_what_is_refused(recording: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="`moto` is not a channel"):
        ns.fit(rig(), recording, ["k"], inputs={"f": "moto"}, progress=False)
    with pytest.raises(ValueError, match="'f' is missing"):
        ns.fit(rig(), {"x": recording["x"]}, ["k"], progress=False)
    with pytest.raises(ValueError, match="neither 'phase' nor 'clock'"):
        ns.fit(rig(), recording, ["k", "clock"], inputs={"f": "motor"}, progress=False)


def test_a_run_that_begins_at_rest_in_a_mode_that_slips() -> None:
    """Friction catches the block at once, by a transition that sets its rate to zero: derivatives know that."""
    block = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"mu": 0.5},
        forcing={"q": lambda t, p: 0.3 + 0.9 * np.sin(t)},
        elements={"floor": ns.elements.Coulomb(at="q", friction="mu")},
    )
    found = ns.sensitivity(block, duration=3.0, start={"v_q": 0.0}, mode="floor_forward", parameters=["mu"])
    h = 1e-6
    ends = [
        ns.simulate(block.with_parameters(mu=0.5 + s * h), duration=3.0, start={"v_q": 0.0}, mode="floor_forward")
        for s in (1, -1)
    ]
    slope = (ends[0].u.values[-1] - ends[1].u.values[-1]) / (2 * h)
    np.testing.assert_allclose(found.P.sel(parameter="mu"), slope, atol=1e-6)


def test_models_with_an_input_are_ranked_by_what_they_predict() -> None:
    """The channel has the input's name, or is named; the damping that is there predicts better than none."""
    t = np.arange(0.0, 8.0, 0.04)
    force = np.sin(2.0 * t) + np.sin(5.3 * t)
    free = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"k": 40.0, "c": 0.6},
        inputs={"f": "N"},
        modes={"one": lambda t, u, p: [u.v, -p.k * u.x - p.c * u.v + p.f]},
    )
    run = ns.simulate(free, duration=7.8, samples=t[:-6], start={"x": 0.05}, inputs={"f": (t, force)})
    noise = 1e-4 * np.random.default_rng(0).standard_normal(run.sizes["time"])
    record = {"x": (run["time"].values, run["u"].sel(state="x").values + noise), "f": (t, force)}
    models = {"damped": (free, ["k", "c"]), "free": (free.with_parameters(c=0.0), ["k"])}
    asked: dict[str, Any] = {"measured": ["x"], "folds": 2, "tries": 1, "progress": False}
    ranked = ns.select_model(models, record, **asked)
    assert ranked.attrs["best"] == "damped"
    record["load cell"] = record.pop("f")
    assert ns.select_model(models, record, inputs={"f": "load cell"}, **asked).identical(ranked)
    with pytest.raises(ValueError, match="'f' is missing; .* beside a recording also by the name of a channel"):
        ns.select_model(models, record, **asked)


SLOW = (pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 6))


@pytest.mark.parametrize("seed", [2, *SLOW])
def test_two_records_of_a_driven_mass_with_a_stop_and_friction_whose_sensor_is_late(seed: int) -> None:
    """Different rates, a gain between units, and a delay to be found: first guesses end windows before their time."""
    rng, elements = np.random.default_rng(seed), ns.elements
    rig = ns.mechanical(
        1.0,
        "c",
        "k",
        parameters={"k": 1.2, "c": 0.1, "mu": 0.05, "d": 0.25, "e": 0.6},
        forcing={"q": lambda t, p: p.force},
        inputs=["force"],
        elements={
            "stop": elements.Stop(at="q", position="d", restitution="e"),
            "rub": elements.Coulomb(at="q", friction="mu"),
        },
    )
    records, late = [], 0.03
    for length, step in ((16.0, 0.05), (13.0, 0.11)):
        at, t = np.arange(0, length + 1, 0.1), np.arange(late, length, step)
        force = 0.8 * np.sin((0.5 + 0.03 * at) * at + rng.uniform(0, 6)) + 0.3 * np.sin(2.1 * at)
        start = {"q": rng.uniform(-0.2, 0.1), "v_q": rng.uniform(-0.2, 0.2)}
        run = ns.simulate(rig, duration=length, samples=t - late, start=start, inputs={"force": (at, force)})
        q = run.drop_duplicates("time", keep="last").sel(time=t - late)["u"].sel(state="q").values
        records.append({"q in mm": (t, 1e3 * q + rng.normal(0, 1, len(t))), "force": (at, force)})
    first = rig.with_parameters({name: value * rng.uniform(0.93, 1.07) for name, value in rig.values.items()})
    names, sensor = [*rig.values, "q.delay"], {"q": ns.Sensor("q in mm", gain=1e3)}
    found = ns.fit(first, records, names, measured=sensor, progress=False)
    for name, value in rig.values.items():
        assert abs(found[name] - value) < 4 * found.uncertainty[name]
    assert abs(found.extra["q.delay"].value - late) < 4 * found.extra["q.delay"].uncertainty


@pytest.mark.parametrize(
    ("scale", "last", "words"),
    [
        (
            1.0,
            75,
            "151 of 300 readings of the record lie before the first or behind the last sample of the input 'f'",
        ),
        (1e3, 600, "1 of 600 samples of the input 'f' lie within the time of the record"),
        (1.0, 600, ""),
    ],
)
def test_inputs_of_other_times_than_the_readings_are_said(
    recording: dict[str, Any], scale: float, last: int, words: str
) -> None:
    """The first half of the force; the force by a clock of milliseconds."""
    t, force = recording["motor"]
    given = {"x": tuple(one[:300] for one in recording["x"]), "motor": (scale * t[:last], force[:last])}
    found = ns.fit(rig(), given, ["k"], inputs={"f": "motor"}, progress=False, tries=1, window=0.2)
    assert words in "; ".join(found.notes) if words else "input" not in "; ".join(found.notes)


def test_a_window_without_readings_is_refused(recording: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"window = 0\.001 holds no three readings: give at least 0\.02, twice"):
        ns.fit(rig(), recording, ["k"], inputs={"f": "motor"}, progress=False, window=1e-3)
