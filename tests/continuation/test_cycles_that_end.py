"""Branches whose orbit grows beyond all bounds, or shrinks to an equilibrium, on a boundary or in a Hopf point."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics


def side(trace: str):
    return lambda t, u, p: (getattr(p, trace) * u.x - u.y, u.x - p.mu)


@cache
def two_foci() -> ns.Orbit:
    """The continuous normal form of two foci (Freire, Ponce, Rodrigo, Torres 1998), both with the determinant 1.

    Its cycle exists for T_r < -T_l; it is an image of every other one in scale, as large as mu."""
    system = ns.System(
        states=["x", "y"],
        parameters={"T_l": -1.0, "T_r": 0.4, "mu": 1.0},
        modes={"left": side("T_l"), "right": side("T_r")},
        indicators={"border": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("left", "right", when="border > 0"),
            ns.Transition("right", "left", when="border < 0"),
        ],
    )
    return ns.find_orbit(system, start={"x": 1.5})


def test_a_cycle_that_comes_from_infinity() -> None:
    """At T_l + T_r = 0 the two sides balance for all large orbits; nothing is special on the way there."""
    branch = ns.continue_orbit(two_foci(), "T_r", (0.2, 1.9))
    assert branch.sizes["special"] == 0
    assert "grows beyond all bounds" in str(branch["ended_because"].values[-1])
    assert float(branch["T_r"][-1]) == pytest.approx(1.0, abs=1e-4)


def test_a_cycle_that_shrinks_to_the_border() -> None:
    """At mu = 0 the equilibrium lies on the border and the cycle has no size; for mu < 0 there is none."""
    branch = ns.continue_orbit(two_foci(), "mu", (-1.0, 2.0))
    rows = ns.special_points(branch)
    assert rows["kind"].values.tolist() == ["boundary_equilibrium"]
    assert float(rows["mu"][0]) == pytest.approx(0.0, abs=1e-9)
    assert "shrinks to an equilibrium on a boundary" in str(branch["ended_because"].values[0])
    sizes = branch["maximum"].values - branch["minimum"].values
    assert sizes / sizes[-1] == pytest.approx(branch["mu"].values[:, None] / 2.0 * np.ones(2), abs=1e-9)


def test_an_orbit_at_resonance_without_damping() -> None:
    """The amplitude is 1 / c, without bound as c comes to 0."""
    system = ns.System(
        states=["x", "v"],
        parameters={"c": 0.1},
        modes={"m": lambda t, u, p: (u.v, np.cos(t) - u.x - p.c * u.v)},
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "c", (-0.1, 0.2))
    assert branch.sizes["special"] == 0 and float(branch["c"].min()) > 0.0
    assert "grows beyond all bounds" in str(branch["ended_because"].values[0])
    assert branch["maximum"].values[:, 0] == pytest.approx(1.0 / branch["c"].values, rel=1e-7)


def test_an_escapement_without_its_kick() -> None:
    """A clock that gains K in v^2 a turn: amplitudes go with the square root of K, and with its kick it vanishes."""
    decay = 0.05

    def swinging(t, u, p):
        return u.v, -u.x - 2.0 * decay * u.v

    clock = ns.System(
        states=["x", "v"],
        parameters={"K": 1.0},
        modes={"back": swinging, "forth": swinging},
        indicators={"mid": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("back", "forth", when="mid > 0", reset=lambda t, u, p: (u.x, np.sqrt(u.v**2 + p.K))),
            ns.Transition("forth", "back", when="mid < 0"),
        ],
    )
    orbit = ns.find_orbit(clock, start={"x": -0.5})
    turn = 2.0 * np.pi / np.sqrt(1.0 - decay**2)
    assert orbit.period == pytest.approx(turn, abs=1e-9)
    assert orbit.floquet_multipliers.real == pytest.approx([1.0, np.exp(-2.0 * decay * turn)], abs=1e-9)
    branch = ns.continue_orbit(orbit, "K", (-1.0, 2.0))
    assert "shrinks to an equilibrium on a boundary" in str(branch["ended_because"].values[0])


def test_a_branch_ends_in_the_hopf_point_wherever_it_was_begun() -> None:
    """Two masses on a belt: of a cycle without size the tangent is noise, and beyond it are the same cycles."""

    def slips(t, u, p):
        friction = 0.8 / (1.0 + 2.0 * (p.belt - u.v))
        return u.v, u.w, u.y - 2.0 * u.x - 0.05 * u.v + friction, (u.x - 1.5 * u.y - 0.05 * u.w) / 0.6

    def growth(belt: float) -> float:
        falls = 1.6 / (1.0 + 2.0 * belt) ** 2
        A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-2, 1, falls - 0.05, 0], [1 / 0.6, -2.5, 0, -0.05 / 0.6]])
        return float(np.linalg.eigvals(A).real.max())

    pair = ns.System(states=["x", "y", "v", "w"], parameters={"belt": 1.45}, modes={"slip": slips})
    rest = ns.special_points(ns.continue_equilibrium(pair, "belt", (1.2, 1.6), start={"x": 0.2, "y": 0.1}))
    cycles = ns.continue_orbit(rest.isel(special=0), range=(1.2, 1.6))
    exact = brentq(growth, 1.4, 1.5, xtol=1e-14)
    assert float(rest["belt"][0]) == pytest.approx(exact, abs=1e-12)
    for k, high in ((11, 1.6), (15, 1.7), (33, 1.7)):
        at = cycles.isel(point=k)
        orbit = ns.find_orbit(pair.with_parameters(belt=float(at["belt"])), start=at["section"].values, transient=0)
        branch = ns.continue_orbit(orbit, "belt", (1.2, high))
        rows = ns.special_points(branch)
        assert rows["kind"].values.tolist() == ["hopf"] and "shrinks to" in str(branch["ended_because"].values[0])
        assert float(rows["belt"][0]) == pytest.approx(exact, abs=1e-6)


def test_sliders_at_their_bounds_do_not_slip_again() -> None:
    """Two springs with sliders in parallel (Iwan 1966) slip in another order on either side of F1 / k1 = F2 / k2.

    Behind a turn each of them hangs at its bound, to rounding, on either side of it."""

    def motion(first, second):
        def rates(t, u, p):
            force = 0.6 * np.cos(0.9 * t) - 0.5 * u.x - 0.02 * u.v - u.f1 - u.f2
            return u.v, force, p.k1 * u.v if first == "s" else 0.0, p.k2 * u.v if second == "s" else 0.0

        return rates

    changes = []
    for k in (1, 2):
        for other in "spm":
            stick, plus, minus = (f"m{one}{other}" if k == 1 else f"m{other}{one}" for one in "spm")
            changes += [
                ns.Transition(stick, plus, when=f"h{k} > 0"),
                ns.Transition(stick, minus, when=f"l{k} < 0"),
                ns.Transition(plus, stick, when="turn < 0"),
                ns.Transition(minus, stick, when="turn > 0"),
            ]
    iwan = ns.System(
        states=["x", "v", "f1", "f2"],
        parameters={"F1": 0.15, "F2": 0.3, "k1": 0.3, "k2": 0.2},
        modes={f"m{a}{b}": motion(a, b) for a in "spm" for b in "spm"},
        indicators={
            "turn": lambda t, u, p: u.v,
            "h1": lambda t, u, p: u.f1 - p.F1,
            "l1": lambda t, u, p: u.f1 + p.F1,
            "h2": lambda t, u, p: u.f2 - p.F2,
            "l2": lambda t, u, p: u.f2 + p.F2,
        },
        transitions=changes,
    )
    branch = ns.continue_orbit(ns.find_orbit(iwan), "F1", (0.05, 0.6))
    rows = ns.special_points(branch)
    assert rows["kind"].values.tolist() == ["corner"]
    assert float(rows["F1"][0]) == pytest.approx(1.5 * 0.3, abs=1e-9)
    assert all("edge of the range" in str(text) for text in branch["ended_because"].values)
