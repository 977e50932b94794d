"""The models that slide, against closed forms and published orbits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns


@pytest.mark.parametrize("r", [0.6, 0.8, 1.3, 2.0])
@pytest.mark.parametrize("f", [0.1, 0.3])
def test_den_hartogs_amplitude(r: float, f: float) -> None:
    """Without a stop: sqrt(V^2 - (f U)^2), V = 1 / (1 - r^2), U = sin(pi / r) / (r (1 + cos(pi / r)))."""
    V, U = 1 / (1 - r * r), np.sin(np.pi / r) / (r * (1 + np.cos(np.pi / r)))
    amplitude = np.sqrt(V * V - (f * U) ** 2)
    orbit = ns.find_orbit(ns.models.dry_friction_oscillator(omega=r, f_k=f, f_s=f))
    assert [orbit.maximum[0], -orbit.minimum[0]] == pytest.approx([amplitude, amplitude], abs=1e-12)


def test_static_friction_holds_longer_than_kinetic_friction_drives() -> None:
    """The mass sticks at x = c from rest until |f_0 cos w t - c| = f_s, then moves under f_k."""
    w, c = 0.4, 1.0
    system = ns.models.dry_friction_oscillator(omega=w, f_s=0.5)
    run = ns.simulate(system, duration=5.0, start={"x": c}, samples=501)
    assert run.attrs["nonsmooth"].count('"exact"')
    t0 = np.arccos(c - 0.5) / w
    assert run.crossing_time.values[-1] == pytest.approx(t0, abs=1e-14)
    labels = [system.transitions[i].label for i in run.crossing_transition.values]
    assert labels[-1] == "stick -> backward"
    V = 1 / (1 - w * w)  # x'' + x = cos w t + f_k from rest
    s = run.time.values[run.time.values > t0] - t0
    x = V * np.cos(w * (t0 + s)) + 0.3 + (c - 0.3 - V * np.cos(w * t0)) * np.cos(s) + V * w * np.sin(w * t0) * np.sin(s)
    assert run.u.values[run.time.values > t0, 0] == pytest.approx(x, abs=1e-13)
    before = run.friction.values[run.time.values < t0]
    assert before == pytest.approx(c - np.cos(w * run.time.values[run.time.values < t0]), abs=1e-14)
    with pytest.raises(ns.SystemDefinitionError, match="must be 1 or more"):
        system.with_parameters(f_s=0.2)


def test_the_belt_s_published_limit_cycle() -> None:
    """Leine et al. 1998: period 12.001031, slip 4.296000 from x = F to x = -0.54100635, multipliers 1 and 0."""
    orbit = ns.find_orbit(ns.models.stick_slip_belt(), start={"x": 0.5, "v": 0.2})
    assert orbit.period == pytest.approx(12.001031, abs=5e-7)
    assert np.sort(orbit.floquet_multipliers.real) == pytest.approx([0.0, 1.0], abs=1e-10)
    run = ns.simulate(ns.models.stick_slip_belt(), duration=30.0, start={"x": 0.5, "v": 0.2})
    assert run.crossing_time.values[0] == pytest.approx(2.5, abs=1e-12)  # (F - 0.5) / v_b
    assert run.u_after.values[:2, 0] == pytest.approx([1.0, -0.54100635], abs=5e-9)
    assert np.diff(run.crossing_time.values)[0] == pytest.approx(4.296, abs=5e-7)


def test_the_belt_s_exponents() -> None:
    """A limit cycle whose stick forgets the velocity: 0 along it, and minus infinity."""
    spectrum = ns.lyapunov(ns.models.stick_slip_belt(), start={"x": 0.5, "v": 0.2}, duration=600.0, transient=60.0)
    assert spectrum.exponents.values[0] == pytest.approx(0.0, abs=1e-9)
    assert spectrum.exponents.values[1] == -np.inf


def test_the_relay_slides_until_its_control_saturates() -> None:
    """While x1 = 0: x2'' = 2 x2' - x2, x2 = -exp(t) (0.001 + 0.021 t) from the published start, until |x2| = 1."""
    system = ns.models.relay_feedback()
    run = ns.simulate(system, duration=10.0, start=[0.0, -0.001, -0.02], samples=2001)
    leaves = brentq(lambda t: np.exp(t) * (0.001 + 0.021 * t) - 1.0, 1.0, 4.0, xtol=1e-15)
    times, labels = run.crossing_time.values, [system.transitions[i].label for i in run.crossing_transition.values]
    first = next(i for i, label in enumerate(labels) if label.startswith("sliding"))
    assert times[first] == pytest.approx(leaves, abs=1e-13)
    assert run.u_after.values[first] == pytest.approx([0.0, -1.0, np.exp(leaves) * (0.021 * leaves - 0.02)], abs=1e-12)
    slid = run.mode.values == system.modes.index("sliding")
    assert np.abs(run.u.values[slid, 0]).max() < 1e-15
    assert run.relay.values[slid] == pytest.approx(-run.u.values[slid, 1], abs=1e-14)
    again = labels[first:].count("sliding -> plus") + labels[first:].count("sliding -> minus")
    assert again > 10  # several sliding segments in each turn
