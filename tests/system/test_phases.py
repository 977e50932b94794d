"""Transitions at phases that depend on the parameters: `at=` takes a function."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.kernels.hybrid.kept import Section


def heater(duty: float = 0.3, **more: float) -> ns.System:
    """x' = gain - x in the first part of each period, x' = -x in the rest: a linear map from period to period."""
    return ns.System(
        name="heater",
        states=["x"],
        parameters={"duty": duty, "gain": 2.0, "span": 1.0},
        modes={"on": lambda t, u, p: (p.gain - u.x,), "off": lambda t, u, p: (-u.x,)},
        transitions=[ns.Transition("on", "off", at=lambda p: p.duty), ns.Transition("off", "on", at=0.0)],
        period=lambda p: p.span,
    )


def steady(duty: float, span: float = 1.0) -> float:
    """x at the beginning of a period."""
    return float(2.0 * np.exp(-(1 - duty) * span) * (1 - np.exp(-duty * span)) / (1 - np.exp(-span)))


DUTIES = np.array([0.1, 0.35, 0.4, 0.7, 0.95])  # at 0.1, 0.4 and 0.7 a step reaches the end of a period by rounding


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_a_sweep_over_the_phase(method: str):
    found = ns.sweep(heater(), "duty", DUTIES, transient=40, keep=2, max_period=1, method=method)
    expected = [steady(duty) for duty in DUTIES]
    assert found.period_number.values.tolist() == [1] * len(DUTIES)
    assert found.section.values[:, -1, 0] == pytest.approx(expected, rel=1e-9)


def test_points_of_one_call_have_their_own_phases():
    system = heater()
    engine = engine_for(system)
    tables = engine.prepare(system.parameter_points({"duty": DUTIES}))
    out, state = engine.kept(len(DUTIES), 1), State(np.zeros(1), np.zeros(0))
    engine.chain(tables, 0, len(DUTIES), state, np.zeros((len(DUTIES), 1)), Section(), 40, 1, out)
    assert out.section.ravel() == pytest.approx([steady(duty) for duty in DUTIES], rel=1e-12)


def test_a_chart_over_phase_and_period():
    grid = {"duty": DUTIES[1:3], "span": np.array([0.5, 1.0, 2.0])}
    chart = ns.chart(heater(), grid, transient=60)
    top = [[steady(d, T) * np.exp(-d * T) + 2 * (1 - np.exp(-d * T)) for T in grid["span"]] for d in grid["duty"]]
    assert chart.maximum.values[..., 0] == pytest.approx(np.array(top), rel=1e-9)


def test_a_gpu_knows_one_phase_for_all_points():
    with pytest.raises(ValueError, match="`at` depends on the parameters"):
        ns.chart(heater(), {"duty": [0.2, 0.3], "span": [1.0, 2.0]}, device="cuda")


def test_an_orbit_and_its_branch_in_the_phase():
    orbit = ns.find_orbit(heater(0.3))
    assert orbit.u == pytest.approx([steady(0.3)], rel=1e-12)
    assert orbit.floquet_multipliers == pytest.approx([np.exp(-1.0)], rel=1e-12)
    assert "(at duty)" in orbit.signature.text(orbit.system.traced)
    branch = ns.continue_orbit(orbit, "duty", (0.05, 0.9))
    assert branch.duty.values[[0, -1]] == pytest.approx([0.05, 0.9])
    assert branch.section.values[:, 0] == pytest.approx([steady(duty) for duty in branch.duty.values], rel=1e-10)


def test_derivatives_in_the_phase_and_in_the_period():
    """x(1) = x0 e^-1 + gain e^-(1 - duty) (1 - e^-duty), and its derivative in the duty is gain e^-(1 - duty)."""
    system = heater(0.3)
    found = ns.sensitivity(system, periods=1, parameters=["duty"], start={"x": 0.5})
    assert float(found.P.squeeze()) == pytest.approx(2.0 * np.exp(-0.7), rel=1e-10)


def test_a_phase_travels_as_text_and_is_shown():
    system = heater()
    read = ns.System.from_text(system.to_text())
    assert read == system
    assert "at phase duty" in str(read)
    assert "t / T = " in read.to_latex()


@pytest.mark.parametrize("duty", [1.0, -0.1])
def test_a_phase_outside_the_period_is_refused(duty: float):
    with pytest.raises(ns.SystemDefinitionError, match=r"`at` of on -> off, duty, .*a phase is in forcing periods"):
        heater().with_parameters(duty=duty)
    with pytest.raises(ns.SystemDefinitionError, match="a phase is in forcing periods"):
        ns.sweep(heater(), "duty", [0.5, duty])
    with pytest.raises(ns.SystemDefinitionError, match="a phase is in forcing periods"):
        heater(duty=duty)


def test_a_phase_depends_on_parameters_alone():
    def system(at: Any) -> ns.System:
        kick = ns.Transition("one", "one", at=at, reset=lambda t, u, p: (u.x + 1,), write={"kept": lambda t, u, p: u.x})
        return ns.System(
            states=["x"],
            parameters={"a": 0.5},
            modes={"one": lambda t, u, p: (-u.x,)},
            period=1.0,
            memory={"kept": ""},
            transitions=[kick],
        )

    assert system(lambda p: 0.25).transitions[0].at == 0.25
    with pytest.raises(ns.SystemDefinitionError, match="may depend on the parameters only"):
        system(lambda p: p.kept)
    with pytest.raises(ns.SystemDefinitionError, match="0 <= at < 1"):
        system(lambda p: 1.5)
    with pytest.raises(ns.SystemDefinitionError, match="or a function of the parameters"):
        system(1.5)
