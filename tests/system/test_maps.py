"""Maps: what is accepted, what a map is made into, and that iterates are those of a plain loop."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns


def tent(**more: Any) -> ns.Map:
    """A tent with a step: the branches do not agree on the border."""
    return ns.Map(
        name="tent",
        states=["x"],
        parameters={"a": 1.7, "c": 0.3, "step": 0.1},
        branches=[
            ns.Branch(lambda u, p: (p.a * u.x,), when="right < 0"),
            ns.Branch(lambda u, p: (p.a * (2 * p.c - u.x) - p.step,), when="right > 0"),
        ],
        indicators={"right": lambda u, p: u.x - p.c},
        **more,
    )


def one_state(*branches: tuple[Any, str], **indicators: Any) -> ns.Map:
    return ns.Map(
        states=["x"],
        parameters={"a": 1.0},
        branches=[ns.Branch(f, when=when) for f, when in branches],
        indicators=indicators,
    )


def same(u: Any, p: Any) -> Any:
    return (0.5 * u.x,)


def test_iterates_are_those_of_a_loop():
    x, expected = 0.2, []
    for _ in range(200):
        x = 1.7 * x if x <= 0.3 else 1.7 * (0.6 - x) - 0.1
        expected.append(x)
    found = ns.poincare(tent(), n=200, start={"x": 0.2})
    assert found.section.values[:40, 0] == pytest.approx(expected[:40], abs=1e-6)
    assert np.allclose(found.section.values[:12, 0], expected[:12], rtol=0, atol=1e-13)


def test_results_count_iterates():
    """No seconds on the axis, though the state has a unit."""
    growth = ns.Map(states={"mass": "kg"}, parameters={"r": 0.5}, branches=[ns.Branch(lambda u, p: (p.r * u.mass,))])
    run = ns.simulate(growth, periods=2, start={"mass": 1.0})
    assert (run.time.attrs["units"], run.time.attrs["symbol"]) == ("1", "n")
    assert ns.poincare(growth, n=3, start={"mass": 1.0}).time.values.tolist() == [1.0, 2.0, 3.0]
    assert ns.find_orbit(growth).period_number == 1


def test_a_point_on_a_border_belongs_to_the_branch_listed_first():
    found = ns.poincare(tent(), n=1, start={"x": 0.3})
    assert found.section.values[0, 0] == 1.7 * 0.3  # the second would give 0.41


def test_a_map_is_a_system_that_travels_as_text():
    system = tent(scale={"x": 2.0}, outputs={"square": (lambda u, p: u.x**2, "")})
    read = ns.System.from_text(system.to_text())
    assert read == system
    assert read.to_text() == system.to_text()
    assert [row.strict for jump in read.transitions for row in jump.rows] == [False, False]
    assert pickle.loads(pickle.dumps(system)) == system
    assert isinstance(system.with_parameters(a=1.5), ns.Map)
    assert system.is_map
    assert not ns.models.impact_oscillator().is_map


@pytest.mark.parametrize(
    ("branches", "indicators", "message"),
    [
        ([(same, "x < 0")], {}, "lies in no region"),
        (
            [(same, "x < 0"), (same, "x > 0"), (same, "far > 0")],
            {"far": lambda u, p: u.x - p.a},
            "regions of the branches 2 and 3",
        ),
        (
            [(same, "low < 0"), (same, "high > 0")],
            {"low": lambda u, p: u.x + p.a, "high": lambda u, p: u.x - p.a},
            "lies in no region",
        ),
        (
            [(same, "curved < 0"), (same, "x > 0"), (same, "x < 0")],
            {"curved": lambda u, p: u.x**2 - p.a},
            "regions of the branches 1 and",
        ),
        ([(same, "x < 0"), (same, "y > 0")], {}, "`y` is not an indicator"),
        ([(same, "x < 0"), (lambda u, p: (u.x, u.x), "x > 0")], {}, "branch 2 must return 1 value"),
        ([(same, "x < 0"), (lambda t, u, p: (u.x,), "x > 0")], {}, r"called as f\(u, p\)"),
    ],
)
def test_regions_that_do_not_cover_the_states_once(branches: Any, indicators: Any, message: str):
    with pytest.raises(ns.SystemDefinitionError, match=message):
        one_state(*branches, **indicators)


@pytest.mark.parametrize("branches", [None, [], [lambda u, p: u], "x"])
def test_branches_are_a_list_of_branches(branches: Any):
    with pytest.raises(ns.SystemDefinitionError, match=r"`branches` is a list"):
        ns.Map(states=["x"], parameters={}, branches=branches)
    with pytest.raises(ns.SystemDefinitionError, match="each of several branches needs its region"):
        ns.Map(states=["x"], parameters={}, branches=[ns.Branch(same), ns.Branch(same)])


def test_signs_that_no_point_has_are_no_gap():
    """Three pieces: nothing lies below -a and above a at once."""
    low, high = lambda u, p: u.x + p.a, lambda u, p: u.x - p.a
    one_state((same, "low < 0"), (same, "low > 0 and high < 0"), (same, "high > 0"), low=low, high=high)
    one_state(
        (same, "low < 0 and high < 0"),
        (same, "low > 0 and high < 0"),
        (same, "low > 0 and high > 0"),
        low=low,
        high=high,
    )


def test_a_region_that_opens_at_other_values_ends_the_run():
    """With a < 0 the points between a and -a are in no region."""
    low, high = lambda u, p: u.x + p.a, lambda u, p: u.x - p.a
    pieces = ["low < 0 and high < 0", "low > 0 and high < 0", "low > 0 and high > 0"]
    system = one_state(*[(same, when) for when in pieces], low=low, high=high)
    found = ns.sweep(system, "a", [1.0, -1.0], start={"x": 0.5}, direction=None)
    meanings = dict(zip(found.status.attrs["flag_values"], found.status.attrs["flag_meanings"].split(), strict=True))
    assert [meanings[one] for one in found.status.values] == ["ok", "diverged"]
