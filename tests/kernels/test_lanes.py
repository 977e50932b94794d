"""Sums in vector instructions against the same sums in exact arithmetic; memory laid out by cache lines."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numba import njit

from nonsmooth.kernels.compile.block import LINE, one_block
from nonsmooth.kernels.compile.lanes import LANES, plain, sum_columns, sum_rows
from nonsmooth.kernels.linear.tables import DEGREE

# states and terms of a sum: one by one, in vectors, in loops over terms, in several vectors
SHAPES = ((2, 5), (2, 7), (5, 8), (20, 23), (20, 43), (70, 73))


def sums(states: int, terms: int, rows: object, columns: object) -> tuple[object, object]:
    def rows_summed(out, table, w):
        rows(out, 2, table, 1, 2, w, states, terms)

    def columns_summed(out, table, w):
        columns(out, table, 1, 2, w, states, terms)

    return rows_summed, columns_summed


def compiled_sums(states: int, terms: int) -> tuple[object, object]:
    plain_rows, plain_columns = sums(states, terms, sum_rows, sum_columns)
    text = "void(float64[{}::1], float64[:,:,:,::1], float64[::1])"
    return njit(text.format(":,"))(plain_rows), njit(text.format(""))(plain_columns)


def close(found: np.ndarray, table: np.ndarray, weights: np.ndarray) -> None:
    """Each sum to rounding: sum_j table[j, k] weights[j] in exact arithmetic."""
    for k, value in enumerate(found):
        terms = [Fraction(float(a)) * Fraction(float(b)) for a, b in zip(table[:, k], weights, strict=True)]
        most = float(sum(map(abs, terms)))
        assert abs(Fraction(float(value)) - sum(terms)) <= Fraction(len(terms) * 2.0**-53 * most)


@pytest.mark.parametrize("odd", [0, 1])  # also where a row straddles cache lines
@pytest.mark.parametrize(("states", "terms"), SHAPES)
@pytest.mark.parametrize("made", [compiled_sums, lambda n, m: sums(n, m, plain.sum_rows, plain.sum_columns)])
def test_sums_are_right_to_rounding_and_touch_nothing_else(made, states: int, terms: int, odd: int) -> None:
    by_rows, by_columns = made(states, terms)
    rng = np.random.default_rng(3)
    w = rng.standard_normal(terms)
    weights = w.copy()
    weights[states] = 1.0  # this column stands for a constant, whatever w holds
    table = rng.standard_normal((2, 3, terms, LANES))
    out = rng.standard_normal(4 * LANES + odd)[odd:].reshape(4, LANES)
    before = out.copy()
    by_rows(out, table, w)
    close(out[2], table[1, 2], weights)
    np.testing.assert_array_equal(out[[0, 1, 3]], before[[0, 1, 3]])
    table = rng.standard_normal((2, 3, terms, states))
    out = rng.standard_normal(terms + 1 + odd)[odd:]
    before = out.copy()
    by_columns(out, table, w)
    close(out[:states], table[1, 2], weights)
    np.testing.assert_array_equal(out[states:], before[states:])


def test_a_row_of_lanes_is_a_row_of_taylor_coefficients() -> None:
    assert LANES == DEGREE + 1


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
