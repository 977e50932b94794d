"""The models that slide, against closed forms and published orbits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics


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


def test_on_a_moving_support_the_mass_sticks_and_slips_in_closed_form() -> None:
    """x = f_k + a cos t + v_b sin t with a = f_s - f_k, until x = f_k - a moves with the support again."""
    v, a = 0.4, 0.3
    system = ns.models.dry_friction_oscillator(f_0=0.0, f_k=0.2, f_s=0.5, v_b=v)
    run = ns.simulate(system, duration=40.0, start={"v": v}, samples=2)
    labels = np.array([system.transitions[i].label for i in run.crossing_transition.values])
    off, on = np.flatnonzero(labels == "stick -> backward"), np.flatnonzero(labels == "backward -> stick")
    assert len(off) > 3
    assert run.u_after.values[off] == pytest.approx(np.tile([0.5, v], (len(off), 1)), abs=1e-12)
    assert run.u_after.values[on[1:]] == pytest.approx(np.tile([0.2 - a, v], (len(on) - 1, 1)), abs=1e-12)
    times = run.crossing_time.values
    slips = times[on[on > off[0]]] - times[off[: len(on[on > off[0]])]]
    assert slips == pytest.approx(np.pi + 2 * np.arctan(v / a), abs=1e-12)
    assert times[off[1]] - times[off[0]] == pytest.approx(slips[0] + 2 * a / v, abs=1e-12)


def test_a_belt_too_fast_ends_the_cycle_at_a_discontinuous_fold() -> None:
    """By SciPy: the speed of the belt at which the slip that begins at x = F - c v_b just comes up to it again."""
    c = 0.3

    def sticks_again(v_b: float) -> bool:
        def field(t: float, u: np.ndarray) -> list[float]:
            return [u[1], 1 / (1 + 3 * (v_b - u[1])) - u[0] - c * u[1]]

        def top(t: float, u: np.ndarray) -> float:
            return field(t, u)[1]

        def met(t: float, u: np.ndarray) -> float:
            return u[1] - v_b

        top.terminal, top.direction, met.terminal, met.direction = True, -1, True, 1  # type: ignore[attr-defined]
        run = solve_ivp(
            field, (0, 30), [1 - c * v_b, v_b - 1e-9], events=[top, met], rtol=1e-12, atol=1e-13, method="DOP853"
        )
        return len(run.t_events[1]) > 0

    low, high = 0.8, 1.2
    assert sticks_again(low) and not sticks_again(high)
    while high - low > 1e-9:
        middle = (low + high) / 2
        low, high = (middle, high) if sticks_again(middle) else (low, middle)
    start = {"x": 0.6, "v": low}
    orbit = ns.find_orbit(ns.models.stick_slip_belt(c=c, v_b=low - 1e-6), start=start)
    assert orbit.stable and "stick" in str(orbit)
    with pytest.raises(ns.SolveError, match="stable equilibrium"):
        ns.find_orbit(ns.models.stick_slip_belt(c=c, v_b=low + 1e-3), start=start)


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
