"""Transitions at one instant: a reset that leads behind another boundary, and what a branch does there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from brute_force import misses
from test_random_branches import endings

import nonsmooth as ns


def kicked() -> ns.System:
    """x decays to 1 with rate c, three times as fast below b; a kick by -j in the middle of every period.

    (y and a force of size 0: a shape of code that is there.)"""
    kick = {"at": 0.5, "reset": lambda t, u, p: (u.x - p.j, u.y)}

    def decay(factor: float) -> Any:
        return lambda t, u, p: (factor * p.c * (1 - u.x), p.A * np.cos(2 * np.pi * t) - 9 * u.y)

    return ns.System(
        states=["x", "y"],
        parameters={"c": 0.5, "j": 0.3, "b": 0.2, "A": 0.0},
        period=1.0,
        modes={"above": decay(1.0), "below": decay(3.0)},
        indicators={"level": lambda t, u, p: u.x - p.b},
        transitions=[
            ns.Transition("above", "above", **kick),
            ns.Transition("below", "below", **kick),
            ns.Transition("above", "below", when="level < 0"),
            ns.Transition("below", "above", when="level > 0"),
        ],
    )


def closed_form(j: float, c: float = 0.5, b: float = 0.2) -> tuple[float, float]:
    """(x at phase 0, multiplier). With y = 1 - x: once round y -> y + j, which decays, below y = 1 - b at rate c."""
    y = j * np.exp(-c) / (1 - np.exp(-c))
    if y + j <= 1 - b:
        return 1 - y * np.exp(0.5 * c), np.exp(-c)
    # (y + j) exp(-3 c s) = 1 - b, y = (1 - b) exp(-c (1 - s)), hence y^3 = (1 - b)^2 (y + j) exp(-3 c)
    y = max(np.roots([1.0, 0.0, -((1 - b) ** 2) * np.exp(-3 * c), -((1 - b) ** 2) * np.exp(-3 * c) * j]).real)
    return 1 - y * np.exp(0.5 * c), y / (3 * (y + j))


@pytest.mark.parametrize("j", [0.1, 0.31, 0.32, 0.45, 0.6])
def test_a_kick_behind_a_boundary(j: float) -> None:
    orbit = ns.find_orbit(kicked().with_parameters(j=j))
    x, multiplier = closed_form(j)
    assert orbit.u == pytest.approx([x, 0.0], abs=1e-11)
    assert orbit.floquet_multipliers == pytest.approx([multiplier, np.exp(-9)], abs=1e-11)


@pytest.mark.parametrize("begin", [0.1, 0.6])
def test_the_branch_through_the_boundary(begin: float) -> None:
    """The kick leads just onto the boundary at j = (1 - b) (1 - exp(-c)): a corner, and the multiplier jumps there."""
    branch = ns.continue_orbit(ns.find_orbit(kicked().with_parameters(j=begin)), "j", (0.05, 0.7))
    special = ns.special_points(branch)
    assert list(special["kind"].values) == ["corner"] and list(special["touched"].values) == ["level"]
    corner = 0.8 * (1 - np.exp(-0.5))
    assert special["j"].values == pytest.approx([corner], abs=1e-9)
    assert branch["j"].values[[0, -1]] == pytest.approx([0.05, 0.7])
    for j, x, mu in zip(
        branch["j"].values, branch["section"].values[:, 0], branch["floquet_multipliers"].values[:, 0], strict=True
    ):
        if abs(j - corner) > 1e-8:
            assert [x, mu] == pytest.approx(closed_form(float(j)), abs=1e-9)


def impacts_in_two_steps() -> ns.System:
    """The impact oscillator with a mode for the instant of the impact, left because the speed is then negative."""

    def field(t: Any, u: Any, p: Any) -> Any:
        return u.v, p.A * np.cos(t) - 0.1 * u.v - u.x

    return ns.System(
        states=["x", "v"],
        parameters={"A": 1.0, "e": 0.8},
        modes={"free": field, "impact": field},
        indicators={"stop": lambda t, u, p: u.x - 1, "speed": lambda t, u, p: u.v},
        transitions=[
            ns.Transition("free", "impact", when="stop > 0", reset=lambda t, u, p: (u.x, -p.e * u.v)),
            ns.Transition("impact", "free", when="speed < 0"),
        ],
    )


def test_an_impact_in_two_steps_is_that_in_one() -> None:
    """Orbit, multipliers, graze (A = 0.1, exactly) and the saddle beyond it; saved and read back too."""
    one = ns.models.impact_oscillator(A=1.0, e=0.8, c=0.1)
    orbit, wanted = ns.find_orbit(impacts_in_two_steps()), ns.find_orbit(one)
    assert orbit.u == pytest.approx(wanted.u, abs=1e-11)
    assert orbit.floquet_multipliers == pytest.approx(wanted.floquet_multipliers, abs=1e-11)
    assert np.linalg.det(orbit.monodromy_matrix) == pytest.approx(0.64 * np.exp(-0.2 * np.pi), abs=1e-12)
    read = ns.Orbit.from_dataset(orbit.to_dataset())
    assert read.signature == orbit.signature
    found, known = (ns.special_points(ns.continue_orbit(first, "A", (0.05, 2.0))) for first in (read, wanted))
    assert list(found["kind"].values) == list(known["kind"].values) == ["grazing", "fold"]
    assert found["A"].values == pytest.approx(known["A"].values, abs=1e-10)
    assert float(found["A"][0]) == pytest.approx(0.1, abs=1e-10)
    assert found["grazing"].values[0] == known["grazing"].values[0] == "non_smooth_fold"


def rubbed_and_stopped(begun: float, ends: tuple[float, float]) -> tuple[ns.System, xr.Dataset]:
    """An impact behind which friction turns at once; its branch over the frequency."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": begun},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={
            "rub": ns.elements.Coulomb(at="q", friction=0.2),
            "stop": ns.elements.Stop(at="q", position=0.5, restitution=0.5),
        },
    )
    return system, ns.continue_orbit(ns.find_orbit(system, transient=300, progress=False), "w", ends)


def test_transitions_of_one_instant_pass_the_section_together() -> None:
    """The impact meets the section as w is varied, at 0.94: the round begins behind both.

    The orbits are those of simulations, through both ends of the range."""
    system, branch = rubbed_and_stopped(0.9, (0.88, 1.0))
    assert endings(branch) == ["range", "range"]
    assert misses(system, branch, "w") < 1e-9


def test_a_boundary_is_named_alike_from_either_side() -> None:
    """A mass that comes to zero speed under a load equal to the friction sticks at once or slides on a little; it
    arrives with an acceleration, and no motion is tangent to anything."""
    system, branch = rubbed_and_stopped(0.7, (0.64, 0.72))
    begun = ns.find_orbit(system.with_parameters(w=0.643), transient=300, progress=False)
    right, left = (ns.special_points(one) for one in (branch, ns.continue_orbit(begun, "w", (0.64, 0.68))))
    assert left["kind"].values.tolist() == right["kind"].values[:1].tolist() == ["corner"]
    assert left["w"].values == pytest.approx(right["w"].values[:1], abs=1e-10)
