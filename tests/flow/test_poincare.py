"""Sections against motions whose passages are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from linear_flow import LinearFlow

import nonsmooth as ns
from nonsmooth.flow.sections import section_plan

METHODS = {"exact": {}, "taylor": {"rtol": 1e-13}, "rkf45": {"rtol": 1e-13}}


def harmonic() -> ns.System:
    """x = cos t: x'' = -x in two modes, left and right of x = 0.5."""

    def motion(t, u, p):
        return u.v, -p.k * u.x

    return ns.System(
        states=["x", "v"],
        parameters={"k": 1.0},
        modes={"left": motion, "right": motion},
        indicators={
            "side": lambda t, u, p: u.x - 0.5,
            "speed": lambda t, u, p: u.v,
            "level": lambda t, u, p: u.x + 0.2,
        },
        transitions=[ns.Transition("left", "right", when="side > 0"), ns.Transition("right", "left", when="side < 0")],
    )


LEVEL = np.arccos(-0.2)  # x = -0.2 falling at LEVEL, rising at 2 pi - LEVEL


@pytest.fixture(scope="module")
def swing() -> ns.System:
    return harmonic()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("section", "first", "spacing"),
    [
        (ns.Poincare("level"), [2 * np.pi - LEVEL], 2 * np.pi),
        (ns.Poincare("level", rising=False), [LEVEL], 2 * np.pi),
        (ns.Poincare("level", rising=None), [LEVEL, 2 * np.pi - LEVEL], 2 * np.pi),
        (ns.Poincare("level", every=3), [6 * np.pi - LEVEL], 6 * np.pi),
        (ns.Poincare("level", rising=None, every=2), [2 * np.pi - LEVEL], 2 * np.pi),
        (ns.Poincare("speed"), [np.pi], 2 * np.pi),
        (ns.Poincare("speed", rising=None, mode="left"), [np.pi], 2 * np.pi),
        (ns.Poincare("speed", rising=None, mode="right"), [2 * np.pi], 2 * np.pi),
        (ns.Poincare("speed", rising=False), [2 * np.pi], 2 * np.pi),
        (ns.Poincare("side"), [2 * np.pi - np.pi / 3], 2 * np.pi),
        (ns.Poincare("side", rising=None), [np.pi / 3, 5 * np.pi / 3], 2 * np.pi),
        (ns.Poincare("side", rising=None, mode="right"), [5 * np.pi / 3], 2 * np.pi),
        (ns.Poincare("side", rising=None, mode="right", side="before"), [np.pi / 3], 2 * np.pi),
        (ns.Poincare("side", rising=True, mode="left"), None, None),
    ],
    ids=str,
)
def test_passages_of_a_harmonic_motion(section, first, spacing, method: str, swing: ns.System) -> None:
    """x = cos t from t = 0: the start, where the speed is zero, is no passage."""
    options = {"section": section, "start": {"x": 1.0}, "method": method, **METHODS[method]}
    if first is None:
        options["section"] = ns.Poincare(section.indicator, section.rising, section.mode, t_max=100.0)
        with pytest.raises(ns.SolveError, match="did not return to the section"):
            ns.poincare(swing, n=3, **options)
        return
    points = ns.poincare(swing, n=3 * len(first), **options)
    times = np.concatenate([np.array(first) + k * spacing for k in range(3)])
    assert np.max(np.abs(points["time"] - times)) < 1e-9
    assert np.max(np.abs(points["section"].values - np.stack([np.cos(times), -np.sin(times)], axis=1))) < 1e-9
    later = ns.poincare(swing, n=len(first), transient=len(first), **options)
    assert np.max(np.abs(later["time"] - times[len(first) : 2 * len(first)])) < 1e-9


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("side", ["before", "after"])
def test_both_limits_on_a_surface_with_a_reset(method: str, side: str) -> None:
    """A ball that bounces with e = 1 on a floor at x = 0: before -v, after v, v = sqrt(2 g h), all periods equal."""
    ball = ns.System(
        states=["x", "v"],
        parameters={"g": 2.0},
        modes={"flight": lambda t, u, p: (u.v, -p.g)},
        indicators={"floor": lambda t, u, p: u.x},
        transitions=[ns.Transition("flight", "flight", when="floor < 0", reset=lambda t, u, p: (u.x, -u.v))],
    )
    section = ns.Poincare("floor", rising=None, side=side)
    points = ns.poincare(ball, section=section, n=5, start={"x": 4.0}, method=method, **METHODS[method])
    assert np.allclose(points["time"], 2.0 * (1 + 2 * np.arange(5)), rtol=1e-12)
    assert np.allclose(points["section"].sel(state="v"), 4.0 if side == "after" else -4.0, rtol=1e-12)
    assert np.max(np.abs(points["section"].sel(state="x"))) < 1e-12


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5, 0.999])
def test_stroboscopic_at_any_phase(method: str, phase: float) -> None:
    """The forced linear motion by closed form; a start at phase 0 is no return."""
    p = {"k": 1.0, "c": 0.1, "omega": 1.3, "A": 0.7, "d": 1e3}
    system = ns.models.impact_oscillator(**p)
    truth = LinearFlow([[0, 1], [-1.0, -0.1]], [0, 0], {1: ([0, 0.7], [0, 0])}, 1.3)
    points = ns.poincare(
        system, section=ns.Stroboscopic(phase), n=4, transient=2, start=[0.4, -0.2], method=method, **METHODS[method]
    )
    times = (phase + np.arange(3, 7) - (1 if phase else 0)) * 2 * np.pi / 1.3
    assert np.allclose(points["time"], times, rtol=1e-14)
    states = np.array([truth.exactly(0.0, (0.4, -0.2), t) for t in times])
    assert np.max(np.abs(points["section"].values - states)) < 1e-11
    assert points["mode"].values.tolist() == [0] * 4


def test_the_default_section_is_stroboscopic_at_phase_zero() -> None:
    system = ns.models.discontinuous_support()
    run = ns.simulate(system, periods=6, samples=7)
    points = ns.poincare(system, n=6)
    times = run["time"].values
    at = [np.flatnonzero(np.isclose(times, k * system.period(), rtol=1e-14))[0] for k in range(1, 7)]
    assert np.max(np.abs(points["section"].values - run["u"].values[at])) < 1e-14


def test_several_starts_are_a_dim() -> None:
    system = ns.models.impact_oscillator(d=1e3, omega=1.3)
    starts = [{"x": 0.1}, {"x": -0.2, "v": 0.3}]
    several = ns.poincare(system, n=3, start=starts)
    assert several["section"].dims == ("start", "iterate", "state")
    assert several["start_state"].values.tolist() == [[0.1, 0.0], [-0.2, 0.3]]
    for k, start in enumerate(starts):
        alone = ns.poincare(system, n=3, start=start)
        assert alone["section"].dims == ("iterate", "state")
        assert np.array_equal(alone["section"].values, several["section"].values[k])


def test_one_start_of_several_may_fail() -> None:
    system = ns.models.impact_oscillator()
    points = ns.poincare(system, n=3, start=[{"x": 0.0}, {"x": 5.0}])
    meanings = points["status"].attrs["flag_meanings"].split()
    assert meanings[int(points["status"][0])] == "ok"
    assert meanings[int(points["status"][1])] == "no_convergence"
    assert np.isfinite(points["section"].values[0]).all()
    with pytest.raises(ns.SolveError):
        ns.poincare(system, n=3, start={"x": 5.0})


def test_a_start_beyond_a_stop_that_moves_back_is_none_among_others_either() -> None:
    mass = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 0.9},
        forcing={"q": lambda t, p: 0.3 * np.cos(p.w * t)},
        elements={
            "stop": ns.elements.Stop(at="q", position=0.5, restitution=0.6),
            "rub": ns.elements.Coulomb(at="q", friction=0.1),
        },
    )
    points = ns.poincare(mass, n=3, start=[{"q": 1.0, "v_q": -0.1}, {"q": 0.0}])
    meanings = points["status"].attrs["flag_meanings"].split()
    assert [meanings[k] for k in points["status"].values] == ["no_convergence", "ok"]
    assert np.isnan(points["section"].values[0]).all() and np.isnan(points["time"].values[0]).all()
    assert np.isfinite(points["section"].values[1]).all()


def test_maxima_of_the_relief_valve_repeat_the_published_cycle() -> None:
    """q = 8: the cycle spans 0.668282564 <= y1 <= 6.009885866 with period 2.392389442 (Hos & Champneys 2012)."""
    valve = ns.models.relief_valve(q=8.0)
    start = {"y1": 3.0, "y2": 0.0, "y3": 13.0}
    top = ns.poincare(valve, section=ns.Poincare("lift_velocity", rising=False), n=3, transient=300, start=start)
    low = ns.poincare(valve, section=ns.Poincare("lift_velocity", rising=True), n=3, transient=300, start=start)
    assert np.allclose(top["section"].sel(state="y1"), 6.009885866, atol=2e-7)
    assert np.allclose(low["section"].sel(state="y1"), 0.668282564, atol=2e-7)
    assert np.allclose(np.diff(top["time"]), 2.392389442, atol=2e-7)


def test_a_valve_that_comes_to_rest_stands_at_its_equilibrium() -> None:
    """Beyond the Hopf point (q = 8.4911) the lift's maxima die out: an equilibrium, and no section is met again."""
    start = {"y1": 0.2, "y2": 0.0, "y3": 10.0}
    top = ns.Poincare("lift_velocity", rising=False)
    options = {"section": top, "start": start, "method": "taylor", "rtol": 1e-10}
    scan = ns.sweep(
        ns.models.relief_valve(),
        "q",
        [8.0, 8.6, 9.0],
        direction=None,
        transient=1024,
        keep=32,
        progress=False,
        **options,
    )
    assert scan["status"].values.tolist() == [0, 0, 0] and scan["period_number"].values.tolist() == [1, 1, 1]
    assert scan["equilibrium"].values.tolist() == ["", "equilibrium in open", "equilibrium in open"]
    y1 = scan["section"].sel(state="y1").values[2, -1]
    assert y1 * np.sqrt(y1 + 10.0) == pytest.approx(9.0, abs=1e-8)  # the flow through the valve is q
    assert np.isclose(scan["maximum"].sel(q=8.0, state="y1"), 6.009885866, atol=2e-7)
    with pytest.raises(ns.SolveError, match="reached an equilibrium"):
        ns.poincare(ns.models.relief_valve(q=9.0), n=1056, **options)


def test_a_linear_motion_at_rest_is_not_waited_for() -> None:
    """x'' + x' + x = 5 is at x = 5 within rounding after a hundred units of time, of the million that there are."""
    modes = {"only": lambda t, u, p: (u.v, 5.0 - u.v - u.x)}
    level = {"level": lambda t, u, p: u.x - 100.0}
    system = ns.System(states=["x", "v"], parameters={}, modes=modes, indicators=level)
    points = ns.poincare(system, section=ns.Poincare("level"), n=1, start=[{"x": 0.0}, {"x": 5.5}])
    assert points["section"].values[:, 0] == pytest.approx(np.array([[5.0, 0.0]] * 2), abs=1e-12)
    assert (points["time"] < 1e4).all()


def test_a_slow_drift_is_no_rest() -> None:
    """x' = 1e-9 reaches the section x = 1e-5 after 10^4 units of time, on steps as long as the waiting."""

    def drift(t, u, p):
        return (1e-9,)

    def level(t, u, p):
        return u.x - 1e-5

    system = ns.System(states={"x": "m"}, parameters={}, modes={"only": drift}, indicators={"level": level})
    points = ns.poincare(system, section=ns.Poincare("level"), n=1, start={"x": 0.0}, method="taylor")
    assert np.isclose(float(points["time"][0]), 1e4, rtol=1e-6)


def test_a_start_beyond_a_stop_is_said_to_be_one() -> None:
    """Not that the section was not met again: the run never began."""
    with pytest.raises(ns.SolveError, match="beyond a stop") as caught:
        ns.poincare(ns.models.impact_oscillator(), n=3, start={"x": 2.0})
    assert caught.value.status == "beyond_stop"


def test_how_long_a_return_is_waited_for(swing: ns.System) -> None:
    """A thousand forcing periods, or a million units of time where there is no forcing, unless ``t_max`` says."""
    support = ns.models.discontinuous_support(omega=4.0)
    section = ns.Poincare("penetration")
    assert section_plan(support, section)[1].t_max == pytest.approx(1000 * 2 * np.pi / 4.0, rel=1e-15)
    assert section_plan(swing, ns.Poincare("speed"))[1].t_max == 1e6
    assert section_plan(swing, ns.Poincare("speed", t_max=3.0))[1].t_max == 3.0


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_every_start_begins_with_the_initial_memory(method: str) -> None:
    """A point that only a kick of the memory's size moves, once a period: by arithmetic. (A second state and a force of
    size 0: a shape of code that is there.)"""
    system = ns.System(
        states=["x", "y"],
        parameters={"A": 0.0, "w": 2 * np.pi},
        memory={"m": 0.3},
        modes={"all": lambda t, u, p: (0.0, p.A * np.cos(p.w * t))},
        transitions=[ns.Transition("all", "all", at=0.5, reset=lambda t, u, p: (u.x + p.m, u.y))],
    )
    found = ns.poincare(system, n=2, start=[[0.0, 0.0], [1.0, 0.0]], method=method)
    assert np.allclose(found["section"].values[..., 0], [[0.3, 0.6], [1.3, 1.6]], atol=1e-12)


def test_steps_of_returns_that_are_only_counted_do_not_add_up() -> None:
    """A section met by whole steps alone, at rest: more than two million segments pass in so many periods."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 0.4},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"stop": ns.elements.Stop(at="q", position=0.3, restitution=0.5, creep=1e-7)},
    )
    found = ns.poincare(system, n=3, transient=300_000)
    assert np.allclose(found.section.values, [0.3, 0.0], atol=1e-15)


@pytest.mark.parametrize("stopped", [False, True])
def test_a_plane_of_a_mechanical_system(stopped: bool) -> None:
    """x = cos t is at x = 1/2 with the speeds -+sqrt(3)/2; an elastic stop beyond its reach changes nothing."""
    stop = {"far": ns.elements.ElasticStop(at="x", position=2.0, stiffness=9.0)}
    mass = ns.mechanical(
        1.0,
        0.0,
        1.0,
        coordinates=["x"],
        elements=stop if stopped else None,
        indicators={"plane": lambda t, u, p: u.x - 0.5},
    )
    for rising, sign in ((True, 1), (False, -1)):
        found = ns.poincare(mass, section=ns.Poincare("plane", rising=rising), n=4, start={"x": 1.0})
        expected = np.tile([0.5, sign * np.sqrt(0.75)], (4, 1))
        assert found["section"].values == pytest.approx(expected, abs=1e-12)
