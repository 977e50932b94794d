"""Derivatives of readings in all that moves their times, beside differences of the readings themselves."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.fit.first_windows import first_windows
from nonsmooth.identification.fit.fit import problem_of

SENSORS = {"q": ns.Sensor(delay=0.01), "v_q": ns.Sensor(delay=0.03)}


def slopes_beside_differences(system: ns.System, run: Any, names: list[str], inputs: Mapping[str, Any] | None) -> None:
    t, u = run["time"].values, run["u"]
    read = {"q": (t + 1.0, u.sel(state="q").values), "v_q": (t + 1.0039, u.sel(state="v_q").values)}
    problem = problem_of(system, read, names, {"measured": SENSORS}, inputs=inputs)
    theta, step = problem.unknowns.guess, 1e-7
    problem = problem.of(first_windows(problem, theta, 3.0, None, True))
    assert len(problem.pieces) > 2
    slopes = problem.residuals(theta, problem.starts, True).in_parameters
    for i, name in enumerate(problem.unknowns.names):
        ends = [problem.residuals(theta + s * np.eye(len(theta))[i], problem.starts).residuals for s in (step, -step)]
        for above, below, slope in zip(*ends, slopes, strict=True):
            np.testing.assert_allclose(slope[:, i], (below - above) / (2 * step), atol=2e-6, err_msg=name)


def oscillator(parameters: Mapping[str, float], force: Any, **more: Any) -> ns.System:
    return ns.mechanical(1.0, 0.2, 9.0, coordinates=["q"], parameters=parameters, forcing={"q": force}, **more)


def test_of_a_forced_motion_with_impacts() -> None:
    wall = ns.elements.Stop(at="q", position=0.3, restitution=0.7)
    system = oscillator({"w": 2.0}, lambda t, p: np.cos(p.w * t), elements={"wall": wall})
    run = ns.simulate(system, duration=12, samples=601, start={"q": 0.1})
    slopes_beside_differences(system, run, ["w", "q.delay", "v_q.delay", "clock", "phase"], None)


@pytest.mark.parametrize("between", ["linear", "steps"])
def test_of_a_motion_under_an_input_with_a_delay(between: Any) -> None:
    system = oscillator({"late": 0.0131}, lambda t, p: p.force, inputs={"force": "N"})
    t = np.arange(0.0, 14.0, 0.1)
    force = np.random.default_rng(0).standard_normal(len(t))
    inputs = {"force": ns.Input(t, force, between=between, delay="late")}
    run = ns.simulate(system, duration=12, samples=601, inputs=inputs)
    slopes_beside_differences(system, run, ["late", "q.delay", "v_q.delay"], inputs)
