"""The convex problem of forces between bounds (:mod:`nonsmooth.kernels.convex`), for unsymmetric units too."""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.kernels import convex


def least(G: FloatArray, a: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Minimise 1/2 x' G x + a' x between bounds, for G not negative and symmetric by factors (:mod:`.convex`)."""
    size, scale = len(a), _symmetric(G)
    x, sets, factor = np.empty((2, size)), np.empty((2, size), dtype=np.int64), np.empty((size, size + 1))
    unit = max(1.0, np.abs(a).max(initial=0.0))  # high derivatives may be beyond what counts as endless there
    status = convex.least(G * scale, a / unit, low / scale / unit, high / scale / unit, x[0], *sets, factor, x[1])
    if status:
        raise SolveError(
            "the forces of contacts and frictions that decide together were not found: "
            + ("no set is the last" if status == 1 else "contacts close on what cannot give way")
        )
    return x[0] * scale * unit


def least_within(sums: FloatArray, total: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """The forces x of least norm between bounds with ``x @ sums == total``."""
    weight = 1e8 / np.square(sums).sum()
    x = least(np.eye(len(sums)) + weight * sums @ sums.T, -weight * sums @ total, low, high)
    near = 1e-6 * np.abs(x).max()
    bound = np.where(x <= low + near, low, np.where(x >= high - near, high, np.nan))
    free = np.isnan(bound)
    x = np.where(free, 0.0, bound)
    x[free] = np.linalg.pinv(sums[free].T) @ (total - x @ sums)
    return x


def is_symmetric(G: FloatArray) -> bool:
    """Return whether positive factors of its columns make G symmetric."""
    scaled = G * _symmetric(G)
    return bool((np.abs(scaled - scaled.T) <= 1e-12 * np.abs(scaled).max(initial=0.0)).all())


def _symmetric(G: FloatArray) -> FloatArray:
    """Positive factors s of the columns that make G symmetric; ones where there are none."""
    size = len(G)
    scale = np.zeros(size)
    for first in range(size):
        if scale[first]:
            continue
        scale[first], known = 1.0, [first]
        for i in known:
            for j in range(size):
                if not scale[j] and G[i, j] and G[i, j] * G[j, i] > 0:
                    scale[j] = G[j, i] * scale[i] / G[i, j]
                    known.append(j)
    return scale
