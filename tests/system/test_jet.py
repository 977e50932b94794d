"""The generated Taylor coefficients against mpmath, closed forms and repeated Lie derivatives."""

import math

import mpmath
import numpy as np
import pytest
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.codegen.generate import compile_model
from nonsmooth.system.codegen.jet import jet_code
from nonsmooth.system.symbolic.traced import Traced

T = sp.Symbol("t", real=True)
X, Y, Z = sp.symbols("x y z", real=True)
A, B = sp.symbols("a b", real=True)
PARAMETERS = {A: 0.7, B: -1.3}


def make(fields, indicators=(), outputs=()):
    """A Traced of one mode in x, y, z with the parameters a, b."""
    u = (X, Y, Z)[: len(fields)]
    return Traced(
        name="made",
        t=T,
        u=u,
        p=(A, B),
        m=(),
        state_names=tuple(map(str, u)),
        parameter_names=("a", "b"),
        memory_names=(),
        mode_names=("only",),
        indicator_names=tuple(f"g{i}" for i in range(len(indicators))),
        output_names=tuple(f"o{i}" for i in range(len(outputs))),
        fields=(tuple(map(sp.sympify, fields)),),
        lacking=((False,) * len(fields),),
        indicators=tuple(map(sp.sympify, indicators)),
        transitions=(),
        outputs=tuple((sp.sympify(o),) for o in outputs),
        period=None,
    )


def series(traced, u, t=0.0, order=12):
    model = compile_model(traced)
    rows = len(traced.u) + len(traced.indicators) + len(traced.outputs)
    c = np.full((rows, order + 1), np.nan)
    q = np.array(list(PARAMETERS.values()))
    model.jet(0, order, t, np.asarray(u, float), q, c, np.full((model.n_scratch, order + 1), np.nan))
    return c


# With x' = a, y' = b, z' = 1 the states are x0 + a s, ...: g(u(s)) is an explicit function of s.
SMOOTH = {
    "sum and product": 2 * X - Y * Z / 3 + A,
    "products sharing a factor": X * Y * Z + X * Y,
    "square": (X + 2 * Y) ** 2,
    "integer power": X**7 - Y**3,
    "negative power": Y**-3,
    "reciprocal": 1 / (X + 5),
    "quotient": (X + T) / (Y + X * Z + 7),
    "scaled quotient": A * X / (-B * Y * Z),
    "root": sp.sqrt(X + 3),
    "root of a scaled state": sp.sqrt(A * X),
    "root of the opposite of a negative state": sp.sqrt(-Y),
    "inverse root": 1 / sp.sqrt(X * X + Z),
    "real power": X**2.5,
    "parameter power": X**A,
    "half-integer power": (X**2 + Y**2) ** sp.Rational(-3, 2),
    "variable power": X**Z,
    "constant base": A**X,
    "exp": sp.exp(B * X + 1),
    "exp of a square": sp.exp(-X * X),
    "exp of time": sp.exp(-A * T + 1),
    "log": sp.log(X * X + 2),
    "log of a scaled state": sp.log(3 * Z),
    "sin and cos": sp.sin(X * Y) + 2 * sp.cos(X * Y),
    "sin of a state": sp.sin(3 * X - 1),
    "forcing": sp.cos(A * T + 1) * X - sp.sin(A * T + 1),
    "square of a wave": sp.cos(2 * T) ** 2,
    "modulated wave": sp.sin(T * T) * T**3,
    "sinh and cosh": sp.sinh(X / 2) * sp.cosh(Y / 3),
    "tan": sp.tan(X / 3),
    "tanh": sp.tanh(-2 * X + Y),
    "atan": sp.atan(X - Y),
    "asin": sp.asin(X / 9),
    "acos": sp.acos(Y / 9),
    "asinh": sp.asinh(X * 2),
    "acosh": sp.acosh(Z + 3),
    "atanh": sp.atanh(X / 11),
    "atan2": sp.atan2(X - 2, Y),
    "choice by a parameter": sp.Piecewise((sp.log(-X), A < 0), (X**2, True)),
    "parameters with corners": sp.Max(A, B) * X + sp.Abs(B) * sp.sign(B) + sp.Heaviside(A, 1),
    "constant": A * B,
    "time": T,
}


@pytest.fixture(scope="module")
def explicit():
    traced = make((A, B, 1), indicators=SMOOTH.values())
    start, t = (1.2, -0.9, 0.8), 0.3
    return start, t, series(traced, start, t)


@pytest.mark.parametrize("name", SMOOTH)
def test_every_function_against_mpmath(explicit, name):
    start, t, coefficients = explicit
    row = coefficients[3 + list(SMOOTH).index(name)]
    with mpmath.workdps(60):
        a, b = map(mpmath.mpf, PARAMETERS.values())
        g = sp.lambdify((X, Y, Z, T, A, B), SMOOTH[name], "mpmath")
        x, y, z = map(mpmath.mpf, start)
        expected = mpmath.taylor(lambda s: g(x + a * s, y + b * s, z + s, t + s, a, b), 0, 12)
        expected = np.array([float(mpmath.re(e)) for e in expected])
    # A few ulp of what a power series with this radius of convergence carries at each order.
    nonzero = [abs(e) ** (1 / k) for k, e in enumerate(expected) if k and e]
    scale = max(abs(expected[0]), 1e-3) * np.maximum(1.0, max(nonzero, default=0.0)) ** np.arange(13)
    assert np.all(np.abs(row - expected) <= 64 * np.finfo(float).eps * np.maximum(np.abs(expected), scale))


def test_logistic_growth():
    """x' = a x (1 - x): x = 1 / (1 + ((1 - x0) / x0) exp(-a s))."""
    a, start = PARAMETERS[A], 0.3
    got = series(make([A * X * (1 - X)]), [start], order=20)[0]
    with mpmath.workdps(50):
        ratio = (1 - mpmath.mpf(start)) / mpmath.mpf(start)
        exact = mpmath.taylor(lambda s: 1 / (1 + ratio * mpmath.exp(-mpmath.mpf(a) * s)), 0, 20)
    np.testing.assert_allclose(got, [float(e) for e in exact], rtol=1e-12)


def test_linear_oscillator_with_forcing_at_high_order():
    """x'' = -x + cos(a t) has x = cos(a t) / (1 - a^2) + free motion."""
    a = PARAMETERS[A]
    got = series(make([Y, -X + sp.cos(A * T)]), [1 / (1 - a * a), 0.0], order=24)[0]
    k = np.arange(25)
    exact = [math.cos(i * math.pi / 2) * a**i / math.factorial(i) / (1 - a * a) if i % 2 == 0 else 0.0 for i in k]
    np.testing.assert_allclose(got, exact, rtol=1e-11, atol=1e-25)


@pytest.mark.parametrize(
    ("fields", "order"),
    [
        pytest.param((10 * (Y - X), X * (28 - Z) - Y, X * Y - sp.Rational(8, 3) * Z), 4, marks=pytest.mark.slow),
        ((Y, -A * Y - (X + 10) + Z, 20 * (8 - X * sp.sqrt(Z))), 4),
        ((Y + sp.cos(T) ** 2, -sp.sin(X) * sp.exp(-Y / 3) + sp.cos(3 * T + B), sp.tanh(X * Y) / (1 + Z**2) + T), 3),
    ],
    ids=["Lorenz", "relief valve", "forced"],
)
def test_nonlinear_fields_against_lie_derivatives(fields, order):
    u = (X, Y, Z)
    start, t = (1.5, -0.4, 9.0), 0.2
    indicator = X * Z - Y**2
    got = series(make(fields, indicators=[indicator]), start, t, order=order)
    for row, g in enumerate([*u, indicator]):
        for k in range(order + 1):  # the derivatives' length grows very fast
            function = sp.lambdify((X, Y, Z, T, A, B), g, "mpmath")
            with mpmath.workdps(40):
                exact = function(*map(mpmath.mpf, (*start, t, *PARAMETERS.values()))) / math.factorial(k)
            np.testing.assert_allclose(got[row, k], float(exact), rtol=2e-13, atol=1e-13)
            g = sp.diff(g, T) + sum(sp.diff(g, v) * f for v, f in zip(u, fields, strict=True))


def test_lowest_order_and_wider_arrays():
    traced = make([Y, -X + sp.cos(A * T) * X], indicators=[X - A, T * X])
    one, many = series(traced, [1.0, 0.5], 0.3, order=1), series(traced, [1.0, 0.5], 0.3, order=9)
    np.testing.assert_array_equal(one, many[:, :2])
    model = compile_model(traced)
    wide = np.full((4, 15), 7.0)
    model.jet(0, 9, 0.3, np.array([1.0, 0.5]), np.array([0.7, -1.3]), wide, np.zeros((model.n_scratch, 15)))
    np.testing.assert_array_equal(wide[:, :10], many)
    assert np.all(wide[:, 10:] == 7.0)


def test_surface_is_exactly_zero_on_itself():
    """x - a and a - x vanish exactly where x equals a, whatever else the indicator adds."""
    rows = series(make([Y, -X], indicators=[X - A, -(X - A) - B * Y]), [PARAMETERS[A], 0.0])
    assert rows[2, 0] == 0.0
    assert rows[3, 0] == 0.0


def test_output_with_a_corner_has_a_value_but_no_series():
    traced = make([Y, -X], outputs=[sp.Abs(X) + Y, X**2, sp.Piecewise((X, X > 0), (0, True))])
    rows = series(traced, [-2.0, 0.5])[2:]
    np.testing.assert_array_equal(rows[:, 0], [2.5, 4.0, 0.0])
    assert np.all(np.isnan(rows[[0, 2], 1:]))
    assert np.all(np.isfinite(rows[1]))
    assert compile_model(traced).smooth_outputs == (False, True, False)


@pytest.mark.parametrize("fields", [(Y, -sp.sign(Y)), (Y, sp.Max(X, 0)), (Y, sp.Piecewise((1, X > 0), (2, True)))])
def test_field_with_a_corner_is_refused(fields):
    with pytest.raises(SystemDefinitionError, match="corner"):
        compile_model(make(fields))


def test_function_without_series_is_refused():
    with pytest.raises(SystemDefinitionError, match=r"no Taylor series is known for .*erf.*allowed are"):
        jet_code(T, (X,), {}, [[sp.erf(X)]], [[]])
