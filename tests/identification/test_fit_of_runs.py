"""One fit of several runs: unknowns of each run, the recording's clock, windows left out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

T = np.arange(0.0, 20.0, 0.05)


def oscillator(**values: float) -> ns.System:
    parameters = {"k": 9.0, "c": 0.15, "F": 0.0, "omega": 2.0, **values}
    return ns.mechanical(
        1.0, "c", "k", parameters=parameters, coordinates=["q"], forcing={"q": lambda t, p: p.F * np.cos(p.omega * t)}
    )


def decay(t: Any, c: float = 0.15, k: float = 9.0, q: float = 1.0, v: float = 0.0) -> Any:
    w = np.sqrt(k - c**2 / 4)
    return np.exp(-c / 2 * t) * (q * np.cos(w * t) + (v + c / 2 * q) / w * np.sin(w * t))


def within(found: ns.ParameterSet, truth: dict[str, float], most: float = 4.0) -> None:
    for name, value in truth.items():
        estimate = found.estimate(name)
        assert abs(estimate.value - value) < most * estimate.uncertainty, (name, estimate, value)


def test_each_run_has_its_own_damping_and_offset_and_all_share_the_stiffness() -> None:
    rng = np.random.default_rng(3)
    truth = {"0": (0.1, 0.02), "1": (0.2, -0.01), "2": (0.4, 0.05)}
    runs = [{"q": (T, decay(T, c=c) + o + 1e-3 * rng.standard_normal(T.size))} for c, o in truth.values()]
    found = ns.fit(oscillator(k=8.6), runs, ["k", "c", "q.offset"], per_run=["c", "q.offset"], progress=False, tries=2)
    assert list(found) == ["k"] and not found.anomalies
    within(found, {"k": 9.0})
    within(found, {f"c, {run}": c for run, (c, _) in truth.items()})
    within(found, {f"q.offset, {run}": o for run, (_, o) in truth.items()})
    alone = ns.fit(oscillator(k=8.6), runs[0], ["k", "c", "q.offset"], progress=False, tries=2)
    assert found.uncertainty["k"] < alone.uncertainty["k"]


def test_one_unknown_of_each_run_and_one_of_the_forcing() -> None:
    """Two forced runs at amplitudes that were set differently: the closed form of the linear response."""
    rng = np.random.default_rng(5)
    k, c, w = 9.0, 0.15, 2.0
    response = 1 / (k - w**2 + 1j * c * w)
    runs = [{"q": (T, F * np.real(response * np.exp(1j * w * T)) + 1e-3 * rng.standard_normal(T.size))} for F in (1, 3)]
    found = ns.fit(oscillator(F=2.0), runs, ["F"], per_run=["F"], progress=False, tries=2)
    assert list(found) == []
    within(found, {"F, 0": 1.0, "F, 1": 3.0})


@pytest.mark.parametrize("clock", [1.002, 0.995])
def test_the_clock_of_a_recording_is_found_where_the_forcing_is_known(clock: float) -> None:
    """A recorder whose seconds are too long or too short, of a resonance and its transient, both in closed form."""
    rng = np.random.default_rng(2)
    k, c, w = 9.0, 0.15, 2.0
    response = np.real(np.exp(1j * w * clock * T) / (k - w**2 + 1j * c * w))
    y = response + decay(clock * T) + 1e-3 * rng.standard_normal(T.size)
    found = ns.fit(oscillator(F=1.0, k=8.8), {"q": (T, y)}, ["k", "c", "clock"], progress=False, tries=2)
    within(found, {"k": k, "c": c, "clock": clock})
    assert found.estimate("clock").uncertainty < 2e-4 and not found.anomalies


@pytest.mark.parametrize("names", [["k", "c", "q.delay", "q.gain", "clock"], ["k", "c", "phase", "clock"]])
def test_derivatives_in_sensor_clock_and_phase_are_those_of_differences(names: list[str]) -> None:
    """Of motions that hit a stop, simulated anew at each value; the start, free in both, is eliminated."""
    stop = ns.elements.Stop(at="q", position=0.7, restitution=0.8)
    s = ns.mechanical(
        1.0,
        "c",
        "k",
        parameters={"k": 9.0, "c": 0.15},
        coordinates=["q"],
        elements={"s": stop},
        forcing={"q": lambda t, p: 0.5 * np.cos(2.0 * t)},
    )
    t, start, period = np.linspace(0.0, 4.0, 81), {"q": 0.1, "v_q": 3.0}, np.pi
    plan = ns.plan_experiment(
        s,
        {"run": {"duration": 4.0, "samples": t, "start": start}},
        names,
        measured={"q": ns.Sensor(noise=1e-3)},
    )

    def readings(own: dict[str, float], q: float, v: float) -> Any:
        at = own.get("clock", 1.0) * t - own.get("q.delay", 0.0) + own.get("phase", 0.0) * period
        one = s.with_parameters(k=own["k"], c=own["c"])
        run = ns.simulate(one, duration=5.0, samples=np.maximum(at, 0.0), start={"q": q, "v_q": v}, transient=0)
        motion = run["u"].sel(state="q").groupby("time").last()
        slope = (at < 0) * v * at  # a little before the start
        return own.get("q.gain", 1.0) * (motion.sel(time=np.maximum(at, 0.0), method="nearest").values + slope)

    first = {"k": 9.0, "c": 0.15, "clock": 1.0, "q.gain": 1.0}
    centre = np.array([*(first.get(name, 0.0) for name in names), 0.1, 3.0])
    h, columns = 1e-6, []
    for step in h * np.eye(len(centre)):
        ahead, behind = (readings(dict(zip(names, x, strict=False)), *x[-2:]) for x in (centre + step, centre - step))
        columns.append((ahead - behind) / (2 * h) / 1e-3)
    whole = np.array(columns) @ np.array(columns).T
    shared = [i for i, name in enumerate(names) if name != "phase"]
    free = [i for i in range(len(centre)) if i not in shared]
    cross = whole[np.ix_(shared, free)]
    expected = whole[np.ix_(shared, shared)] - cross @ np.linalg.solve(whole[np.ix_(free, free)], cross.T)
    size = np.sqrt(np.diag(expected))
    found = plan["information"].values[0]
    assert plan["parameter"].values.tolist() == [name for name in names if name != "phase"]
    np.testing.assert_allclose(found / np.outer(size, size), expected / np.outer(size, size), atol=1e-4)


def test_a_knock_is_left_out_and_named() -> None:
    """From 8 s on the mass moves on from another state; the readings of half a second before are of a hand."""
    rng = np.random.default_rng(7)
    y = np.where(T < 8.0, decay(T), decay(T - 8.0, q=0.5, v=1.2))
    hand = (T > 7.4) & (T < 8.0)
    y[hand] += 0.3 * np.sin(9.0 * (T[hand] - 7.4) / 0.6)
    y = y + 2e-3 * rng.standard_normal(T.size)
    guess = oscillator(k=8.7, c=0.2)
    kept = ns.fit(guess, {"q": (T, y)}, ["k", "c"], progress=False, tries=1)
    found = ns.fit(guess, {"q": (T, y)}, ["k", "c"], leave_out=True, progress=False, tries=1)
    assert kept.anomalies and not found.anomalies
    (note,) = [note for note in found.notes if note.startswith("left out")]
    begin, end = (float(word.strip(",")) for word in np.array(note.split())[[4, 6]])
    assert 6.0 < begin < 7.45 and 7.95 <= end < 9.2
    times = float(note.split("up to ")[1].split()[0])
    assert 3.0 < times < 150.0  # a hand of 0.3 beside a noise of 2e-3
    within(found, {"k": 9.0, "c": 0.15})
    y = decay(T) + 2e-3 * rng.standard_normal(T.size)
    clean = ns.fit(guess, {"q": (T, y)}, ["k"], leave_out=True, progress=False)
    assert not [note for note in clean.notes if note.startswith("left out")]


@pytest.mark.parametrize(("length", "knock"), [(16.0, 8.0), pytest.param(40.0, 20.0, marks=pytest.mark.slow)])
def test_a_knock_in_one_of_two_driven_runs_with_a_stop(length: float, knock: float) -> None:
    """Phases and forces of each run stay those of all its parts; readings of 1.2 s are of something else."""
    rng, t, period = np.random.default_rng(0), np.arange(0.0, length, 0.04), np.pi
    stop = ns.elements.Stop(at="q", position=0.15, restitution="e")
    s = ns.mechanical(
        1.0,
        "c",
        "k",
        parameters={"c": 0.1, "k": 9.0, "F": 0.5, "e": 0.8},
        coordinates=["q"],
        elements={"s": stop},
        forcing={"q": lambda t, p: p.F * np.cos(2.0 * t)},
    )
    runs = []
    for phase, F in ((0.2, 0.5), (0.7, 0.55)):
        at = t + phase * period
        run = ns.simulate(s.with_parameters(F=F), duration=at[-1] + 0.1, samples=at, start={"q": 0.0, "v_q": 0.1})
        q = run["u"].sel(state="q").groupby("time").last().sel(time=at, method="nearest").values
        runs.append({"q": (t, q + 1e-3 * rng.standard_normal(t.size))})
    hand = np.arange(30) + round(knock / 0.04)
    runs[1]["q"][1][hand] += 0.05 * np.sin(np.arange(30))
    found = ns.fit(
        s.with_parameters(k=8.7, e=0.7, c=0.15),
        runs,
        ["k", "c", "e", "F", "phase"],
        per_run=["F"],
        leave_out=True,
        progress=False,
        tries=1,
    )
    within(found, {"k": 9.0, "c": 0.1, "e": 0.8, "F, 0": 0.5, "F, 1": 0.55, "phase, 0": 0.2, "phase, 1": 0.7})
    assert len([note for note in found.notes if note.startswith("left out: run 1")]) == 1
    assert f"q(0), 1 from {knock + 1:.0f}" in " ".join(found.extra) and found.estimate("q.noise").value < 1.2e-3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"per_run": ["m"]}, "per_run: `m` is not an unknown of this fit"),
        ({"leave_out": True, "free_start": False, "start": {"q": 1.0}}, "needs free starts"),
        ({"leave_out": "maybe"}, "leave_out"),
    ],
)
def test_what_does_not_fit_is_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        ns.fit(oscillator(), {"q": (T, decay(T))}, ["k"], progress=False, **options)


@pytest.mark.parametrize("name", ["phase", "clock"])
def test_a_parameter_of_the_system_may_be_called_as_an_unknown_of_the_recording(name: str) -> None:
    """Two forced runs in closed form, whose forces lead by angles of their own: a parameter, in rad."""
    rng, leads = np.random.default_rng(6), (0.2, 0.5)
    s = ns.mechanical(
        1.0,
        0.15,
        "k",
        parameters={"k": 8.8, name: 0.3},
        coordinates=["q"],
        forcing={"q": lambda t, p: np.cos(2.0 * t + getattr(p, name))},
    )
    runs = [
        {"q": (T, np.real(np.exp(1j * (2 * T + lead)) / (5 + 0.3j)) + decay(T) + 1e-3 * rng.standard_normal(T.size))}
        for lead in leads
    ]
    found = ns.fit(s, runs, ["k", name], per_run=[name], progress=False, tries=2)
    within(found, {"k": 9.0, **{f"{name}, {run}": lead for run, lead in enumerate(leads)}})
    assert found.estimate(f"{name}, 0").unit == "" and not found.anomalies


def test_a_channel_that_a_run_lacks_or_that_holds_few_readings() -> None:
    """Of five decays the velocity is known in one; of one decay at three instants."""
    rng, sizes = np.random.default_rng(4), 1.0 + 0.1 * np.arange(5)
    w = np.sqrt(9.0 - 0.15**2 / 4)
    q = [size * decay(T) + 1e-3 * rng.standard_normal(T.size) for size in sizes]
    v = -9.0 / w * np.exp(-0.15 / 2 * T) * np.sin(w * T) + 3e-3 * rng.standard_normal(T.size)
    runs = [{"time": T, "q": one, "v_q": np.where(k == 0, v, np.nan)} for k, one in enumerate(q)]
    few = {"time": T, "q": q[0], "v_q": np.where(np.arange(T.size) % 150 == 30, v, np.nan)}
    for given in (runs, few):
        found = ns.fit(oscillator(k=8.7), given, ["k", "c"], progress=False, tries=1)
        within(found, {"k": 9.0, "c": 0.15, "v_q.noise": 3e-3})
        assert not found.anomalies
    with pytest.raises(ValueError, match=r"measured\['v_q'\]: channel 'v_q' holds no number"):
        ns.fit(oscillator(), runs[1], ["k", "c"], progress=False)


@pytest.mark.parametrize("gain", [1.0, 20.0])
def test_a_gain_that_another_start_makes_up_for_is_not_determined(gain: float) -> None:
    """Of a linear decay from an unknown start: the readings are gain times start, whatever either is."""
    rng = np.random.default_rng(0)
    y = gain * (decay(T) + 1e-2 * rng.standard_normal(T.size))
    found = ns.fit(oscillator(k=8.8), {"q": (T, y)}, ["k", "c", "q.gain"], progress=False)
    assert found.estimate("q.gain").uncertainty == np.inf
    assert "another start makes up for it" in found.identifiability["q.gain"]
    within(found, {"k": 9.0, "c": 0.15})
    run = {"duration": 20.0, "samples": T, "start": {"q": 1.0}}
    plan = ns.plan_experiment(
        oscillator(), {"decay": run}, ["k", "c", "q.gain"], measured={"q": ns.Sensor(noise=gain * 1e-2, gain=gain)}
    )
    known = [found.uncertainty["k"], found.uncertainty["c"]]
    assert plan["uncertainty"].values[0] == pytest.approx([*known, np.inf], rel=0.25)
    forced = ns.plan_experiment(  # the gain of a known force is told
        oscillator(F=1.0), {"run": run}, ["k", "q.gain"], measured={"q": ns.Sensor(noise=1e-2)}
    )
    assert float(forced["uncertainty"].sel(parameter="q.gain")[0]) < 0.01
