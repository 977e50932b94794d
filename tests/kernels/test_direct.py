"""Functions of models made without Numba beside the same functions run by Python."""

import math
import types

import numba
import numpy as np
import pytest

from nonsmooth.kernels.compile.cache import load_module
from nonsmooth.kernels.compile.direct import device

SOURCE = '''
from math import acosh, atan2, ceil, cos, exp, fabs, floor, log, sin, sqrt, tanh

from numpy import array

from nonsmooth.kernels.circular import cosine, sine
from nonsmooth.kernels.compile.direct import callback, device
from nonsmooth.kernels.compile.lanes import load, plus, store, times

SHIFT = 0.25
ROWS = 3
case_of_mixed = array([2, 0, 1])


@callback("void(i8, f8, f8[::1], f8[::1], f8[::1])")
def mixed(mode, t, u, q, out):
    """All that expressions hold."""
    case = case_of_mixed[mode]
    x = u[0]
    y = u[1]
    if case == 0:
        z = x - y * t
    elif case == 1:
        z = (x + SHIFT) / (y * y + 1)
    else:
        z = -x
    out[0] = z
    out[1] = x % y
    out[2] = abs(x) ** q[0] + x ** 3 + y ** -2 + 2 ** (x - y)
    out[3] = max(x, y, z) - min(x, y)
    out[4] = float((x > 0.0) - (x < 0.0))
    out[5] = 1.0 if x > 0.0 and not y > 0.0 else (0.5 if x >= y or z != z else q[1])
    out[6] = atan2(x, y) + tanh(z) * exp(-fabs(x)) - log(fabs(y)) + sqrt(fabs(z)) + acosh(1.0 + fabs(x))
    out[7] = floor(x) + ceil(y) + int(x) + (mode + 5) * 2 - 7
    out[8] = cosine(1e3 * x) + sine(-50.0 * y) - cos(1e3 * x) - sin(-50.0 * y) + t
    out[9] = cosine(1e7 * x) + SHIFT if x == x else 0
    out[mode + 10] += x


@device
def horner(order, x, C, row):
    s = 0.0
    for k in range(order, order + 1):
        s += C[row, k]
    for k in range(order):
        s = s * x + C[row, order - 1 - k]
        if k == 6:
            break
    C[row, 0] = s
    for k in range(0, order, 2):
        C[row, k + 1] = C[row, k] * float(k)


@callback("void(i8, i8, f8, f8[::1], f8[::1], f8[:,::1], f8[:,:,::1])")
def series(mode, order, t, u, q, C, D):
    for row in range(ROWS):
        if row != mode:
            horner(order, u[row] - t, C, row)
        else:
            pass
    for b in range(0, 8, 4):
        x = load(D, b)
        s = times(q[0], x)
        s = plus(s, 1.0 / (order + 1), load(D, 8 + b))
        store(D, 16 + b, s)


@callback("float64(float64)")
def value(x):
    for i in range(4):
        x += sin(x) * i
    return x
'''

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")


@pytest.fixture(scope="module")
def module():
    return load_module(SOURCE, "direct")


@pytest.mark.parametrize("seed", range(40))
def test_expressions(module, seed) -> None:
    rng = np.random.default_rng(seed)
    u, q, mode, t = rng.normal(size=2) * 3.0, rng.uniform(0.5, 2.0, 2), seed % 3, rng.normal()
    found, expected = np.zeros((2, 13))
    module.mixed(mode, t, u, q, found)
    function = module.mixed.py_func
    names = function.__globals__ | {"cosine": math.cos, "sine": math.sin}
    types.FunctionType(function.__code__, names)(mode, t, u.tolist(), q.tolist(), expected)
    np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(
    ("a", "b"), [(7.5, -2.0), (-7.5, 2.0), (-7.5, -2.0), (6.0, -2.0), (-0.0, 3.0), (1e300, 1e-300)]
)
def test_remainders_have_the_sign_of_the_divisor(module, a, b) -> None:
    out = np.zeros(13)
    module.mixed(0, 0.0, np.array([a, b]), np.ones(2), out)
    assert out[1] == a % b and math.copysign(1.0, out[1]) == math.copysign(1.0, b)


@pytest.mark.parametrize("order", [2, 4, 9, 12])
def test_loops_and_calls(module, order) -> None:
    rng = np.random.default_rng(order)
    u, q, C, D = rng.normal(size=3), rng.normal(size=1), rng.normal(size=(3, order + 2)), rng.normal(size=(3, 4, 2))
    expected_C, expected_D = C.copy(), D.copy()
    module.series(1, order, 0.3, u, q, C, D)
    for row in (0, 2):
        horner(order, u[row] - 0.3, expected_C[row])
    np.testing.assert_allclose(C, expected_C, rtol=1e-12)
    expected_D[2] = (q[0] * expected_D[0].ravel() + expected_D[1].ravel() / (order + 1)).reshape(4, 2)
    np.testing.assert_allclose(D, expected_D, rtol=1e-15)


def horner(order, x, c) -> None:
    """By NumPy: the polynomial of the last coefficients, of eight at most, then every second one by its number."""
    c[0] = np.polyval(c[order::-1][: min(order, 7) + 1], x)
    for k in range(0, order, 2):
        c[k + 1] = c[k] * k


def test_a_number_is_returned(module) -> None:
    assert module.value(0.7) == pytest.approx(module.value.py_func(0.7), rel=1e-15)
    assert device(len) is len


@pytest.mark.parametrize(
    "line",
    [
        "out[0] = u[0] // 2.0",
        "out[0] = u[0:1]",
        "while u[0] > 0.0:\n        u[0] -= 1.0",
        "out[0] = hypot(u[0], 1.0)",
        "k = 1\n    k = u[0]",
    ],
)
def test_what_is_no_scalar_code_is_refused(line) -> None:
    source = f"""
from math import hypot
from nonsmooth.kernels.compile.direct import callback


@callback("void(f8[::1], f8[::1])")
def wrong(u, out):
    {line}
"""
    with pytest.raises(NotImplementedError, match="wrong: "):
        load_module(source, "wrong")
