"""Beginning of a march: the curve through an orbit or a recorded point, and its range."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.branches.records import PointRecord
from nonsmooth.continuation.problems.anchor import anchor_at
from nonsmooth.continuation.problems.orbits import Orbits
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.surfaces import look_at_surfaces
from nonsmooth.errors import shortened
from nonsmooth.flow.arguments import real_number

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["curve_of", "largest_step", "limits", "resumed_at", "size_of"]


def largest_step(step: Any) -> float:
    """The largest step, checked."""
    largest = real_number(step, "step")
    if not 0 < largest <= 1:
        raise ValueError(f"step = {step!r}: the largest step is above 0 and at most 1 (the branch's own size is 1)")
    return largest


def limits(
    system: System, name: Any, given: Any, here: float | None, *, word: str = "range", what: str = "the orbit"
) -> tuple[float, float]:
    """The range given for a parameter, checked; ``here``: where ``what`` lies, which must be within it."""
    if not isinstance(name, str) or name not in system.values:
        system.with_parameters({str(name): 0.0})  # raises with the names there are
    try:
        low, high = (real_number(x, "an end of the range") for x in given)
    except (TypeError, ValueError):
        raise ValueError(f"{word} = {shortened(given)}: give its two ends, (low, high)") from None
    if not low < high:
        raise ValueError(f"{word} = {shortened(given)}: the first end must be below the second")
    if here is not None and not low <= here <= high:
        raise ValueError(f"{what} lies at {name} = {here!r}, outside the range {low!r} ... {high!r}")
    return low, high


def size_of(maximum: FloatArray, minimum: FloatArray, system: System) -> FloatArray:
    """Half the range of each state, and 1 for the memory; of a state that no mode moves at least its absolute value.

    Between two resets such a state has no range that could tell how far it moves along a branch."""
    half = np.maximum(np.nan_to_num(0.5 * (maximum - minimum)), 1e-3 * system.scale_vector())
    still = np.array([all(field[i] == 0 for field in system.traced.fields) for i in range(len(half))])
    largest = np.nan_to_num(np.maximum(np.abs(maximum), np.abs(minimum)))
    return np.concatenate([np.where(still, np.maximum(half, largest), half), np.ones(len(system.memory))])


def curve_of(orbit: Orbit, name: str, width: float) -> tuple[Orbits, FloatArray]:
    """The curve through an orbit, and its unknowns."""
    system = orbit.system
    shooting = Shooting(system, orbit.signature, orbit.period_number, (name,))
    size = size_of(orbit.maximum, orbit.minimum, system)
    section = np.concatenate([orbit.u, orbit.memory])
    anchor_at(shooting, shooting.values, section, size)
    X = shooting.join(
        orbit.crossing_times, np.vstack([section, orbit.crossing_states]), orbit.period, [system.values[name]]
    )
    look_at_surfaces(shooting, X)
    return Orbits(shooting, size, orbit.period, (width,)), X


def resumed_at(
    system: System, period_number: int, point: PointRecord, name: str, width: float
) -> tuple[Orbits, FloatArray]:
    """The curve through a recorded point."""
    shooting = Shooting(system, point.signature, period_number, (name,))
    size = size_of(point.maximum, point.minimum, system)
    anchor_at(shooting, shooting.parameters(point.X), point.X[: shooting.n], size)
    look_at_surfaces(shooting, point.X)
    return Orbits(shooting, size, point.period, (width,)), point.X
