"""Models with dry friction against closed forms and SciPy."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

from .independent import march

pytestmark = pytest.mark.physics


def test_the_drift_against_scipy_in_absolute_positions() -> None:
    """Mass x, slider's top z and the slider s itself, as the paper writes them."""
    a, b, xi, w, g = 0.3, 0.1, 0.1, 0.1, 0.02

    def drive(t: float) -> float:
        return a * np.cos(w * t) + b

    fields = {
        "free": lambda t, u: [u[1], drive(t), -(u[2] - u[3]) / (2 * xi), 0.0],
        "contact": lambda t, u: [u[1], drive(t) - 2 * xi * u[1] - (u[2] - u[3]), u[1], 0.0],
        "progress": lambda t, u: [u[1], drive(t) - 1, u[1], u[1] + (u[2] - u[3] - 1) / (2 * xi)],
    }

    def force(t: float, u: np.ndarray) -> float:
        return 2 * xi * u[1] + u[2] - u[3]

    leaving = {
        "free": [(lambda t, u: u[0] - u[2] - g, 1, "contact", None)],
        "contact": [(force, -1, "free", None), (lambda t, u: force(t, u) - 1, 1, "progress", None)],
        "progress": [(lambda t, u: force(t, u) - 1, -1, "contact", None)],
    }
    system = ns.models.drifting_impact_oscillator()
    end = 10 * 2 * np.pi / w
    mode, u, log = march(fields, leaving, "free", np.zeros(4), end)
    run = ns.simulate(system, duration=end, samples=20001)
    assert run.crossing_time.values == pytest.approx([t for t, _ in log], abs=1e-6)
    assert system.modes[int(run.mode[-1])] == mode
    assert run.u.values[-1] == pytest.approx([u[0] - u[3], u[1], u[2] - u[3]], abs=1e-6)
    progress = np.trapezoid(run.slider_velocity.values, run.time.values)
    assert progress == pytest.approx(u[3], rel=1e-3)
    travelled = np.trapezoid(run.u.values[:, 1], run.time.values)
    assert travelled - run.u.values[-1, 0] == pytest.approx(u[3], abs=1e-3)
    assert u[3] > 1


def test_without_forcing_the_drifting_mass_rests_with_its_spring_pressed_by_the_constant_force() -> None:
    run = ns.simulate(ns.models.drifting_impact_oscillator(a=0.0, b=0.4), duration=400.0)
    assert run.u.values[-1] == pytest.approx([0.42, 0.0, 0.4], abs=1e-8)
    assert run.contact_force.values[-1] == pytest.approx(0.4, abs=1e-8)


@pytest.mark.parametrize("omega", [0.8, 1.4])
def test_sliding_motion_grazes_the_stop_at_den_hartogs_amplitude(omega: float) -> None:
    V, U = 1 / (1 - omega**2), np.sin(np.pi / omega) / (omega * (1 + np.cos(np.pi / omega)))
    amplitude = np.sqrt(V**2 - (0.2 * U) ** 2)
    system = ns.models.impact_friction_oscillator(omega=omega)
    orbit = ns.find_orbit(system.with_parameters(g=10.0))
    assert orbit.maximum[0] == pytest.approx(amplitude, rel=1e-12)
    for g, hits in ((amplitude * (1 + 1e-9), False), (amplitude * (1 - 1e-9), True)):
        run = ns.simulate(system.with_parameters(g=g), periods=2, start=orbit.u)
        assert bool((abs(run.u_before - run.u_after).sel(state="v_x") > 1e-6).any()) is hits


def test_impacts_and_sticking_against_scipy() -> None:
    """Mass that rubs with f = 0.6 under cos(0.5 t) and hits a stop at 0.3."""
    w, f, g, e = 0.5, 0.6, 0.3, 0.7

    def slip(side: int):
        return lambda t, u: [u[1], np.cos(w * t) - u[0] - side * f]

    def load(t: float, u: np.ndarray) -> float:
        return np.cos(w * t) - u[0]

    def still(u: np.ndarray) -> list[float]:
        return [u[0], 0.0]

    leaving = {
        "stick": [(lambda t, u: load(t, u) - f, 1, "forward", None), (lambda t, u: load(t, u) + f, -1, "back", None)],
        "forward": [
            (lambda t, u: u[0] - g, 1, "back", lambda u: [g, -e * u[1]]),
            (lambda t, u: u[1], -1, "stick", still),
        ],
        "back": [(lambda t, u: u[1], 1, "stick", still)],
    }
    fields = {"stick": lambda t, u: [0.0, 0.0], "forward": slip(1), "back": slip(-1)}
    _, u, log = march(fields, leaving, "forward", np.zeros(2), 60.0)
    run = ns.simulate(ns.models.impact_friction_oscillator(omega=w, f=f, g=g, e=e), duration=60.0)
    names = {"stick", "forward", "back"} & {mode for _, mode in log}
    assert names == {"stick", "forward", "back"}
    assert run.u.values[-1] == pytest.approx(u, abs=1e-9)
    assert set(np.round(run.crossing_time.values, 6)) >= {round(t, 6) for t, _ in log}


def stribeck(v: float) -> float:
    return 0.3 / (1 + 1.42 * v) + 0.1 + 0.01 * v * v


def test_the_stribeck_oscillator_against_scipy() -> None:
    def held(t: float, u: np.ndarray) -> float:
        return 0.5 * np.cos(0.6 * t) - u[0]

    def side(sign: int):
        return lambda t, u: [u[1], 0.5 * np.cos(0.6 * t) - u[0] - sign * stribeck(sign * (u[1] - 1))]

    def still(u: np.ndarray) -> list[float]:
        return [u[0], 1.0]

    leaving = {
        "belt_stick": [
            (lambda t, u: held(t, u) - 0.4, 1, "belt_forward", None),
            (lambda t, u: held(t, u) + 0.4, -1, "belt_back", None),
        ],
        "belt_forward": [(lambda t, u: u[1] - 1, -1, "belt_stick", still)],
        "belt_back": [(lambda t, u: u[1] - 1, 1, "belt_stick", still)],
    }
    fields = {"belt_stick": lambda t, u: [u[1], 0.0], "belt_forward": side(1), "belt_back": side(-1)}
    _, u, log = march(fields, leaving, "belt_back", np.zeros(2), 50.0)
    system = ns.models.stribeck_oscillator()
    run = ns.simulate(system, duration=50.0)
    assert run.u.values[-1] == pytest.approx(u, abs=1e-7)
    assert "belt_stick" in {mode for _, mode in log}


def test_the_unforced_belt_lets_go_at_its_static_friction_and_drives_steady_sliding() -> None:
    system = ns.models.stribeck_oscillator(u_0=0.0)
    run = ns.simulate(system, duration=60.0)
    off = np.array([system.transitions[i].label.startswith("belt_stick") for i in run.crossing_transition.values])
    assert off.any()
    assert run.u_before.values[off] == pytest.approx(np.tile([0.4, 1.0], (off.sum(), 1)), abs=1e-9)
    near = ns.simulate(system, duration=30.0, start={"x": stribeck(1.0) + 1e-4})
    slope = -0.3 * 1.42 / 2.42**2 + 0.02
    growth = np.exp(-slope / 2 * 30)  # of a small motion: eigenvalues of s^2 + mu' s + 1
    phase = np.sqrt(1 - slope**2 / 4) * 30
    expected = 1e-4 * growth * (np.cos(phase) + slope / 2 * np.sin(phase) / np.sqrt(1 - slope**2 / 4))
    assert near.u.values[-1, 0] - stribeck(1.0) == pytest.approx(expected, rel=1e-2)
