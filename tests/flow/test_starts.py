"""Starts: one or several, drawn or given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.starts import is_one_start, start_states
from nonsmooth.results.provenance import read_provenance


@pytest.fixture(scope="module")
def system() -> ns.System:
    return ns.models.discontinuous_support()


def test_random_starts_fill_their_box_and_repeat() -> None:
    starts = ns.random_starts(500, {"x": -1.0, "v": 2.0}, {"x": 1.0, "v": 2.5}, seed=3)
    assert starts == ns.random_starts(500, {"x": -1.0, "v": 2.0}, {"x": 1.0, "v": 2.5}, seed=3)
    assert starts != ns.random_starts(500, {"x": -1.0, "v": 2.0}, {"x": 1.0, "v": 2.5}, seed=4)
    table = np.array([[s["x"], s["v"]] for s in starts])
    assert table.min(axis=0) == pytest.approx([-1.0, 2.0], abs=0.01)
    assert table.max(axis=0) == pytest.approx([1.0, 2.5], abs=0.01)
    assert np.abs(table.mean(axis=0) - [0.0, 2.25]).max() < 0.1
    flat = ns.random_starts(4, [0, 1], [1, 1], seed=1)
    assert all(len(one) == 2 and one[1] == 1.0 for one in flat)
    for low, high in (({"x": 1.0}, {"x": -1.0}), ([1.0], [-1.0])):
        with pytest.raises(ValueError, match="low must be finite and not above high"):
            ns.random_starts(2, low, high, seed=1)


@pytest.mark.parametrize(
    ("start", "one"),
    [
        (None, True),
        ({"x": 1.0}, True),
        ([1.0, 2.0], True),
        ((1, 2), True),
        (np.array([1.0, 2.0]), True),
        ([[1.0, 2.0]], False),
        ([{"x": 1.0}, {"v": 1.0}], False),
        (np.zeros((3, 2)), False),
    ],
)
def test_one_start_is_told_from_several(start: object, one: bool, system: ns.System) -> None:
    assert is_one_start(start) is one
    assert start_states(system, start).shape[1] == 2


def test_states_not_named_are_zero(system: ns.System) -> None:
    assert start_states(system, {"v": 0.5}).tolist() == [[0.0, 0.5]]
    assert start_states(system, [{"x": 1}, [2, 3]]).tolist() == [[1.0, 0.0], [2.0, 3.0]]
    assert start_states(system, None).tolist() == [[0.0, 0.0]]


def test_the_last_state_of_a_run_is_a_start(system: ns.System) -> None:
    run = ns.simulate(system, periods=2)
    assert start_states(system, run).tolist() == [run["u"].values[-1].tolist()]
    again = ns.simulate(system, periods=1, start=run["u"].isel(time=-1))
    assert again["u"].values[0].tolist() == run["u"].values[-1].tolist()
    swept = ns.sweep(system, "rho", [0.4], transient=2, keep=2, max_period=1, start=run)
    assert swept["start_state"].values.tolist() == run["u"].values[-1].tolist()
    other = ns.models.relief_valve()
    with pytest.raises(ValueError, match=r"must be a result of simulate with the states y1, y2, y3"):
        start_states(other, run)
    with pytest.raises(ValueError, match="must be a result of simulate"):
        start_states(system, ns.poincare(system, n=2))
    with pytest.raises(ValueError, match=r"a state within it is run\['u'\].isel\(time=k\)"):
        ns.simulate(system, periods=1, start=run.isel(time=5))
    with pytest.raises(ValueError, match=r"has no `mode`: give it whole, or a state of it, run\['u'\].isel\(time=-1\)"):
        ns.simulate(system, periods=1, start=run[["u"]])


def relay() -> ns.System:
    """x' = a cos t - x + b + d / 10 in "high", which the motion x = b + d / 10 + a (cos t + sin t) / 2 does not leave;
    d counts how often it was entered."""
    return ns.System(
        states=["x"],
        parameters={"a": 0.1, "b": 1.0},
        memory={"d": 0.0},
        modes={
            "low": lambda t, u, p: (p.a * np.cos(t) - u.x - 1.0 + 0.1 * p.d,),
            "high": lambda t, u, p: (p.a * np.cos(t) - u.x + p.b + 0.1 * p.d,),
        },
        indicators={"up": lambda t, u, p: u.x - 1.5, "down": lambda t, u, p: u.x + 1.5},
        transitions=[
            ns.Transition("low", "high", when="up > 0", write={"d": lambda t, u, p: p.d + 1.0}),
            ns.Transition("high", "low", when="down < 0"),
        ],
    )


def test_a_run_as_a_start_brings_its_mode_and_memory_to_every_verb(tmp_path: Path) -> None:
    """From "low" alone, where every run begins else, the motion is about -1."""
    system, options = relay(), {"progress": False, "transient": 20, "keep": 5}
    run = ns.simulate(system, periods=5, start={"x": 2.0})
    assert run["mode"].values[-1] == 1 and run["d"].values[-1] == 1.0
    where = 1.0 + 0.1 + 0.05
    assert run["u"].values[-1, 0] == pytest.approx(where, abs=1e-9)
    named = {"x": where, "mode": "high", "d": 1.0}
    for start in (run, named):
        assert ns.poincare(system, n=2, transient=10, start=start)["section"].values == pytest.approx(where, abs=1e-9)
        both = ns.sweep(system, "a", [0.1, 0.2], direction="both", start=[start, {"x": 0.0}], **options)
        expected = np.array([[[where, -0.95]], [[where + 0.05, -0.9]]]) * np.ones((2, 2, 2))
        assert both["section"].values[..., 0, 0] == pytest.approx(expected, abs=1e-9)
        assert ns.amplitude_spectrum(system, start=start)["amplitude"].values[0, 0] == pytest.approx(1.1, abs=1e-6)
        plane = {"a": [0.1, 0.2], "b": [1.0, 1.2]}
        for carry in (None, {"b": "down"}):
            top = ns.chart(system, plane, start=start, carry=carry, **options)["maximum"].values[..., 0]
            a, b = np.meshgrid(plane["a"], plane["b"], indexing="ij")
            assert top == pytest.approx(b + 0.1 + a / np.sqrt(2), abs=1e-9)
    again = ns.sweep(system, "a", [0.1], start=[run], **options)
    assert read_provenance(again)["options"]["start"] == [{"x": run["u"].values[-1, 0], "d": 1.0, "mode": "high"}]
    kept = {"store": tmp_path / "chart.zarr", **options}
    ns.chart(system, plane, start=run, **kept)
    with pytest.raises(ns.DataFileError, match="another work"):
        ns.chart(system, plane, start=run["u"].values[-1], **kept)


def test_a_mode_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="hihg"):
        ns.sweep(relay(), "a", [0.1], start={"x": 0.0, "mode": "hihg"})
    with pytest.raises(ValueError, match="must be a finite number"):
        ns.simulate(relay(), periods=1, start={"d": np.nan})
