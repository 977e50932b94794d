"""Models with elastic contacts against closed forms, published values and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

from .independent import march, multipliers

pytestmark = pytest.mark.physics


def contacts(system: ns.System, **start: float) -> float:
    """Transitions per period in the steady state."""
    name, value = next(iter(system.values.items()))
    found = ns.sweep(system, name, [value], start=start, direction=None, transient=500, keep=20, progress=False)
    assert int(found.status[0]) == 0
    return float(found.crossings_per_period[0])


def test_the_bilinear_oscillator_grazes_its_outer_springs_at_the_linear_amplitude() -> None:
    omega, zeta = 0.7, 0.05
    amplitude = np.hypot(1 - omega**2, 2 * zeta * omega) / omega**2
    assert contacts(ns.models.bilinear_oscillator(A=amplitude * 0.999)) == 0
    assert contacts(ns.models.bilinear_oscillator(A=amplitude * 1.001)) == 4


@pytest.mark.parametrize("v", [0.3, 2.0])
def test_free_motion_of_the_bilinear_oscillator_has_the_period_of_its_pieces(v: float) -> None:
    system = ns.models.bilinear_oscillator(zeta=0.0, A=0.0)
    run = ns.simulate(system, duration=20.0, start={"x": 0.0, "v_x": np.hypot(v, 1)})
    a, s = np.hypot(1, v), np.sqrt(11)
    period = 4 * np.arcsin(1 / a) + 4 / s * np.arctan(s * v)
    assert run.crossing_time.values[4] - run.crossing_time.values[0] == pytest.approx(period, rel=1e-13)
    assert np.allclose(abs(run.u_before.values[:, 1]), v, rtol=1e-12)


def bilinear(t: float, u: np.ndarray) -> list[float]:
    x, v = u
    return [v, 2 * 0.7**2 * np.cos(0.7 * t) - 0.1 * v - x - 10 * (x - np.clip(x, -1, 1))]


def test_the_forced_bilinear_oscillator_and_its_multipliers_against_scipy() -> None:
    orbit = ns.find_orbit(ns.models.bilinear_oscillator())
    assert orbit.maximum[0] > 1 and orbit.minimum[0] < -1
    assert march({"all": bilinear}, {}, "all", orbit.u, orbit.period)[1] == pytest.approx(orbit.u, abs=1e-9)
    expected = multipliers(bilinear, orbit.u, orbit.period)
    assert np.sort_complex(orbit.floquet_multipliers) == pytest.approx(expected, abs=1e-5)


def test_the_gears_lose_contact_at_the_closed_form_frequency() -> None:
    def above(w: float) -> float:
        return 0.05 * w**2 / np.hypot(1 - w**2, 0.1 * w) - 0.1

    omega = brentq(above, 0.5, 0.99, xtol=1e-15)
    for w, lost in ((omega * 0.999, False), (omega * 1.001, True)):
        linear = 0.05 * w**2 / (1 - w**2 + 0.1j * w)  # beside it there is a motion that rattles
        found = contacts(ns.models.gear_pair(omega=w), q=1.1 + linear.real, v_q=-w * linear.imag)
        assert (found > 0) is lost


def test_rattling_gears_against_scipy() -> None:
    system = ns.models.gear_pair(omega=0.85)
    orbit = ns.find_orbit(system, start={"q": 1.1})

    def field(t: float, u: np.ndarray) -> list[float]:
        q, v = u
        return [v, 0.1 + 0.05 * 0.85**2 * np.cos(0.85 * t) - 0.1 * v - (q - np.clip(q, -1, 1))]

    assert "teeth_free" in str(orbit)
    assert march({"all": field}, {}, "all", orbit.u, orbit.period)[1] == pytest.approx(orbit.u, abs=1e-9)
    expected = multipliers(field, orbit.u, orbit.period)
    assert np.sort_complex(orbit.floquet_multipliers) == pytest.approx(expected, abs=1e-5)


def test_chuas_outer_equilibria_lose_stability_where_routh_and_hurwitz_say() -> None:
    b, beta = 2 / 7, 100 / 7

    def condition(alpha: float) -> float:
        return (1 + alpha * b) * (alpha * b - alpha + beta) - alpha * beta * b

    alpha = brentq(condition, 5, 8, xtol=1e-15)
    branch = ns.continue_equilibrium(
        ns.models.chua_circuit(alpha=6.5), "alpha", (6, 8), start={"x": 1.4, "y": 0.0, "z": -1.4}, mode="diode_above"
    )
    assert ns.special_points(branch).alpha.values == pytest.approx([alpha], abs=1e-9)
    assert branch.u.values == pytest.approx(np.tile([1.5, 0.0, -1.5], (len(branch.alpha), 1)), abs=1e-12)


def test_the_double_scroll_has_the_published_exponents() -> None:
    """0.23, 0 and -1.78 per unit of the circuit's time, 1 / 0.7 of the dimensionless one (its conductance is 0.7)."""
    found = ns.lyapunov(ns.models.chua_circuit(), duration=4000.0, start={"x": 0.1, "y": 0.0, "z": 0.0}, progress=False)
    # to the published digits and twice the standard error of a run of this length
    doubt = 0.02 + 2.0 * 0.7 * found.standard_error.values
    assert (np.abs(0.7 * found.exponents.values - [0.23, 0.0, -1.78]) < doubt).all()
    assert float(found.kaplan_yorke) == pytest.approx(2.13, abs=0.005)


def test_the_rotor_whirls_on_the_circle_of_full_annular_rub() -> None:
    zeta, beta, r_0, mu, w = 0.05, 0.04, 1.05, 0.2, 0.2

    def balance(r: float) -> float:
        return (r * (1 + beta - w**2) - r_0) ** 2 + (2 * zeta * w * r + mu * (r - r_0)) ** 2 - w**4

    radius = brentq(balance, r_0, 2.0, xtol=1e-15)
    system = ns.models.rubbing_rotor()
    run = ns.simulate(system, periods=1, transient=150, start={"x": 0.5})
    x, y = run.u.values[:, 0], run.u.values[:, 1]
    assert np.hypot(x, y) == pytest.approx(radius, abs=1e-8)
    assert run.stator_force.values == pytest.approx(radius - r_0, abs=1e-8)
    free = ns.simulate(system.with_parameters(omega=0.12), periods=1, transient=150, start={"x": 0.5})
    whirl = 0.12**2 / np.hypot(beta - 0.12**2, 2 * zeta * 0.12)
    assert np.hypot(*free.u.values[:, :2].T) == pytest.approx(whirl, abs=1e-8)


def test_dry_whip_of_the_rotor_grows_at_the_rate_of_its_linear_limit() -> None:
    """z'' + 2 zeta z' + (1 + beta + i mu) z = 0 far out: unstable where mu > 2 zeta sqrt(1 + beta)."""
    threshold = 0.1 * np.sqrt(1.04)
    for mu in (0.2, 0.98 * threshold):
        fastest = max(np.roots([1, 0.1, 1.04 + 1j * mu]), key=lambda s: s.real)
        assert (fastest.real > 0) is (mu > threshold) and fastest.imag < 0
        v = 1e5 * fastest
        system = ns.models.rubbing_rotor(omega=0.5, mu=mu)
        run = ns.simulate(system, duration=20.0, start=[1e5, 0.0, v.real, v.imag], samples=2)
        growth = np.log(np.hypot(*run.u.values[-1, :2]) / 1e5) / 20
        assert growth == pytest.approx(fastest.real, abs=1e-5)
    with pytest.raises(ns.SolveError, match="grew beyond"):
        ns.simulate(ns.models.rubbing_rotor(omega=0.5), periods=300, start={"x": 0.5})
    run = ns.simulate(ns.models.rubbing_rotor(omega=0.5, mu=0.1), periods=300, start={"x": 0.5})
    assert np.hypot(*run.u.values[-1, :2]) < 3
