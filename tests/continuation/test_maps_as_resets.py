"""Maps with closed forms as resets at a phase, with nothing between: which orbit is found, and its multipliers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def kicked(states: list[str], values: dict[str, float], kick: Callable[..., Any]) -> ns.System:
    """States at rest but for a reset in the middle of every period of length 1."""
    return ns.System(
        states=states,
        parameters=values,
        modes={"rest": lambda t, u, p: tuple(0 * x for x in u)},
        period=1.0,
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=kick)],
    )


def logistic(r: float) -> ns.System:
    return kicked(["x"], {"r": r}, lambda t, u, p: (p.r * u.x * (1 - u.x),))


def henon(a: float) -> ns.System:
    return kicked(["x", "y"], {"a": a, "b": 0.3}, lambda t, u, p: (1 - p.a * u.x**2 + u.y, p.b * u.x))


@pytest.mark.parametrize(
    ("r", "period_number", "multiplier"),
    [
        (2.99, 1, -0.99),
        (2.999, 1, -0.999),
        (2.9999, 1, -0.9999),
        (3.001, 2, 4 + 2 * 3.001 - 3.001**2),
        (3.449, 2, 4 + 2 * 3.449 - 3.449**2),
    ],
)
def test_the_period_near_a_flip(r: float, period_number: int, multiplier: float) -> None:
    """A motion that settles slowly returns better after two periods, or 24, than after its own one."""
    orbit = ns.find_orbit(logistic(r), start={"x": 0.3})
    assert orbit.period_number == period_number
    assert orbit.floquet_multipliers == pytest.approx([multiplier], abs=1e-9)
    assert "rest (at 0.5) rest" in repr(orbit)


def test_the_period_of_henons_cycle_near_its_flip() -> None:
    """The 2-cycle x1 + x2 = 0.7 / a, x1 x2 = (0.49 - a) / a^2 has trace 4 a^2 x1 x2 + 2 b and determinant b^2."""
    a, b = 0.9, 0.3
    orbit = ns.find_orbit(henon(a), start={"x": 0.1, "y": 0.1})
    trace = 4 * (0.49 - a) + 2 * b
    assert orbit.period_number == 2
    assert np.sort(orbit.floquet_multipliers.real) == pytest.approx(np.sort(np.roots([1, -trace, b**2])), abs=1e-10)


def test_a_period_number_that_the_orbit_has_not() -> None:
    """A fixed point is one of period 2, 3, ... too: that is said, not returned as such an orbit."""
    with pytest.raises(ns.SolveError, match="period-1, gone round several times") as caught:
        ns.find_orbit(logistic(2.5), start={"x": 0.3}, period_number=2)
    assert caught.value.status == "shorter_period"


@pytest.mark.parametrize(
    ("system", "word"),
    [
        (ns.models.impact_oscillator(omega=1.5, d=0.3, c=0.3), "period-1"),
        (ns.models.stick_slip_belt(), "a shorter one"),  # not forced: a period of its own
    ],
    ids=["one impact a period", "one stick a round"],
)
def test_nor_has_one_with_transitions(system: ns.System, word: str) -> None:
    """Rounds of an orbit with transitions are told by its first one, which begins anew after the time of one round."""
    start = {"v": 0.5}
    once = ns.find_orbit(system, start=start)
    assert once.stable and len(once.signature.crossings) > 0
    for rounds in (2, 3):
        with pytest.raises(ns.SolveError, match=f"orbit found is {word}, gone round several times") as caught:
            ns.find_orbit(system, start=once.u, period_number=rounds)
        assert caught.value.status == "shorter_period"


@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_modes_that_alternate(phase: float) -> None:
    """x' = -x and x' = -3 x in turn: x = 0 returns after one period, the mode after two, with exp(-4).

    (y and a force of size 0: a shape of code that is there.)"""

    def decay(rate: float) -> Any:
        return lambda t, u, p: (-rate * u.x, p.A * np.cos(2 * np.pi * t) - 2 * rate * u.y)

    system = ns.System(
        states=["x", "y"],
        parameters={"A": 0.0},
        modes={"slow": decay(1.0), "fast": decay(3.0)},
        period=1.0,
        transitions=[ns.Transition("slow", "fast", at=phase), ns.Transition("fast", "slow", at=phase)],
    )
    orbit = ns.find_orbit(system, start={"x": 1.0})
    assert orbit.period_number == 2
    assert orbit.floquet_multipliers == pytest.approx([np.exp(-4.0), np.exp(-8.0)], abs=1e-12)
    with pytest.raises(ns.SolveError, match="no periodic motion"):
        ns.find_orbit(system, period_number=1)
