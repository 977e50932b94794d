"""Certified bounds, first crossings and largest values of polynomials, against NumPy's roots and double zeros."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import types

from nonsmooth.kernels.compile.cache import kernel  # kept on disk, as what ``njit`` makes is not
from nonsmooth.kernels.series import polynomial as poly

UP, DOWN, EITHER = 1, -1, 0
i, f, i1, f1, f2 = types.int64, types.float64, types.int64[::1], types.float64[::1], types.float64[:, ::1]


@kernel(f(f1, i, i, i, f, f1, i1))
def _crossing(a: Any, m: int, way: int, before: int, error: float, stack: Any, found: Any) -> float:
    return poly.first_crossing(a, m, np.int64(way), np.int64(before), error, stack, found)


@kernel(f(f1, i, f, f1))
def _largest(a: Any, m: int, current: float, stack: Any) -> float:
    return poly.largest(a, m, current, stack)


@kernel(types.UniTuple(f, 2)(f1, i))
def _bounds(a: Any, m: int) -> Any:
    return poly.bounds(a, m)


@kernel(types.UniTuple(f, 3)(f2, f, i, f1))
def _row_bounds(C: Any, sign: float, m: int, powers: Any) -> Any:
    return poly.row_bounds(C, 1, sign, m, powers)


@kernel(i(f2, f, i, f1, f1))
def _load(C: Any, sign: float, m: int, powers: Any, a: Any) -> int:
    return poly.load(C, 1, sign, m, powers, a)


@kernel(types.void(f1, i, f, f, f1))
def _shift(a: Any, m: int, x: float, width: float, out: Any) -> None:
    poly.shift(a, m, x, width, out)


@kernel(i(f1, i))
def _strip(a: Any, m: int) -> int:
    return poly.strip(a, m)


def crossing(a: np.ndarray, way: int, before: int = 0, error: float = 0.0) -> tuple[float, np.ndarray]:
    m, found = max(len(a) - 1, 4), np.zeros(2, dtype=np.int64)
    padded = np.zeros(m + 1)
    padded[: len(a)] = a
    return _crossing(padded, m, way, before, error, np.zeros(poly.stack_size(m)), found), found


def from_roots(roots: list[float], lead: float = 1.0) -> np.ndarray:
    return lead * np.polynomial.polynomial.polyfromroots(roots)


def random_polynomials(n: int, seed: int) -> list[np.ndarray]:
    """Coefficients that fall off like those of a step, and some that do not."""
    rng = np.random.default_rng(seed)
    return [
        rng.normal(size=m + 1) * rng.choice([0.2, 0.6, 1.0]) ** np.arange(m + 1) for m in rng.integers(4, 24, size=n)
    ]


def test_bounds_enclose_all_values() -> None:
    x = np.linspace(0.0, 1.0, 401)
    for a in random_polynomials(300, 1):
        low, high = _bounds(a, len(a) - 1)
        values = np.polynomial.polynomial.polyval(x, a)
        assert low <= values.min() + 1e-13
        assert values.max() <= high + 1e-13


@pytest.mark.parametrize("m", [2, 3, 4, 5, 16])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_bounds_of_a_row_are_those_of_the_loaded_polynomial(m: int, sign: float) -> None:
    C = np.random.default_rng(m).normal(size=(3, 20))
    powers, a = 0.7 ** np.arange(20.0), np.full(24, np.nan)
    degree = _load(C, sign, m, powers, a)
    assert degree == max(m, 4)
    a0, low, high = _row_bounds(C, sign, m, powers)
    assert a0 == a[0]
    np.testing.assert_allclose((low, high), _bounds(a, degree), rtol=1e-13)


@pytest.mark.parametrize("way", [UP, DOWN, EITHER])
def test_first_crossing_is_the_first_root_of_that_direction(way: int) -> None:
    checked = 0
    for a in random_polynomials(400, 2):
        roots = np.polynomial.polynomial.polyroots(a)
        real = np.sort(roots[np.abs(roots.imag) < 1e-9].real)
        near = np.concatenate([real, [0.0, 1.0]])
        if np.min(np.diff(np.sort(near))) < 1e-5:
            continue
        slope = np.polynomial.polynomial.polyval(real, np.polynomial.polynomial.polyder(a))
        wanted = [r for r, s in zip(real, slope, strict=True) if 0 < r < 1 and (way == EITHER or s * way > 0)]
        x, found = crossing(a, way)
        if wanted:
            assert x == pytest.approx(wanted[0], abs=1e-9)
            checked += 1
        else:
            assert x == poly.NONE
            assert found[1] == np.sign(a.sum())
    assert checked > 40


def test_many_roots_in_the_interval() -> None:
    """Up to eight crossings and seven extrema in one interval."""
    rng = np.random.default_rng(5)
    for _ in range(300):
        roots = np.sort(rng.uniform(0.02, 0.98, rng.integers(2, 9)))
        if np.min(np.diff(roots)) < 1e-3:
            continue
        a = np.convolve(from_roots(list(roots)), from_roots([-1.0, 3.0 + 1j, 3.0 - 1j]).real)
        first = 1 if a[0] < 0 else -1  # the direction of the crossing at roots[0]
        size = np.abs(a).sum()
        for way, expected in ((first, roots[0]), (-first, roots[1]), (EITHER, roots[0])):
            slope = abs(np.polynomial.polynomial.polyval(expected, np.polynomial.polynomial.polyder(a)))
            assert crossing(a, way)[0] == pytest.approx(expected, abs=1e-14 * size / slope)


def test_two_crossings_and_two_extrema_inside() -> None:
    """(x - 0.3)(x - 0.301)(x - 0.8): both ends have the signs of a single crossing."""
    a = from_roots([0.3, 0.301, 0.8])
    assert crossing(a, UP)[0] == pytest.approx(0.3, abs=1e-12)
    assert crossing(a, DOWN)[0] == pytest.approx(0.301, abs=1e-12)
    assert crossing(-a, UP)[0] == pytest.approx(0.301, abs=1e-12)


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12, 1e-14])
def test_grazes_are_decided(depth: float) -> None:
    """depth - (x - c)^2 rises above zero for depth > 0 only, at c - sqrt(depth)."""
    for c in np.random.default_rng(3).uniform(0.05, 0.95, 200):
        shape = from_roots([c, c], -1.0)
        quartic = np.convolve(shape, [1.0, 0.3, -0.2])  # the same double zero in a polynomial of higher degree
        for a in (shape, quartic):
            below, above = a.copy(), a.copy()
            below[0] -= depth
            above[0] += depth
            assert crossing(below, UP)[0] == poly.NONE
            x = crossing(above, UP)[0]
            assert abs(c - x) < 2.0 * np.sqrt(depth)
            assert x < c


def test_a_graze_within_the_error_is_reported() -> None:
    a = from_roots([0.4, 0.4], -1.0)
    a[0] -= 1e-10
    assert crossing(a, UP, error=1e-11)[1][0] == 0
    assert crossing(a, UP, error=1e-9)[1][0] == 1


def test_a_change_between_two_steps_is_found_at_the_beginning() -> None:
    """The last step ended below zero, this one begins above it by a rounding."""
    a = np.array([1e-17, 1.0, 0.1, 0.0, 0.0])
    assert crossing(a, UP, before=-1)[0] == 0.0
    assert crossing(a, UP, before=1)[0] == poly.NONE
    assert crossing(a, UP)[0] == poly.NONE


def test_zeros_of_small_numbers_keep_their_digits() -> None:
    a = np.array([-1e-30, 1.0, -0.5, 0.1, 0.0])
    assert crossing(a, UP)[0] == pytest.approx(1e-30, rel=1e-12)


def test_largest_is_the_largest_value() -> None:
    x = np.linspace(0.0, 1.0, 20001)
    for a in random_polynomials(200, 4):
        m = len(a) - 1
        expected = np.polynomial.polynomial.polyval(x, a).max()
        found = _largest(a.copy(), m, -np.inf, np.zeros(poly.stack_size(m)))
        size = np.abs(a).sum()
        assert expected - 1e-13 * size <= found <= expected + 3e-7 * size  # the grid misses the maximum by its spacing
        assert _largest(a.copy(), m, found + 1.0, np.zeros(poly.stack_size(m))) == found + 1.0


def test_shift_and_strip() -> None:
    a = np.array([0.3, -1.0, 0.5, 2.0, -0.7, 0.2])
    out = np.zeros(6)
    _shift(a, 5, 0.25, 0.5, out)
    y = np.linspace(0, 1, 7)
    np.testing.assert_allclose(
        np.polynomial.polynomial.polyval(y, out), np.polynomial.polynomial.polyval(0.25 + 0.5 * y, a), rtol=1e-13
    )
    b = np.array([0.0, 0.0, 3.0, 1.0, 0.0, 2.0])
    assert _strip(b, 5) == 4
    np.testing.assert_array_equal(b[:5], [3.0, 1.0, 0.0, 2.0, 0.0])
    assert _strip(np.zeros(6), 5) == -1
