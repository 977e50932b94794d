"""A buck converter whose duty ratio, of 0 to 1, is computed from a sample a period: memory, a clock, a ramp."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import nonsmooth as ns

pytestmark = pytest.mark.physics

V, L, C, R, T, REF = 20.0, 20e-3, 47e-6, 22.0, 400e-6, 12.0
A = np.array([[0.0, -1.0 / L], [1.0 / C, -1.0 / (R * C)]])
HELD = np.linalg.solve(A, [-V / L, 0.0])  # where the closed switch would lead


def converter(gain: float) -> ns.System:
    def duty(t, u, p):
        wanted = 0.6 - p.K * (u.v - REF)
        return ns.where(wanted > 1.0, 1.0, ns.where(wanted < 0.0, 0.0, wanted))

    return ns.System(
        states=["i", "v", "s"],
        parameters={"K": gain},
        memory={"d": (0.6, "")},
        modes={
            "on": lambda t, u, p: ((V - u.v) / L, (u.i - u.v / R) / C, 1.0 / T),
            "off": lambda t, u, p: (-u.v / L, (u.i - u.v / R) / C, 1.0 / T),
        },
        indicators={"pwm": lambda t, u, p: u.s - p.d},
        transitions=[
            *(
                ns.Transition(mode, "on", at=0.0, reset=lambda t, u, p: (u.i, u.v, 0.0), write={"d": duty})
                for mode in ("on", "off")
            ),
            ns.Transition("on", "off", when="pwm > 0"),
        ],
        period=T,
    )


def sampled(gain: float, x: np.ndarray) -> np.ndarray:
    """The converter a period on, from a state at a sample."""
    d = min(1.0, max(0.0, 0.6 - gain * (x[1] - REF)))
    x = HELD + expm(A * d * T) @ (x - HELD)
    return np.asarray(expm(A * (1.0 - d) * T) @ x)


def after(gain: float, x: np.ndarray, periods: int) -> np.ndarray:
    for _ in range(periods):
        x = sampled(gain, x)
    return x


def test_an_orbit_that_saturates() -> None:
    """Of seven periods the switch is closed for three and open for two; the multipliers are those of the map."""
    orbit = ns.find_orbit(converter(0.35), start={"i": 0.5, "v": 11.5})
    x, h = orbit.u[:2], 1e-5
    assert orbit.period_number == 7 and after(0.35, x, 7) == pytest.approx(x, abs=1e-9)
    J = np.transpose([(after(0.35, x + h * e, 7) - after(0.35, x - h * e, 7)) / (2.0 * h) for e in np.eye(2)])
    found = orbit.floquet_multipliers[:2]
    assert found.sum().real == pytest.approx(np.trace(J), abs=1e-7)
    assert np.prod(found).real == pytest.approx(np.linalg.det(J), abs=1e-7)


def test_a_ramp_that_passes_the_duty_is_no_orbit() -> None:
    """A switch at the instant of a sample, behind it, says nothing of one that was passed before it.

    At this gain the motion is no orbit of period 7; Newton's method finds one that misses a switch at s = 0.94."""
    with pytest.raises(ns.SolveError, match="boundary it should obey|not converge"):
        ns.find_orbit(converter(0.4), start={"i": 0.5, "v": 11.5})
