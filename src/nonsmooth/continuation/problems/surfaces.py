"""Surfaces that coincide, and means of an indicator's derivatives along a short visit."""

from __future__ import annotations

from functools import cache

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.variational import VariationalFlow

SAME = 1e-12  # of their sizes: gradients and values of one surface
NODES = 6


def mean_along(
    flow: VariationalFlow, x: FloatArray, values: FloatArray, mode: int, indicator: int, order: int
) -> tuple[float, FloatArray]:
    """The mean of L_f h (order 1) or of (1 - s) L_f^2 h (order 2) along a visit, and its slopes.

    ``x`` holds the visit's begin, the state there, its length, and the active parameters."""
    nodes, weights = _gauss(order - 1)
    n, tau = len(flow.scale), nodes * x[flow.n + 1]
    start = np.broadcast_to(x[1 : n + 1], (NODES, n))
    ends = flow.segments(values, np.full(NODES, mode), np.full(NODES, x[0]), tau, start)
    g, g_z, g_t, g_p = flow.rates(values, indicator, mode, order, x[0] + tau, ends.z)
    across = weights[:, None] * g_z
    mean, slopes = float(weights @ g), np.empty(len(x))
    slopes[0] = weights @ g_t + np.vdot(across, ends.start_time())
    slopes[1 : n + 1] = across.ravel() @ ends.Phi.reshape(-1, n)
    slopes[n + 1] = (weights * nodes) @ g_t + nodes @ (across * ends.f_end).sum(axis=1)
    slopes[n + 2 :] = weights @ g_p + across.ravel() @ ends.P.reshape(NODES * n, -1)
    return mean, slopes


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
