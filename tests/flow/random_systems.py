"""Ten piecewise-smooth systems whose every number is a parameter, and random draws of them.

Two to four states; linear and nonlinear; with and without resets; surfaces that move and that do not; memory, modes
with fewer states, transitions at a phase, and the smoothed switch. Each comes with the parameters in which its runs are
differentiated. Draws are made by ``draw``: parameters, a start and a duration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

import nonsmooth as ns


@dataclass(frozen=True)
class Template:
    system: ns.System
    active: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]
    start: tuple[float, float]  # every state is drawn from this interval
    duration: tuple[float, float]


def draw(template: Template, rng: np.random.Generator):
    """(system, start, duration) with every number random."""
    system = template.system.with_parameters({k: rng.uniform(*r) for k, r in template.ranges.items()})
    start = rng.uniform(*template.start, size=len(system.states))
    return system, start, rng.uniform(*template.duration)


def _parameters(ranges: dict[str, tuple[float, float]]) -> dict[str, float]:
    return {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}


def _matrix(name: str, n: int) -> dict[str, tuple[float, float]]:
    """Entries of a damped rotation, roughly: -0.3 on the diagonal, anything beside it."""
    return {f"{name}{i}{j}": (-0.5, -0.1) if i == j else (-1.5, 1.5) for i in range(n) for j in range(n)}


def _product(p, name: str, u) -> list:
    n = len(u)
    return [sum(getattr(p, f"{name}{i}{j}") * u[j] for j in range(n)) for i in range(n)]


@cache
def bilinear() -> Template:
    """Two states, a support with spring, damper and preload behind a moving gap; no reset."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "k_s": (1.0, 8.0),
        "c_s": (0.1, 1.0),
        "b": (-1.0, 1.0),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (-0.3, 0.5),
        "a": (0.0, 0.3),
    }

    def wall(t, u, p):
        return u.x - p.g - p.a * np.sin(p.w * t)

    def free(t, u, p):
        return u.v, p.F * np.cos(p.w * t) - p.k * u.x - p.c * u.v

    def contact(t, u, p):
        return u.v, free(t, u, p)[1] - p.k_s * (u.x - p.g) - p.c_s * u.v + p.b

    system = ns.System(
        name="bilinear",
        states=["x", "v"],
        parameters=_parameters(ranges),
        modes={"free": free, "contact": contact},
        indicators={"wall": wall},
        transitions=[
            ns.Transition("free", "contact", when="wall > 0"),
            ns.Transition("contact", "free", when="wall < 0"),
        ],
    )
    return Template(system, ("w", "g", "a", "k_s"), ranges, (-1.5, 1.5), (4.0, 12.0))


@cache
def impact() -> Template:
    """Two states, impacts on a moving wall with restitution and a loss of position (a reset that mixes the states)."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (0.2, 0.8),
        "a": (0.0, 0.2),
        "e": (0.5, 0.9),
        "d": (0.0, 0.1),
    }

    def wall(t, u, p):
        return u.x - p.g - p.a * np.sin(p.w * t)

    def flight(t, u, p):
        return u.v, p.F * np.cos(p.w * t) - p.k * u.x - p.c * u.v

    def bounce(t, u, p):
        speed = p.a * p.w * np.cos(p.w * t)
        return u.x - p.d * (u.v - speed), speed - p.e * (u.v - speed)

    system = ns.System(
        name="impact",
        states=["x", "v"],
        parameters=_parameters(ranges),
        modes={"flight": flight},
        indicators={"wall": wall},
        transitions=[ns.Transition("flight", "flight", when="wall > 0", reset=bounce)],
    )
    return Template(system, ("w", "g", "a", "e"), ranges, (-1.5, 0.1), (4.0, 10.0))


@cache
def relay() -> Template:
    """Four states, two full matrices, a relay with hysteresis whose upper threshold moves."""
    ranges = (
        _matrix("A", 4)
        | _matrix("B", 4)
        | {
            "c1": (-1.0, 1.0),
            "c2": (-1.0, 1.0),
            "g1": (0.3, 0.8),
            "g2": (0.3, 0.8),
            "a": (0.0, 0.2),
            "w": (0.5, 2.0),
            "s": (0.5, 2.0),
            "F": (0.0, 1.0),
        }
    )

    def field(name, sign):
        def vector(t, u, p):
            x, y, z, r = _product(p, name, u)
            return x + sign * p.s, y, z + p.F * np.cos(p.w * t), r

        return vector

    def signal(u, p):
        return u.x + p.c1 * u.y + p.c2 * u.z

    system = ns.System(
        name="relay",
        states=["x", "y", "z", "r"],
        parameters=_parameters(ranges),
        modes={"up": field("A", 1.0), "down": field("B", -1.0)},
        indicators={
            "high": lambda t, u, p: signal(u, p) - p.g1 - p.a * np.sin(p.w * t),
            "low": lambda t, u, p: signal(u, p) + p.g2,
        },
        transitions=[ns.Transition("up", "down", when="high > 0"), ns.Transition("down", "up", when="low < 0")],
    )
    return Template(system, ("w", "g1", "a", "A01"), ranges, (-0.5, 0.2), (3.0, 8.0))


@cache
def shell() -> Template:
    """Three states, nonlinear fields, round thresholds of which one breathes; a nonlinear reset at the outer one."""
    ranges = {
        "r": (0.1, 0.5),
        "q": (0.1, 0.5),
        "w": (0.5, 2.0),
        "R": (1.2, 1.8),
        "S": (0.3, 0.6),
        "a": (0.0, 0.2),
        "e": (0.6, 0.8),
        "b": (0.0, 0.3),
        "n": (0.5, 2.0),
    }

    def size(u):
        return u.x**2 + u.y**2 + 0.7 * u.z**2 + 0.3 * u.x * u.z

    def out(t, u, p):
        return p.r * u.x - u.y + p.b * u.y * u.z, u.x + p.r * u.y - u.x * u.z, p.r * u.z + p.n * u.x * u.y

    def home(t, u, p):
        return -p.q * u.x - p.n * u.y, p.n * u.x - p.q * u.y - u.x * u.z, -p.q * u.z + p.b * np.sin(u.x * u.y)

    def squash(t, u, p):
        return p.e * u.x, p.e * u.y + p.b * 0.2 * u.x * u.y, p.e * u.z + 0.1 * p.a * np.cos(p.w * t)

    system = ns.System(
        name="shell",
        states=["x", "y", "z"],
        parameters=_parameters(ranges),
        modes={"out": out, "home": home},
        indicators={
            "outer": lambda t, u, p: size(u) - p.R - p.a * np.sin(p.w * t),
            "inner": lambda t, u, p: size(u) - p.S,
        },
        transitions=[
            ns.Transition("out", "home", when="outer > 0", reset=squash),
            ns.Transition("home", "out", when="inner < 0"),
        ],
    )
    return Template(system, ("w", "R", "e", "n"), ranges, (-0.6, 0.6), (4.0, 10.0))


@cache
def two_masses() -> Template:
    """Four states, two masses on springs that hit each other: momentum is kept, energy is not."""
    ranges = {
        "m": (0.5, 2.0),
        "k1": (0.5, 2.0),
        "k2": (0.5, 2.0),
        "k12": (0.1, 0.5),
        "c": (0.05, 0.3),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (0.1, 0.6),
        "e": (0.5, 0.9),
    }

    def field(t, u, p):
        coupling = p.k12 * (u.x - u.y)
        return (
            u.v,
            p.F * np.cos(p.w * t) - p.k1 * u.x - p.c * u.v - coupling,
            u.r,
            (-p.k2 * u.y - p.c * u.r + coupling) / p.m,
        )

    def strike(t, u, p):
        impulse = (1 + p.e) * (u.v - u.r) * p.m / (1 + p.m)
        return u.x, u.v - impulse, u.y, u.r + impulse / p.m

    system = ns.System(
        name="two masses",
        states=["x", "v", "y", "r"],
        parameters=_parameters(ranges),
        modes={"apart": field},
        indicators={"gap": lambda t, u, p: u.x - u.y - p.g},
        transitions=[ns.Transition("apart", "apart", when="gap > 0", reset=strike)],
    )
    return Template(system, ("w", "g", "e", "m"), ranges, (-1.0, 0.05), (4.0, 10.0))


@cache
def pendula() -> Template:
    """Four states, two coupled pendula, one of which meets a soft rim that moves; a jump of the force, no reset."""
    ranges = {
        "l": (0.7, 1.5),
        "c": (0.05, 0.3),
        "k": (0.1, 0.6),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (-0.3, 0.4),
        "a": (0.0, 0.2),
        "b": (0.2, 1.0),
        "s": (1.0, 4.0),
    }

    def rim(t, u, p):
        return np.sin(u.x) + 0.3 * u.y - p.g - p.a * np.cos(p.w * t)

    def free(t, u, p):
        return (
            u.v,
            p.F * np.cos(p.w * t) - p.l * np.sin(u.x) - p.c * u.v - p.k * (u.x - u.y),
            u.r,
            -np.sin(u.y) - p.c * u.r + p.k * (u.x - u.y),
        )

    def pressed(t, u, p):
        push = p.b + p.s * rim(t, u, p) + p.b * u.v
        x, v, y, r = free(t, u, p)
        return x, v - push * np.cos(u.x), y, r - 0.3 * push

    system = ns.System(
        name="pendula",
        states=["x", "v", "y", "r"],
        parameters=_parameters(ranges),
        modes={"free": free, "pressed": pressed},
        indicators={"rim": rim},
        transitions=[
            ns.Transition("free", "pressed", when="rim > 0"),
            ns.Transition("pressed", "free", when="rim < 0"),
        ],
    )
    return Template(system, ("w", "g", "a", "s"), ranges, (-1.0, 1.0), (4.0, 9.0))


@cache
def remembering() -> Template:
    """Two states and memory: a latch keeps the speed of its last entry, and the field reads it."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (-0.2, 0.5),
        "d": (0.2, 1.0),
        "n": (0.0, 0.5),
        "m0": (-0.5, 0.5),
    }

    def free(t, u, p):
        return u.v, p.F * np.cos(p.w * t) - p.k * u.x - p.c * u.v - p.n * u.x**3 + 0.2 * p.v_a

    def held(t, u, p):
        return u.v, free(t, u, p)[1] - p.d * u.v * p.v_a - p.d

    system = ns.System(
        name="remembering",
        states=["x", "v"],
        parameters=_parameters(ranges),
        modes={"free": free, "held": held},
        memory={"v_a": (0.3, "")},
        indicators={"wall": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition("free", "held", when="wall > 0", write={"v_a": lambda t, u, p: u.v + p.d * u.x}),
            ns.Transition("held", "free", when="wall < 0", write={"v_a": lambda t, u, p: 0.5 * p.v_a + u.v * p.m0}),
        ],
    )
    return Template(system, ("w", "g", "d", "m0"), ranges, (-1.5, 1.5), (4.0, 10.0))


@cache
def growing() -> Template:
    """A mode of two states and one of four, two being made at the entry and dropped at the way out."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "g": (-0.2, 0.5),
        "s": (1.0, 4.0),
        "T": (0.3, 1.0),
        "e": (0.1, 0.6),
    }

    def free(t, u, p):
        return u.v, p.F * np.cos(p.w * t) - p.k * u.x - p.c * u.v

    def pressed(t, u, p):
        v, a = free(t, u, p)
        return v, a - p.s * (u.x - p.g) - u.y, (u.v - u.y) / p.T, u.y - u.z

    system = ns.System(
        name="growing",
        states=["x", "v", "y", "z"],
        parameters=_parameters(ranges),
        modes={"free": ns.Mode(free, states=["x", "v"]), "pressed": pressed},
        indicators={"wall": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition("free", "pressed", when="wall > 0", reset=lambda t, u, p: (u.x, u.v, p.e * u.v, u.x)),
            ns.Transition("pressed", "free", when="wall < 0", reset=lambda t, u, p: (u.x, u.v + p.e * (u.y - u.z))),
        ],
    )
    return Template(system, ("w", "g", "e", "T"), ranges, (-1.5, -0.2), (4.0, 10.0))


@cache
def pulsed() -> Template:
    """Two states, a cubic spring, a force that changes its sign at a phase, a kick at another; and a wall."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "n": (0.1, 0.5),
        "F": (0.5, 1.5),
        "w": (0.8, 2.0),
        "g": (0.5, 1.0),
        "e": (0.5, 0.9),
        "j": (-0.5, 0.5),
    }

    def field(sign):
        def vector(t, u, p):
            return u.v, sign * p.F - p.k * u.x - p.c * u.v - p.n * u.x**3

        return vector

    def bounce(t, u, p):
        return u.x, -p.e * u.v

    system = ns.System(
        name="pulsed",
        states=["x", "v"],
        parameters=_parameters(ranges),
        period=lambda p: 2 * np.pi / p.w,
        modes={"plus": field(1.0), "minus": field(-1.0)},
        indicators={"wall": lambda t, u, p: u.x - p.g},
        transitions=[
            ns.Transition("plus", "minus", at=0.5),
            ns.Transition("minus", "plus", at=0.9, reset=lambda t, u, p: (u.x, u.v + p.j * u.x)),
            ns.Transition("plus", "plus", when="wall > 0", reset=bounce),
            ns.Transition("minus", "minus", when="wall > 0", reset=bounce),
        ],
    )
    return Template(system, ("w", "g", "F", "e", "j"), ranges, (-1.0, 0.4), (4.0, 10.0))


@cache
def smoothed() -> Template:
    """The paper's smoothed switch: two states and the velocity at which the band was entered, at sizes of order one."""
    ranges = {
        "m": (0.8, 1.2),
        "k": (0.3, 1.0),
        "k_s": (1.0, 8.0),
        "c": (0.05, 0.4),
        "c_s": (0.1, 0.6),
        "g": (-0.3, 0.5),
        "rho": (0.5, 2.0),
        "omega": (0.6, 1.8),
        "eta": (0.02, 0.1),
    }
    system = ns.models.discontinuous_support().with_parameters(
        {k: v for k, v in _parameters(ranges).items() if k != "eta"}
    )
    return Template(system.smoothed(0.05), ("omega", "g", "c_s", "eta"), ranges, (-1.5, 1.0), (3.0, 8.0))


TEMPLATES: dict[str, Callable[[], Template]] = {
    make.__name__: make
    for make in (bilinear, impact, relay, shell, two_masses, pendula, remembering, growing, pulsed, smoothed)
}
