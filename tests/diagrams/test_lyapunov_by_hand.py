"""Every variable of ``lyapunov`` of an oscillator that strikes a stop once in each period."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

T, N = 2 * np.pi, 200


@pytest.fixture(scope="module")
def system() -> ns.System:
    return ns.models.impact_oscillator()


def sum_of(system: ns.System, e: float | None = None) -> float:
    """A period multiplies areas by exp(-c T), and an impact by e^2."""
    p = system.values
    return float(-p["c"] + 2 * np.log(p["e"] if e is None else e) / T)


def test_every_variable_of_a_periodic_motion(system: ns.System) -> None:
    p = system.values
    orbit = ns.find_orbit(system)
    assert orbit.period_number == 1 and len(orbit.crossing_times) == 1
    found = ns.lyapunov(system, periods=N, transient=300, progress=False)
    exponents = np.log(np.abs(orbit.floquet_multipliers)) / T
    assert found["exponents"].values == pytest.approx(exponents, abs=3e-3)
    assert found["exponents"].values.sum() == pytest.approx(sum_of(system), abs=1e-9)
    assert found["running"].values.sum(axis=1) == pytest.approx(sum_of(system), abs=1e-9)
    assert found["running"].values[-1] == pytest.approx(found["exponents"].values, abs=2e-3)
    assert float(found["trace_defect"]) == pytest.approx(0.0, abs=1e-10)
    assert float(found["elapsed"]) == pytest.approx(N * T)
    assert (found["standard_error"].values < 1e-3).all()
    assert float(found["kaplan_yorke"]) == 0.0 and int(found["equilibrium"]) == 0 and int(found["status"]) == 0
    assert found["exponent"].values.tolist() == [1, 2]
    # of the stop's indicator x - d: |v| over the size of the rate (v, a), where it is struck
    run = ns.simulate(system, periods=2, transient=300)
    x, v = run["u_before"].values[0]
    a = p["A"] * np.cos(p["omega"] * float(run["crossing_time"][0])) - p["c"] * v - p["k"] * x
    assert float(found["nearest_graze"]) == pytest.approx(v / np.hypot(v, a), rel=1e-4)


@pytest.mark.parametrize("direction", ["up", "down", None])
def test_the_sum_over_a_parameter(system: ns.System, direction: str | None) -> None:
    values = np.array([0.75, 0.8, 0.85])
    found = ns.lyapunov(
        system, parameter="e", values=values, direction=direction, periods=50, transient=300, progress=False
    )
    assert found["e"].values == pytest.approx(values) and found["exponents"].dims == ("e", "exponent")
    assert found["exponents"].values.sum(axis=1) == pytest.approx([sum_of(system, e) for e in values], abs=1e-6)
    assert found["elapsed"].values == pytest.approx(np.full(3, 50 * T))
    assert np.abs(found["trace_defect"].values).max() < 1e-10
