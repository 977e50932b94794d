"""Mechanical systems, elements and maps against closed forms and SciPy's matrix exponential, through verbs alone."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import nonsmooth as ns

E = ns.elements
pytestmark = pytest.mark.physics
#: So many other stops, never met, that all combinations cannot be written out.
FAR = {f"far_{i}": E.Stop(at="q", position=100.0 + i) for i in range(8)}


@pytest.fixture(scope="module", params=["written out", "patterns"])
def others(request: pytest.FixtureRequest) -> dict[str, Any]:
    return {} if request.param == "written out" else FAR


def end(run: Any) -> np.ndarray:
    return run["u"].values[-1]


def test_a_base_that_moves_is_the_absolute_frame() -> None:
    """x'' + c (x' - y') + k (x - y) = 0 with y = Y cos wt: x - y = Re w^2 Y / (k - w^2 + i c w) e^(iwt)."""
    c, k, w, Y = 0.3, 2.0, 1.1, 0.4
    relative = w**2 * Y / (k - w**2 + 1j * c * w)
    system = ns.mechanical(
        1.0, c, k, parameters={"w": w, "Y": Y}, base=lambda t, p: -p.Y * p.w**2 * np.cos(p.w * t), coordinates=["q"]
    )
    run = ns.simulate(system, periods=2.3, start={"q": relative.real, "v_q": (1j * w * relative).real})
    wave = relative * np.exp(1j * w * run["time"].values)
    assert run["u"].sel(state="q").values == pytest.approx(wave.real, abs=1e-10)
    assert run["u"].sel(state="v_q").values == pytest.approx((1j * w * wave).real, abs=1e-10)


@pytest.mark.parametrize(
    ("C", "K"),
    [
        ([[0.1, -1.2], [1.2, 0.1]], [[3.0, 0.0], [0.0, 1.0]]),  # gyroscopic
        ([[0.1, 0.0], [0.0, 0.2]], [[3.0, -0.4], [0.9, 1.0]]),  # a follower force
    ],
)
def test_damping_and_stiffness_need_not_be_symmetric(C: list[list[float]], K: list[list[float]]) -> None:
    M = np.array([[2.0, 0.3], [0.3, 1.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    start = np.array([0.5, -0.2, 0.1, 0.7])
    run = ns.simulate(ns.mechanical(M.tolist(), C, K, parameters={}), duration=3.0, start=start)
    assert end(run) == pytest.approx(scipy.linalg.expm(3.0 * A) @ start, abs=1e-10)


def test_an_impact_on_a_wall_that_moves_harmonically(others: dict[str, Any]) -> None:
    """Without force q = v t until it meets 1 + a sin wt + b cos wt; then v' = (1 + e) wall' - e v."""
    a, b, w, e, v = 0.3, 0.1, 2.0, 0.5, 1.5

    def wall(t: Any) -> Any:
        return 1.0 + a * np.sin(w * t) + b * np.cos(w * t)

    stop = E.Stop(at="q", position=lambda t, u, p: 1.0 + a * np.sin(p.w * t) + b * np.cos(p.w * t), restitution=e)
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={"w": w}, elements={"wall": stop, **others}, coordinates=["q"])
    run = ns.simulate(system, duration=1.2, start={"v_q": v})
    at = scipy.optimize.brentq(lambda t: v * t - wall(t), 0.5, 1.0, xtol=1e-14)
    after = (1 + e) * w * (a * np.cos(w * at) - b * np.sin(w * at)) - e * v
    assert run["crossing_time"].values == pytest.approx([at], abs=1e-12)
    assert end(run) == pytest.approx([wall(at) + after * (1.2 - at), after], abs=1e-11)


def test_what_sticks_to_a_belt_that_moves_harmonically_moves_with_it(others: dict[str, Any]) -> None:
    """Its acceleration, at most .66, stays below the friction of 1: v = V sin wt, q = V (1 - cos wt) / w."""
    V, w = 0.6, 1.1
    belt = E.Coulomb(at="q", friction=1.0, belt=lambda t, u, p: V * np.sin(p.w * t))
    system = ns.mechanical(1.0, 0.0, 0.0, parameters={"w": w}, elements={"belt": belt, **others}, coordinates=["q"])
    run = ns.simulate(system, duration=7.0)
    assert end(run) == pytest.approx([V * (1 - np.cos(w * 7.0)) / w, V * np.sin(w * 7.0)], abs=1e-9)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_mass_that_rests_on_a_stop_goes_where_the_stop_goes(others: dict[str, Any], direction: str) -> None:
    """Pressed by 2 + .1 cos t against its own spring it rests at q = d, whether d falls under it or away from it."""
    stop = E.Stop(at="q", position="d")
    system = ns.mechanical(
        1.0,
        0.2,
        1.0,
        parameters={"d": 0.5, "w": 1.0},
        forcing={"q": lambda t, p: 2.0 + 0.1 * np.cos(p.w * t)},
        elements={"stop": stop, **others},
        coordinates=["q"],
    )
    values = np.linspace(0.5, 0.8, 4)
    swept = ns.sweep(
        system, "d", values, direction=direction, start={"q": 0.5}, transient=20, keep=3, max_period=1, progress=False
    )
    section = swept["section"].squeeze().transpose("d", "iterate", "state").values
    assert section[..., 0] == pytest.approx(np.repeat(swept["d"].values[:, None], 3, axis=1), abs=1e-9)
    assert section[..., 1] == pytest.approx(0.0, abs=1e-9)
    assert (swept["period_number"].values == 1).all()


def test_a_stop_that_moves_in_time_pushes_the_mass() -> None:
    stop = E.Stop(at="q", position=lambda t, u, p: p.d - t / 60)
    system = ns.mechanical(
        1.0,
        0.2,
        1.0,
        parameters={"d": 0.8},
        forcing={"q": lambda t, p: 2.0},
        elements={"stop": stop},
        coordinates=["q"],
    )
    run = ns.simulate(system, duration=0.6, start={"q": 0.8, "v_q": -1 / 60})
    assert run["u"].sel(state="q").values == pytest.approx(0.8 - run["time"].values / 60, abs=1e-12)
    with pytest.raises(ValueError, match="a ramp moves element 'stop'"):
        ns.simulate(system, duration=0.6, start={"q": 0.8}, ramps={"d": (0.8, 0.79)})


def test_an_impact_slower_than_creep_under_a_pull_rebounds(others: dict[str, Any]) -> None:
    """q'' = -1 pulls away from the stop at 1/2, met at 0.05 < creep: it leaves at e times that speed, and no faster."""
    v = 0.05
    stop = E.Stop(at="q", position=0.5, restitution=0.5, creep=0.1)
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"w": 1.0},
        forcing={"q": lambda t, p: -1.0 + 0.0 * np.cos(p.w * t)},
        elements={"stop": stop, **others},
        coordinates=["q"],
    )
    first = np.sqrt(1.0 + v**2)  # v0^2 = v^2 + 2 * 1/2
    run = ns.simulate(system, duration=first - v + 0.3, start={"v_q": first})
    assert run["crossing_time"].values == pytest.approx([first - v], abs=1e-10)
    assert end(run) == pytest.approx([0.5 - 0.5 * v * 0.3 - 0.045, -0.5 * v - 0.3], abs=1e-10)


def test_what_was_taken_off_a_surface_decays_at_the_same_rate_whatever_its_gradient() -> None:
    """Beside the surface a motion with a field of its own comes back as e^(-t): h = L (x + 2 y) for every L."""
    from nonsmooth import Surface, System

    for length in (1.0, 30.0):
        system = System(
            states=["x", "y"],
            parameters={"L": length},
            modes={"below": lambda t, u, p: (1.0, 0.5), "above": lambda t, u, p: (1.0, -2.0)},
            indicators={"h": lambda t, u, p: p.L * (u.x + 2 * u.y)},
            transitions=[Surface("h", below="below", above="above", field=lambda t, u, p: (2.0, -1.0))],
        )
        off = 1e-9
        run = ns.simulate(system, duration=1.5, start={"x": off}, mode="h_sliding")
        x, y = end(run)
        assert x + 2 * y == pytest.approx(off * np.exp(-1.5), rel=1e-4)
        assert [x, y] == pytest.approx([3.0, -1.5], abs=1e-8)


def test_a_gap_between_regions_of_a_map_is_shown_in_the_units_of_its_states() -> None:
    """The regions x < 200 and x > 500 leave out what lies between them: the message names a point of it."""
    still = lambda u, p: (0.5 * u.x,)
    with pytest.raises(ns.SystemDefinitionError, match="lies in no region") as caught:
        ns.Map(
            states=["x"],
            parameters={"a": 1.0},
            scale={"x": 100.0},
            branches=[ns.Branch(still, when="low < 0"), ns.Branch(still, when="high > 0")],
            indicators={"low": lambda u, p: u.x - 200 * p.a, "high": lambda u, p: u.x - 500 * p.a},
        )
    assert 200.0 < float(re.search(r"x = (\S+) lies", str(caught.value))[1]) < 500.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("growth", [1.0, -1.0])
def test_one_breaks_away_and_how_its_friction_grows_decides_about_the_other(side: float, growth: float) -> None:
    """M = [[2, 1], [1, 2]] at rest under loads 3 and -.5 with bounds 2 + r t and 1: the first breaks away with
    a1 = (1 - r t) / 2, the force on the second is -.5 - a1, which is at its bound at t = 0. It holds where r > 0, and
    else both move, M a = (1 - r t, .5)."""
    system = ns.mechanical(
        [[2.0, 1.0], [1.0, 2.0]],
        np.zeros((2, 2)),
        np.zeros((2, 2)),
        forcing={"q1": lambda t, p: p.f + 0 * t, "q2": lambda t, p: p.h + 0 * t},
        parameters={"f": 3.0 * side, "h": -0.5 * side, "r": growth},
        elements={
            "a": ns.elements.Coulomb(at="q1", friction=lambda t, u, p: 2.0 + p.r * t),
            "b": ns.elements.Coulomb(at="q2", friction=1.0),
        },
    )
    t, speeds = 0.5, ns.simulate(system, duration=0.5).u.values[-1, 2:]
    impulse = t - growth * t**2 / 2
    exact = [impulse / 2, 0.0] if growth > 0 else np.linalg.solve([[2.0, 1.0], [1.0, 2.0]], [impulse, 0.5 * t])
    np.testing.assert_allclose(speeds, side * np.asarray(exact), atol=1e-13)


def test_masses_of_a_chain_are_positive_definite_up_to_the_known_coupling() -> None:
    """M = m I + d (each with its neighbours), n = 20: its least eigenvalue is m - 2 |d| cos(pi / (n + 1))."""
    n = 20

    def masses(p: Any) -> Any:
        near = {0: p.m, 1: p.d}
        return [[near.get(abs(i - j), 0.0) for j in range(n)] for i in range(n)]

    system = ns.mechanical(masses, np.eye(n), np.eye(n), parameters={"m": 2.0, "d": 0.1})
    edge = 1.0 / np.cos(np.pi / (n + 1))
    for sign in (1.0, -1.0):
        assert system.with_parameters(d=sign * 0.9999 * edge)
        with pytest.raises(ValueError, match="the mass matrix must be positive definite"):
            system.with_parameters(d=sign * 1.0001 * edge)


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize("speed", [0.0, 1e-15, -1e-15, 1e-12, -1e-12, -1e-9, -1e-6, -9e-5, -1e-3, 1e-6])
def test_a_slip_however_small_turns_round_under_a_load_beyond_friction(speed: float, method: str) -> None:
    """A block at this speed, under a load of 1 and friction of 0.3, is at v0 + 0.7 t, or turns after -v0 / 1.3."""
    friction = ns.elements.Coulomb(at="q", friction=0.3)
    block = ns.mechanical(1.0, 0.0, 0.0, forcing={"q": lambda t, p: 1.0}, elements={"f": friction}, coordinates="q")
    run = ns.simulate(block, duration=2.0, start={"v_q": speed}, method=method)
    end = speed + 0.7 * 2.0 if speed >= 0 else 0.7 * (2.0 + speed / 1.3)
    assert float(run["u"].sel(state="v_q")[-1]) == pytest.approx(end, abs=1e-14)


@pytest.mark.parametrize("load", [0.3, -0.3, 0.2999999])
def test_a_load_as_large_as_the_friction_holds(load: float) -> None:
    friction = ns.elements.Coulomb(at="q", friction=0.3)
    block = ns.mechanical(1.0, 0.0, 0.0, forcing={"q": lambda t, p: load}, elements={"f": friction}, coordinates="q")
    start = {"v_q": -0.6 * np.sign(load)}  # its deceleration is the load and the friction: 0.6
    run = ns.simulate(block, duration=3.0, start=start)
    assert run["mode"].values[-1] == list(block.modes).index("f_stick")
    assert float(run["u"].sel(state="q")[-1]) == pytest.approx(-np.sign(load) * 0.18 / (abs(load) + 0.3), abs=1e-12)
