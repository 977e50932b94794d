"""Basins of an oscillator with a rigid stop against its closed-form pieces, the same starts."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_stop import RigidStop
from where_runs_end import agreement, end_of

import nonsmooth as ns

pytestmark = pytest.mark.physics

#: Parameters, half the box, period numbers in rising order: two cycles; and three, one of which is rare.
CASES = {
    "bistable": ({"omega": 1.4, "d": 1.8554}, (2.0, 3.0), [1, 1]),
    "three cycles": ({"omega": 2.5, "d": 0.342469}, (0.55, 0.75), [1, 4, 4]),
    "sticking": ({"omega": 2.5, "d": 0.342469}, (0.55, 0.75), [1, 2]),
}


def sticking(omega: float, d: float) -> ns.System:
    """The same without restitution: what hits the stop stays there while the force presses it."""
    return ns.System(
        states=["x", "v"],
        parameters={"k": 1.0, "c": 0.1, "omega": omega, "d": d, "e": 0.0, "A": 1.0},
        modes={
            "free": lambda t, u, p: (u.v, p.A * np.cos(p.omega * t) - p.k * u.x - p.c * u.v),
            "held": lambda t, u, p: (0 * u.v, 0 * u.x),
        },
        indicators={
            "stop": lambda t, u, p: u.x - p.d,
            "outward": lambda t, u, p: u.v,
            "pressing": lambda t, u, p: p.A * np.cos(p.omega * t) - p.k * u.x - p.c * u.v,
        },
        transitions=[
            ns.Transition("free", "held", when="stop > 0 and outward > 0", reset=lambda t, u, p: (p.d, 0 * u.v)),
            ns.Transition("held", "free", when="pressing < 0"),
        ],
    )


def check(system: ns.System, half: tuple[float, float], n: int, periods: list[int]) -> None:
    p = system.values
    x, v = np.linspace(-half[0], 0.999 * p["d"], n), np.linspace(-half[1], half[1], n)
    found = ns.basins(system, {"x": x, "v": v}, progress=False)
    assert sorted(found["period_number"].values.tolist()) == periods
    assert found["confirmed"].values.all()
    starts = np.column_stack([np.repeat(x, n), np.tile(v, n)])
    kept = RigidStop(p).sections(starts, 150, 52)
    share = agreement(found, [end_of(kept[:, k]) for k in range(len(starts))])
    print(f"{n * n} starts, {periods}: {100 * share:.3f} % end where brute force says")
    assert share >= 0.998


def system_of(name: str, parameters: dict[str, float]) -> ns.System:
    return sticking(**parameters) if name == "sticking" else ns.models.impact_oscillator(**parameters)


@pytest.mark.parametrize(
    ("name", "n"), [("bistable", 7), ("sticking", 7), pytest.param("three cycles", 10, marks=pytest.mark.slow)]
)
def test_basins_of_a_rigid_stop(name: str, n: int) -> None:
    parameters, half, periods = CASES[name]
    check(system_of(name, parameters), half, n, periods)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_10000_starts_against_a_rigid_stop(name: str) -> None:
    parameters, half, periods = CASES[name]
    check(system_of(name, parameters), half, 100, periods)
