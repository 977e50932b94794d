"""Options of fits that are seldom given: the name of the time, some of the runs, what is known before an experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import nonsmooth as ns

QUIET = {"progress": False, "tries": 1}


def swing() -> ns.System:
    return ns.System(
        name="swing",
        states={"x": "m", "v": "m/s"},
        parameters={"k": 5.0, "c": 0.1},
        modes={"one": lambda t, u, p: (u.v, -p.k * u.x - p.c * u.v)},
    )


def decay(k: float, t: Any, c: float = 0.1) -> Any:
    """x of a free decay from x = 1 with v = -c / 2."""
    return np.exp(-c * t / 2) * np.cos(np.sqrt(k - c * c / 4) * t)


T = np.linspace(0.0, 8.0, 161)
NOISE = 1e-3 * np.random.default_rng(5).standard_normal((2, len(T)))


def test_the_time_by_another_name() -> None:
    table = pd.DataFrame({"seconds": T, "x": decay(4.0, T) + NOISE[0], "time": 2 * T})
    found = ns.fit(swing(), table, ["k"], measured="x", time="seconds", **QUIET)
    assert found["k"] == pytest.approx(4.0, rel=2e-3)
    slow = ns.fit(
        swing().with_parameters(k=1.1, c=0.05), table, ["k", "c"], measured="x", **QUIET
    )  # by its usual name: twice as long
    assert slow["k"] == pytest.approx(1.0, rel=5e-3)


@pytest.fixture(scope="module")
def two_runs(tmp_path_factory: pytest.TempPathFactory) -> ns.Recording:
    file: Path = tmp_path_factory.mktemp("runs") / "runs.csv"
    rows = [(n, t, x) for n, k in ((1, 4.0), (2, 9.0)) for t, x in zip(T, decay(k, T) + NOISE[n - 1], strict=True)]
    pd.DataFrame(rows, columns=["n", "t", "x"]).to_csv(file, index=False)
    return ns.load_recording(file, columns={"run": "n", "time": ("t", "s"), "x": ("x", "m")})


def test_some_of_the_runs(two_runs: ns.Recording) -> None:
    first, second = two_runs.runs
    for run, k in ((first, 4.0), (second, 9.0)):
        found = ns.fit(swing().with_parameters(k=k * 1.1), two_runs, ["k"], measured="x", runs=[run], **QUIET)
        assert found["k"] == pytest.approx(k, rel=2e-3)
    both = ns.fit(swing(), two_runs, ["k"], measured="x", per_run=["k"], **QUIET)
    assert [both.estimate(f"k, {run}").value for run in two_runs.runs] == pytest.approx([4.0, 9.0], rel=2e-3)
    with pytest.raises(ValueError, match="runs= chooses runs of a Recording"):
        ns.fit(swing(), {"time": T, "x": decay(4.0, T)}, ["k"], measured="x", runs=[first], **QUIET)


def test_a_plan_adds_what_is_known_before() -> None:
    """Of one unknown 1 / u^2 is the sum of what the run says and of what was known."""
    run = {"one": {"duration": 8.0, "samples": 161, "start": {"x": 1.0}}}
    asked = (swing(), run, ["k"])
    u = {}
    for prior in (None, 1e-3, 1e-4):
        priors = None if prior is None else {"k": (5.0, prior)}
        plan = ns.plan_experiment(*asked, measured={"x": ns.Sensor(noise=0.01)}, free_start=False, priors=priors)
        u[prior] = float(plan["uncertainty"].sel(run="one").values.ravel()[0])
    for prior in (1e-3, 1e-4):
        assert u[prior] ** -2 == pytest.approx(u[None] ** -2 + prior**-2, rel=1e-6)


def test_a_plan_takes_each_time_the_run_that_adds_most() -> None:
    """By the information of each run, which the plan holds: greedy over determinants, and what is known by then."""
    runs = {
        "short": {"duration": 2.0, "samples": 41, "start": {"x": 1.0}},
        "long": {"duration": 16.0, "samples": 161, "start": {"x": 1.0}},
        "large": {"duration": 4.0, "samples": 81, "start": {"x": 3.0}},
        "late": {"duration": 9.0, "samples": 33, "start": {"x": 0.5}},
    }
    plan = ns.plan_experiment(swing(), runs, ["k", "c"], measured={"x": ns.Sensor(noise=0.01)}, free_start=False)
    information = dict(zip(runs, plan["information"].values, strict=True))
    left, known, order = [*runs], np.zeros((2, 2)), []
    while left:
        best = max(left, key=lambda name: np.linalg.slogdet(known + information[name])[1])
        left.remove(best)
        order.append(best)
        known = known + information[best]
        after = np.sqrt(np.diag(np.linalg.inv(known)))
        assert plan["uncertainty_after"].isel(step=len(order) - 1).values == pytest.approx(after, rel=1e-6)
    assert plan["order"].values.tolist() == order


def test_two_samples_of_one_instant_are_refused() -> None:
    t = np.repeat(T[::2], 2)
    with pytest.raises(ValueError, match="the time must increase from sample to sample; sample 1 is at 0 after 0"):
        ns.fit(swing(), {"time": t, "x": decay(4.0, t)}, ["k"], measured="x", **QUIET)


def test_a_phase_is_not_known_from_another_record() -> None:
    """Of two records one after the other, k is known from both, and the phase of each is its own."""
    system = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"k": 5.2, "c": 0.3},
        modes={"one": lambda t, u, p: (u.v, np.cos(2.0 * t) - p.k * u.x - p.c * u.v)},
    )
    found, alone = None, []
    for phase in (0.2, 0.7):
        x = (np.exp(2j * T + 2j * np.pi * phase) / (5.0 - 4.0 + 0.6j)).real + decay(5.0, T, 0.3)
        record = {"x": (T, x + NOISE[len(alone)])}
        alone.append(ns.fit(system, record, ["k", "c", "phase"], **QUIET).uncertainty["k"])
        found = ns.fit(system, record, ["k", "c", "phase"], priors=found, **QUIET)
        told = found.estimate("phase")
        assert abs(told.value - phase) < 4 * told.uncertainty < 0.01
        assert abs(found["k"] - 5.0) < 4 * found.uncertainty["k"] and not found.anomalies
    assert found is not None and found.uncertainty["k"] < 0.95 * min(alone)


def test_an_offset_is_in_the_unit_of_its_channel() -> None:
    """Of a channel in mm, which names no unit, it is in none; beside a gain of 1 in that of the place."""
    for gain, unit in ((1e3, ""), (1.0, "m")):
        record = {"time": T, "x": gain * (decay(4.0, T) + NOISE[0]) + 7.0}
        found = ns.fit(swing(), record, ["k", "x.offset"], measured={"x": ns.Sensor(gain=gain)}, **QUIET)
        assert found.estimate("x.offset").value == pytest.approx(7.0, abs=gain * 1e-3)
        assert found.estimate("x.offset").unit == unit
