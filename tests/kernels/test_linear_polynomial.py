"""Certainty of the exact flow's search on a segment, against quartics whose fourth derivative is the bound."""

from __future__ import annotations

import numpy as np
import pytest
from numba import types
from numpy.polynomial import polynomial as P

from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.linear import polynomial as linear

NAMES = {linear.NEVER: "never", linear.ALWAYS: "always", linear.ONCE: "once", linear.OPEN: "open"}


@kernel(types.int64(*[types.float64] * 6))
def _classify(g0: float, s0: float, g1: float, s1: float, h: float, bound: float) -> int:
    return linear.classify(g0, s0, g1, s1, h, bound)


@kernel(types.float64(types.float64[:, ::1], types.float64, types.float64))
def _bracketed(row: np.ndarray, lo: float, hi: float) -> float:
    return linear.bracketed(row, 0, 0, lo, hi)


def classify(g: np.ndarray, h: float, bound: float) -> str:
    slope = P.polyder(g)
    ends = (g[0], slope[0], P.polyval(h, g), P.polyval(h, slope))
    return NAMES[_classify(*ends, h, bound)]


def hermite(g0: float, b1: float, b2: float, g1: float, h: float, fourth: float) -> np.ndarray:
    """The quartic on [0, h] with these Bezier coefficients of its Hermite cubic and this fourth derivative."""
    t = np.array([0.0, 1.0 / h])
    rest = np.array([1.0, -1.0 / h])
    cubic = np.zeros(1)
    for k, b in enumerate((g0, b1, b2, g1)):
        cubic = P.polyadd(cubic, (1, 3, 3, 1)[k] * b * P.polymul(P.polypow(t, k), P.polypow(rest, 3 - k)))
    bump = P.polymul(P.polypow([0.0, 1.0], 2), P.polypow([h, -1.0], 2)) * (fourth / 24.0)
    return P.polyadd(cubic, bump)


def signs(g: np.ndarray, h: float) -> np.ndarray:
    """Signs of g between its zeros in (0, h)."""
    roots = P.polyroots(g)
    inside = np.sort(roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 1e-9 * h) & (roots.real < (1 - 1e-9) * h)])
    edges = np.concatenate([[0.0], inside, [h]])
    return np.sign(P.polyval(0.5 * (edges[1:] + edges[:-1]), g))


def test_what_is_certain_is_true() -> None:
    """Random quartics: never, always and once are right for each; every answer occurs."""
    rng = np.random.default_rng(5)
    met = dict.fromkeys(NAMES.values(), 0)
    for _ in range(4000):
        h, bound = rng.uniform(0.1, 2.0), 10.0 ** rng.uniform(-2, 2)
        size = bound * h**4 / 144.0 * 10.0 ** rng.uniform(-0.5, 1.5)
        data = size * rng.normal(size=4)
        data[:3] *= rng.random(3) > 0.15  # a step may begin on the surface
        g = hermite(*data, h, bound * rng.choice([-1, 1]))
        kind = classify(g, h, bound)
        met[kind] += 1
        pattern = signs(g, h)
        if kind == "never":
            assert (pattern <= 0).all()
        elif kind == "always":
            assert (pattern >= 0).all()
        elif kind == "once":
            assert (pattern[0] < 0 or g[0] == 0.0) and pattern[-1] > 0 and (np.diff(pattern) != 0).sum() <= 1
    assert min(met.values()) > 50, met


@pytest.mark.parametrize(("part", "kind"), [(0.9, "open"), (1.1, "never")])
def test_the_bound_on_what_is_never_positive_is_sharp(part: float, kind: str) -> None:
    """g = g' = 0 at the start: the coefficient -part K h^4 / 144 and the bump K t^2 (h - t)^2 / 24 decide what is next.

    Below one part of it g is positive just after the start."""
    h, bound = 0.7, 3.0
    delta = part * bound * h**4 / 144.0
    g = hermite(0.0, 0.0, -2.0 * delta, 0.0, h, bound)
    assert (P.polyval(1e-3 * h, g) > 0.0) == (part < 1.0)
    assert classify(g, h, bound) == kind


@pytest.mark.parametrize(("part", "kind"), [(0.9, "open"), (1.1, "always")])
def test_the_bound_on_what_is_always_positive_is_sharp(part: float, kind: str) -> None:
    h, bound = 0.7, 3.0
    delta = part * bound * h**4 / 144.0
    g = hermite(0.0, 1e-9 * delta, 2.0 * delta, delta, h, -bound)
    assert (P.polyval(1e-3 * h, g) < 0.0) == (part < 1.0)
    assert classify(g, h, bound) == kind


def test_a_root_of_high_order_is_found() -> None:
    """Newton's method converges slowly to (t - r)^5; a bracket goes on shrinking until nothing can be told apart."""
    root = 0.37
    row = np.zeros((1, 8))
    row[0, :6] = P.polyfromroots([root] * 5)
    found = _bracketed(row, 0.0, 1.0)
    assert abs(P.polyval(found, row[0])) < 1e-15  # rounding of the coefficients
    assert found == pytest.approx(root, abs=2e-3)
