"""Branches whose orbit grows beyond all bounds, or shrinks to an equilibrium on a boundary."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

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
