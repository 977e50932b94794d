"""The linear form against matrices written by hand, and against the expressions themselves."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from nonsmooth import models
from nonsmooth.system.codegen.linear import linear_form
from nonsmooth.system.symbolic.traced import Traced, TracedCondition, TracedTransition

T = sp.Symbol("t", real=True)
X, Y, Z, V = sp.symbols("x y z v", real=True)
A, B, W = sp.symbols("a b w", real=True)
MEMORY = sp.Symbol("m", real=True)
PERIOD = 2 * sp.pi / W


def make(*fields, indicators=(), outputs=(), resets=(), period=None, u=(X, Y), memory=()):
    """A Traced with one mode for each field, and one transition for each reset (or None)."""
    modes, sympify = range(len(fields)), sp.sympify
    return Traced(
        name="made",
        t=T,
        u=u,
        p=(A, B, W),
        m=memory,
        state_names=tuple(map(str, u)),
        parameter_names=("a", "b", "w"),
        memory_names=tuple(map(str, memory)),
        mode_names=tuple(f"mode{i}" for i in modes),
        indicator_names=tuple(f"g{i}" for i in range(len(indicators))),
        output_names=tuple(f"o{i}" for i in range(len(outputs))),
        fields=tuple(tuple(map(sympify, f)) for f in fields),
        lacking=tuple((False,) * len(u) for _ in modes),
        indicators=tuple(map(sympify, indicators)),
        transitions=tuple(
            TracedTransition(0, 0, (TracedCondition(0, 1),), reset=None if r is None else tuple(map(sympify, r)))
            for r in resets
        ),
        outputs=tuple(tuple(map(sympify, o)) for o in outputs),
        period=period,
    )


POINTS = np.array([[0.7, -1.3, 2.1], [0.2, 0.4, 5.0], [-1.0, 3.0, 0.3]])


def check(traced, points=POINTS):
    """Rebuild every expression from the tables, at a few instants and states, and compare."""
    form = linear_form(traced)
    tables = form.evaluate(points)
    k = np.array(form.multiples, dtype=float)
    random = np.random.default_rng(0)
    assert all(value.flags.c_contiguous and value.dtype == np.float64 for value in tables if value.dtype != np.int64)
    for i, point in enumerate(points):
        for _ in range(4):
            t, u = random.uniform(0, 10), random.normal(size=len(traced.u))
            cosine, sine = np.cos(k * tables.omega[i] * t), np.sin(k * tables.omega[i] * t)

            def value(expressions, t=t, u=u, point=point):
                values = [sp.lambdify((traced.t, traced.u, traced.p), e)(t, u, point) for e in expressions]
                return np.array(values, dtype=float)

            def close(got, expressions):
                np.testing.assert_allclose(got, value(expressions), rtol=1e-11, atol=1e-11)

            for mode, fields in enumerate(traced.fields):
                forcing = cosine @ tables.c[i, mode] + sine @ tables.s[i, mode]
                close(tables.A[i, mode] @ u + tables.b[i, mode] + forcing, fields)
                got = tables.oa[i, :, mode] @ u + tables.ob[i, :, mode]
                got += tables.oc[i, :, mode] @ cosine + tables.os[i, :, mode] @ sine
                known = np.isfinite(got)
                close(got[known], [output[mode] for output, one in zip(traced.outputs, known, strict=True) if one])
            if form.affine_indicators:
                got = tables.ia[i] @ u + tables.ib[i] + tables.ic[i] @ cosine + tables.is_[i] @ sine
                close(got, traced.indicators)
            if form.affine_resets:
                for j, transition in enumerate(traced.transitions):
                    got = tables.ra[i, j] @ u + tables.rb[i, j] + cosine @ tables.rc[i, j] + sine @ tables.rs[i, j]
                    close(got, traced.u if transition.reset is None else transition.reset)
    return form, tables


def test_papers_oscillator_by_hand():
    system = models.discontinuous_support()
    names = list(system.parameters)
    values = {"m": 0.838, "k": 8.47, "c": 0.87, "k_s": 1210.0, "c_s": 0.6, "g": 0.0018, "rho": 0.33, "omega": 11.15}
    assert set(names) == set(values)
    form = linear_form(system.traced)
    tables = form.evaluate(np.array([[values[name] for name in names]]))
    m, k, c, k_s, c_s, g, rho, omega = values.values()
    assert form.multiples == (1,)
    assert form.affine_indicators and form.affine_resets
    np.testing.assert_allclose(tables.omega, [omega], rtol=1e-15)
    free = [[0, 1], [-2 * k / m, -c / m]]
    contact = [[0, 1], [-(2 * k + k_s) / m, -(c + c_s) / m]]
    np.testing.assert_allclose(tables.A[0], [free, contact], rtol=1e-15)
    np.testing.assert_allclose(tables.b[0], [[0, 0], [0, k_s * g / m]], rtol=1e-15)
    np.testing.assert_allclose(tables.c[0], [[[0, rho / m]]] * 2, rtol=1e-15)
    np.testing.assert_array_equal(tables.s[0], np.zeros((2, 1, 2)))
    order = [list(system.indicators).index(name) for name in ("penetration", "separation")]
    np.testing.assert_allclose(tables.ia[0][order], [[1, 0], [-1, -c_s / k_s]], rtol=1e-15)
    np.testing.assert_allclose(tables.ib[0][order], [-g, g], rtol=1e-15)
    np.testing.assert_array_equal(tables.ra[0], [np.eye(2)] * 2)
    check(system.traced, np.array([list(values.values())]))


def test_impact_oscillator_has_an_affine_reset():
    system = models.impact_oscillator()
    form = linear_form(system.traced)
    tables = form.evaluate(system.parameter_vector()[None])
    assert form.affine_resets and form.multiples == (1,)
    impact = next(i for i, transition in enumerate(system.transitions) if transition.reset is not None)
    np.testing.assert_allclose(tables.ra[0, impact], [[1, 0], [0, -system.values["e"]]], atol=0)


def test_forced_resets_indicators_and_outputs():
    check(
        make(
            (Y, -X),
            indicators=[X - A * sp.cos(W * T), Y + B],
            outputs=[[A * X + sp.sin(W * T) + 1]],
            resets=[(X + B, -A * Y + (1 + A) * sp.sin(W * T + B)), None],
            period=PERIOD,
        )
    )


def test_switched_oscillator_has_linear_modes_and_nonlinear_indicators():
    """Problem L: circles switched on the unit circle."""
    left, right = sp.Matrix([[1, -2 * sp.pi], [2 * sp.pi, 1]]), sp.Matrix([[1, 2 * sp.pi], [-2 * sp.pi, 1]])
    u = sp.Matrix([X, Y])
    form, tables = check(make(tuple(left * u), tuple(right * u), indicators=[X**2 + Y**2 - 1], resets=[(X * Y, Y)]))
    assert not form.affine_indicators and not form.affine_resets
    assert form.multiples == ()
    np.testing.assert_array_equal(tables.omega, 0.0)
    np.testing.assert_allclose(tables.A[0], [np.array(left, float), np.array(right, float)], rtol=1e-15)
    np.testing.assert_array_equal(tables.ia, 0.0)
    assert tables.c.shape == (3, 2, 0, 2)


def test_two_degrees_of_freedom():
    u = (X, Y, Z, V)
    form, tables = check(
        make(
            (Z, V, -2 * X + Y - A * Z + B * sp.cos(W * T), X - 2 * Y - A * V),
            indicators=[X - Y - A],
            resets=[(X, Y, -A * Z + B * V, Z)],
            period=PERIOD,
            u=u,
        )
    )
    assert form.affine_resets
    assert tables.A.shape == (3, 1, 4, 4)


def test_singular_matrix_and_constant_field():
    _, tables = check(make((Y, -9.81), (0, 0)))
    np.testing.assert_array_equal(tables.A[0, 0], [[0, 1], [0, 0]])
    np.testing.assert_array_equal(tables.b[0], [[0, -9.81], [0, 0]])


@pytest.mark.parametrize(
    ("forcing", "multiples"),
    [
        (sp.cos(W * T) + A * sp.sin(3 * W * T + B), (1, 3)),
        (sp.cos(W * T) ** 2, (2,)),
        (sp.sin(W * T) ** 3, (1, 3)),
        (sp.sin(W * T) * sp.cos(2 * W * T + A), (1, 3)),
        (sp.cos(A - W * T) + sp.sin(-2 * W * T), (1, 2)),
        ((1 + A * sp.cos(W * T)) * (B - sp.sin(W * T)), (1, 2)),
        (sp.cos(B) * sp.exp(A), ()),
    ],
)
def test_harmonics_of_the_base_frequency(forcing, multiples):
    form, _ = check(make((Y, -X + forcing), period=PERIOD))
    assert form.multiples == multiples


def test_subharmonic_period_and_numbers():
    assert check(make((Y, sp.cos(3 * T)), period=2 * sp.pi))[0].multiples == (3,)
    assert check(make((Y, sp.cos(3.3 * T)), period=sp.Float(2 * np.pi / 1.1)))[0].multiples == (3,)


def test_cancelling_terms_are_multiplied_out():
    form, _ = check(make(((X + 1) ** 2 - X**2, A * (T + Y) - A * T)))
    assert form is not None


@pytest.mark.parametrize(
    "traced",
    [
        make((Y, -(X**3))),
        make((Y, -X + X * sp.cos(W * T)), period=PERIOD),
        make((Y, sp.sin(X))),
        make((Y, T)),
        make((Y, sp.cos(W * T))),
        make((Y, sp.cos(W * T) + sp.cos(A * T)), period=PERIOD),
        make((Y, sp.cos(W * T) + sp.cos(sp.sqrt(2) * W * T)), period=PERIOD),
        make((Y, sp.exp(-T)), period=PERIOD),
        make((Y, 1 / (2 + sp.cos(W * T))), period=PERIOD),
        make((Y, -X), (Y, X * Y)),
        make((Y, -X * MEMORY), memory=(MEMORY,)),
    ],
    ids=[
        "cubic",
        "parametric forcing",
        "pendulum",
        "ramp",
        "no period",
        "two frequencies",
        "irrational",
        "decaying",
        "not harmonic",
        "second mode",
        "memory times a state",
    ],
)
def test_not_linear(traced):
    assert linear_form(traced) is None


def test_memory_is_a_state_that_only_transitions_change():
    traced = make(
        (Y, A * MEMORY - X), indicators=[X - B * MEMORY], outputs=[[MEMORY + Y]], resets=[(X, MEMORY)], memory=(MEMORY,)
    )
    jump = traced.transitions[0]
    form = linear_form(replace(traced, transitions=(jump, replace(jump, reset=None, writes=((0, MEMORY / 2 + Y),)))))
    assert form.affine_indicators and form.affine_resets
    (a, b, _), tables = POINTS[0], form.evaluate(POINTS)
    np.testing.assert_array_equal(tables.A[0, 0], [[0, 1, 0], [-1, 0, a], [0, 0, 0]])
    np.testing.assert_array_equal(tables.ia[0, 0], [1, 0, -b])
    np.testing.assert_array_equal(tables.oa[0, 0, 0], [0, 1, 1])
    maps = [[[1, 0, 0], [0, 0, 1], [0, 0, 1]], [[1, 0, 0], [0, 1, 0], [0, 1, 0.5]]]
    np.testing.assert_array_equal(tables.ra[0], maps)


def test_memory_times_a_state_is_not_affine():
    form = linear_form(make((Y, -X), indicators=[X * MEMORY], resets=[(X, Y * MEMORY)], memory=(MEMORY,)))
    assert not form.affine_indicators and not form.affine_resets


def test_nonlinear_output_leaves_the_rest():
    form, tables = check(make((Y, -X), indicators=[X - A], outputs=[[Y**2], [2 * X], [sp.Abs(X)]]))
    assert form.affine_indicators
    assert np.isnan(tables.ob[:, [0, 2]]).all()
    np.testing.assert_array_equal(tables.oa[:, 1, 0], [[2.0, 0.0]] * len(tables.oa))


def test_parameter_choices_are_constants():
    stiffness = sp.Piecewise((A, B > 0), (2 * A, True))
    _, tables = check(make((Y, -stiffness * X + sp.Max(A, B) + sp.Abs(B)), indicators=[X - sp.Min(A, B)]))
    np.testing.assert_allclose(tables.A[:, 0, 1, 0], [-1.4, -0.2, 1.0])


def test_no_points_and_many_points():
    system = models.discontinuous_support()
    form = linear_form(system.traced)
    assert form.evaluate(np.zeros((0, 8))).A.shape == (0, 2, 2, 2)
    points = np.tile(system.parameter_vector(), (1000, 1))
    points[:, list(system.parameters).index("k")] = np.linspace(1, 10, 1000)
    many = form.evaluate(points)
    np.testing.assert_array_equal(many.A[[17]], form.evaluate(points[[17]]).A)
