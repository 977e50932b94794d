r"""Normal form coefficients of the return map at flips and Neimark-Sacker points, within one signature.

With A the monodromy matrix, B and C the second and third derivatives of the return map, and eigenvectors
A q = mu q, :math:`A^T p = \bar\mu p`, :math:`\bar p \cdot q = 1` (Kuznetsov, *Elements of Applied Bifurcation Theory*,
section 5.4):

.. math::

    c = \tfrac16 p \cdot C(q, q, q) + \tfrac12 p \cdot B(q, (I - A)^{-1} B(q, q)) \quad (\mu = -1)

    d = \tfrac12 \mathrm{Re}\, e^{-i\theta} [\bar p \cdot C(q, q, \bar q)
        + 2 \bar p \cdot B(q, (I - A)^{-1} B(q, \bar q))
        + \bar p \cdot B(\bar q, (e^{2i\theta} I - A)^{-1} B(q, q))] \quad (\mu = e^{i\theta})

A flip with c > 0 is supercritical (the doubled orbit is stable where the orbit is not), a torus with d < 0. B and C are
differences of the exact monodromy matrix along lines, of the fourth order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.solve import solve

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Shooting, Solved

STEP = 1e-2  # of the orbit's size
SHRINKS, AGREED = 5, 1e-5
ROUNDS = 12
DONE = 1e-13


class _ReturnMap:
    """The derivative of the return map near a solved orbit, in states divided by ``size``."""

    def __init__(self, shooting: Shooting, solved: Solved, scale: FloatArray) -> None:
        self.shooting, self.solved, self.scale = shooting, solved, scale
        self.size = scale[: shooting.n] / (np.sqrt(shooting.m + 1))
        self.A = self._scaled(solved.monodromy)

    def _scaled(self, M: FloatArray) -> FloatArray:
        return np.asarray(M * self.size[None, :] / self.size[:, None])

    def at(self, y: FloatArray) -> FloatArray:
        """The derivative at ``y`` from the orbit; NaN where the crossings are not found again."""
        shooting, n, size = self.shooting, self.shooting.n, self.shooting.size
        X = self.solved.X.copy()
        X[:n] += y * self.size
        inner = self.scale[n:size]
        for _ in range(ROUNDS):
            solved = shooting.evaluate(X)
            if size == n:
                return self._scaled(solved.monodromy)
            right = -solved.residual[n:size] / inner
            try:
                step = solve(solved.jacobian[n:size, n:size] * inner[None, :] / inner[:, None], right)
            except np.linalg.LinAlgError:
                return np.full((n, n), np.nan)
            length = float(np.abs(step).max())
            if not length < 10.0:
                return np.full((n, n), np.nan)
            if length < DONE:
                return self._scaled(solved.monodromy)
            X[n:size] += inner * step
        return np.full((n, n), np.nan)

    def along(self, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """B(v, .) and C(v, v, .) as matrices; steps shrink until two agree (near a graze they must be short)."""
        h = STEP / float(np.abs(v).max())
        first = second = np.full_like(self.A, np.nan)
        for _ in range(SHRINKS):
            before = second
            M = {k: self.at(k * h * v) for k in (-2, -1, 1, 2)}
            first = (8 * (M[1] - M[-1]) - (M[2] - M[-2])) / (12 * h)
            second = (16 * (M[1] + M[-1]) - (M[2] + M[-2]) - 30 * self.A) / (12 * h * h)
            if np.abs(second - before).max() <= AGREED * max(np.abs(second).max(), np.abs(first).max()):
                break
            h *= 0.25
        return first, second


def _vectors(A: FloatArray, at: complex) -> tuple[Any, Any, complex]:
    """Right and left eigenvectors of the eigenvalue nearest ``at``, and that eigenvalue."""
    from scipy.linalg import eig

    values, left, right = eig(A, left=True)
    i = int(np.abs(values - at).argmin())
    q, p = right[:, i], left[:, i]
    along = np.vdot(p, q)
    if along == 0.0:
        raise np.linalg.LinAlgError("the eigenvalue is double: its eigenvectors are orthogonal")
    return q, p / np.conj(along), complex(values[i])


def _summed(terms: list[complex]) -> tuple[float, float]:
    """The real part of the sum, and that against the sum of their sizes: 0 where they cancel, at most 1."""
    whole, total = sum(abs(term) for term in terms), float(sum(terms).real)
    return total, total / whole if whole > 0.0 else 0.0


def flip_coefficient(shooting: Shooting, solved: Solved, scale: FloatArray) -> tuple[float, float]:
    """(c, its balance between -1 and 1) at a flip of a forced orbit; ``scale`` holds the sizes of the unknowns."""
    around = _ReturnMap(shooting, solved, scale)
    q, p, _ = _vectors(around.A, -1.0)
    q, p = q.real, p.real / float(p.real @ q.real)
    B, C = around.along(q)
    inner = np.linalg.solve(np.eye(len(q)) - around.A, B @ q)
    return _summed([complex(p @ (C @ q)) / 6.0, complex(p @ (B @ inner)) / 2.0])


def torus_coefficient(shooting: Shooting, solved: Solved, scale: FloatArray, mu: complex) -> tuple[float, float]:
    """(d, its balance between -1 and 1) at a Neimark-Sacker point of a forced orbit with the multiplier ``mu``."""
    around = _ReturnMap(shooting, solved, scale)
    q, p, mu = _vectors(around.A, mu)
    a, b = q.real.copy(), q.imag.copy()
    Ba, Caa = around.along(a)
    Bb, Cbb = around.along(b)
    C_plus, C_minus = around.along(a + b)[1], around.along(a - b)[1]
    Cab = 0.25 * (C_plus - C_minus)
    one = np.eye(len(q))
    Bq, Bc = Ba + 1j * Bb, Ba - 1j * Bb  # B(q, .), B(conj q, .)
    cubic = np.vdot(p, (Caa - Cbb + 2j * Cab) @ np.conj(q))
    mean = 2 * np.vdot(p, Bq @ np.linalg.solve(one - around.A, Bq @ np.conj(q)))
    double = np.vdot(p, Bc @ np.linalg.solve(mu * mu * one - around.A, Bq @ q))
    return _summed([0.5 * complex(np.conj(mu) * term) for term in (cubic, mean, double)])
