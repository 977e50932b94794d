"""Continuation of a branch behind a change of signature.

From the common orbit of both signatures it goes along the null vector of the new equations, on the side where the path
is admissible.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.anchor import anchor_at, anchored
from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.change import Change
from nonsmooth.continuation.shooting import Shooting
from nonsmooth.continuation.surfaces import look_at_surfaces

__all__ = ["common_point", "resumed"]

FloatArray = NDArray[np.float64]
COMMON = 1e-6  # scaled residual of the common orbit in the new equations
STEPS = (2e-6, 1e-6, 1e-7, 1e-5, 1e-4, 1e-8)  # first steps after a change


def resumed(curve: Curve, point: Point, change: Change) -> tuple[Curve, Point, float] | None:
    """The curve of the new signature, its first admissible point, and the step that led there."""
    fresh, X = _curve(curve, change, point)
    Y = X / fresh.scale
    solved = fresh.shooting.evaluate(X)
    if not np.isfinite(solved.residual).all() or np.abs(solved.residual * fresh.rows).max() > COMMON:
        return None
    if change.kind == "section":
        return _same_way(fresh, Y, curve, point)
    null = fresh.null_vectors(solved)
    for ds in STEPS:
        for direction in _directions(null):
            guess = Y + ds * direction
            found = fresh.correct(guess, direction, float(direction @ guess))
            if found is None:
                continue
            first = fresh.point(found[0], found[1], direction)
            if first is not None and (first.path.violation() > 0.0).all():
                return fresh, first, ds
    return None


def common_point(curve: Curve, point: Point, change: Change) -> Point | None:
    """The common orbit as a point of the new signature."""
    fresh, X = _curve(curve, change, point)
    solved = fresh.shooting.evaluate(X)
    null = fresh.null_vectors(solved)
    return fresh.point(solved, X / fresh.scale, null[-1]) if len(null) else None


def _directions(null: FloatArray) -> list[FloatArray]:
    """Both ways along each null vector."""
    return [sign * vector for vector in null for sign in (1.0, -1.0)]


def _same_way(fresh: Curve, Y: FloatArray, curve: Curve, point: Point) -> tuple[Curve, Point, float] | None:
    """Go on in the same direction: the parameter's, or that of the state at the section near a fold."""
    border = np.zeros(fresh.n)
    border[-1] = 1.0
    found = fresh.correct(Y, border, float(Y[-1]))
    if found is None:
        solved = fresh.shooting.evaluate(Y * fresh.scale)
        null = fresh.null_vectors(solved)
        if len(null) != 1:
            return None
        found = fresh.correct(Y, null[0], float(null[0] @ Y))
        if found is None:
            return None
    null = fresh.null_vectors(found[0])
    if not len(null):
        return None
    tangent = null[-1]
    old = point.tangent
    # The tangents of both live in different unknowns; the parameter and the later instants are common to them.
    if abs(old[-1]) > 1e-3:
        tangent = tangent * np.sign(tangent[-1] * old[-1])
    else:
        tangent = tangent * np.sign(float(tangent[: fresh.shooting.n] @ old[: fresh.shooting.n]) or 1.0)
    first = fresh.point(found[0], found[1], tangent)
    return None if first is None else (fresh, first, 0.0)


def _curve(curve: Curve, change: Change, point: Point) -> tuple[Curve, FloatArray]:
    """The curve of a change's signature, and the common orbit in its unknowns."""
    old, values = curve.shooting, point.solved.values
    signature, times, states = change.signature, change.times, change.states
    period = None if old.forced else float(point.solved.times[-1])
    if period is not None and len(times):
        signature, times, states = anchored(old.flow, values, signature, times, states, period)
    shooting = Shooting(old.system, signature, old.period_number, old.active)
    anchor_at(shooting, values, states[0], curve.size)
    X = shooting.join(times, states, period, point.X[old.size :])
    look_at_surfaces(shooting, X)
    return Curve(shooting, curve.size, curve.period, curve.width), X
