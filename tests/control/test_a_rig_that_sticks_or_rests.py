"""An actuator on a mass that friction holds, or that lies on a rigid floor: closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

F, W = 0.05, 2.0  # of the drive F cos(W t)


def moved(t: float, since: float, push: float, x: float = 0.0, v: float = 0.0) -> tuple[float, float]:
    """Place and speed of a unit mass under push + F cos(W t)."""
    a, b, d = W * t, W * since, t - since
    swing = F / W * (np.sin(a) - np.sin(b)), -F / W * ((np.cos(a) - np.cos(b)) / W + np.sin(b) * d)
    return x + v * d + push * d**2 / 2 + swing[1], v + push * d + swing[0]


def readings(element: Any, weight: float, forces: dict[int, float]) -> list[float]:
    """Positions at 0.01, 0.02, ..., 1 under forces set before some of these samples."""
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"f": F, "w": W},
        forcing={"q": lambda t, p: p.f * np.cos(p.w * t) - weight},
        elements={"element": element},
    )
    rig = ns.SimulatedRig(system, position="q", velocity="v_q", mass=1.0, frequency="w", amplitude="f", rate=100.0)
    found = []
    for k in range(100):
        if k in forces:
            rig.apply_force(forces[k])
        found.append(rig.read()[1])
    return found


def test_friction_holds_the_actuator_as_it_holds_any_force() -> None:
    x = readings(ns.elements.Coulomb(at="q", friction=0.3), 0.0, {10: 0.2, 30: 0.5, 60: 0.2})
    assert x[29] == pytest.approx(0.0, abs=1e-15)
    faster = moved(0.6, 0.3, 0.5 - 0.3)
    assert x[59] == pytest.approx(faster[0], rel=1e-10)
    assert x[99] == pytest.approx(moved(1.0, 0.6, 0.2 - 0.3, *faster)[0], rel=1e-10)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_mass_is_lifted_off_a_rigid_floor(e: float) -> None:
    x = readings(ns.elements.Stop(at="q", side=-1, position=0.0, restitution=e), 1.0, {30: 0.5, 60: 1.5})
    assert x[59] == pytest.approx(0.0, abs=1e-15)
    assert x[99] == pytest.approx(moved(1.0, 0.6, 0.5)[0], rel=1e-10)


@pytest.mark.parametrize("chosen", [("floor", "between", "belt"), ("rub", "pre", "soft")])
def test_an_actuator_on_several_elements_is_a_force_in_steps(chosen: tuple[str, ...]) -> None:
    """The same forces as an input of the same chain."""
    rng, E = np.random.default_rng(7), ns.elements
    elements = {
        "floor": E.Stop(at="q1", side=-1, position=-0.2, restitution=0.5),
        "between": E.Stop(at={"q1": 1.0, "q2": -1.0}, side=1, position=0.2, restitution=0.4),
        "belt": E.Coulomb(at="q2", friction=0.3, belt=0.1),
        "rub": E.Coulomb(at="q1", friction=0.2),
        "pre": E.PreloadedSpring(at="q2", preload=0.2, stiffness=1.0),
        "soft": E.ElasticStop(at="q2", side=1, position=0.3, stiffness=20.0),
    }
    forces = rng.normal(0, 0.8, 20)

    def chain(push: Any, **options: Any) -> ns.System:
        return ns.mechanical(
            np.diag([0.8, 1.2]),
            [[0.2, -0.1], [-0.1, 0.2]],
            [[2.0, -1.0], [-1.0, 2.0]],
            parameters={"f": 0.6, "w": 1.7},
            forcing={"q1": push, "q2": lambda t, p: p.f * np.cos(p.w * t)},
            elements={name: elements[name] for name in chosen},
            **options,
        )

    rig = ns.SimulatedRig(
        chain(0.0), position="q1", velocity="v_q1", mass=0.8, frequency="w", amplitude="f", rate=100.0
    )
    found = []
    for k in range(199):
        if k % 10 == 0:
            rig.apply_force(forces[k // 10])
        found.append(rig.read()[1])
    steps = ns.Input(0.1 * np.arange(21), np.append(forces, forces[-1]), between="steps")
    driven, times = chain(lambda t, p: p.push, inputs={"push": ""}), 0.01 * np.arange(1, 200)
    run = ns.simulate(driven, duration=2.0, inputs={"push": steps}, samples=times)
    q = dict(zip(np.round(run.time.values, 9), run.u.sel(state="q1").values, strict=True))
    assert run.sizes["crossing"] > 2
    assert found == pytest.approx([q[t] for t in np.round(times, 9)], abs=1e-12)
