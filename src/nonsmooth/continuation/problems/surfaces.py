"""Surfaces that coincide, and means of an indicator's derivatives along a short visit."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.variational import VariationalFlow

__all__ = ["coincide", "mean_along", "one_surface"]

SAME = 1e-12  # of their sizes: gradients and values of one surface
STEP = 1e-5  # of the differences of a mean
NODES = 6


def mean_along(
    flow: VariationalFlow, x: FloatArray, values: FloatArray, places: NDArray[np.int64], mode: int, indicator: int,
    order: int,
) -> tuple[float, FloatArray]:  # fmt: skip
    """The mean of L_f h (order 1) or of (1 - s) L_f^2 h (order 2) along a visit, and its slopes.

    ``x`` holds the visit's begin, the state there, its length, and the active parameters."""
    nodes, weights = _gauss(order - 1)
    n, values = len(flow.scale), values.copy()
    modes = np.full(NODES, mode)

    def mean(x: FloatArray) -> float:
        values[places] = x[n + 2 :]
        tau = nodes * x[n + 1]
        there = flow.segments(values, modes, np.full(NODES, x[0]), tau, np.tile(x[1 : n + 1], (NODES, 1))).z
        found = [flow.indicator(values, indicator, mode, x[0] + s, z) for s, z in zip(tau, there, strict=True)]
        return float(weights @ [one.L if order == 1 else one.L2 for one in found])

    steps = STEP * np.concatenate([[1.0], flow.scale, np.ones(len(x) - n - 1)])
    slopes = [(mean(x + one) - mean(x - one)) / (2.0 * one.max()) for one in np.diag(steps)]
    return mean(x), np.array(slopes)


@cache
def _gauss(power: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of the integral over (0, 1) with the weight (1 - s)^power."""
    from scipy.special import roots_jacobi

    nodes, weights = roots_jacobi(NODES, power, 0.0)
    return 0.5 * (nodes + 1.0), weights * 0.5 ** (power + 1)


def one_surface(a: FloatArray, h: float, b: FloatArray, g: float, z: FloatArray) -> bool:
    """Return whether two indicators vanish on one surface."""
    return coincide(a, h, b, g, z) or coincide(a, h, -b, -g, z)


def coincide(a: FloatArray, h: float, b: FloatArray, g: float, z: FloatArray) -> bool:
    """Return whether two indicators with gradients a, b and values h, g near z are one, but for a positive factor."""
    size = float(np.sqrt((a @ a) * (b @ b)))
    if size == 0.0 or float(a @ b) < (1.0 - SAME) * size:
        return False
    ratio = float(np.sqrt((b @ b) / (a @ a)))
    return bool(abs(g - ratio * h) <= SAME * (np.abs(b * z).max() + abs(g)))
