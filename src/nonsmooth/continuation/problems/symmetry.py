"""Symmetries of an orbit: gone round twice, its own mirror image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits

__all__ = ["breaks_symmetry", "is_doubled"]


def is_doubled(curve: Orbits, point: OrbitPoint) -> bool:
    """Return whether an orbit is a shorter one gone round twice, as where a doubled branch meets its flip."""
    shooting = curve.shooting
    visits, m = shooting.signature.visits, shooting.m
    if m % 2 or (shooting.forced and shooting.period_number % 2):
        return False
    word = [(v.mode, v.transition, v.row) for v in visits[:-1]]
    if word[: m // 2] != word[m // 2 :]:
        return False
    half = _state_in(curve, point, m // 2, 0.5 * float(point.solved.times[-1]))
    here = point.X[: len(half)]
    return bool(np.abs((half - here) / curve.size[: len(half)]).max() < 1e-4)


def breaks_symmetry(curve: Orbits, point: OrbitPoint) -> bool:
    """Return whether an orbit at a branch point is its own mirror image under the system's declared symmetry."""
    symmetry = curve.shooting.system.symmetry
    if symmetry is None:
        return False
    system, shooting = curve.shooting.system, curve.shooting
    from sympy import lambdify

    traced = system.traced
    image = lambdify([traced.t, list(traced.u), list(traced.p)], list(symmetry.map), "numpy")
    # u(t) -> map(u(t + shift T)): compare the section point with the mapped state one shift later.
    period = system.period_at(point.solved.values) or float(point.solved.times[-1])
    state = _state_at(curve, point, symmetry.shift * period)
    mapped = np.array(image(0.0, list(state), list(point.solved.values)), dtype=float)
    here = point.X[: len(traced.u)]
    return bool(np.abs((mapped - here) / curve.size[: len(here)]).max() < 1e-6 and shooting.period_number % 2 == 1)


def _state_at(curve: Orbits, point: OrbitPoint, t: float) -> FloatArray:
    """The state at a time after the section."""
    return _state_in(curve, point, int(np.searchsorted(point.solved.times[1:-1], t, side="right")), t)


def _state_in(curve: Orbits, point: OrbitPoint, i: int, t: float) -> FloatArray:
    """The state at a time that lies in visit i, or at its ends."""
    states = curve.shooting.split(point.X)[1]
    mode, begin = curve.shooting.signature.visits[i].mode, float(point.solved.times[i])
    segments = curve.shooting.flow.segments(point.solved.values, [mode], [begin], [t - begin], states[i][None, :])
    return np.asarray(segments.z[0, : len(curve.shooting.system.states)])
