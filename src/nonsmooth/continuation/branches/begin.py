"""The curve through an orbit or a recorded point."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.branches.records import PointRecord
from nonsmooth.continuation.problems.orbits import Orbits, size_of
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import Round
from nonsmooth.system.system import System

__all__ = ["curve_of", "resumed_at"]


def curve_of(orbit: Orbit, name: str, width: float) -> tuple[Orbits, FloatArray]:
    """The curve through an orbit, and its unknowns."""
    system = orbit.system
    states = np.vstack([np.concatenate([orbit.u, orbit.memory]), orbit.crossing_states])
    once = Round(orbit.period_number, orbit.period, orbit.signature, orbit.crossing_times, states)
    shooting, X = Shooting.of(system, once, (name,), [system.values[name]])
    return _through(shooting, X, orbit, width)


def resumed_at(
    system: System, period_number: int, point: PointRecord, name: str, width: float
) -> tuple[Orbits, FloatArray]:
    """The curve through a recorded point."""
    return _through(Shooting(system, point.signature, period_number, (name,)), point.X, point, width)


def _through(shooting: Shooting, X: FloatArray, orbit: Any, width: float) -> tuple[Orbits, FloatArray]:
    size = size_of(orbit.maximum, orbit.minimum, shooting.system)
    shooting.prepare(X, size)
    return Orbits(shooting, size, orbit.period, (width,)), X
