"""Contacts and frictions that decide together, against closed forms."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import block_diag, expm
from scipy.optimize import brentq

import nonsmooth as ns
from nonsmooth.elements import Coulomb, ElasticStop, PreloadedSpring, Stop
from nonsmooth.system.description import describe

Force = Callable[[Any, Any], Any]


@pytest.fixture(params=["visited", "rows", "series"], autouse=True)
def calculus(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Ask by rows, in modes that are visited or written out, and by series as where something is not affine."""
    if request.param == "rows":
        monkeypatch.setattr("nonsmooth.system.system.describe", partial(describe, written=True))
    if request.param == "series":
        monkeypatch.setattr("nonsmooth.system.derived.combinations._affine", lambda *given: None)
    return str(request.param)


def one(force: Force | None = None, *, mass: float = 1.0, c: float = 0.0, k: float = 0.0, **elements: Any) -> ns.System:
    """One mass q with elements."""
    forcing = {"q": force} if force else None
    return ns.mechanical(mass, c, k, parameters={}, forcing=forcing, elements=elements, coordinates=["q"])


def carts(n: int, loads: tuple[float, ...] = (), **elements: Any) -> ns.System:
    """Unit masses without springs under constant loads."""
    forcing = {f"q{i + 1}": (lambda t, p, load=load: load) for i, load in enumerate(loads)} or None
    return ns.mechanical(np.eye(n), 0 * np.eye(n), 0 * np.eye(n), parameters={}, forcing=forcing, elements=elements)


def end(run: xr.Dataset) -> np.ndarray:
    return run["u"].values[-1]


# Impacts


def test_a_plastic_wall_keeps_what_hits_it() -> None:
    run = ns.simulate(one(wall=Stop(at="q", position=1.0)), start={"v_q": 0.5}, duration=6)
    assert run["crossing_time"].values == pytest.approx([2.0], rel=1e-14)
    assert np.array_equal(end(run), [1.0, 0.0])


def test_two_carts_go_on_together() -> None:
    system = carts(2, s=Stop(at={"q1": 1, "q2": -1}, position=0.0))
    run = ns.simulate(system, start={"q1": -1.0, "v_q1": 0.5}, duration=4)
    assert run["crossing_time"].values == pytest.approx([2.0], rel=1e-14)
    assert end(run) == pytest.approx([0.5, 0.5, 0.25, 0.25], abs=1e-14)


def test_a_mass_stuck_to_a_belt_is_stopped() -> None:
    system = one(
        lambda t, p: 0.3 * np.cos(0.7 * t),
        c=0.05,
        k=1.0,
        f=Coulomb(at="q", friction=1.2, belt=-0.5),
        s=Stop(at="q", position=0.2, side=-1),
    )
    run = ns.simulate(system, start={"q": 0.8, "v_q": -0.5}, duration=6)
    assert run["crossing_time"].values == pytest.approx([1.2], rel=1e-13)
    assert end(run) == pytest.approx([0.2, 0.0], abs=1e-14)


@pytest.mark.parametrize(("e", "after"), [(1.0, (-1 / 3, 2 / 3, 2 / 3)), (0.0, (1 / 3, 1 / 3, 1 / 3))])
def test_three_balls_that_touch(e: float, after: tuple[float, ...]) -> None:
    """Newton's law over both contacts at once."""
    first, last = {"q1": 1, "q2": -1}, {"q2": 1, "q3": -1}
    system = carts(3, a=Stop(at=first, position=0.0, restitution=e), b=Stop(at=last, position=0.0, restitution=e))
    run = ns.simulate(system, start={"v_q1": 1.0}, duration=1)
    assert end(run) == pytest.approx([*after, *after], abs=1e-14)


@pytest.mark.parametrize(("e", "after"), [(1.0, (-0.5, 0.5, 0.5, 0.5)), (0.0, (0.25, 0.25, 0.25, 0.25))])
def test_four_balls_that_touch(e: float, after: tuple[float, ...]) -> None:
    """The first contact and the last one do not feel each other: impulses (1 + e) / 4 of 3, 2 and 1."""
    stops = {f"s{i}": Stop(at={f"q{i}": 1, f"q{i + 1}": -1}, position=0.0, restitution=e) for i in (1, 2, 3)}
    run = ns.simulate(carts(4, **stops), start={"v_q1": 1.0}, duration=1)
    assert end(run) == pytest.approx([*after, *after], abs=1e-14)


def test_a_moving_stop_hits_a_mass_at_rest() -> None:
    run = ns.simulate(one(s=Stop(at="q", position=lambda t, u, p: -1.0 * t, restitution=1.0)), start={}, duration=1)
    assert end(run) == pytest.approx([-2.0, -2.0], abs=1e-14)


@pytest.mark.parametrize("e", [0.5, 0.99, 0.999])
def test_a_ball_rests_when_its_bounces_end(e: float) -> None:
    """At sqrt(2 h / g) (1 + e) / (1 - e), less the tail 2 w / (g (1 - e)) of impacts slower than the creep w."""
    creep, g = 1e-7, 2.0
    system = one(lambda t, p: -g, s=Stop(at="q", position=0.0, side=-1, restitution=e, creep=creep))
    whole = np.sqrt(2 / g) * (1 + e) / (1 - e)
    run = ns.simulate(system, start={"q": 1.0}, duration=1.01 * whole, samples=2)
    assert end(run) == pytest.approx([0.0, 0.0], abs=1e-15)
    left = whole - run["crossing_time"].values[-1]
    assert -1e-9 * whole < left < 2 * creep / (g * (1 - e)) + 1e-9 * whole
    fall = -np.sqrt(2 * g)
    speeds = run["u_before"].values[:, 1]
    assert speeds == pytest.approx(fall * e ** np.arange(len(speeds)), rel=1e-9)


# Two plastic stops: a mass rests at one, leaves it where the force turns, and flies to the other


def arrival(w: float) -> float:
    """Return the phase at which the mass arrives at the other stop; it left where the load turned, at 3 pi / 2."""
    c, begin = 0.2, 1.5 * np.pi
    X, Y = np.linalg.solve([[-w * w, c * w], [-c * w, -w * w]], [1.0, 0.0])  # X cos wt + Y sin wt

    def short(phase: float) -> float:
        free = -w * X / c * (1 - np.exp(-c * (phase - begin) / w))
        return float(free + X * np.cos(phase) + Y * (np.sin(phase) + 1) - 2)

    return float(brentq(short, begin + 0.1, begin + 2 * np.pi, xtol=1e-15))


@cache
def two_stops(calculus: str) -> ns.System:
    return ns.mechanical(
        1.0,
        0.2,
        0.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"a": Stop(at="q", position=1.0), "b": Stop(at="q", position=-1.0, side=-1)},
    )


def visits(w: float, calculus: str) -> tuple[list[tuple[float, float]], int]:
    """Speed before and load of each impact of four periods, and the number of departures."""
    run = ns.simulate(two_stops(calculus).with_parameters({"w": w}), periods=4, transient=50)
    before, after = run["u_before"].values[:, 1], run["u_after"].values[:, 1]
    hit = before != after
    loads = np.cos(w * run["crossing_time"].values)
    return list(zip(before[hit], loads[hit], strict=True)), int((~hit).sum())


@pytest.mark.parametrize("w", np.linspace(0.8, 1.2, 9))
def test_two_plastic_stops_are_hit_twice_a_period(w: float, calculus: str) -> None:
    struck, left = visits(w, calculus)
    assert len(struck) == 8
    assert left == (8 if w < 1.1598356214676 else 0)


def test_where_sticking_at_two_plastic_stops_ends(calculus: str) -> None:
    """A flight from one turn of the load ends there at the next."""
    limit = brentq(lambda w: arrival(w) - 2.5 * np.pi, 1.0, 1.3, xtol=1e-14)
    assert limit == pytest.approx(1.1598356214676, abs=1e-12)
    assert visits(limit - 1e-6, calculus)[1] == 8
    assert visits(limit + 1e-6, calculus)[1] == 0


# Friction


def test_a_load_as_large_as_the_friction_stops_a_mass() -> None:
    mu = 0.5
    run = ns.simulate(one(lambda t, p: mu, f=Coulomb(at="q", friction=mu)), start={"v_q": -1.0}, duration=5)
    assert run["crossing_time"].values == pytest.approx([1 / (2 * mu)], rel=1e-14)
    assert end(run) == pytest.approx([-1 / (4 * mu), 0.0], abs=1e-15)


@pytest.mark.parametrize(
    ("force", "friction"),
    [
        (
            lambda t, p: 0.5,
            {"friction": 0.3, "static": 0.6},
        ),  # static and kinetic friction both have a solution: it stays
        (lambda t, p: 0.5 * np.cos(t), {"friction": 0.5}),  # the load equals the friction and falls
    ],
    ids=["static", "tie"],
)
def test_what_can_stick_does(force: Force, friction: dict[str, float]) -> None:
    run = ns.simulate(one(force, f=Coulomb(at="q", **friction)), start={}, duration=20)
    assert not run["u"].values.any()


def test_a_load_that_grows_beyond_the_friction_moves_the_mass_at_once() -> None:
    """With .5 + .3 sin t at friction .5 the speed .3 (1 - cos t) is zero at 2 pi, and the mass does not stick there."""
    run = ns.simulate(one(lambda t, p: 0.5 + 0.3 * np.sin(t), f=Coulomb(at="q", friction=0.5)), start={}, periods=2)
    t = run["time"].values
    assert run["u"].values[:, 0] == pytest.approx(0.3 * (t - np.sin(t)), abs=1e-12)


@pytest.mark.parametrize("order", ["ab", "ba"])
def test_frictions_that_hold_together(order: str) -> None:
    rubs = {"a": Coulomb(at="q", friction=0.3, static=0.6), "b": Coulomb(at="q", friction=0.3)}
    system = one(lambda t, p: 0.75 * np.sin(0.5 * t), **{name: rubs[name] for name in order})
    run = ns.simulate(system, start={}, periods=3, samples=61)
    assert not run["u"].values.any()
    forces = run["a_force"].values + run["b_force"].values
    assert forces == pytest.approx(-0.75 * np.sin(0.5 * run["time"].values), abs=1e-12)


@pytest.mark.parametrize(
    ("rubs", "loads", "accelerations"),
    [
        (
            ({"at": "q1", "friction": 2, "static": 5}, {"at": {"q1": 1, "q2": -1}, "friction": 2}),
            (-5.0, -6.0),
            (-4.5, -4.5),
        ),
        (
            ({"at": {"q1": 1, "q2": 1}, "friction": 1, "static": 6}, {"at": "q1", "friction": 2, "static": 3}),
            (-2.0, -8.0),
            (0.0, -7.0),
        ),
    ],
)
def test_what_slips_is_looked_at_with_kinetic_friction(rubs: Any, loads: Any, accelerations: Any) -> None:
    """Once it slips, all that could hold is asked again with its static friction."""
    run = ns.simulate(carts(2, loads, a=Coulomb(**rubs[0]), b=Coulomb(**rubs[1])), start={}, duration=0.5)
    a = np.array(accelerations)
    assert end(run) == pytest.approx([*(a / 8), *(a / 2)], abs=1e-14)


def between(mass: float) -> tuple[xr.Dataset, np.ndarray]:
    """A mass with friction between two stops, which rests at both and is stuck there; and where it is held."""
    system = one(
        lambda t, p: np.cos(1.1 * t),
        mass=mass,
        c=0.1,
        k=1.0,
        f=Coulomb(at="q", friction=0.1),
        a=Stop(at="q", position=0.5, restitution=0.5),
        b=Stop(at="q", position=-0.5, side=-1),
    )
    run = ns.simulate(system, periods=10)
    held = [any(word in name for word in ("stick", "rest")) for name in system.modes]
    return run, np.array(held)[run["mode"].values]


MASSES = [0.7, 0.838, 1.35]
OTHERS = [mass for mass in np.arange(0.55, 1.45, 0.05).round(3) if mass not in MASSES]


@pytest.mark.parametrize("mass", MASSES + [pytest.param(mass, marks=pytest.mark.slow) for mass in OTHERS])
def test_hyperstatic_contacts_hold_at_any_mass(mass: float) -> None:
    """More forces hold the mass than it has coordinates: no determinant is asked whether it is zero."""
    run, held = between(mass)
    q, v = run["u"].values.T
    assert abs(q).max() <= 0.5 + 1e-12
    assert held.sum() > 50 and abs(v[held]).max() < 1e-15
    forces = -run["a_force"].values + run["b_force"].values + run["f_force"].values
    load = np.cos(1.1 * run["time"].values) - q
    assert abs((forces + load)[held]).max() < 1e-10


def test_forces_of_hyperstatic_contacts_lie_within_their_bounds() -> None:
    run, _ = between(0.838)
    assert abs(run["f_force"].values).max() <= 0.1 + 1e-12
    assert min(run[f"{name}_force"].values.min() for name in ("a", "b")) >= -1e-12


def test_forces_of_frictions_that_hold_together_lie_within_their_bounds() -> None:
    """Of least norm within the bounds: .45 and .3 under .75."""
    system = one(
        lambda t, p: 0.75 * np.sin(0.5 * t),
        a=Coulomb(at="q", friction=0.3, static=0.6),
        b=Coulomb(at="q", friction=0.3),
    )
    run = ns.simulate(system, start={}, duration=np.pi, samples=3)
    assert run["a_force"].values[-1] == pytest.approx(-0.45, abs=1e-12)
    assert run["b_force"].values[-1] == pytest.approx(-0.3, abs=1e-12)


def test_a_preloaded_spring_holds_and_lets_go() -> None:
    """Under .5 sin t with preload .4 it moves where sin t = .8."""
    system = one(lambda t, p: 0.5 * np.sin(t), c=0.1, p=PreloadedSpring(at="q", preload=0.4, stiffness=1.0))
    run = ns.simulate(system, start={}, duration=1.2)
    assert run["crossing_time"].values == pytest.approx([np.arcsin(0.8)], rel=1e-12)
    assert not run["u"].values[run["time"].values < 0.92].any()
    assert run["p_force"].values[0] == 0.0
    still = one(lambda t, p: 0.3 * np.sin(t), p=PreloadedSpring(at="q", preload=0.4))
    run = ns.simulate(still, start={"v_q": 0.0}, duration=20)
    assert not run["u"].values.any()
    assert run["p_force"].values == pytest.approx(-0.3 * np.sin(run["time"].values), abs=1e-14)


@pytest.mark.parametrize("c", [0.5, -0.5])
@pytest.mark.parametrize("rubbing", [False, True])
def test_one_breaks_away_and_the_damper_between_them_decides_about_the_other(c: float, rubbing: bool) -> None:
    """M = [[2, 1], [1, 2]] at rest under loads 3 and -.5 with bounds 2 and 1: the first breaks away with a1 = 1/2, and
    the force .5 + a1 - c v1 on the second is at its bound, from which the damper takes it (c > 0) or drives it on. Its
    damper to the ground does nothing to what rests, and would decide if forces of this instant were a little others. A
    block that rests on a floor with friction beside them changes nothing: all combinations are tried then."""
    M, C, t = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([[c, -c], [-c, c + 5.0]]), 0.5
    elements: Any = {"a": Coulomb(at="q1", friction=2.0), "b": Coulomb(at="q2", friction=1.0)}
    loads: Any = {"q1": lambda t, p: 3.0, "q2": lambda t, p: -0.5}
    masses, dampers = M, C
    if rubbing:
        masses, dampers = block_diag(M, np.eye(2)), block_diag(C, np.zeros((2, 2)))
        elements |= {"floor": Stop(at="q4", side=-1, friction=0.3, tangent="q3")}
        loads |= {"q4": lambda t, p: -9.81}
    system = ns.mechanical(masses, dampers, 0 * dampers, parameters={}, forcing=loads, elements=elements)
    moving = M, C, [1.0, 0.5]  # the speeds follow M a + C v = loads less frictions
    held = M[:1, :1], C[:1, :1], [1.0]
    inertia, damping, load = held if c > 0 else moving
    n = len(load)
    A = np.zeros((n + 1, n + 1))
    A[:n] = np.linalg.solve(inertia, np.column_stack([-damping, load]))
    exact = np.append(expm(t * A)[:n, n], np.zeros(2))
    run = ns.simulate(system, duration=t)
    speeds = end(run)[len(masses) :]
    assert not run.sizes["crossing"]  # a wrong decision would be taken back at once
    assert speeds == pytest.approx([*exact[:2], *np.zeros(len(masses) - 2)], abs=1e-12)


# Modes, resets and memory of the system's own beside elements that decide together

PULL: dict[str, Any] = {"on": {"v": 1.0}}
HOLDS = {
    "a": Coulomb(speed=lambda t, u, p: u.v, friction=0.2, static=0.35, **PULL),
    "b": Coulomb(speed=lambda t, u, p: u.v, friction=0.1, **PULL),
    "s": Stop(gap=lambda t, u, p: 0.9 - u.x, on={"v": -1.0}, restitution=0.3),
}


def block(pull: Any = lambda u, p: 0 * u.x, **given: Any) -> ns.System:
    """A block with two frictions and a stop."""
    usual: dict[str, Any] = {"modes": {"all": lambda t, u, p: (u.v, pull(u, p))}, "elements": HOLDS, "parameters": {}}
    return ns.System(states=["x", "v"], **(usual | given))


@cache
def spring_at_four_tenths(calculus: str) -> tuple[ns.System, ns.System]:
    """A spring that is met at .4, as two modes and as an element."""

    def field(k: float) -> Any:
        return lambda t, u, p: (u.v, 1.6 * np.cos(0.7 * t) - 0.05 * u.v - u.x - k * (u.x - 0.4))

    modes = block(
        modes={"soft": field(0.0), "hard": field(5.0)},
        indicators={"g": lambda t, u, p: u.x - 0.4},
        transitions=[ns.Transition("soft", "hard", when="g > 0"), ns.Transition("hard", "soft", when="g < 0")],
    )
    spring = ElasticStop(gap=lambda t, u, p: 0.4 - u.x, on={"v": -1.0}, stiffness=5.0)
    return modes, block(modes={"all": field(0.0)}, elements={**HOLDS, "spring": spring})


@pytest.mark.parametrize("start", [[0.6, 0.2], [0.0, 0.0]])
def test_modes_of_the_systems_own_are_those_of_an_elastic_stop(start: list[float], calculus: str) -> None:
    """A run may begin in either mode."""
    grid = np.linspace(0, 5 * 2 * np.pi / 0.7, 101)
    systems = spring_at_four_tenths(calculus)
    one, other = (ns.simulate(system, duration=grid[-1], samples=grid, start=start) for system in systems)
    assert len(one["crossing_time"]) == len(other["crossing_time"]) > 40
    assert one["u"].values == pytest.approx(other["u"].values, abs=1e-12)


@pytest.mark.parametrize("kick", [0.3, 0.9])
def test_a_reset_of_the_systems_own_sets_free_what_sticks(kick: float) -> None:
    """Kicked at a quarter of the period, the block comes to rest by .3; faster ones hit the stop at .9."""
    system = block(
        period=2 * np.pi,
        transitions=[ns.Transition("all", "all", at=0.25, reset=lambda t, u, p: (u.x, u.v + kick))],
    )
    run = ns.simulate(system, duration=6.0, start=[0.0, 0.0])
    if kick**2 / 0.6 < 0.9:
        assert run["crossing_time"].values[-1] == pytest.approx(np.pi / 2 + kick / 0.3, rel=1e-12)
        assert end(run) == pytest.approx([kick**2 / 0.6, 0.0], abs=1e-14)
    else:
        back = 0.3 * np.sqrt(kick**2 - 0.54)  # behind the impact
        assert end(run) == pytest.approx([0.9 - back**2 / 0.6, 0.0], abs=1e-14)


def test_memory_of_the_systems_own_loads_what_sticks() -> None:
    system = block(
        lambda u, p: p.load,
        memory={"load": ""},
        period=2 * np.pi,
        transitions=[ns.Transition("all", "all", at=0.25, write={"load": lambda t, u, p: 0.5})],
    )
    run = ns.simulate(system, duration=3.0, start=[0.0, 0.0])
    gone = 3.0 - np.pi / 2
    assert end(run) == pytest.approx([0.1 * gone**2, 0.2 * gone], abs=1e-14)


# Nothing depends on threads or on the order of elements


def rig(order: str = "abs") -> ns.System:
    elements = {
        "a": Coulomb(at="q1", friction=0.2),
        "b": Coulomb(at={"q1": 1, "q2": -1}, friction=0.1, static=0.15),
        "s": Stop(at={"q1": 1, "q2": -1}, position=0.2, restitution=0.5),
    }
    return ns.mechanical(
        [[1.0, 0.0], [0.0, 1.3]],
        [[0.1, -0.05], [-0.05, 0.1]],
        [[2.0, -1.0], [-1.0, 2.0]],
        parameters={"w": 0.7, "F": 0.8},
        forcing={"q1": lambda t, p: p.F * np.cos(p.w * t)},
        elements={name: elements[name] for name in order},
    )


@pytest.mark.parametrize("calculus", ["visited", "rows", pytest.param("series", marks=pytest.mark.slow)], indirect=True)
def test_the_order_of_elements_changes_nothing() -> None:
    grid, found = np.linspace(0, 6 * 2 * np.pi / 0.7, 121), []
    for order in ("abs", "sba"):
        run = ns.simulate(rig(order), duration=grid[-1], samples=grid)
        assert len(run["crossing_time"]) > 20
        found.append(run)
    xr.testing.assert_identical(found[0].drop_attrs(), found[1].drop_attrs())


@pytest.mark.parametrize(
    "calculus", ["visited", *(pytest.param(one, marks=pytest.mark.slow) for one in ("rows", "series"))], indirect=True
)
def test_threads_change_nothing(calculus: str) -> None:
    system = rig()
    systems = system, rig() if calculus == "visited" else system  # each visits its modes itself
    one, two = (
        ns.chart(each, {"w": [0.6, 0.7], "F": [0.8, 0.9]}, threads=n, transient=20, progress=False)
        for n, each in enumerate(systems, start=1)
    )
    xr.testing.assert_identical(one.drop_attrs(), two.drop_attrs())


def charted(store: Path) -> xr.Dataset:
    """A plane whose chunks visit modes of their own, made when they are visited."""
    plane = {"w": [0.6, 0.9], "F": [0.5, 0.8, 1.1, 1.5]}
    return ns.chart(rig(), plane, threads=1, transient=20, store=store, progress=False)


@pytest.mark.parametrize("calculus", ["rows"], indirect=True)
def test_a_kill_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A chart that is killed between two chunks and gone on with by another process is that of one run, bit for bit."""
    pytest.importorskip("zarr")
    monkeypatch.setattr("nonsmooth.system.derived.combinations.MOST", 1)
    monkeypatch.setattr("nonsmooth.diagrams.chart.CHUNK", 1)
    whole = charted(tmp_path / "whole.zarr")
    process = multiprocessing.get_context("fork").Process(target=charted, args=(tmp_path / "killed.zarr",))
    process.start()
    while len(done := list((tmp_path / "killed.zarr" / "run").glob("0*.json"))) < 3 and process.is_alive():
        time.sleep(0.01)
    process.kill()
    process.join()
    assert len(done) < 8
    xr.testing.assert_identical(whole.drop_attrs(), charted(tmp_path / "killed.zarr").drop_attrs())
