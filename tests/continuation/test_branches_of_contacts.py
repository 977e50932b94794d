"""Orbits, branches, derivatives and exponents of a Duffing oscillator that rubs, sticks and hits a stop."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import nonsmooth as ns
from nonsmooth.elements import Coulomb, PreloadedSpring, Stop

NAMES = ["F", "mu", "e", "X"]


@cache
def rig() -> ns.System:
    return ns.System(
        states=["x", "v"],
        parameters={"F": 1.4, "w": 0.8, "mu": 0.15, "e": 0.4, "X": 0.7},
        modes={"all": lambda t, u, p: (u.v, p.F * np.cos(p.w * t) - 0.1 * u.v - u.x - u.x**3)},
        elements={
            "a": Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction="mu", static=0.3),
            "s": Stop(gap=lambda t, u, p: p.X - u.x, on={"v": -1.0}, restitution="e"),
        },
    )


@cache
def orbit() -> ns.Orbit:
    return ns.find_orbit(rig())


def end(duration: float, **given: float) -> np.ndarray:
    values = {key: given.pop(key) for key in list(given) if key in rig().values}
    system = rig().with_parameters(values)
    return ns.simulate(system, duration=duration, samples=2, start=given, rtol=1e-13)["u"].values[-1]


def test_sensitivities_are_those_of_differences() -> None:
    found = ns.sensitivity(rig(), duration=12.0, parameters=NAMES)
    assert len(found["crossing_time"]) > 5
    for name in NAMES:
        value, h = rig().values[name], 1e-5
        difference = (end(12.0, **{name: value + h}) - end(12.0, **{name: value - h})) / (2 * h)
        assert found["P"].sel(parameter=name).values == pytest.approx(difference, abs=1e-6)


def test_an_orbit_its_sweep_and_its_exponent_agree() -> None:
    """Sticking makes one multiplier zero; the other one is that of differences of the return map."""
    period, start = 2 * np.pi / 0.8, dict(zip("xv", orbit().u, strict=True))
    assert end(period, **start) == pytest.approx(list(start.values()), abs=1e-9)
    h, columns = 1e-5, []
    for name in "xv":
        ahead, behind = (end(period, **{**start, name: start[name] + s * h}) for s in (1, -1))
        columns.append((ahead - behind) / (2 * h))
    largest = np.abs(np.linalg.eigvals(np.array(columns).T)).max()
    assert np.abs(orbit().floquet_multipliers) == pytest.approx([largest, 0.0], abs=1e-6)
    exponent = ns.lyapunov(rig(), periods=40)["exponents"].values[0]
    assert exponent == pytest.approx(np.log(largest) / period, abs=1e-6)


def test_a_branch_is_that_of_a_sweep() -> None:
    branch = ns.continue_orbit(orbit(), "F", range=(1.32, 1.42))
    loads = branch["F"].values
    assert [loads.min(), loads.max()] == pytest.approx([1.32, 1.42])
    some = np.linspace(0, len(loads) - 1, 5).astype(int)
    for i in some:
        run = ns.simulate(rig().with_parameters({"F": loads[i]}), periods=1, transient=40, samples=2)
        assert branch["section"].values[i] == pytest.approx(run["u"].values[0], abs=1e-8)


@pytest.mark.parametrize(
    ("frictions", "high"),
    [([(0.1, 0.1, 0.14)], 1.05), pytest.param([(0.25, 0.09), (0.1, 0.1, 0.14)], 1.1, marks=pytest.mark.slow)],
)
def test_frictions_of_one_coordinate_are_their_sum(frictions: list[tuple[float, ...]], high: float) -> None:
    """Two or three frictions on a mass turn at one instant: orbit, multipliers and branch are those of one friction."""

    def branch(*friction: float) -> xr.Dataset:
        rubs = {f"rub{k}": ns.elements.Coulomb(at="q2", friction=mu) for k, mu in enumerate(friction)}
        system = ns.mechanical(
            np.eye(2),
            0.1 * np.eye(2),
            [[2.0, -1.0], [-1.0, 2.0]],
            parameters={"F": 1.0, "w": 1.03},
            forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
            elements={**rubs, "other": ns.elements.Coulomb(at="q1", friction=0.29)},
        )
        return ns.continue_orbit(ns.find_orbit(system, transient=300, progress=False), "w", (1.0, high))

    one = branch(0.34)
    for friction in frictions:
        several = branch(*friction)
        assert several.sizes["special"] == one.sizes["special"] == 0
        assert several["ended_because"].values.tolist() == one["ended_because"].values.tolist()
        np.testing.assert_allclose(several["w"], one["w"], rtol=0, atol=1e-9)
        for name in ("section", "maximum", "minimum", "floquet_multipliers"):
            np.testing.assert_allclose(several[name].values, one[name].values, rtol=0, atol=1e-8, err_msg=name)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_speed_that_was_held_is_zero_where_the_block_leaves_its_belt() -> None:
    """Its rounding, as large as the slow slip that follows, once ended the branch at A = 0.5648."""

    def force(mean: float, *terms: tuple[float, float]) -> Callable[..., Any]:
        waves = [(0.798 * k, a, b) for k, (a, b) in enumerate(terms, 1)]
        return lambda t, p: mean + p.A * sum(a * np.cos(w * t) + b * np.sin(w * t) for w, a, b in waves)

    shake, belt = force(0.0, (-0.296, 0.153), (0.152, -0.281)), force(0.121, (-0.081, 0.511))
    one = {"A": 1.0}
    still = SimpleNamespace(**one)
    system = ns.mechanical(
        np.diag([0.798, 0.92, 0.912]),
        [[0.088, 0.003, 0.008], [0.003, 0.118, -0.02], [0.008, -0.02, 0.172]],
        [[1.493, 0.056, 0.153], [0.056, 2.107, -0.397], [0.153, -0.397, 2.628]],
        coordinates=["x", "y", "z"],
        parameters=one,
        forcing={
            "x": force(0.3, (-0.589, 0.549), (0.516, 0.325)),
            "y": 0.227,
            "z": force(0.387, (0.382, 0.635), (-0.38, -0.723)),
        },
        base=lambda t, p: shake(t, still),
        elements={
            "belt": Coulomb(at="x", friction=0.65, belt=lambda t, u, p: belt(t, still)),
            "one": ns.elements.Backlash(at={"x": -1.0, "z": 1.0}, half_width=0.078, stiffness=2.237),
            "two": ns.elements.Backlash(at="x", half_width=0.113, stiffness=6.988, damping=0.291),
        },
    )
    branch = ns.continue_orbit(ns.find_orbit(system.with_parameters(A=0.57), progress=False), "A", (0.56, 0.575))
    assert branch["ended"].values.tolist() == [0, 0]


@pytest.mark.physics
@pytest.mark.parametrize(
    ("begun", "ends"), [(0.355, (0.34, 0.36)), pytest.param(0.42, (0.33, 0.45), marks=pytest.mark.slow)]
)
def test_stops_out_of_reach_change_nothing(begun: float, ends: tuple[float, float]) -> None:
    """Two masses, one of them with friction: its sliding bifurcations are those beside stops that are never met, with
    which modes are made when they are visited."""

    def special(*stops: int) -> xr.Dataset:
        walls = {f"wall_{k + 1}": ns.elements.Stop(at="a", side=k, position=4.0 * k, restitution=0.6) for k in stops}
        system = ns.mechanical(
            np.eye(2),
            0.1 * np.eye(2),
            [[2.0, -1.0], [-1.0, 2.5]],
            parameters={"w": begun},
            coordinates=["a", "b"],
            forcing={"a": lambda t, p: np.cos(p.w * t)},
            elements={"rub": ns.elements.Coulomb(at="a", friction=0.05), **walls},
        )
        return ns.special_points(ns.continue_orbit(ns.find_orbit(system, transient=300), "w", ends))

    alone, beside = special(), special(1, -1)
    names = ["grazing_sliding", "adding_sliding", "switching_sliding", "grazing_sliding"]
    kinds = ["grazing", "grazing", "corner", "grazing"]
    many = 2 if ends[1] < 0.39 else 4
    assert beside["sliding"].values.tolist() == alone["sliding"].values.tolist() == names[:many]
    assert beside["kind"].values.tolist() == alone["kind"].values.tolist() == kinds[:many]
    np.testing.assert_allclose(beside["w"], alone["w"], rtol=0, atol=1e-9)


@pytest.mark.physics
@pytest.mark.parametrize(
    ("masses", "at", "ends"),
    [
        (1, 0.5, (0.85, 0.95)),
        (2, 0.4, (1.09, 1.11)),
        pytest.param(1, 0.5, (0.8, 1.0), marks=pytest.mark.slow),
        pytest.param(2, 0.4, (1.07, 1.13), marks=pytest.mark.slow),
    ],
)
def test_a_soft_stop_flush_with_a_wall_is_never_pressed(masses: int, at: float, ends: tuple[float, float]) -> None:
    """A spring that begins where a rigid wall stands closes, is struck and opens at one instant: orbit, multipliers and
    branch are those of the wall alone."""

    def branch(*soft: float) -> xr.Dataset:
        elements: dict[str, Any] = {}
        for q in ("a", "b")[:masses]:
            for side in (1, -1)[:masses]:
                for k in soft:
                    spring = ns.elements.ElasticStop(at=q, side=side, position=k * side, stiffness=20.0)
                    elements[f"soft_{q}_{side + 1}"] = spring
                wall = ns.elements.Stop(at=q, side=side, position=at * side, restitution=0.7)
                elements[f"wall_{q}_{side + 1}"] = wall
        system = ns.mechanical(
            np.eye(masses),
            0.1 * np.eye(masses),
            [[1.0]] if masses == 1 else [[2.0, -1.0], [-1.0, 2.5]],
            parameters={"w": 0.9 if masses == 1 else 1.1},
            coordinates=["a", "b"][:masses],
            forcing={"a": lambda t, p: np.cos(p.w * t)},
            elements=elements,
        )
        return ns.continue_orbit(ns.find_orbit(system, transient=300), "w", ends)

    alone, flush = branch(), branch(at)
    assert flush["ended_because"].values.tolist() == alone["ended_because"].values.tolist()
    assert flush.sizes["special"] == alone.sizes["special"] == 0
    for point in (0, -1):
        mine, its = (one.isel(point=point) for one in (alone, flush))
        np.testing.assert_allclose(its["section"], mine["section"], rtol=0, atol=1e-9)
        moduli = [np.sort(np.abs(one["floquet_multipliers"].values)) for one in (mine, its)]
        np.testing.assert_allclose(*moduli, rtol=0, atol=1e-7)


@pytest.mark.physics
@pytest.mark.parametrize(
    ("rest", "ends"),
    [
        ("closing < 0 and slow > 0 and gap < 0", (0.393, 0.3945)),
        *(
            pytest.param(rest, (0.34, 0.4), marks=pytest.mark.slow)
            for rest in ("gap < 0 and closing < 0 and slow > 0", "closing < 0 and slow > 0 and gap < 0")
        ),
    ],
)
def test_how_many_impacts_come_before_rest_is_no_special_point_in_any_order_of_conditions(
    rest: str, ends: tuple[float, float]
) -> None:
    """Of a mass that bounces to rest on a wall, written as modes: below a speed of 1e-7 an impact is completed as rest,
    and their number changes along the branch; the motion does not."""
    system = ns.System(
        states={"q": "1", "v": "1"},
        parameters={"w": 0.3935},
        modes={
            "flight": lambda t, u, p: (u.v, np.cos(p.w * t) - 0.1 * u.v - u.q),
            "rest": lambda t, u, p: (0.0 * u.q, 0.0 * u.v),
        },
        indicators={
            "gap": lambda t, u, p: 0.5 - u.q,
            "closing": lambda t, u, p: -u.v,
            "slow": lambda t, u, p: 1e-7 - u.v,
            "opens": lambda t, u, p: np.cos(p.w * t) - u.q,
        },
        transitions=[
            ns.Transition("flight", "flight", when="gap < 0 and slow < 0", reset=lambda t, u, p: (u.q, -0.5 * u.v)),
            ns.Transition("flight", "rest", when=rest, reset=lambda t, u, p: (u.q, 0.0)),
            ns.Transition("rest", "flight", when="opens < 0"),
        ],
    )
    orbit = ns.find_orbit(system, transient=60, start={"q": 0.0, "v": 0.0})
    branch = ns.continue_orbit(orbit, "w", ends)
    assert [branch["w"].values.min(), branch["w"].values.max()] == pytest.approx(ends)
    assert len(np.unique(branch["crossings_per_period"])) > 1 and branch.sizes["special"] == 0


@pytest.mark.physics
@pytest.mark.parametrize("far", [False, True], ids=["alone", "beside a stop out of reach"])
def test_a_preloaded_spring_has_the_special_points_of_two_plain_modes(far: bool) -> None:
    """The conditions by which a contact is left (fast, or slow against a load) are no events: the same mass written as
    two modes with one condition each has two special points here."""

    def pulled(t: Any, p: Any) -> Any:
        return p.f * np.cos(p.w * t) - 0.03

    def side(sign: int) -> Callable[..., Any]:
        return lambda t, u, p: (u.v, pulled(t, p) - 0.4 * u.v - 16.5 * u.q - 0.29 * sign)

    def period(p: Any) -> Any:
        return 2 * np.pi / p.w

    values = {"w": 1.84, "f": 1.21}
    plain = ns.System(
        states=["q", "v"],
        parameters=values,
        modes={"above": side(1), "below": side(-1)},
        indicators={"side": lambda t, u, p: u.q},
        transitions=[
            ns.Transition("above", "below", when="side < 0"),
            ns.Transition("below", "above", when="side > 0"),
        ],
        period=period,
    )
    elements: dict[str, Any] = {"spring": PreloadedSpring(at="q", preload=0.29, stiffness=12.5)}
    if far:
        elements["far"] = Stop(at="q", position=50.0, restitution=0.5)
    sprung = ns.mechanical(
        1.0,
        0.4,
        4.0,
        parameters=values,
        forcing={"q": pulled},
        elements=elements,
        coordinates=["q"],
        period=period,
    )
    found = []
    for system in (plain, sprung):
        branch = ns.continue_orbit(ns.find_orbit(system, transient=200), "w", (1.8, 2.2), points=300)
        at = branch["w"].values[branch["special_point"].values]
        found.append(sorted(zip(at.tolist(), branch["special_kind"].values.tolist(), strict=True)))
    assert [kind for _, kind in found[0]] == [kind for _, kind in found[1]] == ["grazing", "grazing"]
    np.testing.assert_allclose([at for at, _ in found[1]], [at for at, _ in found[0]], rtol=0, atol=1e-9)


def test_a_rubbing_mass_grazes_a_wall_once() -> None:
    """Impacts below the creep speed that lift off again rebound as faster ones do: behind the graze no other special
    point follows. It is where the motion without the wall reaches it."""
    elements: dict[str, Any] = {"rub": Coulomb(at="q", friction=0.075)}

    def model(**more: Any) -> ns.System:
        return ns.mechanical(
            1.0,
            0.15,
            2.0,
            forcing={"q": lambda t, p: 0.27 * p.F * np.cos(1.85 * t)},
            parameters={"F": 1.0},
            elements=elements | more,
        )

    system, free = model(wall=Stop(at="q", position=0.4, restitution=0.6)), model()
    assert system.traced.patterns is not None  # its modes are made when they are visited
    branch = ns.continue_orbit(ns.find_orbit(system), "F", (0.8, 2.4))
    special = ns.special_points(branch)
    assert special["kind"].values.tolist() == ["grazing", "fold"]
    assert len(set(branch["signature"].values.tolist())) == 2

    def beyond(F: float) -> float:
        run = ns.simulate(free.with_parameters(F=F), periods=2, transient=60)
        return float(run["u"].sel(state="q").max()) - 0.4

    assert float(special["F"][0]) == pytest.approx(brentq(beyond, 1.5, 2.4, xtol=1e-6), abs=2e-5)
