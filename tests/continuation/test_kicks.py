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
