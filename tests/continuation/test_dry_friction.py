"""The forced Coulomb oscillator x'' + x = cos(w t) - F sgn(x'): Den Hartog's closed forms, and sticking."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics


def coulomb(w: float, F: float) -> ns.System:
    return ns.System(
        states=["x", "v"],
        parameters={"w": w, "F": F},
        modes={
            "forward": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x - p.F),
            "backward": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x + p.F),
            "stick": lambda t, u, p: (0 * u.v, 0 * u.v),
        },
        indicators={
            "speed": lambda t, u, p: u.v,
            "push": lambda t, u, p: np.cos(p.w * t) - u.x - p.F,
            "pull": lambda t, u, p: np.cos(p.w * t) - u.x + p.F,
        },
        transitions=[
            ns.Transition("forward", "backward", when="speed < 0 and pull < 0"),
            ns.Transition("backward", "forward", when="speed > 0 and push > 0"),
            ns.Transition("forward", "stick", when="speed < 0 and pull > 0", reset=lambda t, u, p: (u.x, 0 * u.v)),
            ns.Transition("backward", "stick", when="speed > 0 and push < 0", reset=lambda t, u, p: (u.x, 0 * u.v)),
            ns.Transition("stick", "forward", when="push > 0"),
            ns.Transition("stick", "backward", when="pull < 0"),
        ],
    )


def by_surface(w: float, F: float) -> ns.System:
    """The same with the stick derived."""
    return ns.models.dry_friction_oscillator(omega=w, f_k=F, f_s=F)


@pytest.mark.parametrize("r", [0.6, 0.8, 1.3, 2.0])
@pytest.mark.parametrize("F", [0.1, 0.3])
def test_den_hartogs_amplitude(r: float, F: float) -> None:
    """Without a stop: sqrt(V^2 - (F U)^2), V = 1 / (1 - r^2), U = sin(pi / r) / (r (1 + cos(pi / r)))."""
    V, U = 1 / (1 - r * r), np.sin(np.pi / r) / (r * (1 + np.cos(np.pi / r)))
    orbit = ns.find_orbit(coulomb(r, F))
    amplitude = np.sqrt(V * V - (F * U) ** 2)
    assert [orbit.maximum[0], -orbit.minimum[0]] == pytest.approx([amplitude, amplitude], abs=1e-11)


def slip(t0: float, x0: float, w: float, F: float) -> tuple[float, float]:
    """Next instant and place of rest of a slip against the friction F from rest at (t0, x0), in closed form."""
    V = 1 / (1 - w * w)
    a, b = x0 + F - V * np.cos(w * t0), V * w * np.sin(w * t0)

    def x(s: float) -> float:
        return float(V * np.cos(w * (t0 + s)) - F + a * np.cos(s) + b * np.sin(s))

    def v(s: float) -> float:
        return float(-V * w * np.sin(w * (t0 + s)) - a * np.sin(s) + b * np.cos(s))

    grid = np.linspace(1e-3, 20.0, 20001)
    speeds = np.array([v(s) for s in grid])
    i = int(np.flatnonzero(speeds[:-1] * speeds[1:] < 0)[0])
    s = float(brentq(v, grid[i], grid[i + 1], xtol=1e-15))
    return t0 + s, x(s)


@pytest.mark.parametrize("make", [coulomb, by_surface])
def test_a_cycle_that_sticks_twice(make: Callable[[float, float], ns.System]) -> None:
    """w = 0.4, F = 0.3: one slip each way. The place x of rest gives the next, -x, in closed form; its slope too."""
    w, F = 0.4, 0.3

    def next_rest(x: float) -> float:  # from rest at x it goes backward once cos(w t) - x = -F, t < pi / w
        t = np.arccos(x - F) / w
        return slip(t, x, w, -F)[1]

    x = float(brentq(lambda x: next_rest(x) + x, 0.8, 1.25, xtol=1e-14))
    orbit = ns.find_orbit(make(w, F))
    assert orbit.maximum[0] == pytest.approx(x, abs=1e-11)
    slope = (next_rest(x + 1e-6) - next_rest(x - 1e-6)) / 2e-6
    assert np.sort(orbit.floquet_multipliers.real) == pytest.approx([0.0, slope**2], abs=1e-8)
    exponents = ns.lyapunov(make(w, F), periods=200).exponents.values
    assert exponents[0] == pytest.approx(np.log(slope**2) * w / (2 * np.pi), abs=1e-9)
    assert exponents[1] == -np.inf


@pytest.mark.parametrize("make", [coulomb, by_surface])
@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize(("w", "F", "each"), [(0.5, 0.1, 3), (0.4, 0.3, 4), (0.3, 0.1, 8), (0.5, 0.3, 3)])
def test_leaving_the_stick_is_no_return_to_it(
    make: Callable[[float, float], ns.System], method: str, w: float, F: float, each: int
) -> None:
    """A slip begins with no speed and no acceleration: rounding of either must not stop it again."""
    run = ns.simulate(make(w, F), periods=40, transient=40, method=method)
    assert len(run["crossing_time"]) == each * 40


def test_stick_slip_of_a_drill_string_ends_at_a_graze_and_steady_turning_where_friction_falls_too_fast():
    """The bit seen from the table that turns with Omega: the rock is a belt that moves backwards. Steady turning is
    stable where c exceeds the fall of the friction, 4000 / (1 + Omega)^2."""
    bit = ns.mechanical(
        "J",
        "c",
        "k",
        coordinates={"theta": "rad"},
        parameters={
            "J": (370.0, "kg m^2"),
            "c": (100.0, "N m s/rad"),
            "k": (470.0, "N m/rad"),
            "Omega": (4.0, "rad/s"),
        },
        elements={
            "rock": ns.elements.Coulomb(
                at="theta", friction=lambda v, p: 5000 + 4000 / (1 + v), belt=lambda t, u, p: -p.Omega
            )
        },
    )
    steady = ns.continue_equilibrium(bit, "Omega", (1.0, 30.0), start={"theta": -12.0}, mode="rock_forward")
    special = ns.special_points(steady)
    assert special.kind.values.tolist() == ["hopf"]
    assert special.Omega.values == pytest.approx([np.sqrt(40.0) - 1.0], abs=1e-6)
    cycle = ns.find_orbit(bit, start={"theta": -15.0})
    assert cycle.stable and cycle.period > 2 * np.pi * np.sqrt(370.0 / 470.0)
    branch = ns.special_points(ns.continue_orbit(cycle, "Omega", (1.0, 30.0)))
    assert branch.kind.values.tolist() == ["grazing", "hopf"]
    assert branch.Omega.values[1] == pytest.approx(np.sqrt(40.0) - 1.0, abs=1e-4)


@pytest.mark.parametrize("element", ["rail", "belt", "joint"])
def test_a_branch_ends_where_friction_holds_for_ever(element: str) -> None:
    """Held for ever, where mu is the amplitude of what pulls at the joint, motion is one of a family.

    x'' + 0.1 x' + x = cos(w t) before a wall at rest or a belt that swings by 0.2 sin(w t); or two such masses with a
    dry joint and loads, one of them driven. A mean force is borne by where the mass is held."""
    w, s, load = 0.7, 0.2, 0.3
    Z, hold = 1 - w * w + 0.1j * w, ns.elements.Coulomb
    elements = {
        "rail": hold(at="x", friction="mu"),
        "belt": hold(at="x", friction="mu", belt=lambda t, u, p: s * w * np.cos(w * t)),
        "joint": hold(at={"x": 1.0, "y": -1.0}, friction="mu"),
    }
    # x = y = 1 / (2 Z) in the joint, which bears what drives one of them but not the other.
    pull = {"rail": 1.0, "belt": abs(1.0 + 1j * s * Z), "joint": 0.5}[element]
    forcing = {"x": lambda t, p: np.cos(w * t) + load, "y": lambda t, p: 0.0 * t - load}
    names = ["x", "y"] if element == "joint" else ["x"]
    system = ns.mechanical(
        np.eye(len(names)),
        0.1 * np.eye(len(names)),
        np.eye(len(names)),
        coordinates=names,
        forcing={q: forcing[q] for q in names},
        parameters={"mu": 0.8 * pull},
        elements={element: elements[element]},
    )
    branch = ns.continue_orbit(ns.find_orbit(system, progress=False), "mu", (0.7 * pull, 1.5 * pull))
    special = ns.special_points(branch).isel(special=-1)
    assert branch["ended"].attrs["flag_meanings"].split()[int(branch["ended"][-1])] == "family"
    assert [float(special["mu"]), float(branch["mu"].max())] == pytest.approx([pull, pull], abs=1e-10)
    assert [str(special[name].values) for name in ("kind", "sliding")] == ["grazing", "adding_sliding"]
