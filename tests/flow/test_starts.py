"""Starts: one or several, drawn or given."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.starts import is_one_start, start_states


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
