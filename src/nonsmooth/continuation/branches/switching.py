"""Branch switching: the other directions at a branch point, and orbits of twice the period at a flip."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Curve
from nonsmooth.continuation.problems.shooting import Shooting

if TYPE_CHECKING:
    from nonsmooth.continuation.march.arclength import Point

__all__ = ["branch_point", "breaks_symmetry", "doubled", "emanating", "is_doubled", "other_direction"]

FloatArray = NDArray[np.float64]


def doubled(shooting: Shooting, X: FloatArray) -> tuple[Shooting, FloatArray]:
    """The same orbit gone round twice."""
    n = shooting.period_number
    times, states = shooting.split(X)
    period = shooting.period(X)
    signature = shooting.signature.repeated(2, n)
    twice = Shooting(shooting.system, signature, 2 * n, shooting.active)
    # The second round begins at the section within the last visit, which is not a crossing.
    t2 = np.concatenate([times, times + period])
    z2 = np.concatenate([states, states[1:]])
    X2 = twice.join(t2, z2, 2 * period, X[shooting.size :])
    twice.divided, twice.alone = 2 * shooting.divided, 2 * shooting.alone
    if shooting.reference is not None:
        twice.reference = shooting.reference
    return twice, X2


def other_direction(curve: Curve, X: FloatArray, along: FloatArray | None) -> FloatArray | None:
    """A unit vector that the Jacobian at a branch point takes to zero, across the direction ``along`` already known.

    ``along`` is None where only the null vectors are known: then the one with no component in the parameter.
    """
    solved = curve.shooting.evaluate(X)
    _, _, right = np.linalg.svd(solved.jacobian * curve.weights)
    plane = right[-2:]
    if along is None:
        a, b = plane
        vector = a * b[-1] - b * a[-1]
    else:
        inside = plane @ along
        vector = np.array([-inside[1], inside[0]]) @ plane
    length = float(np.linalg.norm(vector))
    return None if length < 1e-12 else vector / length


def branch_point(curve: Curve, Y: FloatArray, *, tolerance: float = 1e-11, most: int = 12) -> FloatArray | None:
    r"""The crossing of branches near Y, to the last digits (Moore's system, which is regular there).

    .. math:: F(Y) + \beta \psi_0 = 0, \quad F_Y^T \psi = 0, \quad \psi_0 \cdot \psi = 1

    in Y, psi and beta, with :math:`\beta = 0` at the solution; second derivatives by central differences.
    """
    shooting, n = curve.shooting, len(Y) - 1

    def scaled(Z: FloatArray) -> tuple[FloatArray, FloatArray]:
        solved = shooting.evaluate(Z * curve.scale)
        return solved.residual * curve.rows, solved.jacobian * curve.weights

    _, J = scaled(Y)
    psi = np.linalg.svd(J)[0][:, -1]
    first, beta, step = psi.copy(), 0.0, 1e-5
    for _ in range(most):
        F, J = scaled(Y)
        second = np.empty((n + 1, n + 1))
        for j in range(n + 1):
            moved = np.zeros(n + 1)
            moved[j] = step
            second[:, j] = (scaled(Y + moved)[1] - scaled(Y - moved)[1]).T @ psi / (2 * step)
        matrix = np.zeros((2 * n + 2, 2 * n + 2))
        matrix[:n, : n + 1], matrix[:n, -1] = J, first
        matrix[n : 2 * n + 1, : n + 1], matrix[n : 2 * n + 1, n + 1 : 2 * n + 1] = second, J.T
        matrix[-1, n + 1 : 2 * n + 1] = first
        right = np.concatenate([F + beta * first, J.T @ psi, [first @ psi - 1.0]])
        try:
            change = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        Y, psi, beta = Y - change[: n + 1], psi - change[n + 1 : 2 * n + 1], beta - change[-1]
        size = float(np.abs(change[: n + 1]).max())
        if not size < 0.1:
            return None
        if size < tolerance:
            return Y if abs(beta) < 1e-8 else None
    return None


def is_doubled(curve: Curve, point: Point) -> bool:
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


def breaks_symmetry(curve: Curve, point: Point) -> bool:
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


def _state_at(curve: Curve, point: Point, t: float) -> FloatArray:
    """The state at a time after the section."""
    return _state_in(curve, point, int(np.searchsorted(point.solved.times[1:-1], t, side="right")), t)


def _state_in(curve: Curve, point: Point, i: int, t: float) -> FloatArray:
    """The state at a time that lies in visit i, or at its ends."""
    states = curve.shooting.split(point.X)[1]
    mode, begin = curve.shooting.signature.visits[i].mode, float(point.solved.times[i])
    segments = curve.shooting.flow.segments(point.solved.values, [mode], [begin], [t - begin], states[i][None, :])
    return np.asarray(segments.z[0, : len(curve.shooting.system.states)])


def emanating(curve: Curve, X: FloatArray, along: FloatArray, kind: str) -> list[tuple[Curve, FloatArray, FloatArray]]:
    """Curve, common point and direction of each new half branch at a special point.

    A flip has one (the orbit begun a round later is the same orbit); a pitchfork or a branch point two.
    """
    if kind == "flip":
        twice, X2 = doubled(curve.shooting, X)
        fresh = Curve(twice, curve.size, 2 * curve.period, curve.width)
        # Across the branch gone round twice: the null vector without a change of the parameter.
        direction = other_direction(fresh, X2, None)
        return [] if direction is None else [(fresh, X2 / fresh.scale, direction)]
    direction = other_direction(curve, X, along / np.linalg.norm(along))
    if direction is None:
        return []
    return [(curve, X / curve.scale, direction), (curve, X / curve.scale, -direction)]
