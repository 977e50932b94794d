"""With crossings located, the error against a fixed step falls with the method's own order; without, like h."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.system.system import System
from nonsmooth.system.transition import Transition

W = 2 * np.pi


def spirals() -> System:
    """Problem L: x' = A1 x inside the unit circle, A2 x outside, from (1 / e, 0): on the circle at t = 1 exactly."""
    return System(
        states=("x", "y"),
        parameters={"w": W},
        modes={
            "inner": lambda t, u, p: (u.x - p.w * u.y, p.w * u.x + u.y),
            "outer": lambda t, u, p: (u.x + p.w * u.y, -p.w * u.x + u.y),
        },
        indicators={"circle": lambda t, u, p: u.x**2 + u.y**2 - 1.0},
        transitions=[Transition("inner", "outer", when="circle > 0"), Transition("outer", "inner", when="circle < 0")],
    )


def tangent() -> System:
    """x = tan t up to 1 (at pi/4), then x' = -2 x^2 down to 1/2 (at pi/4 + 1/2), then x' = x."""
    return System(
        states=("x",),
        parameters={"top": 1.0, "low": 0.5},
        modes={
            "rise": lambda t, u, p: (1.0 + u.x**2,),
            "fall": lambda t, u, p: (-2.0 * u.x**2,),
            "grow": lambda t, u, p: (u.x,),
        },
        indicators={"high": lambda t, u, p: u.x - p.top, "deep": lambda t, u, p: u.x - p.low},
        transitions=[Transition("rise", "fall", when="high > 0"), Transition("fall", "grow", when="deep < 0")],
    )


CASES = {
    "spirals": (
        spirals,
        [np.exp(-1.0), 0.0],
        np.pi / 2,
        np.exp(W / 4 - 1) * np.array([np.cos(W * (W / 4 - 1)), -np.sin(W * (W / 4 - 1))]),
        0.02,
    ),
    "tangent": (tangent, [0.0], 2.0, np.array([0.5 * np.exp(2.0 - np.pi / 4 - 0.5)]), 0.1),
}


def errors(case: str, steps: np.ndarray, method: str, **options: Any) -> np.ndarray:
    build, start, end, truth, _ = CASES[case]
    system = build()
    found = []
    for step in steps:
        e = SeriesEngine(system.traced, system.scale_vector(), method, rtol=1e-14, step=step, **options)
        state = State(np.array(start), np.zeros(0))
        e.record(e.prepare(system.parameter_vector()[None]), state, end, np.zeros(0))
        found.append(np.abs(state.u - truth).max())
    return np.array(found)


def slope(steps: np.ndarray, found: np.ndarray) -> float:
    return float(np.polyfit(np.log(steps), np.log(found), 1)[0])


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize(("method", "order"), [("rkf45", 4), ("taylor", 3), ("taylor", 4)])
def test_the_order_survives_the_crossings(case: str, method: str, order: int) -> None:
    """Two decades of the step; the steps are irrational parts of the run, so that crossings fall anywhere."""
    steps = CASES[case][4] * np.geomspace(1.0, 0.01, 15) * (1 + 0.01 * np.sin(np.arange(15)))
    options = {"order": order} if method == "taylor" else {}
    found = errors(case, steps, method, **options)
    seen = found > 1e-12
    assert seen.sum() >= 8
    assert slope(steps[seen], found[seen]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("method", ["rkf45", "taylor"])
def test_without_location_the_order_is_one(case: str, method: str) -> None:
    steps = CASES[case][4] * np.geomspace(1.0, 0.01, 60) * (1 + 0.01 * np.sin(1.0 + np.arange(60)))
    found = errors(case, steps, method, locate=False)
    assert 0.5 < slope(steps, found) < 1.5
    assert np.median(found / steps) > 1e-2
