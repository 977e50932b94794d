"""A search names the equilibrium it meets, says when a multiplier is 1, and ends with its budget."""

from __future__ import annotations

import io
import re
import sys
import time
from typing import Any

import numpy as np
import pytest
import random_templates as templates

import nonsmooth as ns

QUIET = {"progress": False}


def beyond_one(growth: float) -> ns.System:
    """A saddle at 0; beyond x = 1 the equilibrium 1.5 with the eigenvalues growth / 2 +- i sqrt(1 - growth^2 / 4)."""
    return ns.System(
        states=["x", "v"],
        parameters={"growth": growth},
        modes={"near": lambda t, u, p: (u.v, u.x), "far": lambda t, u, p: (u.v, p.growth * u.v - (u.x - 1.5))},
        indicators={"beyond": lambda t, u, p: u.x - 1},
        transitions=[ns.Transition("near", "far", when="beyond > 0"), ns.Transition("far", "near", when="beyond < 0")],
    )


def undamped(stiffness: float, damping: float = 0.0) -> ns.System:
    return ns.System(
        states=["x", "v"],
        parameters={"k": stiffness, "c": damping, "F": 1.0, "omega": 1.0},
        modes={"all": lambda t, u, p: (u.v, -p.k * u.x - p.c * u.v + p.F * np.cos(p.omega * t))},
    )


#: Damping that pushes below x = 1 and brakes beyond: a stable cycle.
CYCLE = ns.System(
    states=["x", "v"],
    parameters={"push": 0.2, "brake": 1.0},
    modes={"near": lambda t, u, p: (u.v, p.push * u.v - u.x), "far": lambda t, u, p: (u.v, -p.brake * u.v - u.x)},
    indicators={"beyond": lambda t, u, p: u.x - 1},
    transitions=[ns.Transition("near", "far", when="beyond > 0"), ns.Transition("far", "near", when="beyond < 0")],
)


def test_a_start_at_an_unstable_equilibrium_is_named_at_once() -> None:
    """In the mode to which the start belongs, which is not the first."""
    begin = time.thread_time()
    with pytest.raises(ns.SolveError, match=r"the start x = 1\.5, v = 0 \(mode 'far'\) is an unstable eq") as caught:
        ns.find_orbit(beyond_one(0.2), start={"x": 1.5}, **QUIET)
    assert caught.value.status == "equilibrium" and "start=" in str(caught.value)
    assert f"eigenvalues 0.1+{np.sqrt(0.99):.6g}i" in str(caught.value)
    assert time.thread_time() - begin < 30.0  # most of it compiling, where that has not been done


def test_a_motion_that_comes_to_rest_names_the_equilibrium() -> None:
    with pytest.raises(ns.SolveError, match=r"an equilibrium: x = 1\.5, v = 0 .* is a stable equilibrium") as caught:
        ns.find_orbit(beyond_one(-0.2), start={"x": 1.6}, **QUIET)
    assert caught.value.status == "equilibrium"


def test_a_motion_that_never_comes_back() -> None:
    """x' = v, v' = -v + 1 drifts with the speed 1."""
    system = ns.System(states=["x", "v"], parameters={}, modes={"all": lambda t, u, p: (u.v, 1 - u.v)})
    with pytest.raises(ns.SolveError, match="does not come back") as caught:
        ns.find_orbit(system, **QUIET)
    assert caught.value.status == "not_periodic"


@pytest.mark.parametrize(
    ("stiffness", "damping", "multipliers"),
    [(4.0, 0.0, "of a period 2 pi, all motions close"), (0.0, 0.1, "a free translation: 1 and exp(-0.2 pi)")],
)
def test_a_multiplier_that_is_one_is_said(stiffness: float, damping: float, multipliers: str) -> None:
    """No orbit stands alone, once for all the period numbers that were tried."""
    for options in ({}, {"period_number": 1}):
        with pytest.raises(ns.SolveError, match="a multiplier is 1, so that Newton's method") as caught:
            ns.find_orbit(undamped(stiffness, damping), **options, **QUIET)
        assert caught.value.status == "neutral", multipliers
        assert str(caught.value).count("Newton") == 1 and "damping" in str(caught.value)


def test_an_orbit_of_an_undamped_system_is_neutral_not_unstable() -> None:
    """x'' = -2 x + cos t has the orbit cos t, whose multipliers exp(+-2 pi i sqrt 2) have modulus 1."""
    with pytest.raises(ns.SolveError, match="period-1 orbit near the motion is neutral"):
        ns.find_orbit(undamped(2.0), start={"x": 1.0}, **QUIET)
    orbit = ns.find_orbit(undamped(2.0), start={"x": 1.0}, period_number=1, **QUIET)
    assert orbit.u == pytest.approx([1.0, 0.0], abs=1e-12)
    assert np.sort_complex(orbit.floquet_multipliers) == pytest.approx(
        np.sort_complex(np.exp(2j * np.pi * np.sqrt(2.0) * np.array([1, -1]))), abs=1e-9
    )
    assert "period-1, neutral" in repr(orbit)


def test_a_family_of_cycles_is_said_to_be_one() -> None:
    """x'' = -x - (x^3 beyond a kink): here a ball that loses nothing; each height has its own period."""
    ball = ns.System(
        states=["x", "v"],
        parameters={"weight": 1.0},
        modes={"flight": lambda t, u, p: (u.v, -p.weight)},
        indicators={"floor": lambda t, u, p: u.x},
        transitions=[ns.Transition("flight", "flight", when="floor < 0", reset=lambda t, u, p: (u.x, -u.v))],
    )
    with pytest.raises(ns.SolveError, match="a multiplier is 1.*family of orbits") as caught:
        ns.find_orbit(ball, start={"x": 1.0}, **QUIET)
    assert caught.value.status == "neutral"


def test_a_motion_that_dies_out_too_slowly_is_nearly_neutral() -> None:
    """x'' = -x - 2e-4 x': once round its multipliers are exp(-2e-4 pi), and nothing rests for long."""
    with pytest.raises(ns.SolveError, match=r"a multiplier is 0\.9\d+") as caught:
        ns.find_orbit(CYCLE.with_parameters(push=-2e-4), start={"x": 0.5}, transient=10, **QUIET)
    told = float(re.search(r"a multiplier is ([\d.]+),", str(caught.value)).group(1))
    assert told == pytest.approx(np.exp(-2e-4 * np.pi), abs=5e-5)  # where Newton's method was given up
    assert caught.value.status == "neutral" and str(caught.value).count("Newton") == 1
    assert "nearly 1" in str(caught.value) and "dies out or grows very slowly" in str(caught.value)


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("system", [undamped(2.0, 0.1), CYCLE], ids=["forced", "autonomous"])
@pytest.mark.parametrize("shown", [True, False])
def test_a_search_ends_with_its_budget(system: ns.System, shown: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A transient of a thousand million rounds; the time spent is shown, where that is wanted."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with pytest.raises(ns.SolveError, match=r"in the budget of 0\.2 s .* budget=") as caught:
        ns.find_orbit(system, start={"x": 0.5}, transient=10**9, budget=0.2, progress=shown)
    assert caught.value.status == "budget"
    assert ("find_orbit, seconds of its budget" in terminal.getvalue()) == shown


@pytest.mark.parametrize("budget", [0.0, -1.0, "1 s", float("nan")])
def test_a_budget_is_a_positive_number(budget: Any) -> None:
    with pytest.raises((TypeError, ValueError), match="budget"):
        ns.find_orbit(undamped(2.0, 0.1), budget=budget)


@pytest.mark.parametrize(("x", "v"), [(0.0, 0.2), (-0.5, 0.2), (0.9, 0.2), (0.0, 0.0), (2.0, -1.0), (1.0, 0.2)])
def test_a_cycle_is_found_from_wherever_simulate_shows_it(x: float, v: float) -> None:
    """On the belt the mass leaves at x = 1 exactly, from x = 0 at t = 5: a run that is cut there goes on all the same.

    Period of Leine's cycle by quadrature: sticking from the place where it comes to rest to x = 1, and one slip."""
    from scipy.integrate import solve_ivp

    def slip(t: float, u: np.ndarray) -> list[float]:
        return [u[1], -u[0] + 1.0 / (1.0 + 3.0 * (0.2 - u[1]))]

    def back(t: float, u: np.ndarray) -> float:
        return float(u[1] - 0.2)

    back.terminal, back.direction = True, 1.0  # type: ignore[attr-defined]
    run = solve_ivp(slip, (0.0, 20.0), [1.0, 0.2], events=back, rtol=1e-12, atol=1e-13, max_step=0.01)
    period = float(run.t_events[0][0]) + (1.0 - float(run.y_events[0][0, 0])) / 0.2
    orbit = ns.find_orbit(ns.models.stick_slip_belt(), start={"x": x, "v": v})
    assert orbit.period == pytest.approx(period, abs=1e-8)


def test_an_unstable_orbit_is_found_from_itself() -> None:
    """A motion that begins on it leaves it after some rounds for the attractor, which closes no better."""
    system, name, limits, _ = templates.impact(np.random.default_rng([5, 6]))
    branch = ns.continue_orbit(ns.find_orbit(system, max_period=4), name, limits)
    for i in (int(np.abs(branch[name].values - value).argmin()) for value in (0.7193547, 1.5511334)):
        begun = branch["section"].values[i]
        here = system.with_parameters({name: float(branch[name][i])})
        assert not branch["stable"][i]
        orbit = ns.find_orbit(here, start=begun, transient=0, period_number=1)
        assert orbit.u == pytest.approx(begun, abs=1e-9)
