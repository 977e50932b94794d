"""Contacts that begin, counted by sweeps, against impacts of the log and gaps that close in samples of the motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
KEEP, SAMPLES = 20, 200
ELEMENTS = ("stop", "elastic", "backlash", "friction")


def drawn(seed: int, least: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arguments of ``mechanical`` for a chain of two or three masses, and the gap of each element, None of a stop."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 4))
    springs = rng.uniform(0.5, 3.0, n - 1)
    k = np.diag(rng.uniform(1.0, 4.0, n)) - np.diag(springs, 1) - np.diag(springs, -1)
    k += np.diag(np.append(springs, 0.0)) + np.diag(np.append(0.0, springs))
    elements: dict[str, Any] = {}
    gaps: dict[str, Any] = {}
    for j in range(least + int(rng.integers(0, 2))):
        i, kind, d = int(rng.integers(n)), str(rng.choice(ELEMENTS)), float(rng.uniform(0.1, 0.5))
        at, name = f"q{i + 1}", f"e{j}"
        if kind == "stop":
            elements[name] = ns.elements.Stop(at=at, position=d, restitution=rng.uniform(0.2, 0.9), rest=False)
            gaps[name] = None
        elif kind == "elastic":
            elements[name] = ns.elements.ElasticStop(at=at, position=d, stiffness=rng.uniform(5.0, 50.0))
            gaps[name] = lambda u, i=i, d=d: d - u[:, i]
        elif kind == "backlash":
            elements[name] = ns.elements.Backlash(at=at, half_width=d, stiffness=rng.uniform(5.0, 50.0))
            gaps[name] = lambda u, i=i, d=d: d - np.abs(u[:, i])
        else:
            elements[name] = ns.elements.Coulomb(at=at, friction=rng.uniform(0.05, 0.4))
    given = {
        "M": np.diag(rng.uniform(0.5, 2.0, n)).tolist(),
        "C": (0.1 * k).tolist(),
        "K": k.tolist(),
        "parameters": {"omega": float(rng.uniform(0.7, 2.5))},
        "forcing": {"q1": lambda t, p: 1.5 * np.cos(p.omega * t)},
        "elements": elements,
    }
    return given, gaps


@pytest.mark.parametrize(("seed", "least"), [(0, 2), (5, 2), (15, 2), (3, 6), (8, 6)])
def test_contacts_are_impacts_and_gaps_that_close(seed: int, least: int) -> None:
    given, gaps = drawn(seed, least)
    system = ns.mechanical(**given)
    swept = ns.sweep(
        system, "omega", [system.values["omega"]], direction=None, transient=60, keep=KEEP, judge=False, progress=False
    )
    run = ns.simulate(system, periods=KEEP, transient=60, samples=SAMPLES * KEEP + 1)
    expected = 0
    for name, gap in gaps.items():
        if gap is None:
            expected += int(np.isfinite(run[f"{name}_impact_speed"].values).sum())
        else:
            values = gap(run["u"].values)
            expected += int(((values[:-1] > 0) & (values[1:] <= 0)).sum())
    assert expected > 0 or not gaps
    assert round(float(swept["contacts_per_period"].squeeze()) * KEEP) == expected


def test_frictions_are_no_contacts_and_each_stop_is_one() -> None:
    """A block between elastic stops, in contact with one of them before it lets go of the other: both count."""
    both = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"omega": 1.0},
        forcing={"q": lambda t, p: np.cos(p.omega * t)},
        elements={
            "left": ns.elements.ElasticStop(at="q", side=-1, position=0.1, stiffness=2.0),
            "right": ns.elements.ElasticStop(at="q", position=-0.1, stiffness=2.0),
            "friction": ns.elements.Coulomb(at="q", friction=0.1),
        },
    )
    swept = ns.sweep(both, "omega", [1.0], direction=None, transient=60, keep=10, progress=False)
    assert float(swept["contacts_per_period"].squeeze()) == 2.0
    orbit = ns.find_orbit(both, start=[0, 0], transient=60, progress=False)
    assert orbit.contacts_per_period == 2.0


def test_a_transition_of_ones_own_says_whether_a_contact_begins() -> None:
    """Two crossings of x = 0 in a period of cos t; both, or the one that was named, are contacts."""

    def driven(to: bool | None, back: bool | None) -> float:
        system = ns.System(
            states=["x", "v"],
            modes={"left": lambda t, u, p: (u.v, -np.cos(t)), "right": lambda t, u, p: (u.v, -np.cos(t))},
            indicators={"side": lambda t, u, p: u.x},
            transitions=[
                ns.Transition("left", "right", when="side > 0", contact=to),
                ns.Transition("right", "left", when="side < 0", contact=back),
            ],
            parameters={"k": 1.0},
            period=lambda p: 2 * np.pi,
        )
        again = ns.System.from_text(system.to_text())
        assert again == system
        swept = ns.sweep(again, "k", [1.0], start=[1.0, 0.0], direction=None, transient=2, keep=4, progress=False)
        return float(swept["contacts_per_period"].squeeze())

    assert [driven(None, None), driven(False, True), driven(True, True), driven(False, False)] == [1, 1, 2, 0]
