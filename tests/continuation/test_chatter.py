"""Branches of orbits with impacts that accumulate: what rounding decides in the last ones before rest ends nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import brute_force
import numpy as np
import pytest
import random_templates as templates
import xarray as xr
from test_random_branches import endings

import nonsmooth as ns
from nonsmooth.continuation.branches.following import curve_of
from nonsmooth.continuation.events import neighbours


def followed(template: str, seed: int, low: float, high: float, **begin: float) -> xr.Dataset:
    """The branch of a system of the campaign over part of its range, from the orbit at the values ``begin``.

    It goes through that part, and its last orbits are those of a simulation."""
    system, name, _, start = templates.TEMPLATES[template](np.random.default_rng([seed, len(template)]))
    at = system.with_parameters(begin)
    orbit = ns.find_orbit(at, start=start, max_period=4, progress=False)
    branch = ns.continue_orbit(orbit, name, (low, high))
    assert endings(branch) == ["range", "range"]
    assert brute_force.misses(system, branch.isel(point=[0, -1], special=[]), name) < 1e-9
    return branch


def test_lift_off_that_is_only_solved_for_is_no_graze() -> None:
    """Gap, speed and push vanish together at lift-off: behind it the push is zero to what the orbit is solved for."""
    system, name, limits, start = templates.rest(np.random.default_rng([8, 4]))
    orbit = ns.find_orbit(system, start=start, progress=False)
    curve, X = curve_of(orbit, name, limits[1] - limits[0])
    solved = curve.shooting.evaluate(X)
    states = curve.shooting.split(X)[1].copy()
    lifts = len(states) - 1
    assert solved.times[lifts] == orbit.crossing_times[-1]
    for early in (1e-13, 1e-12, 1e-11):
        solved.times[lifts] = orbit.crossing_times[-1] - early
        path = curve.walk.along(solved, states)
        assert not np.isfinite(path.inner[lifts, 2]), early


@pytest.mark.slow
def test_beyond_the_end_of_rest_every_distance_has_another_signature() -> None:
    """Impacts accumulate there: orbits beyond come nearer in proportion, each with another count of them."""
    followed("rest", 3, 1.54, 1.5821424, a=1.56)


def test_flights_do_not_take_their_other_root() -> None:
    """A flight from impact to impact has no length too: beside the end of rest Newton's method went there.

    The orbits are those of a simulation, with thirteen impacts, rest and four more in three periods."""
    system, name, _, _ = templates.rest(np.random.default_rng([1, 4]))
    at = system.with_parameters(a=2.37719246)
    orbit = ns.find_orbit(at, start=[0.21236, 0.72233], max_period=4, progress=False)
    branch = ns.continue_orbit(orbit, name, (2.377192455, 2.3773))
    assert endings(branch) == ["range", "range"]
    assert branch.sizes["special"] == 0
    run = ns.simulate(at.with_parameters(a=2.3773), duration=60 * np.pi, start=branch["section"].values[-1])
    assert run["u"].values[-1] == pytest.approx(branch["section"].values[-1], abs=1e-11)


def test_impacts_as_slow_as_they_are_followed() -> None:
    """The speed at which impacts are completed is passed where a stop at 0.9 leaves it nine digits fewer."""
    followed("two_stops", 1, 0.78, 0.82, w=0.8)


@pytest.mark.parametrize(("w", "low", "high"), [(0.787, 0.785, 0.79), (0.788, 0.78, 0.82), (0.7881, 0.785, 0.79)])
def test_an_impact_that_rounding_takes_or_not(w: float, low: float, high: float) -> None:
    """At a stop at 0.9 the speed 1e-7 below which impacts are completed has two digits: a simulation takes one impact
    more than the orbit beside it. The branch begins there, passes that speed once, and does not turn."""
    branch = followed("two_stops", 1, low, high, w=w)
    assert branch.sizes["special"] == 0
    assert (np.diff(branch["w"].values) > 0.0).all()
    assert branch.sizes["point"] < 40


@pytest.mark.slow
def test_behind_the_end_of_rest_the_edge_of_the_range() -> None:
    """The wide range has a flip and a graze there too."""
    special = ns.special_points(followed("rest", 3, 1.581, 1.5821421, a=1.5815))
    assert special["kind"].values.tolist() == ["flip", "grazing"]


def test_two_impacts_pass_the_section_in_one_step() -> None:
    """Behind the first one the search for the second one began at its zero, and ended there again and again."""
    followed("two_stops", 2, 0.58, 0.585, w=0.583)


def test_the_number_of_impacts_before_rest_is_no_event() -> None:
    """Motion behind rest knows nothing of the restitution: over the whole range the mass rests at the section, the
    extremes are the same, and only the impacts on the way become more. No special point, and no way back."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 0.4, "r": 0.5},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"stop": ns.elements.Stop(at="q", position=0.3, restitution="r", creep=1e-7)},
    )
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), "r", (0.495, 0.505))
    assert endings(branch) == ["range", "range"]
    assert branch.sizes["special"] == 0
    assert (np.diff(branch["r"].values) > 0.0).all()
    np.testing.assert_allclose(branch["section"], [[0.3, 0.0]] * branch.sizes["point"], atol=1e-12)
    assert np.ptp(branch["minimum"].sel(state="q").values) < 1e-12
    few, many = (ns.simulate(system.with_parameters(r=r), periods=1, transient=20) for r in (0.4, 0.52))
    assert many.sizes["crossing"] > few.sizes["crossing"] + 5


@pytest.mark.parametrize("jump", [5e-8, 5e-9])
def test_a_branch_jumps_only_where_no_orbit_comes_nearer(jump: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two orbits, one a jump away at every distance, one that arrives and is found from 1e-8 of the range on."""

    def orbit(name: str, apart: float, left: float) -> Any:
        return SimpleNamespace(name=name, apart=apart, left=left, rise=1.0, signature=SimpleNamespace(cycle=name))

    def found(point: Any, common: Any, side: float, aside: float) -> list[Any]:
        if side < 0.0:
            return []
        own = [orbit("own", aside, 0.1 * aside)] if aside >= 1e-8 else []
        return [orbit("other", jump + aside, jump + 0.1 * aside), *own]

    for name, stand_in in {
        "_found": found,
        "_apart": lambda point, other: other.apart,
        "_left": lambda point, other: other.left,
        "_may_jump": lambda *sides: True,
        "_is_own": lambda point, other: False,
        "_came_by": lambda point, other, passed: False,
    }.items():
        monkeypatch.setattr(neighbours, name, stand_in)
    end = orbit("before", 0.0, 0.0)
    end.tangent, end.value, end.curve = np.array([1.0]), 0.0, SimpleNamespace(width=1.0)
    taken: Any = neighbours.beside(end)  # type: ignore[arg-type]
    assert taken.name == ("own" if jump > 1e-8 else "other")
