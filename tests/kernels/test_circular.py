"""The inlined cosine and sine against multiple-precision arithmetic."""

from __future__ import annotations

from math import cos, inf, isnan, nan, pi, sin

import mpmath
import numba
import numpy as np
import pytest

from nonsmooth.kernels.circular import LARGEST, QUARTER, REST, cosine, sine


@numba.njit
def _both(x):
    return cosine(x), sine(x)


def test_the_two_pieces_are_half_pi():
    assert mpmath.mpf(QUARTER) + mpmath.mpf(REST) - mpmath.pi / 2 == pytest.approx(0.0, abs=1e-26)
    assert (QUARTER * 2**32).is_integer()  # 33 bits


@pytest.mark.parametrize("size", [1e-8, 1.0, 10.0, 1e3, 0.999 * LARGEST])
def test_close_to_the_truth(size):
    rng = np.random.default_rng(1)
    quarters = np.round(rng.uniform(-size, size, 50) / (pi / 2)) * (pi / 2)
    for x in [*rng.uniform(-size, size, 300), *quarters[abs(quarters) < LARGEST], 0.0, size, -size]:
        c, s = _both(float(x))
        with mpmath.workdps(40):
            assert abs(c - mpmath.cos(mpmath.mpf(float(x)))) < 2.3e-16
            assert abs(s - mpmath.sin(mpmath.mpf(float(x)))) < 2.3e-16


def test_beyond_its_range_the_library_answers():
    assert _both(1e9) == (cos(1e9), sin(1e9))
    assert isnan(_both(nan)[0]) and isnan(_both(inf)[1])
