"""A predator that is harvested above a threshold: a cycle that slides along it, on either side of where it does not.

Dercole, Gragnani, Rinaldi, Theor. Popul. Biol. 72 (2007) 197-213."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics

A, B, D, LEVEL = 0.3556, 0.33, 0.0444, 1.25


def field(effort):
    def rates(t, u, p):
        eaten = A * u.x * u.y / (B + u.x)
        return u.x * (1.0 - u.x) - eaten, eaten - p.d * u.y - effort(p) * u.y

    return rates


@cache
def cycle() -> ns.Orbit:
    system = ns.System(
        states=["x", "y"],
        parameters={"d": D, "E": 0.2067},
        modes={"low": field(lambda p: 0.0), "high": field(lambda p: p.E)},
        indicators={"h": lambda t, u, p: u.y - LEVEL},
        transitions=[ns.Surface("h", below="low", above="high", mode="slide")],
    )
    return ns.find_orbit(system, start={"x": 0.5, "y": 0.8})


def back_at_the_level(effort: float) -> float:
    """From where the field below touches the level, once round by SciPy: how far from there the level is met again."""
    edge = B * D / (A - D)
    found = np.array([edge, LEVEL])

    def rates(t, u, E):
        eaten = A * u[0] * u[1] / (B + u[0])
        return u[0] * (1.0 - u[0]) - eaten, eaten - (D + E) * u[1]

    def level(t, u, E):
        return u[1] - LEVEL if t > 1.0 else np.sign(E) - 0.5  # not where it begins

    level.terminal = True
    for E in (0.0, effort):
        run = solve_ivp(rates, (0.0, 200.0), found, args=(E,), events=level, method="DOP853", rtol=1e-11, atol=1e-12)
        found = run.y[:, -1]
    return float(found[0] - edge)


def test_sliding_begins_on_the_edge_of_its_region() -> None:
    """The cycle was found where it slides longest; without its sliding segment it goes on, by crossings alone."""
    branch = ns.continue_orbit(cycle(), "E", (0.05, 0.3))
    assert all("edge of the range" in str(text) for text in branch["ended_because"].values)
    rows = ns.special_points(branch)
    assert rows["sliding"].values.tolist() == ["crossing_sliding", "switching_sliding"]
    assert float(rows["E"][0]) == pytest.approx(brentq(back_at_the_level, 0.069, 0.0705, xtol=1e-10), abs=2e-8)


def test_a_sliding_cycle_becomes_a_small_one_below_the_level() -> None:
    """Below the level the cycle is that of Rosenzweig and MacArthur, born at x = (1 - B) / 2: 4e-6 of d are left."""
    branch = ns.continue_orbit(cycle(), "d", (0.04, 0.2))
    rows = ns.special_points(branch)
    assert rows["kind"].values.tolist() == ["grazing", "hopf"]
    assert str(rows["sliding"].values[0]) == "grazing_sliding"
    x = (1.0 - B) / 2.0
    assert float(rows["d"][1]) == pytest.approx(A * x / (B + x), abs=1e-6)
