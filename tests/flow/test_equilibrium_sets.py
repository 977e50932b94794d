"""Sets of equilibria against force balances in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.equilibrium_sets import EquilibriumSet, equilibrium_sets

E = ns.elements
MU, K = 0.5, 2.0


def sets(system: ns.System, *near: float) -> list[EquilibriumSet]:
    found = equilibrium_sets(system, np.array(near or np.zeros(len(system.states))))
    return sorted(found, key=lambda one: tuple(one.lower))


def one_mass(**elements: Any) -> ns.System:
    return ns.mechanical(
        1.0, 0.1, K, parameters={"P": 0.0}, forcing={"q": lambda t, p: p.P}, elements=elements, coordinates=["q"]
    )


def test_one_friction_leaves_an_interval() -> None:
    (found,) = sets(one_mass(f=E.Coulomb(at="q", friction=MU)).with_parameters(P=0.3))
    assert found.free == 1 and found.name(("f_stick", "f_forward", "f_back")) == "equilibria in f_stick"
    assert [found.lower[0], found.upper[0]] == pytest.approx([(0.3 - MU) / K, (0.3 + MU) / K], abs=1e-14)
    assert found.point == pytest.approx([0.3 / K, 0.0], abs=1e-14)
    inside = found.holds(np.array([[0.0, 0.0], [0.41, 0.0], [0.0, 0.1]]))
    assert inside.tolist() == [True, False, False]


def test_an_interval_of_a_micrometre() -> None:
    scale = {"q": 1e-6, "v_q": 1e-6}
    rubs = {"f": E.Coulomb(at="q", friction=1e-6 * MU)}
    (found,) = sets(ns.mechanical(1.0, 0.1, K, coordinates=["q"], elements=rubs, scale=scale))
    assert [found.lower[0], found.upper[0]] == pytest.approx([-1e-6 * MU / K, 1e-6 * MU / K], rel=1e-12)


def test_two_frictions_leave_a_parallelogram() -> None:
    """K q = lambda_1 (1, 0) + lambda_2 (1, -1) with |lambda_1| <= m, |lambda_2| <= n: K^-1 of four corners."""
    stiffness, m, n = np.array([[3.0, -1.0], [-1.0, 2.0]]), 0.5, 0.3
    system = ns.mechanical(
        np.diag([1.0, 2.0]),
        0.1 * np.eye(2),
        stiffness,
        elements={"f": E.Coulomb(at="q1", friction=m), "g": E.Coulomb(at={"q1": 1, "q2": -1}, friction=n)},
    )
    corners = [np.linalg.solve(stiffness, [a * m + b * n, -b * n]) for a in (-1, 1) for b in (-1, 1)]
    (found,) = sets(system)
    assert found.free == 2
    assert found.lower == pytest.approx([*np.min(corners, axis=0), 0.0, 0.0], abs=1e-12)
    assert found.upper == pytest.approx([*np.max(corners, axis=0), 0.0, 0.0], abs=1e-12)
    ends = [tuple(np.round(one.u[:2], 9)) for one in found.extremes]
    assert set(ends) <= {tuple(np.round(one, 9)) for one in corners}
    grid = np.random.default_rng(0).uniform(-0.5, 0.5, (200, 2))
    a_m, b_n = (stiffness @ grid.T).sum(axis=0), -(stiffness @ grid.T)[1]
    states = np.hstack([grid, np.zeros((200, 2))])
    assert found.holds(states).tolist() == ((np.abs(a_m) <= m) & (np.abs(b_n) <= n)).tolist()


def test_an_elastic_stop_within_the_interval() -> None:
    """|P - k q - k_s (q - g)| <= mu beyond g: both polytopes touch and are one set."""
    P, gap, stiff = 1.7, 0.8, 3.0
    stop = E.ElasticStop(at="q", position=gap, stiffness=stiff, damping=0.1)
    (found,) = sets(one_mass(f=E.Coulomb(at="q", friction=MU), s=stop).with_parameters(P=P))
    assert len(found.polytopes) == 2
    assert [found.lower[0], found.upper[0]] == pytest.approx([(P - MU) / K, (P + MU + stiff * gap) / (K + stiff)])


def test_a_buckled_mass_between_stops_has_three() -> None:
    """q'' = q / 2 between rigid stops at 1 and -1.5: both stops and the middle, which is unstable."""
    system = ns.mechanical(
        1.0,
        0.1,
        -0.5,
        coordinates=["q"],
        elements={"a": E.Stop(at="q", position=1.0), "b": E.Stop(at="q", position=-1.5, side=-1)},
    )
    found = sets(system)
    assert [one.lower[0] for one in found] == pytest.approx([-1.5, 0.0, 1.0], abs=1e-12)
    assert not any(one.free for one in found)


def test_a_mass_pressed_on_a_stop_beside_frictions() -> None:
    """q1 = d where the load presses, and |K21 d + K22 q2| <= m + n: what is held has its place, not any."""
    stiffness, d, m, n = np.array([[3.0, -1.0], [-1.0, 2.0]]), 0.2, 0.5, 0.3
    system = ns.mechanical(
        np.eye(2),
        0.1 * stiffness,
        stiffness,
        forcing={"q1": lambda t, p: 5.0},
        elements={
            "stop": E.Stop(at="q1", position=d, restitution=0.0),
            "rub": E.Coulomb(at="q2", friction=m),
            "tie": E.Coulomb(at={"q1": 1.0, "q2": -1.0}, friction=n),
        },
    )
    assert system.traced.patterns is not None  # modes are made when visited
    (found,) = sets(system, d, 0.0, 0.0, 0.0)
    assert found.free == 1
    assert found.lower[:2] == pytest.approx([d, (d - m - n) / 2.0], abs=1e-12)
    assert found.upper[:2] == pytest.approx([d, (d + m + n) / 2.0], abs=1e-12)


def test_two_stops_never_close_together() -> None:
    """A mode in which both stops of one coordinate rest has a field, but no state."""
    system = one_mass(a=E.Stop(at="q", position=0.5), b=E.Stop(at="q", position=-0.5, side=-1))
    (found,) = sets(system.with_parameters(P=0.2))
    assert found.lower[0] == pytest.approx(0.1)


@pytest.mark.parametrize(("F", "half"), [(0.3, 0.1), (0.5, 0.0)])
def test_a_forcing_below_friction(F: float, half: float) -> None:
    """It stands where |F cos wt - k q| <= mu at all times: |q| <= (mu - F) / k."""
    system = ns.mechanical(
        1.0,
        0.1,
        K,
        parameters={"w": 1.3},
        forcing={"q": lambda t, p: F * np.cos(p.w * t + 0.4)},
        elements={"f": E.Coulomb(at="q", friction=MU)},
    )
    (found,) = sets(system)
    assert [found.lower[0], found.upper[0]] == pytest.approx([-half, half], abs=1e-7)


def test_a_forcing_above_friction_leaves_none() -> None:
    system = ns.mechanical(
        1.0,
        0.1,
        K,
        parameters={"w": 1.3},
        forcing={"q": lambda t, p: 0.6 * np.cos(p.w * t)},
        elements={"f": E.Coulomb(at="q", friction=MU)},
    )
    assert sets(system) == []


def test_without_a_spring_it_has_no_ends() -> None:
    (found,) = sets(ns.mechanical(1.0, 0.1, 0.0, elements={"f": E.Coulomb(at="q", friction=MU)}))
    assert found.lower[0] == -np.inf and found.upper[0] == np.inf
    assert found.holds(np.array([[123.0, 0.0]]))[0]


@pytest.mark.parametrize(("near", "low", "high"), [(0.0, -0.3, 0.7), (np.pi, 0.7, -0.3)])
def test_a_pendulum_with_friction(near: float, low: float, high: float) -> None:
    """|T - sin q| <= mu: asin(T - mu) to asin(T + mu), and mirrored about the upright position."""
    pendulum = ns.System(
        states=["q", "v"],
        parameters={"T": 0.2},
        modes={"swing": lambda t, u, p: (u.v, p.T - np.sin(u.q))},
        elements={"f": E.Coulomb(speed=lambda t, u, p: u.v, on={"v": 1.0}, friction=MU)},
    )
    (found,) = sets(pendulum, near, 0.0)
    ends = np.arcsin([low, high])
    assert [found.lower[0], found.upper[0]] == pytest.approx(np.pi - ends if near else ends, abs=1e-9)


def test_a_relay_on_a_surface() -> None:
    """x'' = -x - F sgn x': the sliding mode rests where |x| <= F."""
    relay = ns.System(
        states=["x", "v"],
        parameters={"F": 0.4},
        modes={"back": lambda t, u, p: (u.v, p.F - u.x), "ahead": lambda t, u, p: (u.v, -p.F - u.x)},
        indicators={"s": lambda t, u, p: u.v},
        transitions=[ns.Surface("s", "back", "ahead")],
    )
    (found,) = sets(relay)
    assert [found.lower[0], found.upper[0]] == pytest.approx([-0.4, 0.4], abs=1e-9)


@pytest.mark.parametrize("size", [1e-6, 1e3])
@pytest.mark.parametrize("near", [-0.1, 0.3])
def test_an_interval_in_any_unit_is_found_from_anywhere_within_it(size: float, near: float) -> None:
    """Lengths and forces so many times as large: from q = 0.15 +- 0.25, wherever one looks."""
    rubs = {"f": E.Coulomb(at="q", friction=size * MU)}
    system = ns.mechanical(
        1.0,
        0.1,
        K,
        coordinates=["q"],
        parameters={"P": 0.3 * size},
        forcing={"q": lambda t, p: p.P},
        elements=rubs,
        scale={"q": size, "v_q": size},
    )
    (found,) = sets(system, near * size, 0.0)
    ends = [(0.3 - MU) / K * size, (0.3 + MU) / K * size]
    assert [found.lower[0], found.upper[0]] == pytest.approx(ends, rel=1e-9)
    inside = found.holds(size * np.array([[0.0, 0.0], [0.39, 0.0], [0.41, 0.0], [0.0, 0.1]]))
    assert inside.tolist() == [True, True, False, False]
