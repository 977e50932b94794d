"""Orbits with a kick at a phase, beside elements: the motion returns, multipliers are those of differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
ELEMENTS: dict[str, Any] = {
    "friction": ns.elements.Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction=0.02),
    "soft": ns.elements.ElasticStop(gap=lambda t, u, p: 0.12 - u.x, on={"v": -1.0}, stiffness=30.0),
    "rigid": ns.elements.Stop(gap=lambda t, u, p: 0.12 - u.x, on={"v": -1.0}, restitution=0.6),
}


def kicked(kind: str, at: float) -> ns.System:
    """A damped oscillator that gains the speed J once in a period."""
    return ns.System(
        states=["x", "v"],
        parameters={"J": 0.5, "w": 1.0},
        modes={"free": lambda t, u, p: [u.v, -0.3 * u.v - 4.0 * u.x]},
        transitions=[ns.Transition("free", "free", at=at, reset=lambda t, u, p: [u.x, u.v + p.J])],
        elements={kind: ELEMENTS[kind]},
        period=lambda p: 2 * np.pi / p.w,
    )


def returned(system: ns.System, u: Any, periods: int) -> np.ndarray:
    run = ns.simulate(system, periods=periods, start=dict(zip(system.states, map(float, u), strict=True)))
    return np.asarray(run.u.values[-1])


@pytest.mark.parametrize("at", [0.0, 0.3])
@pytest.mark.parametrize("kind", ["friction", "soft", "rigid"])
def test_an_orbit_with_a_kick_and_its_multipliers(kind: str, at: float) -> None:
    system = kicked(kind, at)
    orbit = ns.find_orbit(system)
    n, h = orbit.period_number, 1e-6
    np.testing.assert_allclose(returned(system, orbit.u, n), orbit.u, atol=1e-10)
    found = [(returned(system, orbit.u + d, n) - returned(system, orbit.u - d, n)) / (2 * h) for d in h * np.eye(2)]
    np.testing.assert_allclose(orbit.monodromy_matrix, np.transpose(found), atol=1e-6)


@pytest.mark.parametrize("kind", ["soft", "rigid"])
def test_the_section_of_a_branch_lies_behind_a_kick_at_phase_0(kind: str) -> None:
    """On both sides of a graze, where the orbit is read anew."""
    system = kicked(kind, 0.0)
    orbit = ns.find_orbit(system)
    branch = ns.continue_orbit(orbit, "J", (0.3, 0.9))
    assert "grazing" in branch["special_kind"].values
    for J, section in zip(branch["J"].values[::4], branch["section"].values[::4], strict=True):
        after = returned(system.with_parameters(J=J), section.ravel()[:2], orbit.period_number)
        np.testing.assert_allclose(after, section.ravel()[:2], atol=1e-8)


def four_loads(periods: int) -> ns.System:
    """Four loads in turn on a mass before a stop, once in two units of time: the last of them for 0.9 units."""
    ends = {"last": 0.1, "first": 0.3, "second": 0.7, "third": 1.1}
    names = [*ends]
    return ns.System(
        states=["x", "v"],
        parameters={"d": 0.47},
        modes={name: lambda t, u, p, q=name: (u.v, (q == "last") - 9.0 * u.x - 0.4 * u.v) for name in names},
        indicators={"stop": lambda t, u, p: u.x - p.d},
        transitions=[
            *(ns.Transition(a, a, when="stop > 0", reset=lambda t, u, p: (u.x, -0.5 * u.v)) for a in names),
            *(ns.Transition(a, b, at=ends[a] / periods % 1) for a, b in zip(names, names[1:] + names[:1], strict=True)),
        ],
        period=float(periods),
    )


def test_two_periods_are_one_of_twice_the_length() -> None:
    """Through a corner and a graze, also where the longest part of the orbit lies behind the first period."""
    one, two = (ns.continue_orbit(ns.find_orbit(four_loads(n)), "d", (0.46, 0.58)) for n in (2, 1))
    assert two["period_number"] == 2 * one["period_number"] == 2
    assert one["special_kind"].values.tolist() == two["special_kind"].values.tolist() == ["corner", "grazing"]
    assert (one["ended"] == two["ended"]).all() and (two["ended"] == two["ended"][0]).all()
    for name in ("d", "section", "floquet_multipliers"):
        np.testing.assert_allclose(two[name].values, one[name].values, atol=1e-7)
