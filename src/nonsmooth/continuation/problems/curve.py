r"""Curves of solutions in scaled unknowns: predictor, corrector, tangent, and points between two others.

A problem with one more unknown than equations has curves of solutions. Each problem is a subclass that says what its
equations are and how a solved point is measured; a point at distance ds along the tangent t of the last one solves

.. math:: F(Y) = 0, \qquad t \cdot Y = t \cdot Y_0 + ds .
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, Generic, Self, TypeVar, cast

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.solve import Factored, null_vectors, shortest, solve
from nonsmooth.errors import SystemDefinitionError

DONE = 1e-9  # a step this small is followed by one of its square
FARTHEST = 2.5  # times the last step: a cubic is not trusted beyond
SMALL = 1e-6  # residual of a first guess that a small step alone makes a solution
CLOSE = 1e-12  # where multipliers are wanted to the last digits
ROUNDED = 1e-10  # residual: one that is smaller, and not half of that before, is rounding
ROUNDING = 1e-14  # residual: no guess has a smaller one by chance
AGAIN = 1e-7  # in scaled unknowns: as near as a branch comes back to a point of its own, both solved
STEP = 1e-5  # of differences, in scaled unknowns
#: The word of a curve (of orbits: the signature), the unknowns, and what other curves of the branch have of them.
Place = tuple[Any, FloatArray, FloatArray]


@dataclass
class Point:
    """A solved point of a curve."""

    curve: Any
    Y: FloatArray  # X / scale
    tangent: FloatArray  # unit length, in scaled unknowns
    orientation: float  # sign of the bordered determinant
    iterations: int
    solved: Any

    @property
    def X(self) -> FloatArray:
        """The unknowns, the parameters last."""
        return np.asarray(self.solved.X)

    @property
    def value(self) -> float:
        """The last parameter."""
        return float(self.X[-1])

    @property
    def rise(self) -> float:
        """The change of the last parameter along the branch."""
        return float(self.tangent[-1])

    @property
    def virtual(self) -> bool:
        """True for a point that belongs to no motion of the system."""
        return False

    def along(self, Y: FloatArray) -> float:
        """The distance of another place along the tangent."""
        return float(self.tangent @ (Y - self.Y))

    def turned(self) -> Self:
        """The same point looked at the other way along the branch; the bordered determinant turns with the tangent."""
        return replace(self, tangent=-self.tangent, orientation=-self.orientation)

    def facing(self, sign: float) -> Self:
        """The same point with its tangent towards rising (1) or falling (-1) values."""
        return self if (self.rise or 1.0) * sign > 0 else self.turned()


P = TypeVar("P", bound=Point)


class Curve(ABC, Generic[P]):
    """Solutions of n - 1 equations for n unknowns, the parameters last.

    Attributes
    ----------
    scale : array (n,)
        Sizes of the unknowns.
    most, longest, grows : int, float, float
        Newton's method: iterations, the longest step (scaled), the growth of steps that is not let pass.
    """

    scale: FloatArray
    most = 8
    longest, grows = 1e3, 2.0
    tolerance = DONE

    @property
    def n(self) -> int:
        """The number of unknowns."""
        return len(self.scale)

    # --- the problem

    @abstractmethod
    def evaluate(self, Y: FloatArray) -> Any:
        """The equations at Y."""

    @abstractmethod
    def fill(self, solved: Any, matrix: FloatArray) -> None:
        """Put the scaled Jacobian into ``matrix`` (n - 1, n)."""

    @abstractmethod
    def residual(self, solved: Any) -> FloatArray:
        """The scaled residual (n - 1,)."""

    @abstractmethod
    def moved(self, solved: Any, Y: FloatArray) -> Any:
        """The equations after a last step so small that their derivatives stay."""

    def described(self, point: Point) -> P | None:
        """A solved point with all that is known of it; None where that cannot be computed."""
        return cast(P, point)

    def word(self) -> Any:
        """Return what tells curves of one branch apart."""
        return None

    def seen(self, point: P) -> FloatArray:
        """The part of a point that curves of one branch have whatever their word, scaled."""
        return point.Y

    def landmark(self, point: P) -> Place:
        """The place by which a branch that comes back to a point is told."""
        return self.word(), point.X, self.seen(point)

    def at_landmark(self, point: P, place: Place) -> P | None:
        """The point that is a landmark: this one, the one across the branch from it, or at its parameter; or None."""
        word, X, seen = place
        if np.abs(self.seen(point) - seen).max() < AGAIN:  # also where it cannot be solved: at a crossing of branches
            return point
        level = float(point.tangent @ (X / self.scale)) if word == self.word() else None
        for border, at in ((point.tangent, level), (np.eye(self.n)[-1], X[-1] / self.scale[-1])):
            found = None if at is None else self.correct(point.Y, border, at, tolerance=CLOSE, most=2 * self.most)
            same = None if found is None else self.point(found[0], found[1], point.tangent)
            if same is not None and np.abs(self.seen(same) - seen).max() < AGAIN:
                return same
        return None

    def margins(self, point: P) -> FloatArray:
        """The numbers that turn negative beyond the boundaries."""
        return np.empty(0)

    def spread(self, a: P, b: P) -> float:
        """Difference of what is known of two neighbours, from 0 to 1."""
        return 0.0

    def renewed(self, point: P) -> P | None:
        """The last point on a curve in other units, or with a phase condition put through it; None as it is."""
        return None

    # --- along the curve

    def jacobian(self, solved: Any) -> FloatArray:
        """The scaled Jacobian (n - 1, n)."""
        matrix = np.empty((self.n - 1, self.n))
        self.fill(solved, matrix)
        return matrix

    def bordered(self, solved: Any, border: FloatArray) -> FloatArray:
        """The scaled Jacobian with a last row."""
        matrix = np.empty((self.n, self.n))
        self.fill(solved, matrix[:-1])
        matrix[-1] = border
        return matrix

    def correct(
        self,
        Y: FloatArray,
        border: FloatArray,
        level: float,
        *,
        tolerance: float | None = None,
        most: int | None = None,
        singular: bool = False,
    ) -> tuple[Any, FloatArray, int] | None:
        """Newton for F = 0 and border . Y = level, from Y; None where it does not converge.

        ``singular`` takes the shortest step where the matrix has no inverse: at a crossing of branches.
        """
        tolerance = self.tolerance if tolerance is None else tolerance
        right = np.empty(self.n)
        last = before = np.inf
        for i in range(most or self.most):
            with np.errstate(over="ignore", invalid="ignore"):  # of a guess that leads nowhere
                solved = self.evaluate(Y)
                right[:-1] = self.residual(solved)
                right[-1] = border @ Y - level
                try:
                    step = (shortest if singular else solve)(self.bordered(solved, border), right)
                except np.linalg.LinAlgError:
                    return None
            length, size = float(np.abs(step).max()), float(np.abs(right).max())
            # Beside impacts that all but vanish it makes steps of 1e-9; the square of a longer step is no rounding.
            rounded = 0.5 * before < size < (ROUNDED if 100 * last * last < size else ROUNDING)
            if not length < self.longest or (i > 1 and length > self.grows * last and length > 1e-10 and not rounded):
                return None
            # Beside a square root the slopes are so steep that steps are small far from the solution: there they grow,
            # and what is left behind one, length^3 / last^2 of a quadratic convergence, is more than its square.
            left = length * (length / last) ** 2 if i else 0.0
            shrinks = length <= last and left < CLOSE if i else size < SMALL
            if (length < tolerance and shrinks) or rounded:
                if 1e-14 < length < DONE:  # the last evaluation serves; its error is the square of this step
                    Y = Y - step
                    solved = self.moved(solved, Y)
                return solved, Y, i
            Y = Y - step
            last, before = length, size
        return None

    def tangent(self, solved: Any, border: FloatArray) -> tuple[FloatArray, float] | None:
        """Unit tangent with a positive component along ``border``, and the sign of the bordered determinant."""
        right = np.zeros(self.n)
        right[-1] = 1.0
        try:
            factored = Factored(self.bordered(solved, border))
        except np.linalg.LinAlgError:
            return None
        t = factored.solve(right)
        length = np.sqrt(t @ t)
        if not np.isfinite(length):
            return None
        # The determinant has the same sign with t itself as the last row: it is a multiple of (last row) . t.
        return t / length, factored.determinant()[0]

    def null_vectors(self, solved: Any, tolerance: float = 1e-7) -> FloatArray:
        """Orthonormal vectors (k, n) that the scaled Jacobian takes to zero."""
        return null_vectors(self.jacobian(solved), tolerance)

    def point(self, solved: Any, Y: FloatArray, border: FloatArray, iterations: int = 0) -> P | None:
        """A solved point with its tangent along ``border``."""
        found = self.tangent(solved, border)
        return None if found is None else self.described(Point(self, Y, *found, iterations, solved))

    def near(self, Y: FloatArray, border: FloatArray, *, most: int | None = None) -> P | None:
        """The point across ``border`` through Y, with its tangent along it."""
        found = self.correct(Y, border, float(border @ Y), most=most)
        return None if found is None else self.point(found[0], found[1], border)

    def predicted(self, point: P, ds: float, before: P | None) -> FloatArray:
        """A guess at distance ds along the tangent: straight, or on the cubic through both last points and tangents."""
        Y = point.Y + ds * point.tangent
        if before is None or not ds < FARTHEST * (h := before.along(point.Y)):
            return Y
        back = point.Y - before.Y
        second = (2 * before.tangent + 4 * point.tangent - 6 / h * back) / h
        third = (6 * (before.tangent + point.tangent) - 12 / h * back) / (h * h)
        return Y + ds * ds * (0.5 * second + ds / 6 * third)

    def step(self, point: P, ds: float, before: P | None = None) -> P | None:
        """The point at distance ds along the tangent; with the point ``before`` from a better guess."""
        level = float(point.tangent @ point.Y) + ds
        try:
            found = self.correct(self.predicted(point, ds, before), point.tangent, level)
        except SystemDefinitionError:
            return None
        # Newton may have gone to another branch: then the point lies far from the predictor.
        if found is None or np.abs(found[1] - point.Y - ds * point.tangent).max() > 0.5 * ds + 1e-12:
            return None
        return self.point(found[0], found[1], point.tangent, found[2])

    def between(self, a: P, b: P, s: float) -> P | None:
        """The point at distance s from ``a`` towards ``b``, to the last digits."""
        end = a.along(b.Y)
        x = s / end
        # Hermite's cubic through both points and tangents.
        slope = end / max(float(a.tangent @ b.tangent), 1e-3)
        Y = (
            a.Y * (1 + 2 * x) * (1 - x) ** 2
            + a.tangent * (end * x * (1 - x) ** 2)
            + b.Y * x * x * (3 - 2 * x)
            - b.tangent * (slope * x * x * (1 - x))
        )
        level = float(a.tangent @ a.Y) + s
        found = self.correct(Y, a.tangent, level, tolerance=CLOSE, most=2 * self.most)
        if found is None or np.abs(found[1] - Y).max() > 0.1 * abs(end):
            found = self.correct(Y, a.tangent, level, tolerance=1e-10, most=2 * self.most, singular=True)
        if found is None:
            return None
        point = self.point(found[0], found[1], a.tangent, found[2])
        if point is None or float(point.tangent @ a.tangent) < 0.5:
            # At a crossing of branches any direction in their plane is null: keep that of the branch.
            towards = (1 - x) * a.tangent + x * b.tangent
            return self.described(Point(self, found[1], towards / np.linalg.norm(towards), 0.0, found[2], found[0]))
        return point

    def at_parameter(self, Y: FloatArray, value: float, which: int = -1) -> P | None:
        """The point at a value of a parameter, by Newton from Y."""
        border = np.zeros(self.n)
        border[which] = 1.0
        Y = Y.copy()
        Y[which] = value / self.scale[which]
        found = self.correct(Y, border, float(Y[which]), tolerance=CLOSE, most=2 * self.most)
        if found is None:
            return None
        solved, Y, iterations = found
        solved.X[which] = value  # to the last digit: an orbit at the edge of a range is within it
        null = self.null_vectors(solved)
        return self.point(solved, Y, null[-1], iterations) if len(null) else None

    def nearest(self, Y: FloatArray, value: float) -> P | None:
        """The point at a value of the parameter; where that cannot be held, at a fold, the one across the branch."""
        point = self.at_parameter(Y, value)
        if point is None and len(null := self.null_vectors(self.evaluate(Y))):
            return self.near(Y, null[-1], most=20)
        return point

    def at_edge(self, a: P, b: P, edge: float, which: int) -> P | None:
        """The point at the edge of a parameter's range, between two points."""
        edge_there = edge / self.scale[which]
        x = (edge_there - a.Y[which]) / (b.Y[which] - a.Y[which])
        point = self.at_parameter(a.Y + x * (b.Y - a.Y), edge, which)
        if point is None or np.abs(point.Y - a.Y).max() > 4 * np.abs(b.Y - a.Y).max():
            return None
        return point if float(point.tangent @ a.tangent) > 0.0 else point.turned()


def passing(Y: FloatArray, a: FloatArray, b: FloatArray, least: float = 1e-9) -> float | None:
    """The part of the step from a to b after which it goes through Y, as nearly as a chord follows a curve, or None.

    It is more than ``least``: a itself does not count, unless that is negative."""
    step = b - a
    x = float(step @ (Y - a)) / max(float(step @ step), 1e-300)
    return x if least < x <= 1.0 and float(np.abs(Y - a - x * step).max()) < 0.3 * float(np.abs(step).max()) else None


def tangents(curve: Curve[Any], Y: FloatArray) -> FloatArray | None:
    r"""Unit tangents (2, n) of both branches at their crossing; None where only one orbit lies there.

    Null vectors v of the Jacobian with :math:`\psi \cdot F_{YY} v v = 0`, :math:`F_Y^T \psi = 0`.
    """

    def jacobian(Z: FloatArray) -> FloatArray:
        return curve.jacobian(curve.evaluate(Z))

    left, _, right = np.linalg.svd(jacobian(Y))
    plane, psi = right[-2:], left[:, -1]
    bent = np.array([psi @ (jacobian(Y + STEP * v) - jacobian(Y - STEP * v)) @ plane.T for v in plane])
    if not np.isfinite(bent).all():
        return None
    (low, high), own = np.linalg.eigh(bent + bent.T)
    if not low < 0.0 < high:
        return None
    a, b = (np.sqrt(np.array([high, -low]) / (high - low)) * own).T
    return np.array([a + b, a - b]) @ plane


def branch_point(curve: Curve[Any], Y: FloatArray, *, tolerance: float = 1e-11, most: int = 12) -> FloatArray | None:
    r"""The crossing of branches near Y, to the last digits (Moore's system, which is regular there).

    .. math:: F(Y) + \beta \psi_0 = 0, \quad F_Y^T \psi = 0, \quad \psi_0 \cdot \psi = 1

    in Y, psi and beta, with :math:`\beta = 0` at the solution; second derivatives by central differences.
    """
    n = len(Y) - 1

    def scaled(Z: FloatArray) -> tuple[FloatArray, FloatArray]:
        solved = curve.evaluate(Z)
        return curve.residual(solved), curve.jacobian(solved)

    _, J = scaled(Y)
    psi = np.linalg.svd(J)[0][:, -1]
    first, beta = psi.copy(), 0.0
    for _ in range(most):
        F, J = scaled(Y)
        second = np.empty((n + 1, n + 1))
        for j in range(n + 1):
            moved = np.zeros(n + 1)
            moved[j] = STEP
            second[:, j] = (scaled(Y + moved)[1] - scaled(Y - moved)[1]).T @ psi / (2 * STEP)
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
