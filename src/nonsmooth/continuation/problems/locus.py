r"""Loci of special points in two parameters.

The equations of the orbit, F(X, p_1, p_2) = 0, and one more, psi = 0:

========================  ====================================================
fold                      det F_X (scaled)
flip                      det(M + I)
neimark_sacker            :math:`\prod_{i<j} (\mu_i \mu_j - 1)`
grazing                   largest local maximum of the margin that is touched
========================  ====================================================

psi is differentiated by central differences, in the unknowns and in both parameters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Point
from nonsmooth.continuation.problems.multipliers import multipliers_of, product_of_pairs, without_own
from nonsmooth.continuation.problems.solve import determinant
from nonsmooth.continuation.signature.path import Walk

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Shooting, Solved

__all__ = ["KINDS", "Locus"]

FloatArray = NDArray[np.float64]
KINDS = ("fold", "flip", "neimark_sacker", "grazing")
STEP = 1e-6  # of central differences, in scaled unknowns
MOST = 8
DONE = 1e-11
CLOSE = 2e-12


class Locus:
    """A curve of special points of one kind, of orbits with one signature.

    Parameters
    ----------
    shooting : Shooting
        With two active parameters.
    kind : str
        One of ``KINDS``.
    size, period, widths
        Sizes of the states, the times and the two parameters.
    """

    def __init__(
        self, shooting: Shooting, kind: str, size: FloatArray, period: float, widths: tuple[float, float]
    ) -> None:
        self.shooting, self.kind, self.walk = shooting, kind, Walk(shooting)
        m = shooting.m
        scale = shooting.join(np.full(m, period), np.tile(size, (m + 1, 1)), period, widths)
        scale[: shooting.size] *= np.sqrt(m + 1)
        self.scale, self.size, self.period, self.widths = scale, size, period, widths
        self.rows = 1.0 / scale[: shooting.size]
        self.n = shooting.size + 2
        self._eye = np.eye(shooting.n)
        self._unit = 1.0  # of psi
        self.touched: tuple[int, int] | None = None  # (visit, transition) of a grazing curve

    def psi(self, solved: Solved) -> float:
        """The number that vanishes on the locus."""
        if self.kind == "fold":
            n = self.shooting.size
            sign, size = determinant(solved.jacobian[:, :n] * self.rows[:, None] * self.scale[:n])
            return sign * float(np.exp(size)) / self._unit
        if self.kind == "grazing":
            path = self.walk.along(solved, self.shooting.split(solved.X)[1])
            if path is None:
                return np.nan
            if self.touched is None:
                self.touched = path.touched
            return float(path.inner[self.touched]) / self._unit
        M = solved.monodromy
        if self.kind == "flip":
            return float(np.linalg.det(M + self._eye))
        return product_of_pairs(without_own(multipliers_of(M), self.shooting.forced))

    def calibrate(self, Y: FloatArray) -> None:
        """Choose the unit of psi so that its gradient is of order one."""
        self._unit = 1.0
        size = float(np.abs(self.gradient(Y)).max())
        self._unit = size if np.isfinite(size) and size > 0 else 1.0

    def gradient(self, Y: FloatArray) -> FloatArray:
        """d psi / dY by central differences."""
        g = np.empty(self.n)
        for j in range(self.n):
            ahead, behind = Y.copy(), Y.copy()
            ahead[j] += STEP
            behind[j] -= STEP
            above, below = (self.shooting.evaluate(Z * self.scale) for Z in (ahead, behind))
            g[j] = (self.psi(above) - self.psi(below)) / (2 * STEP)
        return g

    def _matrix(self, solved: Solved, gradient: FloatArray, border: FloatArray) -> FloatArray:
        matrix = np.empty((self.n, self.n))
        matrix[:-2] = solved.jacobian * self.rows[:, None] * self.scale
        matrix[-2], matrix[-1] = gradient, border
        return matrix

    def correct(
        self, Y: FloatArray, border: FloatArray, level: float, *, tolerance: float = DONE, most: int = MOST,
        gradient: FloatArray | None = None,
    ) -> tuple[Solved, FloatArray, FloatArray, int] | None:  # fmt: skip
        """Newton for F = 0, psi = 0, border . Y = level; the gradient of psi is renewed where it converges slowly."""
        last = np.inf
        if gradient is None:
            gradient = self.gradient(Y)
        for i in range(most):
            solved = self.shooting.evaluate(Y * self.scale)
            right = np.concatenate([solved.residual * self.rows, [self.psi(solved), border @ Y - level]])
            if not np.isfinite(right).all():
                return None
            try:
                step = np.linalg.solve(self._matrix(solved, gradient, border), right)
            except np.linalg.LinAlgError:
                return None
            length = float(np.abs(step).max())
            if not length < 1e2:
                return None
            if length < tolerance or (i > 4 and length < 1e-10):
                return solved, Y, gradient, i
            Y = Y - step
            if length > 0.05 * last and length > 1e3 * tolerance:
                gradient = self.gradient(Y)
            last = length
        return None

    def place(self, found: tuple[Solved, FloatArray, FloatArray, int], border: FloatArray) -> Point | None:
        """A solved point with its tangent (along ``border``), multipliers and path."""
        solved, Y, _, iterations = found
        gradient = self.gradient(Y)
        right = np.zeros(self.n)
        right[-1] = 1.0
        try:
            t = np.linalg.solve(self._matrix(solved, gradient, border), right)
        except np.linalg.LinAlgError:
            return None
        length = float(np.linalg.norm(t))
        path = self.walk.along(solved, self.shooting.split(solved.X)[1])
        if not np.isfinite(length) or path is None:
            return None
        M = solved.monodromy
        return Point(Y, np.asarray(t / length, dtype=float), solved, M, multipliers_of(M), path, iterations)

    def first(self, X: FloatArray) -> Point | None:
        """The locus at a special point: the shortest correction, and a tangent of either sense."""
        Y = X / self.scale
        self.calibrate(Y)
        for _ in range(3 * MOST):
            solved = self.shooting.evaluate(Y * self.scale)
            gradient = self.gradient(Y)
            matrix = self._matrix(solved, gradient, np.zeros(self.n))[:-1]
            right = np.append(solved.residual * self.rows, self.psi(solved))
            if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
                return None
            step = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
            Y = np.asarray(Y - step, dtype=float)
            if np.abs(step).max() < CLOSE:
                break
        else:
            return None
        _, values, vectors = np.linalg.svd(matrix)
        if values[-1] < 1e-9 * values[0]:
            return None
        solved = self.shooting.evaluate(Y * self.scale)
        return self.place((solved, Y, gradient, 0), vectors[-1])

    def step(self, place: Point, ds: float) -> Point | None:
        """The point at distance ds along the tangent."""
        Y = place.Y + ds * place.tangent
        found = self.correct(Y, place.tangent, float(place.tangent @ Y))
        return None if found is None else self.place(found, place.tangent)

    def between(self, a: Point, b: Point, s: float) -> Point | None:
        """The point at distance s from ``a`` towards ``b``, to the last digits."""
        end = float(a.tangent @ (b.Y - a.Y))
        Y = a.Y + s / end * (b.Y - a.Y)
        level = float(a.tangent @ a.Y) + s
        found = self.correct(Y + (level - a.tangent @ Y) * a.tangent, a.tangent, level, tolerance=CLOSE, most=2 * MOST)
        return None if found is None else self.place(found, a.tangent)
