"""Derivatives against central differences of the user's own functions, and closed forms."""

import numpy as np
import pytest
import sympy as sp

import nonsmooth as ns
from nonsmooth.models import discontinuous_support, impact_oscillator, relief_valve

MODELS = [discontinuous_support(), discontinuous_support().smoothed(1e-2), impact_oscillator(), relief_valve()]


def compiled(traced, expressions):
    return sp.lambdify([traced.t, traced.u, traced.p, traced.m], expressions, modules="numpy")


@pytest.mark.parametrize("system", MODELS, ids=lambda s: s.name + " smoothed" * s.is_smoothed)
@pytest.mark.parametrize("of", ["u", "t", "p", "m"])
def test_jacobians_are_those_of_central_differences(system, of):
    traced, exact = system.traced, system.derivatives
    random = np.random.default_rng(6)
    point = [random.uniform(0.1, 1), *(random.uniform(0.3, 1, len(part)) for part in (traced.u, traced.p, traced.m))]
    slot = "tupm".index(of)
    for mode in range(len(traced.mode_names)):
        function = compiled(traced, [*traced.fields[mode], *traced.indicators])
        rows = [*exact.field(mode, of), *(exact.indicator(i, of) for i in range(len(traced.indicators)))]
        for column in range(len(exact.variables(of))):
            shifted = []
            for step in (1e-6, -1e-6):
                moved = [np.array(part, dtype=float, copy=True) for part in point]
                if slot:
                    moved[slot][column] += step
                else:
                    moved[0] = moved[0] + step
                shifted.append(np.array(function(*moved), dtype=float))
            numeric = (shifted[0] - shifted[1]) / 2e-6
            values = np.array(compiled(traced, [row[column] for row in rows])(*point), dtype=float)
            assert np.allclose(values, numeric, rtol=1e-6, atol=1e-6)


def test_a_linear_mode_has_a_constant_jacobian():
    system = discontinuous_support()
    t = system.traced
    jacobian = system.derivatives.field(1)
    assert not {symbol for row in jacobian for e in row for symbol in e.free_symbols} & {t.t, *t.u}
    m, k, k_s, c, c_s = t.p[:5]
    assert sp.simplify(jacobian[1][0] + (2 * k + k_s) / m) == 0
    assert sp.simplify(jacobian[1][1] + (c + c_s) / m) == 0


def test_lie_derivatives_of_a_position_are_velocity_acceleration_and_jerk():
    system = impact_oscillator()
    t = system.traced
    (x, v), (k, c, w, d, _, A) = t.u, t.p
    acceleration = A * sp.cos(w * t.t) - k * x - c * v
    lie = system.derivatives.lie
    assert lie(0, 0, 0) == x - d
    assert lie(0, 0, 1) == v
    assert sp.expand(lie(0, 0, 2) - acceleration) == 0
    assert sp.expand(lie(0, 0, 3) + A * w * sp.sin(w * t.t) + k * v + c * acceleration) == 0
    with pytest.raises(ValueError, match="not negative"):
        lie(0, 0, -1)


def test_resets_and_writes():
    system = impact_oscillator()
    t, exact = system.traced, system.derivatives
    assert exact.reset(0) == ((1, 0), (0, -t.p[4]))
    assert exact.reset(0, "p")[1][4] == -t.u[1]
    assert discontinuous_support().derivatives.reset(0) == ((1, 0), (0, 1))
    smoothed = discontinuous_support().smoothed(1e-5)
    jump = next(i for i, j in enumerate(smoothed.transitions) if j.writes)
    assert smoothed.derivatives.write(jump) == {0: (0, 1)}
    with pytest.raises(ValueError, match="one of 'u', 't', 'p', 'm'"):
        exact.field(0, "x")


def test_all_copies_share_the_derivatives():
    system = relief_valve()
    assert system.with_parameters(q=3.0).derivatives is system.derivatives


def test_an_angle_that_is_wrapped_has_the_derivatives_of_one_that_is_turned_back():
    """A rotor, turned back at 6.5 by one turn: by np.remainder, whose floor has no slope, and by 2 pi."""

    def rotor(reset):
        return ns.System(
            states=["phi", "w"],
            parameters={"c": 0.5, "M": 1.3},
            modes={"only": lambda t, u, p: (u.w, p.M - p.c * u.w + 0.4 * np.sin(u.phi))},
            indicators={"h": lambda t, u, p: u.phi - 6.5},
            transitions=[ns.Transition("only", "only", when="h > 0", reset=reset)],
        )

    back = rotor(lambda t, u, p: (u.phi - 2 * np.pi, u.w))
    wrapped = rotor(lambda t, u, p: (np.remainder(u.phi, 2 * np.pi), u.w * np.sign(u.w) ** 2))
    one, other = (
        ns.sensitivity(system, duration=17.0, start={"w": 1.0}, parameters=["c", "M"]) for system in (back, wrapped)
    )
    assert one.sizes["crossing"] == 6
    np.testing.assert_allclose(other.Phi, one.Phi, rtol=1e-9)
    np.testing.assert_allclose(other.P, one.P, rtol=1e-9)
