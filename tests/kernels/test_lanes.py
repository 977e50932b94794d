"""Sums in vector instructions against the same sums in exact arithmetic; memory laid out by cache lines."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from nonsmooth.kernels.block import LINE, one_block
from nonsmooth.kernels.cache import kernel
from nonsmooth.kernels.lanes import LANES, mix_rows, plain, sum_rows
from nonsmooth.kernels.planar_tables import DEGREE

COLUMNS = 7


@kernel("void(float64[:,::1], float64[:,:,:,::1], float64[::1])")
def sum_compiled(out, table, w):
    sum_rows(out, 2, table, 1, 2, w, COLUMNS)


@kernel("void(float64[:,::1], float64, float64)")
def mix_compiled(out, a, b):
    mix_rows(out, 2, a, b)


def sum_plain(out, table, w):
    plain.sum_rows(out, 2, table, 1, 2, w, COLUMNS)


def mix_plain(out, a, b):
    plain.mix_rows(out, 2, a, b)


def close(found: np.ndarray, exact: list[Fraction], size: list[float]) -> None:
    for value, wanted, most in zip(found, exact, size, strict=True):
        assert abs(Fraction(float(value)) - wanted) <= Fraction(8 * 2.0**-53 * most)


@pytest.mark.parametrize("odd", [0, 1])  # also where a row straddles cache lines
@pytest.mark.parametrize(("add", "mix"), [(sum_compiled, mix_compiled), (sum_plain, mix_plain)])
def test_rows_are_summed_to_rounding_and_no_other_row_is_touched(add, mix, odd: int) -> None:
    rng = np.random.default_rng(3)
    table, w = rng.standard_normal((2, 3, COLUMNS, LANES)), rng.standard_normal(COLUMNS)
    out = rng.standard_normal(4 * LANES + odd)[odd:].reshape(4, LANES)
    before = out.copy()
    add(out, table, w)
    weights = [*w[:2], 1.0, *w[3:]]  # the third column stands for a constant
    terms = [[Fraction(float(table[1, 2, j, k])) * Fraction(float(weights[j])) for j in range(COLUMNS)]
             for k in range(LANES)]  # fmt: skip
    close(out[2], [sum(row) for row in terms], [float(sum(map(abs, row))) for row in terms])
    np.testing.assert_array_equal(out[[0, 1, 3]], before[[0, 1, 3]])
    mix(out, 0.3, -1.7)
    terms = [[Fraction(0.3) * Fraction(float(out[0, k])), Fraction(-1.7) * Fraction(float(out[1, k]))]
             for k in range(LANES)]  # fmt: skip
    close(out[2], [sum(row) for row in terms], [float(sum(map(abs, row))) for row in terms])
    np.testing.assert_array_equal(out[[0, 1, 3]], before[[0, 1, 3]])


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
