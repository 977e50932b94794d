"""Crossings of branches: the exact place, and the tangents of both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.continuation.march.arclength import Curve

__all__ = ["branch_point", "tangents"]

STEP = 1e-5  # of differences, in scaled unknowns


def tangents(curve: Curve[Any], Y: FloatArray) -> FloatArray | None:
    r"""Unit tangents (2, n) of both branches at their crossing; None where only one orbit lies there.

    Null vectors v of the Jacobian with :math:`\psi \cdot F_{YY} v v = 0`, :math:`F_Y^T \psi = 0`.
    """

    def jacobian(Z: FloatArray) -> FloatArray:
        return curve.bordered(curve.evaluate(Z), np.zeros(curve.n))[:-1]

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
        return curve.residual(solved), curve.bordered(solved, np.zeros(n + 1))[:-1]

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
