"""Sums over any number of states against the same sums in exact arithmetic; memory laid out by cache lines."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.compile.pointers import LINE, one_block
from nonsmooth.kernels.linear.tables import DEGREE

CALLABLE = """
from numba import types
from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.linear import sums

i, f = types.int64, types.float64


@kernel(types.void(*[i] * 6))
def propagated(table, filled, w, n, m, out):
    sums.propagated(table, filled, w, n, m, out)


@kernel(types.void(*[i] * 4))
def composed(table, some, w, out):
    sums.composed(table, some, w, out)


@kernel(f(*[i] * 5))
def row_of(row, some, w, n, m):
    return sums.row_of(row, some, w, n, m)


@kernel(f(*[i] * 4))
def spread_of(row, w, about, n):
    return sums.spread_of(row, w, about, n)


@kernel(f(*[i] * 6))
def sizes_of(row, some, w, n, first, m):
    return sums.sizes_of(row, some, w, n, first, m)


@kernel(f(i, i, i))
def dot(row, w, n):
    return sums.dot(row, w, n)
"""  # kept on disk, as what ``njit`` makes of functions is not
STATES = (1, 3, 4, 5, 8, 13, 20, 32, 33, 70)  # of one vector and of part of one, of several, of more than go at once


@pytest.fixture(scope="module")
def sums():
    return load_module(CALLABLE, "test_sums")


def exact(a, b) -> tuple[Fraction, float]:
    """sum_j a[j] b[j] and its rounding at most."""
    terms = [Fraction(float(x)) * Fraction(float(y)) for x, y in zip(a, b, strict=True)]
    return sum(terms, Fraction(0)), len(terms) * 2.0**-53 * float(sum(map(abs, terms), Fraction(0)))


def near(found: float, a, b) -> bool:
    whole, rounding = exact(a, b)
    return abs(Fraction(float(found)) - whole) <= Fraction(2 * rounding)


def list_of(places: list[int], room: int) -> np.ndarray:
    found = np.zeros(room + 1, dtype=np.int64)
    found[: len(places) + 1] = [len(places), *places]
    return found


@pytest.mark.parametrize("odd", [0, 1])  # also where a row straddles cache lines
@pytest.mark.parametrize("harmonics", [0, 2])
@pytest.mark.parametrize("n", STATES)
def test_columns_of_a_propagator(sums, n: int, harmonics: int, odd: int) -> None:
    rng, m, filled = np.random.default_rng(3), n + 1 + 2 * harmonics, -(-n // 4) * 4
    table = np.zeros(m * filled + odd)[odd:].reshape(m, filled)
    table[:, :n] = rng.standard_normal((m, n))
    w = rng.standard_normal(m)
    weights = np.where(np.arange(m) == n, 1.0, w)  # this column stands for a constant, whatever w holds
    out = rng.standard_normal(filled + 3 + odd)[odd:]
    behind = out[filled:].copy()
    sums.propagated(table.ctypes.data, filled, w.ctypes.data, n, m, out.ctypes.data)
    assert all(near(out[r], table[:, r], weights) for r in range(n))
    np.testing.assert_array_equal(out[filled:], behind)


@pytest.mark.parametrize("places", [[], [2], [0, 3, 4], list(range(17))])
def test_taylor_coefficients_over_the_columns_that_are_not_zero(sums, places: list[int]) -> None:
    rng = np.random.default_rng(4)
    table, w, out = rng.standard_normal((17, DEGREE + 1)), rng.standard_normal(17), rng.standard_normal(10)
    some, behind = list_of(places, 17), out[8:].copy()
    sums.composed(table.ctypes.data, some.ctypes.data, w.ctypes.data, out.ctypes.data)
    assert all(near(out[k], table[places, k], w[places]) for k in range(DEGREE + 1))
    np.testing.assert_array_equal(out[8:], behind)


@pytest.mark.parametrize("n", STATES)
def test_rows_and_their_sizes(sums, n: int) -> None:
    rng, m = np.random.default_rng(5), n + 3
    places = sorted(rng.choice(n, size=max(1, n // 2), replace=False).tolist())
    row, w, about = np.zeros(m), rng.standard_normal(m), rng.standard_normal(n)
    row[[*places, *range(n, m)]] = rng.standard_normal(len(places) + 3)
    some, weights = list_of(places, n), np.where(np.arange(m) == n, 1.0, w)
    row_at, w_at, some_at = row.ctypes.data, w.ctypes.data, some.ctypes.data
    assert near(sums.row_of(row_at, some_at, w_at, n, m), row, weights)
    assert near(sums.dot(row_at, w_at, n), row[:n], w[:n])
    sizes = sums.sizes_of(row_at, some_at, w_at, n, n + 1, m)
    kept = np.arange(m) != n
    assert near(sizes, np.abs(row[kept]), np.abs(w[kept]))
    spread = sums.spread_of(row_at, w_at, about.ctypes.data, n)
    assert near(spread, [*row[:n], row[n]], [*np.abs(w[:n] - about), 1.0])


def test_a_state_alone_is_no_sum(sums) -> None:
    """A condition on one state is that state to the last bit: what a contact cancels must cancel."""
    row, w, some = np.array([0.0, 1.0, -0.3]), np.array([7.0, 0.3, 1.0]), list_of([1], 2)
    assert sums.row_of(row.ctypes.data, some.ctypes.data, w.ctypes.data, 2, 3) == 0.0


def test_one_block_begins_every_array_on_a_cache_line() -> None:
    whole, parts = np.arange(3), (np.ones((2, 5)), np.full(9, 2.0))
    found = one_block(whole, parts, np.ones((1, 1)))
    arrays = [found[0], *found[1], found[2]]
    for array, wanted in zip(arrays, [whole, *parts, np.ones((1, 1))], strict=True):
        np.testing.assert_array_equal(array, wanted)
        assert array.dtype == wanted.dtype and array.flags.c_contiguous and array.ctypes.data % LINE == 0
    for array in arrays:
        array[...] = 7
    assert all((array == 7).all() for array in arrays)
    for i, one in enumerate(arrays):
        assert not any(np.shares_memory(one, other) for other in arrays[i + 1 :])
