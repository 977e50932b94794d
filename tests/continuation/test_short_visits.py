"""Means of an indicator's derivatives along a visit, by what the indicator is at its ends (Taylor's theorem)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.continuation.problems.surfaces import mean_along
from nonsmooth.flow.variational import VariationalFlow

A, W, TAU, BEGIN = 0.7, 1.3, 0.2, 0.4


@pytest.fixture(scope="module")
def swing() -> tuple[VariationalFlow, ns.System]:
    """A forced pendulum that meets a surface which moves, x + x v / 4 = A cos(t)."""
    system = ns.System(
        name="swing",
        states=["x", "v"],
        parameters={"A": A, "w": W},
        modes={"one": lambda t, u, p: (u.v, p.A * np.cos(p.w * t) - np.sin(u.x)), "other": lambda t, u, p: (0.0, 0.0)},
        indicators={"beyond": lambda t, u, p: u.x + u.x * u.v / 4 - p.A * np.cos(t)},
        transitions=[ns.Transition("one", "other", when="beyond > 0")],
    )
    return VariationalFlow.of(system, ("A",)), system


def value(t: float, z: Any, a: float) -> float:
    return float(z[0] + z[0] * z[1] / 4 - a * np.cos(t))


def rate(t: float, z: Any, a: float) -> float:
    """d/dt of it along the motion."""
    x, v = z
    return float(v + v * v / 4 + x * (a * np.cos(W * t) - np.sin(x)) / 4 + a * np.sin(t))


def expected(x: Any, order: int) -> float:
    """h(end) = h + tau mean of L, and = h + tau L + tau^2 mean of (1 - s) L2, with the end by SciPy."""
    from scipy.integrate import solve_ivp

    begin, z, tau, a = x[0], x[1:3], x[3], x[4]
    end = solve_ivp(
        lambda t, u: (u[1], a * np.cos(W * t) - np.sin(u[0])), (begin, begin + tau), z, rtol=1e-12, atol=1e-13
    ).y[:, -1]
    gone = value(begin + tau, end, a) - value(begin, z, a)
    return gone / tau if order == 1 else (gone - tau * rate(begin, z, a)) / tau**2


@pytest.mark.parametrize("order", [1, 2])
def test_means_along_a_visit_are_what_the_ends_say(swing: tuple[VariationalFlow, ns.System], order: int) -> None:
    flow, system = swing
    x = np.array([BEGIN, 0.5, 0.3, TAU, A])
    values = system.parameter_vector()
    mean, slopes = mean_along(flow, x, values, 0, 0, order)
    assert mean == pytest.approx(expected(x, order), rel=1e-7)
    for k, step in enumerate(1e-3 * np.eye(5)):
        by_ends = (expected(x + step, order) - expected(x - step, order)) / 2e-3
        assert slopes[k] == pytest.approx(by_ends, rel=1e-4, abs=1e-5)
