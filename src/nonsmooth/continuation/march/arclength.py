"""Pseudo-arclength continuation of orbits with one signature, in scaled unknowns."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.problems.anchor import anchor_at, plane_across
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.solve import determinant, solve
from nonsmooth.continuation.problems.surfaces import look_at_surfaces
from nonsmooth.continuation.signature.path import Walk

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Solved
    from nonsmooth.continuation.signature.path import Path
    from nonsmooth.continuation.signature.signature import Signature

__all__ = ["Curve", "Point", "chordal", "passes_through"]

FloatArray = NDArray[np.float64]
MOST = 8  # Newton iterations
DONE = 1e-9  # a step this small is followed by one of its square
FARTHEST = 2.5  # times the last step: a cubic is not trusted beyond
SMALL = 1e-6  # residual of a first guess that a small step alone makes a solution
CLOSE = 1e-12  # where multipliers are wanted to the last digits


@dataclass
class Point:
    """A solved point of a curve."""

    Y: FloatArray  # X / scale
    tangent: FloatArray  # unit length, in scaled unknowns
    solved: Solved
    M: FloatArray
    multipliers: NDArray[np.complex128]
    path: Path
    iterations: int
    orientation: float = 0.0  # sign of the bordered determinant (a curve in two parameters asks for none)

    @property
    def X(self) -> FloatArray:
        """The unknowns, the parameters last."""
        return self.solved.X

    def turned(self) -> Point:
        """The same point looked at the other way along the branch; the bordered determinant turns with the tangent."""
        return replace(self, tangent=-self.tangent, orientation=-self.orientation)


class Curve:
    """Orbits of one signature with one active parameter.

    Parameters
    ----------
    shooting : Shooting
        With one active parameter.
    size : array (n_z,)
        Sizes of the states (and memory).
    period : float
        Size of the times.
    width : float
        Size of the parameter: the width of its range.
    """

    def __init__(self, shooting: Shooting, size: FloatArray, period: float, width: float) -> None:
        self.shooting, self.walk = shooting, Walk(shooting)
        m = shooting.m
        self.size, self.period, self.width = size, period, width
        scale = shooting.join(np.full(m, period), np.tile(size, (m + 1, 1)), period, [width])
        # The length of a curve should not depend on how many visits an orbit is cut into.
        scale[: shooting.size] *= np.sqrt(m + 1)
        self.scale = scale
        rows = 1.0 / scale[: shooting.size]
        self.weights = rows[:, None] * scale[None, :]
        self.rows = rows
        self.n = shooting.size + 1
        self._matrix = np.zeros((self.n, self.n))

    def with_signature(
        self, signature: Signature, times: FloatArray, states: FloatArray, period: float, parameters: Any
    ) -> tuple[Curve, FloatArray]:
        """The curve of another signature in the same units, and the unknowns there from instants and states."""
        old = self.shooting
        fresh = Shooting(old.system, signature, old.period_number, old.active)
        X = fresh.join(times, states, period, parameters)
        anchor_at(fresh, fresh.parameters(X), states[0], self.size)
        look_at_surfaces(fresh, X)
        return Curve(fresh, self.size, self.period, self.width), X

    def _bordered(self, solved: Solved, border: FloatArray) -> FloatArray:
        matrix = self._matrix
        np.multiply(solved.jacobian, self.weights, out=matrix[:-1])
        matrix[-1] = border
        return matrix

    def correct(
        self, Y: FloatArray, border: FloatArray, level: float, *, tolerance: float = DONE, most: int = MOST,
        singular: bool = False,
    ) -> tuple[Solved, FloatArray, int] | None:  # fmt: skip
        """Newton for F = 0 and border . Y = level, from Y; None where it does not converge.

        ``singular`` takes the shortest step where the matrix has no inverse: at a crossing of branches.
        """
        shooting = self.shooting
        right = np.empty(self.n)
        last = np.inf
        for i in range(most):
            solved = shooting.evaluate(Y * self.scale)
            np.multiply(solved.residual, self.rows, out=right[:-1])
            right[-1] = border @ Y - level
            try:
                if singular:
                    step = np.linalg.lstsq(self._bordered(solved, border), right, rcond=1e-7)[0]
                else:
                    step = solve(self._bordered(solved, border), right)
            except np.linalg.LinAlgError:
                return None
            length = float(np.abs(step).max())
            if not length < 1e3 or (i > 1 and length > 2.0 * last and length > 1e-10):
                return None
            # Beside a square root the slopes are so steep that steps are small far from the solution: there they grow.
            shrinks = length <= last if i else float(np.abs(right).max()) < SMALL
            if (length < tolerance and shrinks) or (i > 3 and length < 1e-10):
                if length > 1e-14:  # the last evaluation serves; its error is the square of this step
                    Y = Y - step
                    solved = shooting.moved(solved, Y * self.scale)
                return solved, Y, i
            Y = Y - step
            last = length
        return None

    def tangent(self, solved: Solved, border: FloatArray) -> tuple[FloatArray, float] | None:
        """Unit tangent with a positive component along ``border``, and the sign of the bordered determinant."""
        matrix = self._bordered(solved, border)
        right = np.zeros(self.n)
        right[-1] = 1.0
        try:
            t = solve(matrix, right)
        except np.linalg.LinAlgError:
            return None
        length = np.sqrt(t @ t)
        if not np.isfinite(length):
            return None
        t /= length
        matrix[-1] = t
        return t, determinant(matrix)[0]

    def null_vectors(self, solved: Solved, tolerance: float = 1e-7) -> FloatArray:
        """Orthonormal vectors (k, N + 1) that the scaled Jacobian takes to zero."""
        _, values, right = np.linalg.svd(solved.jacobian * self.weights)
        rank = int((values > tolerance * values[0]).sum())
        return np.asarray(right[rank:])

    def point(self, solved: Solved, Y: FloatArray, border: FloatArray, iterations: int = 0) -> Point | None:
        """A solved point with its tangent, multipliers and path."""
        found = self.tangent(solved, border)
        if found is None:
            return None
        M = solved.monodromy
        path = self.walk.along(solved, self.shooting.split(solved.X)[1])
        if path is None:
            return None
        return Point(Y, found[0], solved, M, multipliers_of(M), path, iterations, found[1])

    def predicted(self, point: Point, ds: float, before: Point | None) -> FloatArray:
        """A guess at distance ds along the tangent: straight, or on the cubic through both last points and tangents."""
        Y = point.Y + ds * point.tangent
        if before is None:
            return Y
        back = point.Y - before.Y
        h = float(before.tangent @ back)
        if not (h > 0.0 and ds < FARTHEST * h):
            return Y
        second = (2 * before.tangent + 4 * point.tangent - 6 / h * back) / h
        third = (6 * (before.tangent + point.tangent) - 12 / h * back) / (h * h)
        return Y + ds * ds * (0.5 * second + ds / 6 * third)

    def step(self, point: Point, ds: float, before: Point | None = None, *, tolerance: float = DONE) -> Point | None:
        """The point at distance ds along the tangent; with the point ``before`` from a better guess."""
        level = float(point.tangent @ point.Y) + ds
        found = self.correct(self.predicted(point, ds, before), point.tangent, level, tolerance=tolerance)
        if found is None:
            return None
        return self.point(found[0], found[1], point.tangent, found[2])

    def anchored_anew(self, point: Point) -> Point:
        """The same point with the phase condition of an orbit without transitions put through it."""
        shooting, z = self.shooting, point.X[: self.shooting.n]
        shooting.reference = plane_across(z, point.solved.segments.f_begin[0], self.size)
        row = point.solved.jacobian[-1]
        row[:] = 0.0
        row[: shooting.n] = shooting.reference[1]
        found = self.tangent(point.solved, point.tangent)
        return point if found is None else replace(point, tangent=found[0], orientation=found[1])

    def between(self, a: Point, b: Point, s: float) -> Point | None:
        """The point at distance s from ``a`` towards ``b``, to the last digits."""
        end = float(a.tangent @ (b.Y - a.Y))
        x = s / end
        # Hermite's cubic through both points and tangents.
        slope = end / max(float(a.tangent @ b.tangent), 1e-3)
        Y = (
            a.Y * (1 + 2 * x) * (1 - x) ** 2 + a.tangent * (end * x * (1 - x) ** 2)
            + b.Y * x * x * (3 - 2 * x) - b.tangent * (slope * x * x * (1 - x))
        )  # fmt: skip
        level = float(a.tangent @ a.Y) + s
        found = self.correct(Y, a.tangent, level, tolerance=CLOSE, most=2 * MOST)
        if found is None or np.abs(found[1] - Y).max() > 0.1 * abs(end):
            found = self.correct(Y, a.tangent, level, tolerance=1e-10, most=2 * MOST, singular=True)
        if found is None:
            return None
        point = self.point(found[0], found[1], a.tangent, found[2])
        if point is not None and float(point.tangent @ a.tangent) < 0.5:
            # At a crossing of branches any direction in their plane is null: keep that of the branch.
            towards = (1 - x) * a.tangent + x * b.tangent
            point.tangent = towards / np.linalg.norm(towards)
        return point

    def at_parameter(self, Y: FloatArray, value: float) -> Point | None:
        """The point at a value of the parameter, by Newton from Y."""
        border = np.zeros(self.n)
        border[-1] = 1.0
        Y = Y.copy()
        Y[-1] = value / self.width
        found = self.correct(Y, border, value / self.width, tolerance=CLOSE, most=2 * MOST)
        if found is None:
            return None
        solved, Y, iterations = found
        null = self.null_vectors(solved)
        if not len(null):
            return None
        return self.point(solved, Y, null[-1], iterations)


def passes_through(Y: FloatArray, a: FloatArray, b: FloatArray) -> bool:
    """Return whether the step from a to b goes through Y, as nearly as a chord follows a curve."""
    step = b - a
    x = float(step @ (Y - a)) / float(step @ step)
    return 1e-9 < x <= 1.0 and float(np.abs(Y - a - x * step).max()) < 0.3 * float(np.abs(step).max())


def chordal(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> float:
    """Largest distance of multipliers on the Riemann sphere, matched in order of modulus."""
    return float((np.abs(a - b) / np.sqrt((1 + np.abs(a) ** 2) * (1 + np.abs(b) ** 2))).max())
