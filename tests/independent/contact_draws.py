"""Random affine mechanical systems with contacts: duplicates, equal loads and singular combinations on purpose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from contact_elements import (
    Array,
    Backlash,
    Coulomb,
    ElasticStop,
    Element,
    Harmonic,
    PreloadedSpring,
    Stop,
    System,
    harmonic,
)

MASSES = (1.0, 1.0, 0.838, 1.3, 0.7, 2.0)
RESTITUTIONS = (0.0, 0.0, 0.0, 0.3, 0.5, 0.8, 0.95, 0.985, 0.999)
REST_SPEED = 1e-7


@dataclass(frozen=True)
class Draw:
    """One random system with its initial condition."""

    seed: int
    system: System
    q: Array
    v: Array

    @property
    def period(self) -> float:
        return 2 * np.pi / self.system.frequency

    def words(self) -> str:
        """Return the elements in short: kind and row."""
        signs = {1.0: "+", -1.0: "-", 0.0: "0"}
        return " ".join(f"{type(e).__name__}({''.join(signs[a] for a in e.at)})" for e in self.system.elements.values())


def random_contact_system(seed: int) -> Draw:
    """Return a system of one to four degrees of freedom with one to six elements."""
    rng = np.random.default_rng([seed, 2024])
    n = int(rng.choice([1, 2, 3, 4], p=[0.35, 0.35, 0.2, 0.1]))
    mass = np.diag(rng.choice(MASSES, n) if rng.random() < 0.8 else rng.uniform(0.5, 2.0, n))
    if n > 1 and rng.random() < 0.15:
        mass[0, 1] = mass[1, 0] = 0.2
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stiffness = chain * rng.choice([0.0, 1.0, rng.uniform(0.3, 3.0)], p=[0.2, 0.3, 0.5])
    damping = chain * rng.choice([0.0, 0.05, 0.2], p=[0.2, 0.5, 0.3])
    if not stiffness.any():
        damping = damping + 0.05 * np.eye(n)
    frequency = float(rng.choice([0.5, 0.7, 1.0, 1.3, rng.uniform(0.4, 2.0)]))
    loads = np.zeros((n, 3))
    for i in range(n):
        loads[i] = [
            rng.choice([0.0, 0.0, 0.3, 0.5, rng.uniform(-0.5, 0.5)]),
            rng.choice([0.0, 0.5, rng.normal()]),
            rng.choice([0.0, 0.0, rng.normal()]),
        ]
    if n > 1 and rng.random() < 0.3:
        loads[1] = loads[0]  # equal loads
    still = rng.random() < 0.4
    q = np.zeros(n) if rng.random() < 0.5 else rng.normal(size=n) * 0.3
    v = np.zeros(n) if still else rng.normal(size=n) * 0.7
    elements: dict[str, Element] = {}
    for i in range(int(rng.integers(1, 7))):
        known = list(elements.values())
        elements[f"e{i}"] = _element(rng, n, q, loads, known)
    return Draw(seed, System(mass, damping, stiffness, loads, frequency, elements), q, v)


def random_contact_stack(seed: int) -> Draw:
    """Return two to four masses on each other, shaken: stops between neighbours, impacts of closed contacts, rests."""
    rng = np.random.default_rng([seed, 7])
    n = int(rng.integers(2, 5))
    mass = np.diag(rng.choice(MASSES, n))
    chain = np.eye(n) if rng.random() < 0.5 else 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    stiffness, damping = chain * rng.choice([0.0, 0.0, 0.5]), chain * rng.choice([0.0, 0.1])
    frequency = float(rng.choice([1.0, 2.0, rng.uniform(0.7, 3.0)]))
    loads = np.zeros((n, 3))
    loads[:, 0] = -np.diag(mass) * rng.choice([1.0, 1.0, 0.4])  # weight
    loads[int(rng.integers(n)), 1:] = rng.normal(size=2) * rng.choice([0.3, 1.0, 2.0])
    e = rng.choice(RESTITUTIONS, n) if rng.random() < 0.6 else np.full(n, rng.choice(RESTITUTIONS))
    gaps = rng.choice([0.0, 0.2, rng.uniform(0.0, 0.5)], n)
    rows = np.eye(n) - np.eye(n, k=-1)
    elements: dict[str, Element] = {}
    for i, row in enumerate(rows):
        moving = i == 0 and rng.random() < 0.3
        floor = (0.0, 0.0, float(rng.normal() * 0.3)) if moving else 0.0
        elements[f"e{i}"] = Stop(tuple(map(float, row)), floor, -1, float(e[i]))
    for i in range(int(rng.integers(0, 3))):
        static = 0.2 if rng.random() < 0.3 else None
        row = rows[int(rng.integers(n))] if rng.random() < 0.5 else np.eye(n)[int(rng.integers(n))]
        elements[f"f{i}"] = Coulomb(tuple(map(float, row)), float(rng.choice([0.1, 0.15])), static)
    v = np.zeros(n) if rng.random() < 0.3 else np.abs(rng.normal(size=n)) * 0.5
    return Draw(seed, System(mass, damping, stiffness, loads, frequency, elements), np.cumsum(gaps), v)


def _row(rng: np.random.Generator, n: int) -> tuple[float, ...]:
    row = np.zeros(n)
    i, j = rng.permutation(n)[:2] if n > 1 else (0, 0)
    row[i] = 1.0
    if n > 1 and rng.random() < 0.4:
        row[j] = rng.choice([-1.0, -1.0, 1.0])
    return tuple(map(float, row))


def _element(rng: np.random.Generator, n: int, q: Array, loads: Array, known: list[Element]) -> Element:
    kind = rng.choice(["stop", "elastic", "backlash", "preload", "friction"], p=[0.35, 0.12, 0.08, 0.1, 0.35])
    twin = known[rng.integers(len(known))] if known and rng.random() < 0.4 else None
    at = twin.at if twin else _row(rng, n)
    here = float(np.array(at) @ q)
    if kind == "stop":
        side = int(rng.choice([1, -1]))
        position: float | Harmonic = here + side * float(rng.choice([0.0, 0.1, 0.5, 1.0, rng.uniform(0, 1.0)]))
        if isinstance(twin, Stop) and rng.random() < 0.5:
            position, side = twin.position, twin.side  # two stops at one place
        elif rng.random() < 0.08 and not any(isinstance(e, Stop) for e in known):
            position = (here + side * 0.6, float(rng.normal() * 0.1), float(rng.normal() * 0.1))
        return Stop(at, position, side, float(rng.choice(RESTITUTIONS)))
    if kind == "elastic":
        side = int(rng.choice([1, -1]))
        return ElasticStop(
            at,
            here + side * float(rng.choice([0.0, 0.2, rng.uniform(-0.1, 1)])),
            side,
            float(rng.choice([10.0, 100.0, 1000.0])),
            float(rng.choice([0.0, 0.5, 3.0])),
            bool(rng.random() < 0.3),
        )
    if kind == "backlash":
        return Backlash(at, float(rng.choice([0.05, 0.2])), float(rng.choice([1.0, 20.0])), float(rng.choice([0, 0.1])))
    if kind == "preload":
        return PreloadedSpring(at, float(rng.choice([0.1, 0.3, 0.5])), float(rng.choice([0.0, 1.0, 5.0])))
    friction = float(rng.choice([0.1, 0.3, 0.5, rng.uniform(0.05, 1.0)]))
    if rng.random() < 0.1 and loads[0, 0]:
        friction = abs(float(loads[0, 0]))  # a mean load equal to the friction
    static = friction * float(rng.choice([1.5, 2.0])) if rng.random() < 0.4 else None
    belt: float | Harmonic = float(rng.choice([0.0, 0.0, 0.0, 0.5, -0.3]))
    if rng.random() < 0.08:
        belt = (0.1, 0.0, float(rng.normal() * 0.3))
    return Coulomb(at, friction, static, belt)


def as_nonsmooth(draw: Draw, floors: bool = False) -> Any:
    """Return the same system through the public constructors; with ``floors`` each friction (of one bound) as a mass
    of its own that a load of 2 presses on a floor, which rubs."""
    from scipy.linalg import block_diag

    import nonsmooth as ns

    s = draw.system
    n, w = len(s.mass), s.frequency
    pressed = [name for name, e in s.elements.items() if floors and isinstance(e, Coulomb)]
    names = [f"q{i + 1}" for i in range(n)]

    def law(value: float | Harmonic) -> Any:
        c, a, b = harmonic(value)
        return (lambda t, u, p: c + a * np.cos(w * t) + b * np.sin(w * t)) if a or b else c

    def load(row: Array) -> Callable[[Any, Any], Any]:
        c, a, b = map(float, row)
        return lambda t, p: c + a * np.cos(w * t) + b * np.sin(w * t)

    built: dict[str, Any] = {}
    for name, e in s.elements.items():
        at = {q: a for q, a in zip(names, e.at, strict=True) if a}
        if isinstance(e, Stop):
            built[name] = ns.elements.Stop(
                at=at, position=law(e.position), side=e.side, restitution=e.restitution, creep=REST_SPEED
            )
        elif isinstance(e, ElasticStop):
            built[name] = ns.elements.ElasticStop(
                at=at, position=law(e.position), side=e.side, stiffness=e.stiffness, damping=e.damping, pulls=e.pulls
            )
        elif isinstance(e, Backlash):
            built[name] = ns.elements.Backlash(at=at, half_width=e.half_width, stiffness=e.stiffness, damping=e.damping)
        elif isinstance(e, PreloadedSpring):
            built[name] = ns.elements.PreloadedSpring(at=at, preload=e.preload, stiffness=e.stiffness)
        elif floors:
            built[name] = ns.elements.Stop(
                at=f"y_{name}", side=-1, friction=e.friction / 2.0, tangent=at, belt=law(e.belt)
            )
        else:
            built[name] = ns.elements.Coulomb(at=at, friction=e.friction, static=e.static, belt=law(e.belt))
    forcing = {q: load(row) for q, row in zip(names, s.loads, strict=True) if row.any()}
    forcing |= {f"y_{name}": lambda t, p: -2.0 for name in pressed}
    more, none = np.diag([0.838] * len(pressed)), np.zeros((len(pressed),) * 2)
    return ns.mechanical(
        block_diag(s.mass, more),
        block_diag(s.damping, none),
        block_diag(s.stiffness, none),
        parameters={},
        forcing=forcing,
        elements=built,
        coordinates=[*names, *(f"y_{name}" for name in pressed)],
        period=draw.period,
    )
