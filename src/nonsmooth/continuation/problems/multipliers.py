r"""Floquet multipliers: eigenvalues of a monodromy matrix, and what is read off them.

An orbit without forcing has one multiplier 1 of its own, that along the flow; it says nothing of the orbit's neighbours
and is left out where ``forced`` is False.
"""

from __future__ import annotations

from itertools import combinations
from math import prod

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray

EDGE = 1e-9  # a modulus within this of 1 counts as neither
SAME = 1e-6  # of their sizes: multipliers as near as this are one
NEUTRAL = 1e-6  # an unstable multiplier nearer to the unit circle than this is called neutral: no damping, a family


def multipliers_of(M: FloatArray, determinant: float | None = None, *, forced: bool = True) -> ComplexArray:
    """Eigenvalues (n,) of a monodromy matrix (n, n), largest modulus first.

    Two are taken from trace and determinant: the smaller one as det / larger, so that it keeps its digits; without
    forcing they are 1 and the determinant, however long the orbit waits beside an equilibrium.
    """
    if M.shape == (2, 2):
        half, det = 0.5 * (M[0, 0] + M[1, 1]), determinant
        if det is None:
            det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
        elif not forced:
            return np.array(sorted([1.0, det], key=abs, reverse=True), dtype=complex)
        root = np.sqrt(complex(0.25 * (M[0, 0] - M[1, 1]) ** 2 + M[0, 1] * M[1, 0]))
        if root.imag:
            return np.array([half + root, half - root])
        first = half + (root.real if half >= 0 else -root.real)
        other = det / first if first else 0.0
        return np.array([first, other], dtype=complex)
    found = np.linalg.eigvals(M).astype(complex)
    return found[np.argsort(-np.abs(found), kind="stable")]


def without_own(mu: ComplexArray, forced: bool) -> ComplexArray:
    """The multipliers but for the orbit's own 1."""
    return mu if forced or not len(mu) else np.delete(mu, int(np.abs(mu - 1.0).argmin()))


def stable_by(mu: ComplexArray, forced: bool) -> bool:
    """Return whether all multipliers (but the orbit's own 1) lie inside the unit circle."""
    others = without_own(mu, forced)
    return bool(not len(others) or np.abs(others).max() < 1.0 - EDGE)


def stability(mu: ComplexArray, forced: bool) -> str:
    """ "stable", "unstable", or "neutral" where the largest multiplier (but the orbit's own 1) has modulus 1."""
    if stable_by(mu, forced):
        return "stable"
    return "neutral" if np.abs(without_own(mu, forced)).max() <= 1.0 + NEUTRAL else "unstable"


def nearest_to_one(mu: ComplexArray, forced: bool) -> complex:
    """The multiplier (but the orbit's own 1) that lies nearest to 1; NaN where there is none."""
    others = without_own(mu, forced)
    return complex(others[np.abs(others - 1.0).argmin()]) if len(others) else complex(np.nan)


def distinct(mu: ComplexArray) -> list[complex]:
    """The multipliers, once each: of copies side by side every one has the same, and of an even number of them that
    pass a value together no product would change its sign."""
    found: list[complex] = []
    for one in mu.tolist():
        if all(abs(one - other) > SAME * max(1.0, abs(one)) for other in found):
            found.append(one)
    return found


def copies(mu: ComplexArray) -> bool:
    """Return whether two multipliers or more, other than zero, stand more than once: masses that do the same, apart."""
    moving = mu[np.abs(mu) > SAME]
    near = np.abs(moving[:, None] - moving) <= SAME * np.abs(moving)
    return len(distinct(moving[near.sum(axis=0) > 1])) > 1


def product_of_pairs(mu: ComplexArray) -> float:
    r""":math:`\prod_{i<j} (\mu_i \mu_j - 1)`, zero where a pair reaches the unit circle; NaN where there is no pair."""
    return prod(a * b - 1.0 for a, b in combinations(mu.tolist(), 2)).real if len(mu) > 1 else np.nan
