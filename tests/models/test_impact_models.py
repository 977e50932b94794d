"""Models with rigid impacts against closed forms and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipeinc

import nonsmooth as ns

from .independent import march

pytestmark = pytest.mark.physics


def symmetric_motion(omega: float, g: float = 0.5, e: float = 0.6) -> tuple[float, float, np.ndarray]:
    """Impact velocity and cosine of the phase of Peterka's symmetric motion; its map from impact to impact."""
    half, F = np.pi / omega, 1 / (1 - omega**2)
    C, S = np.cos(half), np.sin(half)
    k, q = (1 + e) * S / (2 * (1 + C)), (1 - e) / (2 * omega)
    V = (g * k + np.sqrt((g * k) ** 2 - (k * k + q * q) * (g * g - F * F))) / (k * k + q * q)
    cosine = (k * V - g) / F
    acceleration = -cosine - g
    saltation = np.array([[-e, 0.0], [(1 + e) * acceleration / V, -e]])
    return V, cosine, -saltation @ np.array([[C, S], [-S, C]])


@pytest.mark.parametrize("omega", [1.5, 2.0])
def test_the_symmetric_motion_between_two_stops(omega: float) -> None:
    velocity, _, half = symmetric_motion(omega)
    orbit = ns.find_orbit(ns.models.double_impact_oscillator(omega=omega))
    run = ns.simulate(orbit.system, periods=1, start=orbit.u)
    assert np.sort(run.u_before.values[:, 1]) == pytest.approx([-velocity, velocity], abs=1e-11)
    assert np.diff(run.crossing_time.values)[0] == pytest.approx(np.pi / omega, abs=1e-11)
    expected = np.linalg.eigvals(half) ** 2
    assert np.sort_complex(orbit.floquet_multipliers) == pytest.approx(np.sort_complex(expected), abs=1e-9)
    assert np.prod(orbit.floquet_multipliers) == pytest.approx(0.6**4, rel=1e-9)


def test_the_symmetric_motion_loses_its_symmetry_where_an_eigenvalue_passes_minus_one() -> None:
    def beyond(omega: float) -> float:
        return np.linalg.det(symmetric_motion(omega)[2] + np.eye(2))

    bound = brentq(beyond, 1.46, 1.5, xtol=1e-15)
    orbit = ns.find_orbit(ns.models.double_impact_oscillator(omega=1.55))
    found = ns.special_points(ns.continue_orbit(orbit, "omega", (1.46, 1.56)))
    assert list(found.kind.values) == ["pitchfork"]
    assert float(found.omega[0]) == pytest.approx(bound, abs=1e-9)


def closed_form_of_the_damper(zeta: float, mu: float, e: float, d: float, F: float, omega: float) -> tuple[float, ...]:
    """Speed of the ball, displacement of the mass at the impact and its velocity behind it (mirrored)."""
    half, natural = np.pi / omega, np.sqrt(1 - zeta**2)
    c, s, fade = np.cos(natural * half), np.sin(natural * half) / natural, np.exp(-zeta * half)
    flow = fade * np.array([[c + zeta * s, s], [-s, c - zeta * s]])
    h = np.linalg.solve(flow + np.eye(2), [0.0, -2 * mu])  # times w
    v = (1 - e - 2 * mu * e) / (1 + e)  # times w
    response = abs(F / (1 - omega**2 + 2j * zeta * omega))

    def miss(w: float) -> float:
        x, speed = (d - w * half) / 2 - h[0] * w, (v - h[1]) * w
        return x**2 + (speed / omega) ** 2 - response**2

    grid = np.linspace(1e-6, 2, 4001)
    bracket = next((a, b) for a, b in zip(grid[:-1][::-1], grid[1:][::-1], strict=True) if miss(a) * miss(b) < 0)
    w = brentq(miss, *bracket, xtol=1e-16)
    return w, (d - w * half) / 2, v * w


def test_the_impact_damper_with_two_impacts_per_period() -> None:
    system = ns.models.impact_damper()
    w, x, v = closed_form_of_the_damper(**system.values)
    settled = ns.simulate(system, periods=1, transient=500, start={"v_y": 0.2})
    orbit = ns.find_orbit(system, start=settled)
    run = ns.simulate(system, periods=1, start=orbit.u)
    before, after = run.u_before.values, run.u_after.values
    assert np.sort(before[:, 3]) == pytest.approx([-w, w], abs=1e-10)
    assert np.sort(before[:, 0]) == pytest.approx(np.sort([-x, x]), abs=1e-10)
    assert np.sort(after[:, 2]) == pytest.approx(np.sort([-v, v]), abs=1e-10)
    momentum = [one[:, 2] + 0.1 * one[:, 3] for one in (before, after)]
    assert momentum[0] == pytest.approx(momentum[1], abs=1e-14)


@pytest.mark.parametrize("beyond", [1e-10, 1e-6, 1e-2])
def test_the_first_impact_of_nordmarks_oscillator_grows_like_a_square_root(beyond: float) -> None:
    omega, damping = 0.8, 0.1
    amplitude = (1 + beyond) * np.hypot(1 - omega**2, damping * omega)
    x = amplitude / (1 - omega**2 + 1j * damping * omega)
    system = ns.models.impact_oscillator(omega=omega, A=amplitude)
    run = ns.simulate(system, periods=1, start={"x": x.real, "v": (1j * omega * x).real})
    speed = omega * np.sqrt(abs(x) ** 2 - 1)
    assert run.u_before.values[0, 1] == pytest.approx(speed, rel=1e-5)


def test_the_masses_of_the_impact_duffing_oscillator_just_touch_at_the_linear_amplitude() -> None:
    mu, zeta, xi, phi, w = 0.1, 0.05, 0.05, 1.0, 0.9
    coupling = phi**2 + 2j * xi * w
    matrix = np.array([[1 - w**2 + 2j * zeta * w + mu * coupling, -mu * coupling], [-coupling, coupling - w**2]])
    x1, x2 = np.linalg.solve(matrix, [1.0, 0.0])
    most = abs(x2 - x1)
    start = {"x1": x1.real, "x2": x2.real, "v1": (1j * w * x1).real, "v2": (1j * w * x2).real}
    linear = ns.models.impact_duffing(eta_1=0.0, eta_2=0.0)
    for clearance, touches in ((most * 1.001, False), (most * 0.999, True)):
        run = ns.simulate(linear.with_parameters(delta_1=clearance, delta_2=clearance), periods=2, start=start)
        assert bool(len(run.crossing_time)) is touches


def test_impacts_of_the_duffing_masses_against_scipy() -> None:
    mu, r, w = 0.1, 0.8, 0.9

    def motion(t: float, u: np.ndarray) -> list[float]:
        x1, x2, v1, v2 = u
        q = 0.1 * (v1 - v2) + (x1 - x2) + 0.01 * (x1 - x2) ** 3
        return [v1, v2, np.cos(w * t) - 0.1 * v1 - x1 - 0.01 * x1**3 - mu * q, q]

    def impact(u: np.ndarray) -> list[float]:
        middle = (u[2] + mu * u[3]) / (1 + mu)
        return [u[0], u[1], (1 + r) * middle - r * u[2], (1 + r) * middle - r * u[3]]

    leaving = {
        "motion": [
            (lambda t, u: u[1] - u[0] - 4, 1, "motion", impact),
            (lambda t, u: u[1] - u[0] + 4, -1, "motion", impact),
        ]
    }
    _, u, log = march({"motion": motion}, leaving, "motion", np.zeros(4), 60.0)
    run = ns.simulate(ns.models.impact_duffing(), duration=60.0)
    assert len(log) > 5
    assert run.crossing_time.values == pytest.approx([t for t, _ in log], abs=1e-6)
    assert run.u.values[-1] == pytest.approx(u, abs=1e-6)
    before, after = run.u_before.values, run.u_after.values
    assert after[:, 2] + mu * after[:, 3] == pytest.approx(before[:, 2] + mu * before[:, 3], abs=1e-13)
    assert after[:, 3] - after[:, 2] == pytest.approx(-r * (before[:, 3] - before[:, 2]), abs=1e-13)


def test_the_cart_on_the_track_has_elliptic_times() -> None:
    """From rest at -a to the stop, then back and forth between the stop and ever less height."""
    a, d, e = 0.8, 0.2, 0.6
    run = ns.simulate(ns.models.parabolic_track(zeta=0.0, A=0.0), duration=12.0, start={"x": -a})

    def flight(a: float) -> float:
        return ellipeinc(np.pi / 2, -(a**2)) + ellipeinc(np.arcsin(d / a), -(a**2))

    times = [flight(a)]
    for _ in range(2):
        a = np.sqrt(d**2 + e**2 * (a**2 - d**2))
        times.append(times[-1] + 2 * flight(a))
    assert run.crossing_time.values[:3] == pytest.approx(times, abs=1e-8)
