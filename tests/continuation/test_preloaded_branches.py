"""Branches of a preloaded spring beside play: its three ways through the middle are no corners of the orbit."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def rig() -> ns.System:
    return ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"omega": 1.4},
        forcing={"q": lambda t, p: np.cos(p.omega * t)},
        elements={
            "pre": ns.elements.PreloadedSpring(at="q", preload=0.3, stiffness=2.0),
            "play": ns.elements.Backlash(at="q", half_width=0.2, stiffness=10.0),
        },
    )


def test_the_branch_goes_through_its_range_and_its_stable_orbits_are_reached() -> None:
    system = rig()
    orbit = ns.find_orbit(system, start=[0.0, 0.0], transient=100, progress=False)
    branch = ns.continue_orbit(orbit, "omega", (1.3, 1.5))
    values = branch["omega"].values
    assert all("edge of the range" in str(why) for why in branch["ended_because"].values)
    stable = np.flatnonzero(branch["stable"].values)
    for k in stable[:: max(len(stable) // 6, 1)]:
        now, start = system.with_parameters(omega=float(values[k])), branch["section"].values[k].ravel()[:2]
        run = ns.simulate(now, start=start, periods=1, samples=2)
        assert run["u"].values[-1] == pytest.approx(start, abs=1e-9)
        swept = ns.sweep(now, "omega", [values[k]], start=start, direction=None, transient=200, keep=4, progress=False)
        reached = swept["maximum"].squeeze().values
        assert branch["maximum"].values[k] == pytest.approx(reached, abs=1e-7)


def test_an_answer_to_several_elements_at_once_is_on_the_orbit() -> None:
    """An impact ends the slip as well: of the two, and a stop further on, that are asked then, the stop is not met."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"omega": 0.8},
        forcing={"q": lambda t, p: np.cos(p.omega * t)},
        elements={
            "far": ns.elements.Stop(at="q", position=0.4, restitution=0.0),
            "low": ns.elements.ElasticStop(at="q", side=-1, position=-0.4, stiffness=5.0),
            "near": ns.elements.Stop(at="q", position=0.3, restitution=0.0),
            "rub": ns.elements.Coulomb(at="q", friction=0.1),
        },
    )
    orbit = ns.find_orbit(system, start=[0.0, 0.0], transient=50, progress=False)
    assert np.abs(orbit.floquet_multipliers).max() < 1e-12  # all motions come to rest at the stop
    run = ns.simulate(system, start=orbit.u, periods=1, samples=2)
    assert run["u"].values[-1] == pytest.approx(orbit.u, abs=1e-12)
