"""Systems with elements: closed forms of balls, dry friction and impacts; what is refused."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.elements import Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop

#: Two masses without a force run on kernels that are there: those of four states and a harmonic.
NO_FORCE: dict[str, Any] = {"parameters": {"F": 0.0}, "forcing": {"a": lambda t, p: p.F * np.cos(t)}}


def shaken(**values: float) -> ns.System:
    """A mass under a force cos(w t), with a rigid stop on its right."""
    return ns.System(
        states=["x", "v"],
        parameters={"w": 1.0, "k": 1.0, "c": 0.0, "d": 0.3, "e": 0.5},
        modes={"all": lambda t, u, p: (u.v, np.cos(p.w * t) - p.k * u.x - p.c * u.v)},
        elements={"stop": Stop(gap=lambda t, u, p: p.d - u.x, on={"v": -1.0}, restitution="e")},
    ).with_parameters(values)


def test_a_ball_comes_to_rest_when_its_bounces_end() -> None:
    """Accumulation 2 v0 / (g (1 - e)) after the first impact that leaves with the speed v0."""
    ball = ns.System(
        states=["x", "v"],
        parameters={"g": 9.81, "e": 0.5},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        elements={"floor": Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution="e", creep=1e-12)},
    )
    run = ns.simulate(ball, duration=2.0, start={"x": 1.0})
    first = np.sqrt(2 / 9.81)
    assert run["crossing_time"].values[-1] == pytest.approx(first + 2 * 0.5 * 9.81 * first / (9.81 * 0.5), abs=1e-12)
    assert ball.modes[int(run["mode"][-1])] == "floor_rest"
    assert run["floor_force"].values[-1] == pytest.approx(9.81, rel=1e-15)
    assert abs(run["u"].values[-1]).max() < 1e-15
    heights = 0.5**2 * run["u_before"].values[:, 1] ** 2 - run["u_after"].values[:, 1] ** 2
    assert abs(heights[:-1]).max() < 1e-12  # each impact leaves e of the speed; the last one nothing


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_ball_on_a_vibrating_table_lifts_off_with_its_acceleration(method: str, e: float) -> None:
    """It rests through a part of each period: the flight that follows begins where the table falls as fast as it."""
    g, rate = 9.81, 2 * np.pi
    ball = ns.System(
        states=["x", "v"],
        parameters={"A": 0.3, "w": rate, "g": g, "e": e},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        scale={"x": 0.1},
        elements=[Stop(gap=lambda t, u, p: u.x - p.A * np.cos(p.w * t), on={"v": 1.0}, restitution="e")],
    )
    amplitudes = np.linspace(0.26, 0.31, 9)
    found = ns.sweep(ball, "A", amplitudes, start={"x": 1.0}, direction=None, progress=False, method=method)
    assert (found["period_number"] == 1).all() and (found["status"] == 0).all()
    off = -np.arccos(g / (amplitudes * rate**2)) / rate
    x, v = amplitudes * np.cos(rate * off), -amplitudes * rate * np.sin(rate * off)
    expected = np.stack([x - v * off - g * off**2 / 2, v + g * off], axis=1)
    assert np.allclose(found["section"].values[:, -1], expected, atol=1e-12 if method == "exact" else 1e-8)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_chatter_ends_in_rest_over_a_sweep(e: float) -> None:
    found = ns.sweep(shaken(c=0.1, e=e), "w", np.linspace(0.2, 2.0, 40), progress=False)
    assert (found["status"] == 0).all() and (found["period_number"] > 0).all()


def test_a_stop_holds_and_no_impact_adds_energy() -> None:
    """Sticking at the stop (Budd and Dux 1994): where cos(w t) > d the force presses the mass against it."""
    system = shaken(w=0.4)
    starts = ns.random_starts(20, {"x": -1.5, "v": -1.0}, {"x": 0.3, "v": 1.0}, seed=0)
    found = ns.sweep(system, "w", [0.4], start=starts, direction=None, transient=20, keep=10, progress=False)
    assert (found["status"] == 0).all()
    assert float(found["maximum"].sel(state="x").max()) <= 0.3 + 1e-12
    run = ns.simulate(system, periods=10, start={"x": -1.0})
    assert float(run["u"].sel(state="x").max()) <= 0.3 + 1e-12
    assert (abs(run["u_after"].values[:, 1]) <= abs(run["u_before"].values[:, 1])).all()
    rests = np.array(system.modes)[run["mode"].values] == "stop_rest"
    assert rests.any()
    assert np.allclose(run["stop_force"].values[rests], np.cos(0.4 * run["time"].values[rests]) - 0.3, atol=1e-12)
    assert (run["stop_force"].values[rests] > -1e-12).all()


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize(
    ("start", "mode", "speed"),
    [((0.3, 0.0), "stop_rest", 0.0), ((0.3, 1.0), "stop_open", -0.5), ((0.3, -1.0), "stop_open", -1.0)],
)
def test_a_start_on_the_stop(method: str, start: tuple[float, float], mode: str, speed: float) -> None:
    """It rests where the force presses, rebounds where it moves in, leaves where it moves out."""
    system = shaken()
    run = ns.simulate(system, duration=1e-6, samples=2, start=list(start), method=method)
    assert system.modes[int(run["mode"][-1])] == mode
    assert run["u"].values[-1] == pytest.approx([0.3, speed], abs=1e-5)
    with pytest.raises(ns.SolveError, match="beyond a stop"):
        ns.simulate(system, periods=1, start={"x": 0.4}, method=method)


def test_friction_sticks_below_its_static_force_and_slips_with_its_kinetic_one() -> None:
    """Under a slowly rising force P sin(w t) the mass holds until P sin(w t) = static, then feels the kinetic one."""
    rig = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"w": 0.1},
        forcing={"q": lambda t, p: np.sin(p.w * t)},
        elements={"rub": Coulomb(at="q", friction=0.3, static=0.5)},
    )
    run = ns.simulate(rig, duration=12.0)
    slip = np.arcsin(0.5) / 0.1
    assert run["crossing_time"].values[0] == pytest.approx(slip, rel=1e-13)
    last = float(run["time"][-1])
    speed = (np.cos(0.1 * slip) - np.cos(0.1 * last)) / 0.1 - 0.3 * (last - slip)
    assert run["u"].values[-1, 1] == pytest.approx(speed, rel=1e-12)
    stuck = run["time"].values < slip * (1 - 1e-13)
    assert np.allclose(run["rub_force"].values[stuck], -np.sin(0.1 * run["time"].values[stuck]), atol=1e-13)


def test_impacts_between_masses_keep_the_momentum() -> None:
    """Two free masses with an elastic bumper, an inelastic one and a spring each: momentum before and after."""
    pair = ns.mechanical(
        [[2.0, 0.0], [0.0, 1.0]],
        np.zeros((2, 2)),
        np.zeros((2, 2)),
        coordinates=["a", "b"],
        **NO_FORCE,
        elements={"bumper": Stop(at={"b": 1, "a": -1}, position=0.0, side=-1, restitution=0.25)},
    )
    run = ns.simulate(pair, duration=3.0, start={"a": 0.0, "b": 1.0, "v_a": 1.0, "v_b": 0.0})
    before, after = run["u_before"].values[0], run["u_after"].values[0]
    assert run["crossing_time"].values == pytest.approx([1.0], rel=1e-14)
    assert 2 * after[2] + after[3] == pytest.approx(2 * before[2] + before[3], rel=1e-14)
    assert after[3] - after[2] == pytest.approx(0.25 * (before[2] - before[3]), rel=1e-14)


def test_what_friction_holds_is_driven_away_by_an_impact() -> None:
    """A finite force bears no impulse: the struck mass leaves with (1 + e) / 2 and the momentum is kept."""
    pair = ns.mechanical(
        np.eye(2),
        np.zeros((2, 2)),
        np.zeros((2, 2)),
        coordinates=["a", "b"],
        **NO_FORCE,
        elements={
            "bumper": Stop(at={"b": 1, "a": -1}, side=-1, restitution=0.25),
            "rub": Coulomb(at="b", friction=0.1),
        },
    )
    run = ns.simulate(pair, duration=1.5, start={"a": 0.0, "b": 1.0, "v_a": 1.0})
    assert run["u_after"].values[0] == pytest.approx([1.0, 1.0, 0.375, 0.625], abs=1e-14)
    assert run["u"].values[-1] == pytest.approx([1.1875, 1.3, 0.375, 0.575], abs=1e-13)


def test_a_mass_that_rubs_rebounds() -> None:
    """The impact turns the speed round and with it the friction: v - f t before, f t - e (v - f) after."""
    puck = ns.mechanical(
        1.0, 0.0, 0.0, elements=[Coulomb(at="q", friction=0.1), Stop(at="q", position=0.95, restitution=0.5)]
    )
    run = ns.simulate(puck, duration=3.0, start={"v_q": 1.0})
    assert run["crossing_time"].values[0] == pytest.approx(1.0, abs=1e-13)
    assert run["u"].values[-1] == pytest.approx([0.95 - 0.45 * 2 + 0.05 * 4, -0.25], abs=1e-13)


def test_friction_under_the_force_of_an_elastic_contact() -> None:
    """A wall pressed by 1 brakes the slider with 0.3 until it sticks; an open one lets it go."""
    slider = ns.mechanical(
        np.eye(2),
        np.zeros((2, 2)),
        np.zeros((2, 2)),
        forcing={"q1": lambda t, p: 1.0},
        elements={
            "wall": ElasticStop(at="q1", stiffness=20.0),
            "rub": Coulomb(at="q2", friction=0.3, normal="wall"),
        },
    )
    run = ns.simulate(slider, duration=5.0, start={"q1": 0.05, "v_q2": 1.0}, samples=11)
    assert run["u"].values[-1] == pytest.approx([0.05, 0.5 / 0.3, 0.0, 0.0], abs=1e-12)
    assert slider.modes[int(run["mode"][-1])] == "rub_stick_wall_contact"
    away = ns.simulate(slider, duration=1.0, start={"q1": -1.0, "v_q2": 1.0})
    assert away["u"].values[-1] == pytest.approx([-0.5, 1.0, 1.0, 1.0], abs=1e-12)


@pytest.mark.parametrize("rest", [True, False])
def test_two_stops_of_a_mass_that_varies(rest: bool) -> None:
    """The track x, x^2 / 2 between two stops: impacts push with 1 / (1 + x^2)."""

    def between(push: Callable[[Any], Any]) -> ns.System:
        return ns.System(
            states=["x", "v"],
            parameters={"e": 0.5},
            modes={"all": lambda t, u, p: (u.v, -u.x * u.v**2 / (1 + u.x**2))},
            elements={
                "right": Stop(
                    gap=lambda t, u, p: 1 - u.x, on={"v": lambda t, u, p: -push(u)}, restitution="e", rest=rest
                ),
                "left": Stop(gap=lambda t, u, p: 1 + u.x, on={"v": lambda t, u, p: push(u)}, restitution="e"),
            },
        )

    run = ns.simulate(between(lambda u: 1 / (1 + u.x**2)), duration=3.0, start={"v": 1.0})
    length = (np.sqrt(2) + np.arcsinh(1)) / 2  # of the track from 0 to 1: (1 + x^2) v^2 is kept
    assert run["crossing_time"].values[:1] == pytest.approx([length], abs=1e-9)
    assert run["u_after"].values[0] == pytest.approx([1.0, -0.5 / np.sqrt(2)], abs=1e-9)


def test_an_elastic_contact_without_a_damper_acts_on_any_state() -> None:
    """x' = -x + F with F = -3 (x - 1) above 1: decay with the rate 4 down to x = 1, then with the rate 1."""
    diode = ns.System(
        states=["x"],
        parameters={},
        modes={"all": lambda t, u, p: (-u.x,)},
        elements=[Backlash(displacement=lambda t, u, p: u.x, on={"x": 1.0}, half_width=1.0, stiffness=3.0)],
    )
    run = ns.simulate(diode, duration=2.0, start={"x": 2.0})
    turn = np.log((2 - 0.75) / (1 - 0.75)) / 4  # x = 3/4 + (2 - 3/4) exp(-4 t)
    assert run["crossing_time"].values[-1] == pytest.approx(turn, rel=1e-13)
    assert float(run["u"][-1, 0]) == pytest.approx(np.exp(-(2.0 - turn)), rel=1e-12)


def test_a_block_rests_on_two_feet_and_tips_over_one() -> None:
    """Forces of two contacts at once: equilibrium of a bar on two supports under a load that moves out.

    Height h and angle of a bar of mass 1 and inertia 1 on feet at -1 and 1, loaded by g = 1 and a moment a t: the feet
    bear (1 -+ a t) / 2, and one of them opens at a t = 1."""
    bar = ns.mechanical(
        np.eye(2),
        np.zeros((2, 2)),
        np.zeros((2, 2)),
        coordinates=["h", "angle"],
        parameters={"a": 0.5},
        forcing={"h": lambda t, p: -1.0, "angle": lambda t, p: p.a * t},
        elements={"left": Stop(at={"h": 1, "angle": 1}, side=-1), "right": Stop(at={"h": 1, "angle": -1}, side=-1)},
    )
    run = ns.simulate(bar, duration=1.9, samples=20)
    t = run["time"].values
    assert np.allclose(run["left_force"].values[1:], 0.5 * (1 - 0.5 * t[1:]), atol=1e-13)
    assert np.allclose(run["right_force"].values[1:], 0.5 * (1 + 0.5 * t[1:]), atol=1e-13)
    assert abs(run["u"].values).max() < 1e-13
    run = ns.simulate(bar, duration=2.5)
    assert run["crossing_time"].values[-1] == pytest.approx(2.0, rel=1e-13)
    assert bar.modes[int(run["mode"][-1])] == "left_open_right_rest"


def test_the_papers_oscillator_is_one_elastic_stop() -> None:
    """A support that relaxes at once (Savi et al. 2007): the same motion as by modes and transitions."""
    paper = ns.models.discontinuous_support()
    p = paper.values
    stop = ElasticStop(
        gap=lambda t, u, p: p.g - u.x, on={"v": lambda t, u, p: -1 / p.m}, stiffness="k_s", damping="c_s"
    )
    own = ns.System(
        states=["x", "v"],
        parameters=dict(p),
        elements={"support": stop},
        scale=dict(paper.scale),
        modes={"free": lambda t, u, p: (u.v, (p.rho * np.cos(p.omega * t) - 2 * p.k * u.x - p.c * u.v) / p.m)},
    )
    a, b = (ns.poincare(one, n=50, transient=50)["section"].values for one in (paper, own))
    assert np.allclose(a, b, atol=1e-11 * abs(a).max())


def test_backlash_and_preload_by_energy() -> None:
    """Free motion without damping keeps the energy; its period is that of the pieces in closed form."""
    play = ns.mechanical(1.0, 0.0, 0.0, elements=[Backlash(at="q", half_width=0.5, stiffness=4.0)])
    run = ns.simulate(play, duration=20.0, start={"v_q": 1.0})
    period = 4 * 0.5 + 2 * np.pi / 2.0
    assert np.allclose(np.diff(run["crossing_time"].values[::4]), period, rtol=1e-13)
    loaded = ns.mechanical(1.0, 0.0, 0.0, elements=[PreloadedSpring(at="q", preload=1.0, stiffness=1.0)])
    run = ns.simulate(loaded, duration=20.0, start={"v_q": 1.0})
    quarter = np.pi / 4  # from q = 0 at the speed 1: q = sqrt(2) sin(t + pi/4) - 1 turns at t = pi / 4
    assert np.allclose(np.diff(run["crossing_time"].values), 2 * quarter, rtol=1e-13)
    assert np.allclose(abs(run["u_before"].values[:, 1]), 1.0, rtol=1e-13)


def test_the_text_of_a_system_with_elements_is_read_back() -> None:
    system = shaken()
    again = ns.System.from_text(system.to_text())
    assert again == system
    assert again.modes == ("stop_open", "stop_rest")


def test_a_contact_written_by_hand_lifts_off_where_its_force_vanishes() -> None:
    """At x = 0, where the force is a harmonic alone and all else is zero; no margin helps the decision."""

    def flight(t: Any, u: Any, p: Any) -> Any:
        return u.v, np.cos(p.w * t) - u.x - p.c * u.v

    plastic = ns.System(
        states=["x", "v"],
        parameters={"w": 0.3, "c": 0.1},
        modes={"flight": flight, "contact": ns.Mode(lambda t, u, p: (0 * u.x,), states=["x"])},
        indicators={"stop": lambda t, u, p: u.x, "pressing": lambda t, u, p: np.cos(p.w * t) - u.x},
        transitions=[
            ns.Transition("flight", "contact", when="stop > 0", reset=lambda t, u, p: (0.0,)),
            ns.Transition("contact", "flight", when="pressing < 0", reset=lambda t, u, p: (0.0, 0.0)),
        ],
    )
    found = ns.sweep(plastic, "w", np.linspace(0.15, 2.5, 41), start={"x": -0.5}, progress=False)
    assert (found["status"] == 0).all()
    run = ns.simulate(plastic, periods=1, start={"x": -0.5})
    off = run["crossing_time"].values[run["crossing_transition"].values == 1][0]
    assert off == pytest.approx(np.pi / 0.6, rel=1e-14)


def test_a_restitution_that_is_a_parameter_stays_between_0_and_1() -> None:
    """At the door, when it is changed, in a sweep, and in a system that was read from text."""
    for system in (shaken(), ns.System.from_text(shaken().to_text())):
        with pytest.raises(ns.SystemDefinitionError, match=r"e = 1\.5: restitution of element 'stop' lies"):
            system.with_parameters(e=1.5)
        with pytest.raises(ns.SystemDefinitionError, match="e = -0.5: restitution"):
            ns.sweep(system, "e", [0.5, -0.5], progress=False)


def test_a_law_of_the_speed_may_be_any_callable() -> None:
    """Friction c v given with its coefficient bound before is a damper: v = exp(-c t)."""

    def law(c: float, v: Any, p: Any) -> Any:
        return c * v

    sled = ns.mechanical(1.0, 0.0, 0.0, elements=[Coulomb(at="q", friction=partial(law, 0.5), static=0.1)])
    run = ns.simulate(sled, duration=2.0, start={"v_q": 1.0}, samples=2)
    assert run["u"].values[-1, 1] == pytest.approx(np.exp(-1.0), rel=1e-13)


def test_indicators_are_called_after_the_element_whose_they_are() -> None:
    """Also where two elements meet at the same place."""
    both = ns.mechanical(
        1.0,
        0.0,
        1.0,
        elements={"soft": ElasticStop(at="q", position=0.1, stiffness=1.0), "wall": Stop(at="q", position=0.1)},
    )
    jump = next(t for t in both.transitions if t.source != t.target and "rest" in both.modes[t.target])
    assert {both.indicators[row.indicator].split("_")[0] for row in jump.rows} == {"wall"}


def test_what_is_refused_says_what_to_write() -> None:
    with pytest.raises(ns.SystemDefinitionError, match=r"give gap= .* and on="):
        Stop(restitution=0.5)
    with pytest.raises(ns.SystemDefinitionError, match="between 0 and 1"):
        Stop(at="q", restitution=1.5)
    with pytest.raises(ns.SystemDefinitionError, match="at= .* and gap= exclude each other"):
        Stop(at="q", gap=lambda t, u, p: 1.0 - u.q)
    with pytest.raises(ns.SystemDefinitionError, match="nearest|parameters"):
        ns.mechanical(1.0, 0.0, 1.0, parameters={"mu": 0.1}, elements=[Coulomb(at="q", friction="mue")])
    with pytest.raises(ns.SystemDefinitionError, match="coordinate"):
        ns.mechanical(1.0, 0.0, 1.0, elements=[Coulomb(at="x", friction=0.1)])
    with pytest.raises(ns.SystemDefinitionError, match="shape"):
        ns.mechanical(np.eye(2), np.eye(3), np.eye(2))
    for mass in (np.zeros((2, 2)), -np.eye(2), [[1.0, 2.0], [2.0, 1.0]]):
        with pytest.raises(ns.SystemDefinitionError, match="positive definite"):
            ns.mechanical(mass, np.eye(2), np.eye(2))
    with pytest.raises(ns.SystemDefinitionError, match="not symmetric"):
        ns.mechanical([[1.0, 0.1], [0.2, 1.0]], np.eye(2), np.eye(2))
    with pytest.raises(ns.SystemDefinitionError, match="inverted"):
        ns.mechanical(lambda p: [[p.m, p.m], [p.m, p.m]], np.eye(2), np.eye(2), parameters={"m": 1.0})
    with pytest.raises(ns.SystemDefinitionError, match="at= is for ns.mechanical"):
        ns.System(states=["x"], parameters={}, modes={"a": lambda t, u, p: (-u.x,)}, elements=[Stop(at="x")])


def test_multipliers_through_stick_and_rest() -> None:
    """Against differences of the map over one period, where the orbit sticks and, with a stop, also rests."""
    rig = ns.mechanical(
        np.diag([1.0, 0.5]),
        [[0.1, -0.05], [-0.05, 0.05]],
        [[2.0, -1.0], [-1.0, 1.0]],
        parameters={"w": 0.7},
        forcing={"q1": lambda t, p: np.cos(p.w * t)},
        elements={
            "rub": Coulomb(at="q1", friction=0.5, static=0.6),
            "wall": Stop(at="q2", position=0.5, restitution=0.3),
        },
    )
    orbit = ns.find_orbit(rig)
    start = orbit.to_dataset()["section"].values.reshape(-1, 4)[0]
    visited = set(np.array(rig.modes)[ns.simulate(rig, periods=1, start=start, samples=200)["mode"].values])
    assert any("stick" in mode for mode in visited) and any("rest" in mode for mode in visited)
    columns = []
    for k in range(4):
        ends = [
            ns.poincare(rig, n=1, start=start + sign * 1e-6 * np.eye(4)[k])["section"].values[0] for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / 2e-6)
    expected = np.linalg.eigvals(np.array(columns).T)
    found = np.asarray(orbit.floquet_multipliers)
    assert np.allclose(np.sort(abs(found)), np.sort(abs(expected)), atol=1e-6)


def test_a_system_is_printed_with_its_elements_as_they_were_given() -> None:
    rig = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"mu": 0.3, "w": 2.0},
        elements={
            "f": Coulomb(at="q", friction="mu", belt=-0.5),
            "s": Stop(at="q", position=-0.2, side=-1),
            "g": Coulomb(at={"q": 2}, friction=lambda v, p: p.mu / (1 + v), belt=lambda t, u, p: np.sin(p.w * t)),
        },
    )
    lines = [line.strip() for line in str(rig).splitlines()]
    assert 'elements    f: Coulomb(at="q", belt=-0.5, friction="mu")' in lines
    assert 's: Stop(at="q", position=-0.2, side=-1)' in lines
    assert 'g: Coulomb(at={"q": 2}, belt=sin(w*t), friction=mu/(1 + v))' in lines
    assert "v_q' = -q - 0.1*v_q" in lines and len(lines) < 14
    assert "->" not in str(rig) and "->" in rig.summary(verbose=True)
    assert "indicator s_gap" in rig.summary(verbose=True) and "s_gap" not in rig.summary()
    every = rig.summary(verbose=True).splitlines()
    shown = [line.split()[1].rstrip(":") for line in every if line.startswith("  mode ")]
    assert sorted(shown) == sorted(rig.written_out().modes)
    ball = shaken()
    assert 'stop: Stop(gap=d - x, on={"v": -1.0}, restitution="e")' in str(ball)
    assert str(ns.System.from_text(ball.to_text())) == str(ball)


def test_messages_name_the_element_and_what_is_allowed() -> None:
    floor = {"floor": Stop(at="x", position=-1.0)}
    below = ns.mechanical(1.0, 0.1, 1.0, parameters={}, elements=floor, coordinates=["x"])
    with pytest.raises(ns.SolveError, match=r"a stop: 'floor', Stop\(at=\"x\", position=-1.0\).*-1 there.*side=-1"):
        ns.simulate(below, duration=1.0)
    with pytest.raises(TypeError, match=r"`pos` is not an option of Stop; nearest: position; all: at, belt, creep"):
        Stop(pos=1)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"Coulomb takes no arguments by position"):
        Coulomb("q")  # type: ignore[misc]


def test_a_mechanical_system_takes_names_of_parameters() -> None:
    named = ns.mechanical("m", [["c"]], "k", parameters={"m": 2.0, "c": 0.1, "k": 3.0, "F": 1.5}, forcing={"q": "F"})
    plain = ns.mechanical(2.0, 0.1, 3.0, parameters={}, forcing={"q": 1.5})
    runs = [ns.simulate(system, duration=3.0, samples=5)["u"].values for system in (named, plain)]
    assert np.allclose(*runs, rtol=0, atol=1e-14)
    with pytest.raises(ns.SystemDefinitionError, match=r"`d` is not a parameter of .*; all: c, k"):
        ns.mechanical(1.0, "d", "k", parameters={"c": 0.1, "k": 3.0})


def test_small_numbers_without_scales_are_warned_of() -> None:
    """All lengths 1e-7: impacts are slower than the rest speed of the scales 1."""

    def system(**scale: Any) -> ns.System:
        return ns.mechanical(
            1.0,
            0.2,
            0.0,
            parameters={"w": 1.0},
            forcing={"q": lambda t, p: 1e-7 * np.cos(p.w * t)},
            **scale,
            elements={"s": Stop(at="q", position=1e-7, restitution=0.5)},
        )

    def large(t: Any, p: Any) -> Any:
        return np.cos(p.w * t)

    for verb in (partial(ns.simulate, periods=3), partial(ns.poincare, n=3), partial(ns.lyapunov, periods=40)):
        with pytest.warns(UserWarning, match=r"told from rest.*System\(scale=\{'q': .*'v_q'"):
            verb(system())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = ns.simulate(system(scale={"q": 1e-7, "v_q": 1e-7}), periods=3)
    true = ns.simulate(
        ns.mechanical(
            1.0,
            0.2,
            0.0,
            parameters={"w": 1.0},
            forcing={"q": large},
            elements={"s": Stop(at="q", position=1.0, restitution=0.5)},
        ),
        periods=3,
    )
    assert run["u"].values[-1] * 1e7 == pytest.approx(true["u"].values[-1], rel=1e-9)


@pytest.mark.parametrize("impacts", ["simultaneous", "sequential"])  # modes written out, and made when visited
def test_what_sticks_or_rests_keeps_no_speed(impacts: str) -> None:
    """Exactly none, whatever the mass: what rounding leaves would decide where a load is as large as the friction."""
    for mass in (0.838, 2.4734, 0.41010313678540405):
        walls = {"up": Stop(at="q", position=0.5), "down": Stop(at="q", position=-0.8, side=-1, restitution=0.4)}
        system = ns.mechanical(
            mass,
            0.3,
            1.0,
            parameters={},
            forcing={"q": lambda t, p: 2.0 * np.cos(0.7 * t)},
            impacts=impacts,
            elements={"rub": Coulomb(at="q", friction=0.6), **walls},
        )
        run = ns.simulate(system, periods=6, start={"q": 0.1})
        held = [
            any(word in system.modes[system.transitions[k].target] for word in ("stick", "rest"))
            for k in run.crossing_transition.values
        ]
        assert sum(held) > 4
        assert not run.u_after.values[held, 1].any()


def test_a_belt_that_is_written_to_memory_at_an_instant_turns_no_mass() -> None:
    """Friction 0.2 and a drag of 0.01 on a mass of 1: v' = -0.01 v - 0.2, then + 0.2; no force is an impulse."""
    system = ns.System(
        states=["v"],
        parameters={"mu": 0.2},
        memory={"belt": (-1.0, "")},
        modes={"all": lambda t, u, p: (-0.01 * u.v,)},
        period=4.0,
        transitions=[ns.Transition("all", "all", at=0.5, write={"belt": lambda t, u, p: 1.5 + 0.0 * t})],
        elements={"rub": Coulomb(speed=lambda t, u, p: u.v - p.belt, friction="mu", on={"v": 1.0})},
    )

    def later(v: float, force: float, time: float) -> float:
        return force / 0.01 + (v - force / 0.01) * np.exp(-0.01 * time)

    for begins, turned in ((0.0, later(0.0, -0.2, 2.0)), (-1.0, -1.0)):  # it slips, and it sticks to the belt before
        run = ns.simulate(system, duration=3.0, start={"v": begins})
        assert run.u_after.values[:, 0] == pytest.approx([turned, turned], abs=1e-12)
        assert run.u.values[-1, 0] == pytest.approx(later(turned, 0.2, 1.0), abs=1e-12)


def test_a_support_lets_go_of_what_a_reset_has_moved_away() -> None:
    """Its damper would push a mass that comes back fast, and the gap is open."""
    system = ns.System(
        states=["x", "v"],
        parameters={"k": 100.0, "c": 5.0},
        modes={"all": lambda t, u, p: (u.v, 0.0)},
        period=1.0,
        transitions=[ns.Transition("all", "all", at=0.6, reset=lambda t, u, p: (-0.01, 1.0))],
        elements={"wall": ElasticStop(gap=lambda t, u, p: -u.x, on={"v": -1.0}, stiffness="k", damping="c")},
    )
    run = ns.simulate(system, duration=0.605, start={"x": -0.5, "v": 1.0})
    assert run.wall_force.values.max() > 4.0  # it was in contact before
    assert run.u.values[-1] == pytest.approx([-0.005, 1.0], abs=1e-12)
    assert run.wall_force.values[-1] == 0.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"outputs": {"floor_force": lambda t, u, p: u.x}}, "an output and to a load of an element"),
        ({"outputs": {"floor_impulse": lambda t, u, p: u.x}}, "an output and to a load of an element"),
        ({"indicators": {"floor_gap": lambda t, u, p: u.x - 1.0}}, "an indicator and to a condition of an element"),
    ],
)
def test_what_is_called_as_something_of_an_element_is_refused(given: dict[str, Any], said: str) -> None:
    """One of the two would stand for both: a switch at a height of 1 would be one at the floor."""
    ball: dict[str, Any] = {"states": ["x", "v"], "parameters": {"e": 0.5}, "modes": {"fly": lambda t, u, p: (u.v, -1)}}
    floor = Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution="e")
    with pytest.raises(ns.SystemDefinitionError, match=said):
        ns.System(**ball, **given, elements={"floor": floor})


def test_the_friction_at_a_stop_is_no_other_element() -> None:
    elements = {"a": Stop(at="x", position=1.0, friction=0.3, tangent="y"), "a_friction": Coulomb(at="x", friction=0.1)}
    with pytest.raises(ns.SystemDefinitionError, match="'a_friction' is the name of an element and of the friction"):
        ns.mechanical(np.eye(2), np.eye(2), np.eye(2), coordinates=["x", "y"], elements=elements)


def test_the_table_of_a_system_shows_what_stands_beside_its_elements() -> None:
    """The user's own switch, also where it begins with the name of an element, and a surface, each once."""
    system = ns.System(
        states=["x", "v", "y"],
        parameters={},
        modes={"low": lambda t, u, p: (u.v, -u.x, 1.0), "high": lambda t, u, p: (u.v, -u.x, -1.0)},
        indicators={"rub_top": lambda t, u, p: u.x - 1.0, "rub_plane": lambda t, u, p: u.y},
        transitions=[
            ns.Surface("rub_plane", "low", "high"),
            ns.Transition("low", "high", when="rub_top > 0 and rub_plane < 0"),
        ],
        elements={"rub": Coulomb(speed=lambda t, u, p: u.v, friction=0.1, on={"v": 1.0})},
    )
    lines = [" ".join(line.split()) for line in str(system).splitlines()]
    assert "indicator rub_top -1 + x" in lines and not any("rub_speed" in line for line in lines)
    assert sum("crossed or slid on" in line for line in lines) == 1
    assert not any("rub_stick" in line for line in lines)
    assert [line for line in lines if "mode" in line[:4]][:2] == ["mode low x' = v", "mode high x' = v"]


def test_the_table_of_a_system_shows_its_own_transitions_beside_elements() -> None:
    floor = Stop(gap=lambda t, u, p: u.x, on={"v": 1.0}, restitution=0.5)
    system = ns.System(
        states=["x", "v"],
        parameters={},
        modes={"fly": lambda t, u, p: (u.v, -1.0)},
        indicators={"top": lambda t, u, p: u.x - 1.0},
        transitions=[ns.Transition("fly", "fly", when="top > 0", reset=lambda t, u, p: (u.x, -u.v))],
        elements={"floor": floor},
    )
    assert "fly -> fly  when top > 0, reset v := -v" in str(system)
