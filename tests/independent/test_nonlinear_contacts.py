"""Nonlinear systems whose contacts and frictions decide together, beside a program written apart."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from nonlinear_contacts import Array, Friction, Masses, Wall

import nonsmooth as ns
from nonsmooth.elements import Coulomb, Stop


def speed(row: tuple[float, ...], belt: float = 0.0) -> Any:
    return lambda t, u, p: sum(a * x for a, x in zip(row, list(u)[len(row) :], strict=True)) - belt


def on(row: tuple[float, ...], mass: tuple[float, ...]) -> dict[str, float]:
    return {f"v{i + 1}": a / m for i, (a, m) in enumerate(zip(row, mass, strict=True)) if a}


def friction(row: tuple[float, ...], mass: tuple[float, ...], **given: Any) -> tuple[Friction, Coulomb]:
    law = Friction(row, given["friction"], given.get("static"), given.get("belt", 0.0))
    belt = given.pop("belt", 0.0)
    return law, Coulomb(speed=speed(row, belt), on=on(row, mass), **given)


def stop(row: tuple[float, ...], mass: tuple[float, ...], position: float, e: float) -> tuple[Wall, Stop]:
    """Keeps row . q below a position."""
    r = np.array(row)
    wall = Wall(lambda q: float(position - r @ q), lambda q: -r, restitution=e)
    gap = lambda t, u, p: position - sum(a * x for a, x in zip(row, list(u)[: len(row)], strict=True))
    return wall, Stop(gap=gap, on=on(tuple(-r), mass), restitution=e)


def duffing(mass: tuple[float, ...], load: float, rate: float, *pairs: Any) -> tuple[Masses, ns.System]:
    """A chain of masses with hardening springs to the ground and to each other, the first one driven."""
    n = len(mass)

    def forces(q: Any, v: Any, drive: Any) -> list[Any]:
        found = [-q[i] - q[i] ** 3 - 0.1 * v[i] for i in range(n)]
        found[0] = found[0] + drive
        for i in range(n - 1):
            between = (q[i + 1] - q[i]) + 0.5 * (q[i + 1] - q[i]) ** 3
            found[i], found[i + 1] = found[i] + between, found[i + 1] - between
        return found

    def force(t: float, q: Array, v: Array) -> Array:
        return np.array(forces(q, v, load * np.cos(rate * t)))

    def field(t: Any, u: Any, p: Any) -> list[Any]:
        q, v = list(u)[:n], list(u)[n:]
        return [*v, *(f / m for f, m in zip(forces(q, v, load * np.cos(rate * t)), mass, strict=True))]

    names = [f"{x}{i + 1}" for x in "qv" for i in range(n)]
    elements = {f"e{i}": pair[1] for i, pair in enumerate(pairs)}
    system = ns.System(states=names, parameters={}, modes={"all": field}, elements=elements)
    return Masses(np.diag(mass), force, [pair[0] for pair in pairs]), system


ONE, TWO = (1.0,), (1.0, 1.3)
CASES: dict[str, tuple[Any, ...]] = {
    "two frictions and a stop": (
        ONE,
        1.0,
        0.8,
        [0.1],
        friction((1.0,), ONE, friction=0.2, static=0.3),
        friction((1.0,), ONE, friction=0.15, belt=0.1),
        stop((1.0,), ONE, 0.6, 0.5),
    ),
    "frictions that hold together": (
        ONE,
        0.9,
        0.5,
        [0.0],
        friction((1.0,), ONE, friction=0.3, static=0.5),
        friction((1.0,), ONE, friction=0.3),
    ),
    "a plastic stop of a mass that rubs": (
        ONE,
        1.2,
        0.7,
        [0.0],
        friction((1.0,), ONE, friction=0.2),
        stop((1.0,), ONE, 0.3, 0.0),
        stop((-1.0,), ONE, 0.5, 0.3),
    ),
    "two masses that rub on each other and on the ground": (
        TWO,
        1.5,
        0.6,
        [0.1, 0.0],
        friction((1.0, 0.0), TWO, friction=0.2),
        friction((0.0, 1.0), TWO, friction=0.15),
        friction((1.0, -1.0), TWO, friction=0.1, static=0.2),
    ),
    "two masses with a stop between them and one outside": (
        TWO,
        2.0,
        0.7,
        [0.0, 0.1],
        stop((1.0, -1.0), TWO, 0.1, 0.0),
        stop((0.0, 1.0), TWO, 0.3, 0.4),
        friction((0.0, 1.0), TWO, friction=0.2, static=0.25),
    ),
}


LONG = "two masses with a stop between them and one outside"


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow) if one == LONG else one for one in CASES])
def test_duffing_masses_move_as_in_the_reference(name: str) -> None:
    mass, load, rate, start, *pairs = CASES[name]
    reference, system = duffing(mass, load, rate, *pairs)
    times = np.linspace(0.0, 1.4 * 2 * np.pi / rate, 57)
    n = len(mass)
    expected = reference.run(np.array(start), np.zeros(n), times)
    run = ns.simulate(system, duration=times[-1], samples=times, start=[*start, *[0.0] * n], rtol=1e-12)
    assert len(run["crossing_time"]) > 4
    at = np.searchsorted(run["time"].values, times, side="right") - 1
    assert np.abs(run["u"].values[at] - expected).max() < 1e-8


@pytest.mark.parametrize("e", [0.0, pytest.param(0.5, marks=pytest.mark.slow)])
def test_a_mass_in_a_ring_rolls_along_it(e: float) -> None:
    """The gap R - |q| has a curvature: what rests at the ring is pressed by v^2 / R too."""
    R, load, rate = 1.0, 1.5, 0.7

    def curvature(q: Array, v: Array) -> float:
        r = np.linalg.norm(q)
        return float(-(v @ v) / r + (q @ v) ** 2 / r**3)

    ring = Wall(lambda q: float(R - np.linalg.norm(q)), lambda q: -q / np.linalg.norm(q), curvature, e)

    def force(t: float, q: Array, v: Array) -> Array:
        return load * np.array([np.cos(rate * t), np.sin(rate * t)]) - 0.2 * v - 0.5 * q

    def radius(u: Any) -> Any:
        return np.sqrt(u.x**2 + u.y**2)

    def field(t: Any, u: Any, p: Any) -> Any:
        f = load * np.cos(rate * t) - 0.2 * u.vx - 0.5 * u.x, load * np.sin(rate * t) - 0.2 * u.vy - 0.5 * u.y
        return (u.vx, u.vy, *f)

    system = ns.System(
        states=["x", "y", "vx", "vy"],
        parameters={},
        modes={"all": field},
        elements={
            "ring": Stop(
                gap=lambda t, u, p: R - radius(u),
                restitution=e,
                on={"vx": lambda t, u, p: -u.x / radius(u), "vy": lambda t, u, p: -u.y / radius(u)},
            ),
            "rub": Coulomb(speed=lambda t, u, p: u.vx, on={"vx": 1.0}, friction=0.2, static=0.3),
        },
    )
    times = np.linspace(0.0, 1.2 * 2 * np.pi / rate, 49)
    reference = Masses(np.eye(2), force, [ring, Friction((1.0, 0.0), 0.2, 0.3)])
    expected = reference.run(np.array([0.3, 0.1]), np.array([0.2, 0.5]), times)
    run = ns.simulate(system, duration=times[-1], samples=times, start=[0.3, 0.1, 0.2, 0.5], rtol=1e-12)
    assert any(system.modes[m].startswith("ring_rest") for m in run["mode"].values)
    at = np.searchsorted(run["time"].values, times, side="right") - 1
    assert np.abs(run["u"].values[at] - expected).max() < 1e-8
