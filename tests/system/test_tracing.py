"""Expressions traced from a function give what the function computes on numbers."""

from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.scalar import Scalar, where
from nonsmooth.system.system import System
from nonsmooth.system.transition import Transition

A = np.array([[0.0, 1.0], [-2.5, -0.1]])


class Vector(np.ndarray):
    """A float state with the attributes the symbolic one has."""

    x = property(lambda self: float(self[0]))
    v = property(lambda self: float(self[1]))


def unpacked(t, u, p):
    x, v = u
    return v, (p.rho * np.cos(p.omega * t) - 2 * p.k * x - p.c * v) / p.m


def matrix(t, u, p):
    return A @ np.array([u.x, u.v]) + np.array([0.0, p.rho]) * np.sin(p.omega * t)


def matrix_of_state(t, u, p):
    return A @ u + 0.5 * u - u / 3


def parameter_times_state(t, u, p):
    return A @ (p.k * u) - u / p.m


def in_place(t, u, p):
    force = -p.k * u.x
    force += p.rho * u.v
    force -= 2.0 * t
    force *= p.c
    return u.v, force


def by_name(t, u, p):
    return {"v": (p.rho * np.cos(p.omega * t) - 2 * p.k * u.x - p.c * u.v) / p.m, "x": u.v}


def indexed(t, u, p):
    return [u[1], -(u[0] ** 3) + u[0] ** 2.0]


def numpy_scalars(t, u, p):
    return np.float64(2) * u.v, np.int64(3) - np.float64(0.5) * u.x + np.pi * p.k


def functions(t, u, p):
    x, v = u
    return (
        np.sqrt(1 + x**2) + np.exp(-x) * np.tanh(v) + np.log1p(x**2) + np.arctan2(v, 2 + x),
        np.hypot(x, v) + np.square(v) * np.arctan(x) + np.power(1 + x**2, 0.25) + np.expm1(x) + np.log10(2 + v**2),
    )


def array_functions(t, u, p):
    both = np.cos(np.array([u.x, u.v]) * np.array([1.0, 2.0])) + np.array([1.0, 2.0]) * u.x
    return both + np.linalg.norm([u.x, u.v]) * np.sum([u.x, u.v])


def negated(t, u, p):
    return -u.v, +u.x - abs(p.c) + 2**u.x + 1 / (2 + u.x) + np.maximum(p.k, p.c)


def make(field, **more):
    return System(
        states={"x": "m", "v": "m/s"},
        parameters={"m": 0.8, "k": 8.5, "c": 0.87, "rho": 0.45, "omega": 3.7},
        modes={"only": field},
        **more,
    )


@pytest.mark.parametrize(
    "field",
    [
        unpacked,
        by_name,
        matrix,
        matrix_of_state,
        parameter_times_state,
        in_place,
        indexed,
        numpy_scalars,
        functions,
        array_functions,
        negated,
    ],
    ids=lambda f: f.__name__,
)
def test_the_expressions_compute_what_the_function_computes(field):
    system = make(field)
    traced = system.traced
    compiled = sp.lambdify([traced.t, traced.u, traced.p], traced.fields[0], modules="numpy")
    p = SimpleNamespace(**system.values)
    for t, x, v in np.random.default_rng(0).uniform(-0.9, 0.9, (5, 3)):
        found = field(t, np.array([x, v]).view(Vector), p)
        truth = np.asarray([found["x"], found["v"]] if isinstance(found, dict) else found, dtype=float)
        assert np.allclose(compiled(t, (x, v), system.parameter_vector()), truth, rtol=1e-14, atol=1e-15)


def test_each_function_of_numpy_that_is_known_is_numpys():
    """All that the refusal of another one names, of numbers on both sides of nought, at it and beyond one."""
    symbols = sp.symbols("x y", real=True)
    with pytest.raises(SystemDefinitionError) as refused:
        np.gcd(*map(Scalar, symbols))
    names = str(refused.value).partition("known are ")[2].replace("np.", "").split(", ")
    assert len(names) > 50
    for name in names:
        function, seen = getattr(np, name), 0
        taken = function.nargs - function.nout
        traced = function(*map(Scalar, symbols[:taken]))
        held = traced.expression if isinstance(traced, Scalar) else traced.relation
        compute = sp.lambdify(symbols, held, modules="math")
        for x, y in ((0.6, 0.7), (-0.6, 0.7), (1.7, -0.7), (0.0, 0.7), (0.7, 0.7), (3.0, -2.0)):
            with np.errstate(all="ignore"):
                truth = function(*(x, y)[:taken])
            if np.isfinite(truth):
                assert compute(x, y) == pytest.approx(truth, rel=1e-14, abs=1e-15), (name, x, y)
                seen += 1
        assert seen > 0, name


def test_each_function_is_called_once():
    calls = []

    def field(t, u, p):
        calls.append("field")
        return u.v, -u.x

    def level(t, u, p):
        calls.append("level")
        return u.x

    system = System(
        states=["x", "v"],
        parameters={},
        modes={"only": field},
        indicators={"level": level},
        transitions=[Transition("only", "only", when="level > 0", reset=lambda t, u, p: (u.x, -u.v))],
    )
    system.with_parameters().content_hash()
    assert sorted(calls) == ["field", "level"]


def test_floats_keep_their_last_bit():
    values = np.random.default_rng(1).uniform(-1, 1, 50) * 10.0 ** np.arange(-25, 25)
    system = make(lambda t, u, p: (u.v, sum(float(c) * u.x**i for i, c in enumerate(values, start=1))))
    coefficients = sp.Poly(system.traced.fields[0][1], system.traced.u[0]).all_coeffs()[:-1][::-1]
    assert [float(c) for c in coefficients] == list(values)


def test_where_on_parameters_outputs_and_resets_is_allowed():
    system = make(
        lambda t, u, p: (u.v, where((p.k > 0) & (p.c > 0), p.k, -p.k) * u.x),
        indicators={"level": lambda t, u, p: u.x},
        transitions=[
            Transition("only", "only", when="level > 0", reset=lambda t, u, p: (u.x, where(u.v > 1, 0, -u.v)))
        ],
        outputs={"spread": lambda t, u, p: np.maximum(abs(u.x), abs(u.v))},
    )
    assert system.traced.transitions[0].reset[1].has(sp.Piecewise)
    assert float(where(np.array(True), 1.0, 2.0)) == 1.0


@pytest.mark.parametrize("a", [-1.0, 1.0, 3.0])
@pytest.mark.parametrize("b", [-1.0, 1.0, 3.0])
def test_conditions_are_joined_and_reversed(a, b):
    x, y = sp.symbols("x y")
    p, q = Scalar(x), Scalar(y)
    found = where((p > 0) & ~(q > 0) | (q > 2), 1.0, 0.0).expression
    assert bool(found.subs({x: a, y: b})) == ((a > 0 and not b > 0) or b > 2)


@pytest.mark.parametrize(
    ("field", "sentence"),
    [
        (lambda t, u, p: (u.v, 1 if u.x > 0 else -1), "Make it two modes"),
        (lambda t, u, p: (u.v, max(u.x, 0)), "Make it two modes"),
        (lambda t, u, p: (u.v, np.where(u.x > 0, 1.0, -1.0)), "Make it two modes"),
        (lambda t, u, p: (u.v, 1 if u.x == 0 else -1), "Make it two modes"),
        (lambda t, u, p: (u.v, 1 if p.k > 0 else -1), r"ns\.where"),
        (lambda t, u, p: (u.v, __import__("math").cos(t)), r"np\.cos"),
        (lambda t, u, p: (u.v, np.array([u.x, u.v], dtype=float)[0]), "without dtype=float"),
        (lambda t, u, p: (u.v, abs(u.x)), r"`abs` of the state.*two modes"),
        (lambda t, u, p: (u.v, np.maximum(u.x, 0)), "`max` of the state"),
        (lambda t, u, p: (u.v, where(u.x > 0, 1, 0)), "`where` of the state"),
        (lambda t, u, p: (u.v, np.sign(np.cos(p.omega * t))), r"`sign` of the state or the time.*at="),
        (lambda t, u, p: (u.v, u.x > 0), r"ns\.where"),
        (lambda t, u, p: (u.v, float("nan")), "not a finite number"),
        (lambda t, u, p: (u.v, u.x / 0), "divides by zero"),
        (lambda t, u, p: (u.v, 1j * u.x), "complex"),
        (lambda t, u, p: (u.v, "x"), "expected a number"),
        (lambda t, u, p: (u.v,), "must return 2 values, one for each of x, v; it returned 1"),
        (lambda t, u, p: None, "it returned NoneType"),
        (lambda t, u, p: (u.y, u.x), "`y` is not a state of mode 'only'; all: v, x"),
        (lambda t, u, p: (u.v, p.rhoo), "`rhoo` is not a parameter of 'system'; nearest: rho"),
        (lambda t, u: (u.v, u.x), r"its arguments are \(t, u\), but it is called as f\(t, u, p\)"),
        (lambda t, u, p: (u.v, np.spacing(u.x)), r"np\.spacing cannot be traced"),
        (lambda t, u, p: setattr(p, "k", 1), "memory is written by"),
    ],
)
def test_what_cannot_be_traced_is_refused_with_the_remedy(field, sentence):
    with pytest.raises(SystemDefinitionError, match=rf"(?s)mode 'only'.*{sentence}"):
        make(field)


def test_an_error_inside_a_function_keeps_its_traceback():
    def field(t, u, p):
        return u.v, [][0]

    with pytest.raises(SystemDefinitionError, match=r"mode 'only' .function `field`.*IndexError") as caught:
        make(field)
    assert isinstance(caught.value.__cause__, IndexError)


def test_whether_a_contact_begins_is_no_word():
    with pytest.raises(SystemDefinitionError, match="`contact` is True, False or None, not 'no'"):
        Transition("free", "contact", when="gap > 0", contact="no")
