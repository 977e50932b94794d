"""Forces of elements and the instants at which they begin and end, on one mass, in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import nonsmooth as ns

E = ns.elements
pytestmark = pytest.mark.physics


def mass(force: Any = None, **elements: Any) -> ns.System:
    """q'' = force + the elements' forces."""
    return ns.mechanical(
        1.0, 0.0, 0.0, parameters={}, forcing={"q": force} if force else None, elements=elements, coordinates=["q"]
    )


def run(system: ns.System, duration: float, q: float, v: float) -> Any:
    return ns.simulate(system, duration=duration, start={"q": q, "v_q": v})


def swing(t: Any, v: float, k: float, c: float) -> tuple[Any, Any]:
    """Place and speed of x'' + c x' + k x = 0 from x = 0."""
    w, d = np.sqrt(k - c * c / 4), c / 2
    wave = np.exp(-d * t)
    return v / w * wave * np.sin(w * t), v * wave * (np.cos(w * t) - d / w * np.sin(w * t))


@pytest.mark.parametrize("side", [1, -1])
def test_a_backlash_is_free_in_its_play_and_a_damped_spring_beyond(side: int) -> None:
    b, k, c, v = 0.2, 9.0, 0.8, 1.5
    found = run(mass(play=E.Backlash(at="q", half_width=b, stiffness=k, damping=c)), 0.6, 0.0, side * v)
    x, speed = swing(0.6 - b / v, v, k, c)
    assert found["u"].values[-1] == pytest.approx([side * (b + x), side * speed], abs=1e-10)
    assert found["crossing_time"].values == pytest.approx([b / v], abs=1e-12)
    assert float(found["play_force"][-1]) == pytest.approx(-side * (k * x + c * speed), abs=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_a_preloaded_spring_pulls_back_by_its_preload_and_its_stiffness(side: int) -> None:
    """From s = 0 at speed v: s = -P / k + P / k cos w t + v / w sin w t on its side."""
    P, k, v, t = 0.7, 4.0, 2.0, 0.5
    found = run(mass(spring=E.PreloadedSpring(at="q", preload=P, stiffness=k)), t, 0.0, side * v)
    w = np.sqrt(k)
    s = -P / k + P / k * np.cos(w * t) + v / w * np.sin(w * t)
    assert found["u"].values[-1, 0] == pytest.approx(side * s, abs=1e-10)


@pytest.mark.parametrize("load", [0.6, -0.6, 0.9, -0.9])
def test_a_preload_holds_what_is_less(load: float) -> None:
    """P = .7 holds .6; of .9 it leaves .2, which moves the mass as load - P - k s."""
    P, k, t = 0.7, 4.0, 0.5
    found = run(mass(lambda t, p: load, spring=E.PreloadedSpring(at="q", preload=P, stiffness=k)), t, 0.0, 0.0)
    left = np.sign(load) * max(abs(load) - P, 0.0)
    assert found["u"].values[-1, 0] == pytest.approx(left / k * (1 - np.cos(np.sqrt(k) * t)), abs=1e-8)


@pytest.mark.parametrize("pulls", [False, True])
def test_an_elastic_stop_ends_where_its_force_or_its_gap_vanishes(pulls: bool) -> None:
    """A damper would pull before the gap opens: one that does not pull lets go where k x + c v = 0."""
    k, c, v = 9.0, 1.2, 1.0
    stop = E.ElasticStop(at="q", position=0.5, stiffness=k, damping=c, pulls=pulls)
    found = run(mass(stop=stop), 2.5, 0.0, v)
    last = np.pi / np.sqrt(k - c * c / 4)
    end = last if pulls else brentq(lambda t: k * swing(t, v, k, c)[0] + c * swing(t, v, k, c)[1], 0.5 * last, last)
    assert found["crossing_time"].values == pytest.approx([0.5 / v, 0.5 / v + end], abs=1e-9)
    assert found["u"].values[-1, 1] == pytest.approx(swing(end, v, k, c)[1], abs=1e-9)
    t = np.linspace(0, end, 10001)
    largest = (k * swing(t, v, k, c)[0] + c * swing(t, v, k, c)[1]).max()
    assert np.abs(found["stop_force"].values).max() == pytest.approx(largest, rel=2e-3)


@pytest.mark.parametrize("v", [1.0, -1.0])
def test_friction_is_the_coefficient_times_the_normal_force(v: float) -> None:
    """mu N = .6 brings the mass to rest at v^2 / 2 mu N, where a load of 1.4 mu N, below static N, holds it."""
    mu, static, N = 0.2, 0.3, 3.0
    friction = E.Coulomb(at="q", friction=mu, static=static, normal=N)
    found = run(mass(f=friction), 3.0, 0.0, v)
    assert found["u"].values[-1] == pytest.approx([v * abs(v) / (2 * mu * N), 0.0], abs=1e-9)
    held = run(mass(lambda t, p: np.sign(v) * 0.84, f=friction), 3.0, 0.0, 0.0)
    assert held["u"].values[-1] == pytest.approx([0.0, 0.0], abs=1e-12)
    torn = run(mass(lambda t, p: np.sign(v) * 0.96, f=friction), 1.0, 0.0, 0.0)
    assert torn["u"].values[-1] == pytest.approx(np.sign(v) * np.array([0.18, 0.36]), abs=1e-9)


@pytest.mark.parametrize("v", [1.0, -1.0])
def test_friction_that_depends_on_the_speeds_magnitude(v: float) -> None:
    """v' = -(f + g |v|): |v| = (|v_0| + f / g) e^(-g t) - f / g, until it stops."""
    f, g, t = 0.3, 0.5, 1.0
    found = run(mass(f=E.Coulomb(at="q", friction=lambda speed, p: f + g * speed)), t, 0.0, v)
    size = (1 + f / g) * np.exp(-g * t) - f / g
    assert found["u"].values[-1, 1] == pytest.approx(np.sign(v) * size, abs=1e-9)


def test_a_belt_carries_the_mass_along() -> None:
    """Slower than the belt the friction drives it on, until it sticks: at t = belt / f it has gone belt^2 / 2 f."""
    f, belt = 0.4, -0.8
    found = run(mass(f=E.Coulomb(at="q", friction=f, belt=belt)), 3.0, 0.0, 0.0)
    assert found["u"].values[-1] == pytest.approx([-(belt**2) / (2 * f) + belt * (3.0 - 2.0), belt], abs=1e-9)
    assert found["crossing_time"].values == pytest.approx([2.0], abs=1e-9)


@pytest.mark.parametrize(("side", "e"), [(1, 0.5), (-1, 0.5), (1, 0.0), (1, 1.0)])
def test_an_impact_turns_the_speed_round_by_the_restitution(side: int, e: float) -> None:
    found = run(mass(s=E.Stop(at="q", position=side * 0.3, side=side, restitution=e)), 0.5, 0.0, side * 1.0)
    assert found["u"].values[-1] == pytest.approx([side * (0.3 - e * 0.2), -side * e], abs=1e-10)
    with pytest.raises(ns.SystemDefinitionError, match="between 0 and 1"):
        E.Stop(at="q", position=0.3, restitution=1.1)
    by_name = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"e": 0.5},
        elements={"s": E.Stop(at="q", position=1.0, restitution="e")},
        coordinates=["q"],
    )
    for wrong in (1.1, -0.1):
        with pytest.raises(ValueError, match="restitution of element 's' lies between 0 and 1"):
            by_name.with_parameters(e=wrong)


def test_a_block_leaves_a_belt_whose_speed_grows() -> None:
    """It sticks until k (c t + d t^2 / 2) + d = mu, then slips back; what its slip is computed from is not small."""
    belt = ns.elements.Coulomb(at="q", friction="mu", belt=lambda t, u, p: p.c + p.d * t)
    rig = ns.mechanical(1.0, 0.0, "k", parameters={"k": 1.0, "mu": 0.5, "c": 1.0, "d": 0.1}, elements={"belt": belt})
    for seed in range(40):
        k, mu, c, d = np.random.default_rng(seed).uniform([0.5, 0.4, 0.2, 0.01], [3.0, 1.0, 1.0, 0.3])
        leaves = (np.sqrt(c**2 + 2 * d * (mu - d) / k) - c) / d
        run = ns.simulate(rig.with_parameters(k=k, mu=mu, c=c, d=d), duration=leaves + 0.5, start={"v_q": c})
        w, off, speed = np.sqrt(k), -d / k, c + d * leaves  # of the place where the friction holds the spring
        np.testing.assert_allclose(run.crossing_time.values, [leaves], atol=1e-13)
        place = mu / k + off * np.cos(0.5 * w) + speed / w * np.sin(0.5 * w)
        np.testing.assert_allclose(run.u.values[-1, 0], place, atol=1e-12)


@pytest.mark.parametrize("method", ["auto", "taylor", "rkf45"])
def test_a_motion_that_begins_at_the_edge_of_a_play_enters_it(method: str) -> None:
    """q - h = (v / w) sin w t, w^2 = k / m, beside a stop and a friction of zero, which are asked what they do."""
    elements = {
        "play": ns.elements.Backlash(at="q", half_width=0.2, stiffness=10.0),
        "far": ns.elements.Stop(at="q", position=5.0),
        "rail": ns.elements.Coulomb(at="q", friction=0.0),
    }
    system = ns.mechanical(1.0, 0.0, 0.0, elements=elements)
    for side in (1, -1):
        run = ns.simulate(system, duration=0.5, start={"q": 0.2 * side, "v_q": 0.3 * side}, method=method)
        w = np.sqrt(10.0)
        exact = side * (0.2 + 0.3 / w * np.sin(0.5 * w)), side * 0.3 * np.cos(0.5 * w)
        np.testing.assert_allclose(run.u.values[-1], exact, atol=1e-7 if method == "rkf45" else 1e-12)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_mass_leaves_its_plate_where_its_friction_turns_round(method: str) -> None:
    """At the top of a plate that goes down with .85: pulled by 1 and held by .3, the mass falls with .7."""
    plate = ns.elements.Stop(at="q", side=-1, position=lambda t, u, p: 0.85 / p.w**2 * np.cos(p.w * t - p.late))
    rail = ns.elements.Coulomb(at="q", friction=0.3)
    table = {"w": 1.0, "late": 0.5}
    system = ns.mechanical(1.0, 0, 0, forcing={"q": -1.0}, parameters=table, elements={"plate": plate, "rail": rail})
    for seed in range(30):
        w, late = np.random.default_rng(seed).uniform([0.5, 0.5], [3.0, 1.5])
        size, top = 0.85 / w**2, late / w
        start = {"q": size * np.cos(late), "v_q": size * w * np.sin(late)}
        run = ns.simulate(system.with_parameters(w=w, late=late), duration=top + 0.2 / w, start=start, method=method)
        fall = 0.7 * np.array([0.5 * 0.04 / w**2, 0.2 / w])
        np.testing.assert_allclose(run.u.values[-1], [size - fall[0], -fall[1]], atol=1e-12)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
@pytest.mark.parametrize("speed", [-1e-12, -1e-17, 0.0, 1e-17])
def test_two_masses_that_friction_holds_stay_whatever_the_rounding_of_their_speeds(speed: float, method: Any) -> None:
    """Pushed together by .2 and -.1, which leaves .1 for a friction of .5."""
    elements = {
        "between": ns.elements.Stop(at={"q1": 1.0, "q2": -1.0}, position=0.3),
        "rail": ns.elements.Coulomb(at="q1", friction=0.5),
    }
    loads, zeros = {"q1": 0.2, "q2": -0.1}, np.zeros((2, 2))
    pair = ns.mechanical(np.eye(2), zeros, zeros, forcing=loads, parameters={}, elements=elements)
    run = ns.simulate(pair, duration=2.0, start={"q1": 0.3, "q2": 0.0, "v_q2": speed}, method=method)
    np.testing.assert_allclose(run.u.values[-1], [0.3, 0.0, 0.0, 0.0], atol=3e-12)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("speed", [0.0, 4.8e-49, 1e-16, 5e-11])
def test_a_contact_that_parts_by_less_than_rounding_holds(speed: float, restitution: float, method: Any) -> None:
    """Pressed by a force of 1 a mass turns after v^2 / 2: it rests at the other one, which friction holds."""
    system = ns.mechanical(
        np.eye(2),
        0.1 * np.eye(2),
        np.zeros((2, 2)),
        parameters={},
        forcing={"q2": lambda t, p: -1.0},
        elements={
            "stop": E.Stop(at={"q1": 1.0, "q2": -1.0}, position=0.3, restitution=restitution),
            "rail": E.Coulomb(at="q1", friction=2.0),
        },
        coordinates=["q1", "q2"],
    )
    for rounding in (0.0, 6e-17, -6e-17):
        start = {"q1": -0.5, "q2": -0.8 - rounding, "v_q2": speed}
        run = ns.simulate(system, duration=1.0, start=start, method=method)
        assert run["u"].values[-1] == pytest.approx([-0.5, -0.8, 0.0, 0.0], abs=1e-12)
