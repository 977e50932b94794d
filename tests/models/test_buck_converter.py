"""The buck converter against published values and an independent return map."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import nonsmooth as ns
from nonsmooth import models

pytestmark = pytest.mark.physics

R, L, C, T, REF, GAIN, LOW, HIGH = 22.0, 20e-3, 47e-6, 400e-6, 11.3, 8.4, 3.8, 8.2
A = np.array([[-1 / (R * C), 1 / C], [-1 / L, 0.0]])


def flow(state: np.ndarray, t: float, source: float) -> np.ndarray:
    """(v, i) after t under a constant input voltage: matrix exponential about the equilibrium."""
    rest = np.array([source, source / R])
    return rest + expm(A * t) @ (state - rest)


def cycle_and_trace(v_in: float) -> tuple[np.ndarray, np.ndarray]:
    """State at the fall of the sawtooth and multipliers of the cycle that is open first, then closed."""

    def miss(unknown: np.ndarray) -> list[float]:
        state, share = np.array([unknown[0], unknown[1] / 10]), unknown[2]
        middle = flow(state, share * T, 0.0)
        back = flow(middle, (1 - share) * T, v_in)
        return [*(back - state), LOW + (HIGH - LOW) * share - GAIN * (middle[0] - REF)]

    v, i, share = fsolve(miss, [12.0, 5.5, 0.5], xtol=1e-13)
    state = np.array([v, i / 10])
    middle = flow(state, share * T, 0.0)
    before, after = A @ middle, A @ middle + np.array([0.0, v_in / L])
    gradient = np.array([-GAIN, 0.0])
    rate = (HIGH - LOW) / T + gradient @ before
    saltation = np.eye(2) + np.outer(after - before, gradient) / rate
    return state, np.linalg.eigvals(expm(A * (1 - share) * T) @ saltation @ expm(A * share * T))


def test_the_first_period_doubling():
    orbit = ns.find_orbit(models.buck_converter(V_in=22.0), start={"v": 12.0, "i": 0.5, "ramp": 3.8})
    state, multipliers = cycle_and_trace(22.0)
    assert orbit.u[:2] == pytest.approx(state, rel=1e-9)
    assert np.sort_complex(orbit.floquet_multipliers) == pytest.approx(
        np.sort_complex(np.append(multipliers, 0.0)), abs=1e-8
    )
    table = ns.special_points(ns.continue_orbit(orbit, "V_in", (20.0, 30.0)))
    flip = float(table.V_in.values[list(table.kind.values).index("flip")])
    independent = brentq(lambda v_in: cycle_and_trace(v_in)[1].real.min() + 1.0, 23.0, 26.0, xtol=1e-12)
    assert flip == pytest.approx(independent, rel=1e-8)
    assert flip == pytest.approx(24.5, abs=0.05)  # Fossas and Olivar; di Bernardo et al.


def test_the_published_sequence_of_periods():
    found = ns.sweep(models.buck_converter(), "V_in", [23.0, 28.0, 31.6], transient=4000)
    assert found.period_number.values.tolist() == [1, 2, 4]
