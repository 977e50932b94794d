"""Affine mechanical systems with contact elements as plain numbers, for the independent reference of contacts.

M q'' + C q' + K q = loads(t) + forces of the elements. Everything is a row over the state
z = (q, v, 1, cos w t, sin w t): a load, a gap, a slip speed. Nothing here imports nonsmooth.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Harmonic = tuple[float, float, float]  # constant, cosine, sine


def harmonic(value: float | Harmonic) -> Harmonic:
    return tuple(map(float, value)) if isinstance(value, tuple) else (float(value), 0.0, 0.0)


@dataclass(frozen=True)
class Stop:
    """Rigid stop at ``at . q = position``; the mass stays below it (side 1) or above it (side -1)."""

    at: tuple[float, ...]
    position: float | Harmonic = 0.0
    side: int = 1
    restitution: float = 0.0


@dataclass(frozen=True)
class ElasticStop:
    """Force -k g - c g' along the gap g while g < 0 and it pushes (``pulls``: while g < 0)."""

    at: tuple[float, ...]
    position: float | Harmonic = 0.0
    side: int = 1
    stiffness: float = 0.0
    damping: float = 0.0
    pulls: bool = False


@dataclass(frozen=True)
class Backlash:
    """-k (s - b) - c s' for s > b and its mirror image for s < -b: two elastic stops that pull."""

    at: tuple[float, ...]
    half_width: float
    stiffness: float
    damping: float = 0.0


@dataclass(frozen=True)
class PreloadedSpring:
    """-P - k s for s > 0, P - k s for s < 0, whatever holds within +-P at s = 0."""

    at: tuple[float, ...]
    preload: float
    stiffness: float = 0.0


@dataclass(frozen=True)
class Coulomb:
    """Dry friction of bound ``friction`` while slipping and ``static`` while sticking on a belt."""

    at: tuple[float, ...]
    friction: float
    static: float | None = None
    belt: float | Harmonic = 0.0


Element = Stop | ElasticStop | Backlash | PreloadedSpring | Coulomb


@dataclass(frozen=True)
class System:
    """Matrices, loads (n rows of constant, cosine, sine), frequency and named elements."""

    mass: Array
    damping: Array
    stiffness: Array
    loads: Array
    frequency: float
    elements: dict[str, Element] = field(default_factory=dict)


def one_mass(
    mass: float = 1.0,
    damping: float = 0.0,
    stiffness: float = 0.0,
    load: float | Harmonic = 0.0,
    frequency: float = 1.0,
    **elements: Element,
) -> System:
    """Return the system of one coordinate; the worked cases are mostly these."""
    matrices = (np.array([[float(x)]]) for x in (mass, damping, stiffness))
    return System(*matrices, np.array([harmonic(load)]), frequency, elements)


@dataclass(frozen=True)
class Part:
    """One element in rows over z: ``zero`` is the gap or displacement (none for frictions), ``rate`` its rate."""

    name: str
    kind: str  # stop, elastic, friction, preload
    direction: Array  # what the force of this element acts along
    rate: Array
    zero: Array
    numbers: dict[str, float]


def parts(system: System) -> tuple[Part, ...]:
    """Return the elements as rows; a backlash is two parts."""
    n, w = len(system.mass), system.frequency
    out: list[Part] = []

    def add(name: str, kind: str, at: tuple[float, ...], offset: Harmonic, sign: float, **numbers: float) -> None:
        """The quantity is sign * (offset - at . q), its rate likewise; of a friction it is a rate already."""
        direction = -sign * np.array(at, float)
        row = np.concatenate(
            (
                np.zeros(n) if kind == "friction" else direction,
                direction if kind == "friction" else np.zeros(n),
                sign * np.array(offset),
            )
        )
        rate = row if kind == "friction" else row @ kinematics(n, w)
        out.append(Part(name, kind, direction, rate, row, numbers))

    for name, e in system.elements.items():
        if isinstance(e, Stop):
            add(name, "stop", e.at, harmonic(e.position), e.side, e=e.restitution)
        elif isinstance(e, ElasticStop):
            add(name, "elastic", e.at, harmonic(e.position), e.side, k=e.stiffness, c=e.damping, pulls=e.pulls)
        elif isinstance(e, Backlash):
            for side in (1, -1):
                add(name, "elastic", e.at, harmonic(side * e.half_width), side, k=e.stiffness, c=e.damping, pulls=1)
        elif isinstance(e, PreloadedSpring):
            add(name, "preload", e.at, harmonic(0.0), -1, static=e.preload, kinetic=e.preload, k=e.stiffness)
        else:
            static = e.friction if e.static is None else e.static
            add(name, "friction", e.at, harmonic(e.belt), -1, static=static, kinetic=e.friction)
    return tuple(out)


def kinematics(n: int, w: float) -> Array:
    """Return z' = N z without the accelerations."""
    out = np.zeros((2 * n + 3, 2 * n + 3))
    out[:n, n : 2 * n] = np.eye(n)
    out[2 * n + 1, 2 * n + 2], out[2 * n + 2, 2 * n + 1] = -w, w
    return out
