"""Branches whose period diverges, a rimless wheel that barely passes its apex; and one whose period is finite."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics

ALPHA = np.pi / 8  # half the angle between two spokes: a step keeps cos(2 alpha)^2 = 1/2 of the energy


def speed_squared(slope: float) -> float:
    """Of the wheel just behind a heel strike, in closed form: w^2 = (w^2 + 2 cos(g - a) - 2 cos(g + a)) / 2."""
    return float(2.0 * (np.cos(slope - ALPHA) - np.cos(slope + ALPHA)))


def rimless_wheel(slope: float) -> ns.System:
    return ns.System(
        states=["theta", "omega"],
        parameters={"slope": slope, "alpha": ALPHA},
        modes={"stance": lambda t, u, p: (u.omega, np.sin(u.theta))},
        indicators={"heel": lambda t, u, p: u.theta - p.slope - p.alpha},
        transitions=[
            ns.Transition(
                "stance",
                "stance",
                when="heel > 0",
                reset=lambda t, u, p: (p.slope - p.alpha, u.omega * np.cos(2 * p.alpha)),
            ),
        ],
    )


@pytest.mark.parametrize("slope", [0.1, 0.2])
def test_a_wheel_that_barely_passes_its_apex(slope: float) -> None:
    """The multiplier is 1/2 everywhere: nothing is listed. Below the slope of w^2 = 2 - 2 cos(g - a) it stops."""
    critical = brentq(lambda g: speed_squared(g) - 2.0 + 2.0 * np.cos(g - ALPHA), 0.01, 0.2, xtol=1e-15)
    start = {"theta": slope - ALPHA, "omega": float(np.sqrt(speed_squared(slope)))}
    branch = ns.continue_orbit(ns.find_orbit(rimless_wheel(slope), start=start), "slope", (0.01, 0.3))
    assert not branch.sizes["special"] and branch.sizes["point"] < 300
    first, last = map(str, branch["ended_because"].values)
    assert "homoclinic" in first and "edge of the range" in last
    assert float(branch["slope"][0]) == pytest.approx(critical, abs=1e-5)
    assert float(branch["period"][0]) > 5.0 * float(branch["period"][-1])
    assert branch["floquet_multipliers"].values[:, 1] == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize("step", [0.05, 0.02])
def test_an_explosion_of_canards_is_no_connection(step: float) -> None:
    """Van der Pol's cycle, e x' = y - x^3 / 3 + x, y' = a - x, grows at a = 1 - e / 8 - 3 e^2 / 32 (to O(e^3)) within
    exp(-1 / e) of a: period and extremes grow while the parameter stands, and the period stays finite."""
    e = 0.02
    system = ns.System(
        states=["x", "y"],
        parameters={"a": 0.9, "e": e},
        modes={"slow": lambda t, u, p: ((u.y - u.x**3 / 3 + u.x) / p.e, p.a - u.x)},
        indicators={"far": lambda t, u, p: u.x - 10.0},
    )
    orbit = ns.find_orbit(system, start={"x": 2.0, "y": 0.0}, transient=100)
    branch = ns.continue_orbit(orbit, "a", (0.8, 1.1), step=step)
    assert not any("homoclinic" in str(one) for one in branch["ended_because"].values)
    assert float(branch["a"][-1]) == pytest.approx(1 - e / 8 - 3 * e**2 / 32, abs=5 * e**3)
    assert float(branch["period"].max()) < 5.0
