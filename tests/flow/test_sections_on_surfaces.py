"""Sections on the surface of a motion that slides or rests on it: a return is an arrival, not what rounding does there.

The arrivals are counted in the log of the same run.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

PERIODS = 12
ELEMENT = {"w": 0.4, "d": 0.3}


def block(speed: str) -> ns.System:
    """A forced block on a belt whose speed is constant, or swings with the forcing."""
    belt = (lambda t, p: p.v_b) if speed == "constant" else (lambda t, p: p.v_b * np.sin(p.omega * t))
    rest = lambda t, u, p: p.A * np.cos(p.omega * t) - u.x - 0.1 * u.v
    return ns.System(
        name="block on a belt",
        states=["x", "v"],
        parameters={"A": 0.6, "omega": 0.7, "F": 0.5, "v_b": 0.3},
        modes={
            "slower": lambda t, u, p: (u.v, rest(t, u, p) + p.F),
            "faster": lambda t, u, p: (u.v, rest(t, u, p) - p.F),
        },
        indicators={"slip": lambda t, u, p: u.v - belt(t, p)},
        transitions=[ns.Surface("slip", below="slower", above="faster", mode="stick")],
    )


def arrivals(system: ns.System, sources: tuple[str, ...], method: str) -> Any:
    run = ns.simulate(system, periods=PERIODS, transient=20, method=method)
    from_there = [system.transitions[i].label.split(" -> ")[0] in sources for i in run.crossing_transition.values]
    return run.crossing_time.values[from_there]


@pytest.mark.parametrize("method", ["auto", "taylor"])
@pytest.mark.parametrize("speed", ["constant", "swings"])
def test_each_arrival_at_a_belt_is_one_return(speed: str, method: str) -> None:
    base = block(speed)
    for v_b in np.linspace(0.05, 0.6, 12):
        system = base.with_parameters(v_b=v_b)
        ends = [k * system.period() for k in (20, 20 + PERIODS)]
        for rising, sources in ((True, ("slower",)), (False, ("faster",)), (None, ("slower", "faster"))):
            known = arrivals(system, sources, method)
            if not len(known):
                continue
            many = ns.poincare(system, section=ns.Poincare("slip", rising=rising), n=300, method=method).time.values
            assert many[-1] > ends[1]
            np.testing.assert_allclose(many[(many >= ends[0]) & (many < ends[1])], known, rtol=1e-9)


def test_a_contact_that_rests_is_met_at_its_impacts() -> None:
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters=ELEMENT,
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"stop": ns.elements.Stop(at="q", position="d", restitution=0.5, creep=1e-4)},
    )
    known = arrivals(system, ("stop_open",), "auto")
    ends = [k * system.period() for k in (20, 20 + PERIODS)]
    many = ns.poincare(system, section=ns.Poincare("stop_gap", rising=False), n=1000).time.values
    assert many[-1] > ends[1]
    np.testing.assert_allclose(many[(many >= ends[0]) & (many < ends[1])], known, rtol=1e-9)


def test_a_sweep_of_the_stick_slip_belt_finds_one_return_per_cycle_everywhere() -> None:
    values = np.linspace(0.12, 0.28, 600)[[193, 194, 373, 416, 422, 470]]
    swept = ns.sweep(
        ns.models.stick_slip_belt(),
        "v_b",
        values,
        direction="down",
        start=[0.1, 0.1],
        section=ns.Poincare("relative"),
        progress=False,
    )
    assert (swept.period_number.values == 1).all()


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_an_impact_passes_its_stop_both_ways(method: str) -> None:
    ball = ns.models.impact_oscillator(omega=0.8, A=0.5)
    times = [
        ns.poincare(ball, section=ns.Poincare("stop", rising=rising), n=6, transient=50, method=method).time.values
        for rising in (True, False, None)
    ]
    np.testing.assert_allclose(times[1], times[0], rtol=1e-12)
    np.testing.assert_allclose(times[2], times[0], rtol=1e-12)


E, load = ns.elements, {"q": lambda t, p: np.cos(p.w * t)}


@pytest.mark.parametrize("method", ["auto", "taylor"])
@pytest.mark.parametrize(
    ("element", "surface", "plane", "way"),
    [
        (E.Coulomb(at="q", friction=0.1), "one_speed", lambda t, u, p: 3 * u.v_q, 1),
        (E.Coulomb(at="q", friction=0.4, belt=0.3), "one_speed", lambda t, u, p: u.v_q - 0.3, 1),
        (E.ElasticStop(at="q", position=0.5, stiffness=9.0), "one_gap", lambda t, u, p: u.q - 0.5, -1),
        (E.ElasticStop(at="q", position=0.5, stiffness=9.0, damping=0.4), "one_gap", lambda t, u, p: u.q - 0.5, -1),
        (E.Stop(at="q", position=0.5, restitution=0.5), "one_gap", lambda t, u, p: u.q - 0.5, -1),
        (E.Stop(at="q", position=0.5), "one_gap", lambda t, u, p: 2 * u.q - 1.0, -1),
    ],
)
def test_a_plane_of_ones_own_where_an_element_has_its_surface(element, surface, plane, way: int, method: str) -> None:
    """Both vanish together, so that both are passed at the same instants."""
    mass = ns.mechanical(
        1.0, 0.1, 1.0, parameters={"w": 0.6}, forcing=load, elements={"one": element}, indicators={"own": plane}
    )
    for rising in (True, False, None):
        own, known = (
            ns.poincare(mass, section=ns.Poincare(name, rising=up), n=12, method=method).time.values
            for name, up in (("own", rising), (surface, rising if rising is None or way > 0 else not rising))
        )
        np.testing.assert_allclose(own, known, rtol=1e-9)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_plastic_impact_passes_its_stop_both_ways_where_the_mass_is_drawn_off(method: str) -> None:
    mass = ns.mechanical(
        1.0, 0.1, 1.0, parameters={"w": 0.6}, forcing=load, elements={"one": E.Stop(at="q", position=0.5)}
    )
    run = ns.simulate(mass, duration=60.0, method=method)
    labels = np.array([mass.transitions[k].label for k in run.crossing_transition.values])
    for rising, met in ((True, ("one_open -> one_open",)), (False, ("one_open -> one_open", "one_open -> one_rest"))):
        known = run.crossing_time.values[np.isin(labels, met)]
        found = ns.poincare(mass, section=ns.Poincare("one_gap", rising=rising), n=len(known), method=method)
        np.testing.assert_allclose(found.time.values, known, rtol=1e-9)


@pytest.mark.parametrize("method", ["auto", "taylor"])
@pytest.mark.parametrize("rising", [True, False, None])
def test_a_mass_that_its_belt_carries_into_a_stop_meets_it_there(rising: bool | None, method: str) -> None:
    """It rides at 1/5 for 3/10: what the stop and the belt then do is decided together."""
    elements = {
        "belt": E.Coulomb(at="q", belt=0.2, friction=0.3),
        "stop": E.Stop(at="q", position=0.3, restitution=0.8),
    }
    mass = ns.mechanical(1.0, 0.0, 0.1, elements=elements, indicators={"own": lambda t, u, p: 3 * u.q - 0.1})
    section, start = ns.Poincare("stop_gap", rising=rising), {"v_q": 0.2}
    found = ns.poincare(mass, section=section, n=4, start=start, method=method)
    run = ns.simulate(mass, duration=float(found.time[-1]) + 1e-9, start=start, method=method)
    struck = run.crossing_time.values[run.stop_impact_speed.values > 0]
    assert struck[0] == pytest.approx(1.5, abs=1e-12)
    np.testing.assert_allclose(found.time.values, struck, rtol=1e-9)
