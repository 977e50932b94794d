"""Corners of two transitions: their order changes, or one fires before the other; places and orbits in closed form."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns

pytestmark = pytest.mark.physics

# x' = -x + cos(t - phi) answers with cos(t - phi - pi / 4) / sqrt(2)


@cache
def quadrants() -> ns.System:
    """Modes by the signs of x and of y - c; y is driven by a cosine (q = 1) or by the sign of x (q = 0).

    z adds up the time spent in each mode, with its own weight. r is there because four states are compiled anyhow."""
    modes, transitions = {}, []
    for i in (0, 1):
        for j in (0, 1):

            def field(t: Any, u: Any, p: Any, i: int = i, j: int = j) -> Any:
                drive = p.q * np.cos(t - 1.0 - p.phi) + (1 - p.q) * (-1.0 if i else 1.0)
                return np.cos(t - 1.0) - u.x, drive - u.y, i + 2.0 * j + i * j - u.z, np.cos(t) - u.r

            modes[f"m{i}{j}"] = field
            transitions.append(ns.Transition(f"m{i}{j}", f"m{1 - i}{j}", when=f"right {'<' if i else '>'} 0"))
            transitions.append(ns.Transition(f"m{i}{j}", f"m{i}{1 - j}", when=f"above {'<' if j else '>'} 0"))
    return ns.System(
        name="quadrants",
        states=["x", "y", "z", "r"],
        parameters={"phi": 0.0, "c": 0.1, "q": 1.0},
        modes=modes,
        transitions=transitions,
        period=2 * np.pi,
        indicators={"right": lambda t, u, p: u.x, "above": lambda t, u, p: u.y - p.c},
    )


def corners(branch: xr.Dataset) -> list[float]:
    special = ns.special_points(branch)
    assert set(special["kind"].values) <= {"corner"}
    return sorted(special[branch.attrs["parameter"]].values.tolist())


def settled(branch: xr.Dataset, system: ns.System, values: list[float]) -> None:
    """The branch is what the system settles on, found without it."""
    name = branch.attrs["parameter"]
    for value in values:
        k = int(np.argmin(np.abs(branch[name].values - value)))
        orbit = ns.find_orbit(system.with_parameters({name: float(branch[name][k])}))
        assert branch["section"].values[k] == pytest.approx(orbit.u, abs=1e-9)
        assert branch["floquet_multipliers"].values[k] == pytest.approx([np.exp(-2 * np.pi)] * 4, rel=1e-6)


@pytest.mark.parametrize("start", [-0.4, 0.4])
def test_two_surfaces_change_their_order(start: float) -> None:
    """x = 0 and y = c are crossed in one order or the other; both at once where -+(pi / 2 - arccos(c sqrt 2)) = phi."""
    system = quadrants().with_parameters(phi=start)
    branch = ns.continue_orbit(ns.find_orbit(system), "phi", (-0.6, 0.6))
    at = np.pi / 2 - np.arccos(0.1 * np.sqrt(2))
    assert corners(branch) == pytest.approx([-at, at], abs=1e-9)
    assert branch["phi"].values[[0, -1]] == pytest.approx([-0.6, 0.6])
    assert (branch["crossings_per_period"] == 4).all()
    settled(branch, system, [-0.5, 0.0, 0.5])
    assert {str(w) for w in ns.special_points(branch)["touched"].values} <= {"right", "above"}


@pytest.mark.parametrize("start", [-0.4, 0.4])
def test_surfaces_that_move_are_named_at_the_instant_at_which_they_are_reached(start: float) -> None:
    """The same in coordinates less cos(t) / 2; ``within`` always holds, and half a period off it is the nearest."""
    modes, transitions = {}, []
    for i in (0, 1):
        for j in (0, 1):

            def field(t: Any, u: Any, p: Any) -> Any:
                x, y = (one + 0.5 * np.cos(t) for one in u)
                return np.cos(t - 1.0) - x + 0.5 * np.sin(t), np.cos(t - 1.0 - p.phi) - y + 0.5 * np.sin(t)

            modes[f"m{i}{j}"] = field
            for to, when in (
                (f"m{1 - i}{j}", f"right {'<' if i else '>'} 0"),
                (f"m{i}{1 - j}", f"above {'<' if j else '>'} 0"),
            ):
                transitions.append(ns.Transition(f"m{i}{j}", to, when=f"{when} and within > 0"))
    system = ns.System(
        name="moving quadrants",
        states=["x", "y"],
        parameters={"phi": start},
        modes=modes,
        transitions=transitions,
        period=2 * np.pi,
        indicators={
            "right": lambda t, u, p: u.x + 0.5 * np.cos(t),
            "above": lambda t, u, p: u.y + 0.5 * np.cos(t) - 0.1,
            "within": lambda t, u, p: 1.02 + np.cos(t - 0.2) + 0.01 * u.x,
        },
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "phi", (-0.6, 0.6))
    at = np.pi / 2 - np.arccos(0.1 * np.sqrt(2))
    assert corners(branch) == pytest.approx([-at, at], abs=1e-9)
    assert {str(w) for w in ns.special_points(branch)["touched"].values} <= {"right", "above"}


@pytest.mark.parametrize("start", [1.2, 0.6])
def test_a_crossing_reaches_another_surface(start: float) -> None:
    """y follows a square wave and turns at the crossing of x = 0, at +-tanh(T / 4); there it meets y = c."""
    system = quadrants().with_parameters(q=0.0, c=start)
    branch = ns.continue_orbit(ns.find_orbit(system), "c", (0.5, 1.3))
    assert corners(branch) == pytest.approx([np.tanh(np.pi / 2)], abs=1e-9)
    assert branch["c"].values[[0, -1]] == pytest.approx([0.5, 1.3])
    assert set(np.unique(branch["crossings_per_period"])) == {2.0, 4.0}
    settled(branch, system, [0.6, 1.2])


@pytest.mark.parametrize("start", [-0.3, 0.3])
def test_a_surface_and_a_phase_change_their_order(start: float) -> None:
    """x rises through 0 at t = 0.5 + phi; the weight of z switches at t = 0.6, so they meet at phi = 0.1."""
    modes, transitions = {}, []
    for i in (0, 1):
        for s in (0, 1):

            def field(t: Any, u: Any, p: Any, i: int = i, s: int = s) -> Any:
                return np.cos(t - np.pi / 4 - 0.5 - p.phi) - u.x, i + 3.0 * s + i * s - u.z

            modes[f"m{i}{s}"] = field
            transitions.append(ns.Transition(f"m{i}{s}", f"m{1 - i}{s}", when=f"right {'<' if i else '>'} 0"))
            transitions.append(ns.Transition(f"m{i}{s}", f"m{i}{1 - s}", at=0.95 if s else 0.3 / np.pi))
    system = ns.System(
        name="phase",
        states=["x", "z"],
        parameters={"phi": start},
        modes=modes,
        transitions=transitions,
        indicators={"right": lambda t, u, p: u.x},
        period=2 * np.pi,
    )
    branch = ns.continue_orbit(ns.find_orbit(system), "phi", (-0.45, 0.45))
    assert branch["phi"].values[[0, -1]] == pytest.approx([-0.45, 0.45])
    assert corners(branch) == pytest.approx([0.1], abs=1e-9)
    for k in (0, -1):
        orbit = ns.find_orbit(system.with_parameters(phi=float(branch["phi"][k])))
        assert branch["section"].values[k] == pytest.approx(orbit.u, abs=1e-9)
