"""The start rule: no order of the modes makes a start invalid that lies beyond no stop."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns


def block(first: str) -> ns.System:
    """A mass on a spring with dry friction under a force; sticking, it has no velocity."""

    def net(t, u, p):
        return p.force * np.cos(p.w * t) - u.x

    modes = {
        "stick": ns.Mode(lambda t, u, p: (0.0,), states=["x"]),
        "pos": lambda t, u, p: (u.v, net(t, u, p) - p.F),
        "neg": lambda t, u, p: (u.v, net(t, u, p) + p.F),
    }
    indicators = {
        "vel": lambda t, u, p: u.v,
        "over": lambda t, u, p: net(t, u, p) - p.F,
        "under": lambda t, u, p: net(t, u, p) + p.F,
    }
    off, on = lambda t, u, p: (u.x, 0.0), lambda t, u, p: (u.x,)
    T = ns.Transition
    return ns.System(
        states=["x", "v"],
        parameters={"force": 1.0, "F": 0.3, "w": 0.8},
        modes={first: modes[first], **modes},
        indicators=indicators,
        transitions=[
            T("stick", "pos", when="over > 0", reset=off),
            T("stick", "neg", when="under < 0", reset=off),
            T("pos", "neg", when="vel < 0 and under < 0"),
            T("neg", "pos", when="vel > 0 and over > 0"),
            T("pos", "stick", when="vel < 0 and under > 0", reset=on),
            T("neg", "stick", when="vel > 0 and over < 0", reset=on),
        ],
    )


@pytest.mark.parametrize("first", ["stick", "pos"])
def test_a_start_that_sticks_under_a_force_above_friction_slips(first: str):
    """x'' = force cos(w t) - x - F from rest, until the velocity vanishes at t = 2.04."""
    run = ns.simulate(block(first), duration=2.0, samples=31)
    t = run.time.values
    P, F, w = 1.0, 0.3, 0.8
    forced = P / (1 - w**2)
    expected = forced * np.cos(w * t) - F + (F - forced) * np.cos(t)
    assert run.u.values[:, 0] == pytest.approx(expected, abs=1e-9)
    assert run.mode.attrs["flag_meanings"].split()[int(run.mode.values[0])] == "pos"


def test_sweeps_from_both_orders_agree():
    stick, slip = (ns.sweep(block(first), "w", [0.8], keep=4) for first in ("stick", "pos"))
    assert stick.status.values.tolist() == [0]
    assert np.nan_to_num(stick.section.values) == pytest.approx(np.nan_to_num(slip.section.values), abs=1e-8)


def test_the_derivative_in_the_start_goes_through_the_first_transition():
    """From stick the velocity begins at 0 whatever the start says: dx(t)/dx0 = cos t, dx(t)/dv0 = 0."""
    found = ns.sensitivity(block("stick"), duration=1.5)
    assert found.Phi.values[0] == pytest.approx([np.cos(1.5), 0.0], abs=1e-9)
    assert found.Phi.values[1] == pytest.approx([-np.sin(1.5), 0.0], abs=1e-9)


def test_a_reset_that_moves_a_state_is_a_stop():
    """A stop beside fewer states: what the source has is moved, so the start lies beyond it."""
    system = ns.System(
        states=["x", "v"],
        parameters={"g": 1.0},
        modes={"rest": ns.Mode(lambda t, u, p: (-p.g,), states=["x"]), "fly": lambda t, u, p: (u.v, -p.g)},
        indicators={"low": lambda t, u, p: u.x + 1.0},
        transitions=[ns.Transition("rest", "fly", when="low < 0", reset=lambda t, u, p: (-1.0, 0.5))],
    )
    with pytest.raises(ns.SolveError, match="beyond a stop"):
        ns.simulate(system, duration=1.0, start={"x": -2.0})
