"""Equilibria: Hopf points, boundary equilibria, and the cycles born there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import nonsmooth as ns


def valve_hopf() -> float:
    """q of test problem E by Routh-Hurwitz: a2 a1 = a0 of the characteristic polynomial, with y1 sqrt(y3) = q."""
    k, delta, beta = 1.25, 10.0, 20.0

    def condition(q: float) -> float:
        y1 = brentq(lambda y: y * np.sqrt(y + delta) - q, 0.0, 10.0, xtol=1e-15)
        y3 = y1 + delta
        r, s = beta * np.sqrt(y3), beta * y1 / (2 * np.sqrt(y3))
        # lambda^3 + (k + s) lambda^2 + (1 + k s) lambda + s + r
        return float((k + s) * (1 + k * s) - (s + r))

    return float(brentq(condition, 5.0, 10.0, xtol=1e-14))


@pytest.fixture(scope="module")
def valve() -> xr.Dataset:
    system = ns.models.relief_valve(q=9.0)
    return ns.continue_equilibrium(system, "q", (0.2, 10.0), start={"y1": 2.0, "y3": 12.0})


def test_hopf_point_of_the_relief_valve(valve: xr.Dataset) -> None:
    special = ns.special_points(valve)
    assert list(special["kind"].values) == ["hopf"]
    assert float(special["q"][0]) == pytest.approx(8.4911176352, abs=5e-11)
    assert float(special["q"][0]) == pytest.approx(valve_hopf(), abs=1e-11)
    stable = valve["stable"].values
    assert stable[valve["q"] > 8.5].all() and not stable[valve["q"] < 8.49].any()


def test_cycle_born_at_the_hopf_point(valve: xr.Dataset) -> None:
    """It begins with the pair's own period, and at q = 8 it is the published cycle."""
    special = ns.special_points(valve)
    omega = float(np.abs(special["eigenvalues"].values[0].imag).max())
    branch = ns.continue_orbit(special.isel(special=0), range=(7.9, 10.0))
    assert float(branch["period"][0]) == pytest.approx(2 * np.pi / omega, rel=1e-4)
    assert float(branch["q"][0]) == pytest.approx(valve_hopf(), abs=1e-4)
    i = int(np.argmin(np.abs(branch["q"].values - 8.0)))
    start = dict(zip(("y1", "y2", "y3"), branch["section"].values[i], strict=True))
    orbit = ns.find_orbit(ns.models.relief_valve(q=8.0), start=start, transient=3)
    assert orbit.period == pytest.approx(2.392389442, abs=5e-10)
    assert float(branch["period"][i]) == pytest.approx(orbit.period, abs=1e-2)


def hinge() -> ns.System:
    """x' = mu - x below 0, mu - 2 x above: the equilibrium is mu, then mu / 2; it crosses the boundary at mu = 0."""

    def below(t: Any, u: Any, p: Any) -> Any:
        x, y = u
        return p.mu - x, -y

    def above(t: Any, u: Any, p: Any) -> Any:
        x, y = u
        return p.mu - 2 * x, -y

    return ns.System(
        name="hinge",
        states=["x", "y"],
        parameters={"mu": -0.5},
        modes={"below": below, "above": above},
        indicators={"side": lambda t, u, p: u.x},
        transitions=[
            ns.Transition("below", "above", when="side > 0"),
            ns.Transition("above", "below", when="side < 0"),
        ],
    )


@pytest.mark.parametrize(("power", "kind"), [(2, "transcritical"), (3, "pitchfork")])
def test_crossings_of_equilibria(power: int, kind: str) -> None:
    """x' = mu x - x^n: x = 0 is crossed at mu = 0 by mu = x^(n - 1)."""
    system = ns.System(
        name="crossing",
        states=["x"],
        parameters={"mu": -0.5},
        modes={"one": lambda t, u, p: (p.mu * u.x - u.x**power,)},
    )
    special = ns.special_points(ns.continue_equilibrium(system, "mu", (-1.0, 1.0)))
    assert special["kind"].values.tolist() == [kind]
    assert float(special["mu"][0]) == pytest.approx(0.0, abs=1e-12)


def test_boundary_equilibrium() -> None:
    branch = ns.continue_equilibrium(hinge(), "mu", (-1.0, 1.0))
    special = ns.special_points(branch)
    assert list(special["kind"].values) == ["boundary_equilibrium"]
    assert float(special["mu"][0]) == pytest.approx(0.0, abs=1e-12)
    mu, x = branch["mu"].values, branch["u"].values[:, 0]
    assert x == pytest.approx(np.where(mu < 0, mu, mu / 2), abs=1e-12)
    assert mu[0] == pytest.approx(-1.0) and mu[-1] == pytest.approx(1.0)


def test_equilibrium_that_a_stop_ends() -> None:
    """The valve's lift is never negative: with falling inflow the equilibrium reaches the seat only at q = 0."""
    branch = ns.continue_equilibrium(ns.models.relief_valve(q=9.0), "q", (-1.0, 10.0), start={"y1": 2.0, "y3": 12.0})
    special = ns.special_points(branch)
    assert "boundary_equilibrium" in special["kind"].values
    i = list(special["kind"].values).index("boundary_equilibrium")
    assert float(special["q"][i]) == pytest.approx(0.0, abs=1e-11)
    assert "boundary" in str(branch["ended_because"].values[0])


def test_forced_systems_have_none() -> None:
    with pytest.raises(ValueError, match="find_orbit"):
        ns.continue_equilibrium(ns.models.impact_oscillator(), "A", (0.1, 2.0))
