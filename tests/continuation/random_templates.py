"""Ten kinds of systems whose parameters are drawn at random, for the campaign of branches."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import test_ways_on as ways

import nonsmooth as ns

__all__ = ["TEMPLATES", "Drawn"]

Drawn = tuple[ns.System, str, tuple[float, float], Any]  # system, parameter, range, start
Random = np.random.Generator


def _force(t: Any, p: Any) -> Any:
    return p.f * np.cos(p.w * t) + p.m


@cache
def _elastic() -> ns.System:
    stops = ns.elements.ElasticStop
    return ns.mechanical(
        1.0,
        lambda p: 2 * p.z,
        1.0,
        name="two elastic stops",
        coordinates="x",
        forcing={"x": _force},
        parameters={"z": 0.05, "f": 1.0, "m": 0.0, "w": 0.8, "b": 0.5, "g": -0.1, "k": 5.0, "l": 5.0, "c": 0.1},
        elements={
            "upper": stops(at="x", position="b", stiffness="k", damping="c"),
            "lower": stops(at="x", position="g", side=-1, stiffness="l", damping="c"),
        },
    )


def elastic(rng: Random) -> Drawn:
    """An elastic stop with a gap above, one that is preloaded below (position -g > 0), both with dampers."""
    drawn = {
        "z": (0.02, 0.1),
        "m": (-0.3, 0.3),
        "b": (0.2, 1.2),
        "g": (-0.3, 0.1),
        "k": (1, 10),
        "l": (1, 10),
        "c": (0.02, 0.3),
    }
    return _elastic().with_parameters(_drawn(rng, drawn)), "w", (0.6, 2.5), None


def impact(rng: Random) -> Drawn:
    """A rigid stop without rest, from motion free of impacts or not."""
    values = _drawn(rng, {"c": (0.05, 0.4), "d": (0.4, 1.5), "e": (0.3, 0.9)})
    return ns.models.impact_oscillator(omega=0.8, **values), "omega", (0.6, 3.5), None


def coulomb(rng: Random) -> Drawn:
    """Static friction equal to the kinetic one, unequal in the two directions: stops set in one after the other."""
    F, ratio, z = rng.uniform(0.05, 0.6), rng.uniform(0.6, 1.0), rng.uniform(0.01, 0.1)
    return ways.coulomb(rng.uniform(0.6, 0.9), F, ratio, z), "w", (0.35, 1.6), None


def static(rng: Random) -> Drawn:
    """Static friction above the kinetic one, on a support that may move."""
    f_k = rng.uniform(0.1, 0.6)
    moving = rng.uniform(0.0, 0.5) if rng.integers(2) else 0.0
    system = ns.models.dry_friction_oscillator(
        omega=rng.uniform(0.5, 1.4), f_k=f_k, f_s=f_k * rng.uniform(1.05, 1.8), zeta=rng.uniform(0.02, 0.1), v_b=moving
    )
    return system, "omega", (0.4, 1.8), None


@cache
def _two_stops() -> ns.System:
    return ns.mechanical(
        np.eye(2),
        lambda p: [[2 * p.z, -p.z], [-p.z, p.z]],
        lambda p: [[1 + p.s, -p.s], [-p.s, p.s]],
        name="two masses, two stops",
        coordinates=["x", "y"],
        forcing={"x": _force},
        parameters={"z": 0.1, "s": 1.0, "f": 1.0, "m": 0.0, "w": 1.0, "b": 1.0, "g": 1.0, "e": 0.5, "k": 4.0},
        elements={
            "rigid": ns.elements.Stop(at="x", position="b", restitution="e"),
            "soft": ns.elements.ElasticStop(at="y", position=lambda t, u, p: -p.g, side=-1, stiffness="k"),
        },
    )


def two_stops(rng: Random) -> Drawn:
    """Two masses in a row, the first before a rigid stop, the second before an elastic one."""
    drawn = {"z": (0.1, 0.4), "s": (0.5, 2.0), "b": (0.3, 2.0), "g": (0.3, 2.0), "e": (0.2, 0.8), "k": (1.0, 8.0)}
    return _two_stops().with_parameters(_drawn(rng, drawn) | {"w": rng.uniform(0.5, 2.5)}), "w", (0.4, 3.0), None


@cache
def _relay() -> ns.System:
    def plant(side: int) -> Any:
        return lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - u.x - 2 * p.z * u.v - side * p.F)

    return ns.System(
        name="forced relay",
        states=["x", "v"],
        parameters={"A": 1.0, "w": 1.5, "z": 0.1, "F": 0.5, "c": 0.5},
        modes={"below": plant(-1), "above": plant(1)},
        indicators={"h": lambda t, u, p: u.v + p.c * u.x},
        transitions=[ns.Surface("h", below="below", above="above", mode="sliding")],
    )


def relay(rng: Random) -> Drawn:
    """A relay whose switching line v + c x = 0 is slid along for some forcings."""
    values = _drawn(rng, {"w": (0.5, 2.5), "z": (0.02, 0.2), "F": (0.2, 0.8), "c": (-0.3, 1.5)})
    return _relay().with_parameters(values | {"A": rng.uniform(0.5, 2.5)}), "A", (0.2, 3.0), None


@cache
def _table() -> ns.System:
    return ns.mechanical(
        1.0,
        lambda p: p.c,
        0.0,
        name="mass on a table",
        coordinates="x",
        forcing={"x": lambda t, p: p.a * np.cos(p.w * t) - p.G},
        parameters={"a": 1.5, "w": 1.0, "G": 1.0, "e": 0.5, "c": 0.0},
        elements={"table": ns.elements.Stop(at="x", position=0.0, side=-1, restitution="e")},
    )


def rest(rng: Random) -> Drawn:
    """A mass that is thrown up by a vibrating table, impacts and comes to rest once in a period."""
    values = _drawn(rng, {"e": (0.1, 0.6), "c": (0.0, 0.2), "a": (1.1, 2.5)})
    return _table().with_parameters(values), "a", (1.05, 4.0), [0.1, 0.0]


def buck(rng: Random) -> Drawn:
    """A converter switched by a clocked ramp."""
    system = ways.buck(rng.uniform(16.0, 24.0)).with_parameters(a=rng.uniform(6.0, 9.0))
    return system, "V", (14.0, 40.0), [12.0, 0.5, 0.0]


def piecewise_map(rng: Random) -> Drawn:
    """The normal forms of border collision and of grazing impact as maps."""
    if rng.integers(2):
        return ns.models.square_root_map(lam=rng.uniform(0.05, 0.9), mu=-0.05), "mu", (-0.1, 0.3), [-0.05]
    values = _drawn(rng, {"tau_l": (-1.0, 1.0), "tau_r": (-3.0, 1.5), "delta_l": (-0.5, 0.9), "delta_r": (-0.5, 1.5)})
    return ns.models.border_collision(mu=-0.2, **values), "mu", (-0.5, 0.5), [-0.1, 0.0]


def gear(rng: Random) -> Drawn:
    """Two flanks that are grazed at once by symmetric motion."""
    values = _drawn(rng, {"zeta": (0.03, 0.15), "beta": (1.0, 15.0), "g": (0.5, 2.0), "A": (0.5, 2.0)})
    return ns.models.bilinear_oscillator(omega=rng.uniform(0.3, 2.5), **values), "omega", (0.3, 3.0), None


def _drawn(rng: Random, ranges: dict[str, tuple[float, float]]) -> dict[str, float]:
    return {name: float(rng.uniform(*limits)) for name, limits in ranges.items()}


TEMPLATES: dict[str, Callable[[Random], Drawn]] = {
    one.__name__: one for one in (elastic, impact, coulomb, static, two_stops, relay, rest, buck, piecewise_map, gear)
}
