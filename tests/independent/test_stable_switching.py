"""Unstable modes whose switching is stable (Hiskens and Pai 2000; an example of PETSc), by matrix exponentials.

x' = A1 x until x2 = 2.75 x1, x' = A2 x until x2 = 0.36 x1: each mode spirals outwards, together they contract.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

pytestmark = pytest.mark.physics

MATRICES = np.array([[[1.0, -100.0], [10.0, 1.0]], [[1.0, 10.0], [-100.0, 1.0]]])
SLOPES = 2.75, 0.36
START = np.array([0.0, 1.0])
END = 0.5


def switched() -> ns.System:
    def field(A):
        return lambda t, u, p: A @ u

    return ns.System(
        states=["x1", "x2"],
        parameters={"steep": SLOPES[0], "flat": SLOPES[1]},
        modes={"first": field(MATRICES[0]), "second": field(MATRICES[1])},
        indicators={"above": lambda t, u, p: u.x2 - p.steep * u.x1, "below": lambda t, u, p: u.x2 - p.flat * u.x1},
        transitions=[
            ns.Transition("first", "second", when="above < 0"),
            ns.Transition("second", "first", when="below > 0"),
        ],
    )


def exponential(mode, s):
    """exp(A s): A less the unit matrix has the square -1000."""
    w = np.sqrt(1000.0)
    return np.exp(s) * (np.cos(w * s) * np.eye(2) + np.sin(w * s) / w * (MATRICES[mode] - np.eye(2)))


def by_exponentials(u, slopes=SLOPES):
    """Times of switching, the end, its derivatives in the start: exponentials and I + (f+ - f-) h_u / h' in turn."""
    t, mode, times, phi = 0.0, 0, [], np.eye(2)
    u = np.array(u, float)
    while True:
        normal, sign = np.array([-slopes[mode], 1.0]), (-1, 1)[mode]

        def h(s, u=u, mode=mode, normal=normal):
            return normal @ exponential(mode, s) @ u

        grid = np.linspace(1e-6, 0.2, 401)
        values = sign * np.array([h(s) for s in grid])
        k = int(np.argmax(values > 0))
        at = brentq(h, grid[k - 1], grid[k], xtol=1e-16)
        if t + at > END:
            last = exponential(mode, END - t)
            return np.array(times), last @ u, last @ phi
        step = exponential(mode, at)
        t, u, phi = t + at, step @ u, step @ phi
        before, after = MATRICES[mode] @ u, MATRICES[1 - mode] @ u
        phi = (np.eye(2) + np.outer(after - before, normal) / (normal @ before)) @ phi
        times.append(t)
        mode = 1 - mode


def test_times_states_and_sensitivities_of_stable_switching():
    times, end, phi = by_exponentials(START)
    system = switched()
    run = ns.simulate(system, duration=END, start=START, samples=2)
    assert len(times) > 10
    assert run.crossing_time.values == pytest.approx(times, abs=1e-13)
    assert run.u.values[-1] == pytest.approx(end, abs=1e-12)
    assert np.linalg.norm(end) < 0.1  # though either mode alone grows by exp(0.5)
    found = ns.sensitivity(system, duration=END, start=START, parameters=["steep", "flat"])
    assert found.Phi.values == pytest.approx(phi, abs=1e-11)
    for k in range(2):
        moved = [by_exponentials(START, [s + (j == k) * d for j, s in enumerate(SLOPES)])[1] for d in (1e-6, -1e-6)]
        assert found.P.values[:, k] == pytest.approx((moved[0] - moved[1]) / 2e-6, abs=1e-7)
