"""The generated field, values and jumps against the expressions; the cache of whole models."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
import sympy as sp

from nonsmooth import models
from nonsmooth.system.codegen.generate import compile_model, model_source
from nonsmooth.system.symbolic.traced import Traced, TracedCondition, TracedTransition

T = sp.Symbol("t_", real=True)
X, Y = sp.symbols("u_x u_lambda", real=True)
A, B, Q = sp.symbols("p_t p_def p_q0", real=True)
M = sp.Symbol("m_C", real=True)

# 0.1 + 0.2 needs 17 digits; SymPy prints 15.
CORNERS = (
    sp.Abs(X) + sp.sign(Y) * A,
    sp.Max(X, Y, B) - sp.Min(X * Y, A),
    sp.Piecewise((X**2, (X > 0) & (Y > 0)), (Y / 3, sp.Or(X < -1, sp.Eq(Y, 2))), (T, True)),
    sp.Heaviside(X, sp.Rational(1, 4)) * 3 - sp.Heaviside(-X, 0),
    sp.floor(3 * X) + sp.ceiling(Y) + (X - 3 * sp.floor(X / 3)),
    sp.Piecewise((0, X < 0), (1, True)) + sp.Piecewise((sp.sqrt(X), X >= 0), (0, True)),
    sp.Piecewise((1, sp.Not(X > Y)), (2, X > 100), (sp.Abs(Y) ** A, True)),
)
SMOOTH = (
    sp.Float(0.1 + 0.2) * X + sp.Rational(2, 3) * Y + sp.pi / 7,
    -X - Y,
    (A - X) / (B * (Y - 5)) - 1 / X**2 + X**9,
    sp.sqrt(X**2 + Y**2) ** 3 / sp.sqrt(Y**2 + 1) + (X**2 + 1) ** A,
    sp.exp(-X) * sp.log(Y**2) + sp.atan2(X, Y) + sp.tanh(X) - sp.sinh(Y / 9) * sp.cosh(X) + sp.E**2,
    sp.sin(T) * sp.cos(2 * T) + sp.tan(X) + sp.asin(X / 9) + sp.acos(Y / 9) + sp.atan(Y),
    sp.asinh(X) + sp.acosh(X**2 + 1) + sp.atanh(Y / 9) + 2**X,
    (X + Y) * Q + M - (X + Y) ** 2 * sp.Max(A, M),
)


@pytest.fixture(scope="module")
def traced():
    transitions = (
        TracedTransition(0, 1, (TracedCondition(0, 1),)),
        TracedTransition(1, 0, (TracedCondition(0, 1),), reset=(Y, -A * X + M), writes=((0, X * B),)),
        TracedTransition(1, 0, (), at=0.5, writes=((0, M + 1),)),
        TracedTransition(1, 1, (TracedCondition(0, -1),), reset=(sp.Abs(X), Y)),
    )
    outputs = tuple((corner, smooth) for corner, smooth in zip(CORNERS, SMOOTH, strict=False))
    return Traced(
        name="made",
        t=T,
        u=(X, Y),
        p=(A, B, Q),
        m=(M,),
        state_names=("x", "lambda"),
        parameter_names=("t", "def", "q0"),
        memory_names=("C",),
        mode_names=("first", "second"),
        indicator_names=("gap", "other"),
        output_names=tuple(f"o{i}" for i in range(len(outputs))),
        fields=((SMOOTH[0], SMOOTH[2]), (SMOOTH[7], sp.S.Zero)),
        lacking=((False, False), (False, True)),
        indicators=(SMOOTH[3], SMOOTH[5]),
        transitions=transitions,
        outputs=outputs,
        period=None,
    )


PARAMETERS = (0.75, -1.5, 2.25)
MEMORY = 0.3
POINTS = [(-1.25, 2.0), (0.5, 0.75), (1.75, -0.5), (-0.5, -2.25)]


def exact(expression, t, x, y):
    values = {T: t, X: x, Y: y, M: MEMORY, **dict(zip((A, B, Q), PARAMETERS, strict=True))}
    return float(expression.subs({symbol: sp.Rational(value) for symbol, value in values.items()}).evalf(30))


@pytest.mark.parametrize("point", POINTS)
def test_field_and_values(traced, point):
    model, q = compile_model(traced), np.array([*PARAMETERS, MEMORY])
    u, t = np.array(point), 0.4
    for mode in range(2):
        du = np.full(2, np.nan)
        model.field(mode, t, u, q, du)
        expected = [exact(e, t, *point) for e in traced.fields[mode]]
        np.testing.assert_allclose(du, expected, rtol=4e-15, atol=1e-15)
        rows = [*traced.indicators, *(output[mode] for output in traced.outputs)]
        out = np.full(len(rows), np.nan)
        model.values(mode, t, u, q, out)
        np.testing.assert_allclose(out, [exact(e, t, *point) for e in rows], rtol=1e-14, atol=1e-14)


def test_the_sign_of_zero_is_zero(traced):
    """|x| + A sign(y) at y = 0 is |x|: sign(0) = 0, as in NumPy and SymPy."""
    model, q = compile_model(traced), np.array([*PARAMETERS, MEMORY])
    out = np.full(len(traced.indicators) + len(CORNERS), np.nan)
    for y, sign in ((0.0, 0.0), (1e-300, 1.0), (-1e-300, -1.0)):
        model.values(0, 0.4, np.array([-1.25, y]), q, out)
        assert out[len(traced.indicators)] == 1.25 + PARAMETERS[0] * sign


def test_jumps_write_state_and_memory_from_the_state_before(traced):
    model, q, u = compile_model(traced), np.array([*PARAMETERS, MEMORY]), np.array([-1.25, 2.0])
    a, b, _ = PARAMETERS
    expected = [
        ([-1.25, 2.0], MEMORY),
        ([2.0, a * 1.25 + MEMORY], -1.25 * b),
        ([-1.25, 2.0], MEMORY + 1),
        ([1.25, 2.0], MEMORY),
    ]
    for transition, (state, memory) in enumerate(expected):
        u_new, q_new = np.full(2, np.nan), np.full(4, np.nan)
        model.jump(transition, 0.0, u, q, u_new, q_new)
        np.testing.assert_allclose(u_new, state, rtol=1e-15)
        np.testing.assert_allclose(q_new, [*PARAMETERS, memory], rtol=1e-15)
    np.testing.assert_array_equal(u, [-1.25, 2.0])


def test_only_corners_lose_their_series(traced):
    assert compile_model(traced).smooth_outputs == (False,) * len(CORNERS)
    valve = models.relief_valve().traced
    assert all(compile_model(valve).smooth_outputs)


def test_jet_starts_with_values_and_field(traced):
    model, q = compile_model(traced), np.array([*PARAMETERS, MEMORY])
    u, t, n = np.array([1.75, -0.5]), 0.4, 2 + 2 + len(CORNERS)
    for mode in range(2):
        c = np.full((n, 6), np.nan)
        model.jet(mode, 5, t, u, q, c, np.empty((model.n_scratch, 6)))
        out, du = np.empty(n - 2), np.empty(2)
        model.values(mode, t, u, q, out)
        model.field(mode, t, u, q, du)
        np.testing.assert_array_equal(c[:2, 0], u)
        np.testing.assert_allclose(c[2:, 0], out, rtol=1e-14)
        np.testing.assert_allclose(c[:2, 1], du, rtol=1e-14)
        np.testing.assert_array_equal(np.isnan(c[4:, 1:]).all(axis=1), [mode == 0] * len(CORNERS))


def test_same_model_is_compiled_once():
    first, second = models.discontinuous_support(), models.discontinuous_support().with_parameters(g=0.002)
    assert compile_model(first.traced).jet is compile_model(second.traced).jet
    assert model_source(first.traced) != model_source(models.relief_valve().traced)


@pytest.mark.parametrize("name", models.names())
def test_published_models_compile_and_agree_with_their_expressions(name):
    system = getattr(models, name)()
    traced, model = system.traced, compile_model(system.traced)
    random = np.random.default_rng(1)
    q = np.concatenate([system.parameter_vector(), system.memory_vector()])
    for mode, fields in enumerate(traced.fields):
        u, t = random.uniform(0.1, 2.0, len(traced.u)), 0.3
        du = np.empty(len(u))
        model.field(mode, t, u, q, du)
        values = dict(zip((*traced.u, *traced.p, *traced.m, traced.t), (*u, *q, t), strict=True))
        np.testing.assert_allclose(du, [float(e.evalf(20, subs=values)) for e in fields], rtol=1e-13, atol=1e-13)


SCRIPT = """
import json, time, numpy as np
from nonsmooth import models
from nonsmooth.kernels.compile.cache import _passing, cache_statistics
from nonsmooth.system.codegen.generate import compile_model, model_source
import sys
traced = models.discontinuous_support().traced
model = compile_model(traced)
module = _passing[model.jet.__module__]
du = np.empty(2)
q = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])
model.field(1, 0.5, np.array([0.25, 0.5]), q, du)
print(json.dumps([model_source(traced), list(cache_statistics(module)), list(du)]))
"""


def run(folder, **environment):
    path = os.pathsep.join(p for p in sys.path if p)
    environment = {**os.environ, "PYTHONPATH": path, "NONSMOOTH_CACHE_DIR": str(folder), **environment}
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_second_process_writes_the_same_source_and_compiles_nothing(tmp_path):
    content, first, du = run(tmp_path, PYTHONHASHSEED="1")
    assert sorted(name for name, _, _ in first) == ["field", "jet", "jump", "values"]
    assert all((hits, misses) == (0, 1) for _, hits, misses in first)
    again, second, _ = run(tmp_path, PYTHONHASHSEED="2")
    assert again == content
    assert all((hits, misses) == (1, 0) for _, hits, misses in second)
    plain_hash, nothing, plain = run(tmp_path, NUMBA_DISABLE_JIT="1")
    assert (plain_hash, nothing) == (content, [])
    np.testing.assert_allclose(plain, du, rtol=1e-15)


def test_source_holds_no_name_of_the_user(traced):
    names = {"t_", "u_x", "u_lambda", "p_t", "p_def", "p_q0", "m_C"}
    assert not any(name in model_source(traced) for name in names)


def test_large_model_stays_compact():
    """Forty coupled cubic oscillators: source and scratch grow like the model, not like its square."""
    n = 40
    u = sp.symbols(f"u0:{2 * n}", real=True)
    x, v = u[:n], u[n:]
    forces = [A * (x[(i + 1) % n] + x[i - 1] - 2 * x[i]) - x[i] ** 3 - B * v[i] for i in range(n)]
    big = Traced(
        name="chain",
        t=T,
        u=u,
        p=(A, B),
        m=(),
        state_names=tuple(map(str, u)),
        parameter_names=("a", "b"),
        memory_names=(),
        mode_names=("only",),
        indicator_names=("g",),
        output_names=(),
        fields=((*v, *forces),),
        lacking=((False,) * len(u),),
        indicators=(x[0] - 1,),
        transitions=(),
        outputs=(),
        period=None,
    )
    source = model_source(big)
    assert len(source) < 60_000
    assert "N_SCRATCH = 40\n" in source
