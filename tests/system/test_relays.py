"""Surfaces that add up as relays: a twisting controller comes to rest where its surfaces meet."""

import numpy as np
import pytest

import nonsmooth as ns


def quadrants(g, h, pp, pm, mp, mm):
    """The surfaces between four modes, by the signs of two indicators."""
    return [
        ns.Surface(g, below=mp, above=pp),
        ns.Surface(g, below=mm, above=pm),
        ns.Surface(h, below=pm, above=pp),
        ns.Surface(h, below=mm, above=mp),
    ]


def twisting(load=0.0, r1=10.0, r2=3.0):
    """x1' = x2, x2' = load - r1 sgn x1 - r2 sgn x2, as four modes and two surfaces."""

    def field(a, b):
        return lambda t, u, p: (u.x2, load - r1 * a - r2 * b)

    sides = {"pp": (1, 1), "pm": (1, -1), "mp": (-1, 1), "mm": (-1, -1)}
    return ns.System(
        name="twisting controller",
        states=["x1", "x2"],
        parameters={},
        modes={key: field(*s) for key, s in sides.items()},
        indicators={"h1": lambda t, u, p: u.x1, "h2": lambda t, u, p: u.x2},
        transitions=quadrants("h1", "h2", "pp", "pm", "mp", "mm"),
    )


@pytest.mark.parametrize("speed", [1.0, -0.5])
def test_speed_falls_by_the_closed_form_and_both_surfaces_hold(speed):
    """From x1 = 0 each half turn takes |x2| down by sqrt(7/13); the sum of all of them ends at a finite time."""
    system = twisting()
    run = ns.simulate(system, duration=1.0, start={"x2": speed})
    at_zero = np.abs(run.u_before[:, 0].values) < 1e-14
    speeds = np.abs(run.u_before[:, 1].values[at_zero])
    assert len(speeds) > 40
    np.testing.assert_allclose(speeds[1:30] / speeds[:29], np.sqrt(7 / 13), rtol=1e-9)
    half = abs(speed) * (1 / 13 + 1 / np.sqrt(91))  # out and back
    assert float(run.crossing_time[-1]) == pytest.approx(half / (1 - np.sqrt(7 / 13)), abs=2e-7)
    assert system.modes[int(run.mode[-1])] == "h1_h2_sliding"
    np.testing.assert_allclose(run.u[-1], 0.0, atol=1e-12)


@pytest.mark.parametrize(("load", "holds"), [(12.9, True), (13.1, False)])
def test_it_holds_against_what_both_relays_can_bear(load, holds):
    run = ns.simulate(twisting(load), duration=1.0)
    assert float(run.u[-1, 0]) == pytest.approx(0.0 if holds else 0.05, abs=1e-12)


def test_surfaces_of_relative_degree_one_stay_filippovs():
    """Two planes that both attract: the declared construction, with its names."""

    def field(a, b):
        return lambda t, u, p: (-a, -2 * b)

    system = ns.System(
        states=["x", "y"],
        parameters={},
        modes={"a": field(1, 1), "b": field(1, -1), "c": field(-1, 1), "d": field(-1, -1)},
        indicators={"h": lambda t, u, p: u.x, "g": lambda t, u, p: u.y},
        transitions=quadrants("h", "g", "a", "b", "c", "d"),
    )
    assert len(system.surfaces) == 4
    assert "h_g_sliding" in system.modes


def test_a_saved_run_is_read_back(tmp_path):
    run = ns.simulate(twisting(), duration=0.1, start={"x2": 1.0})
    ns.save(run, tmp_path / "run.nc")
    assert ns.load(tmp_path / "run.nc").equals(run)


def with_strengths():
    def field(a, b):
        return lambda t, u, p: (u.x2, p.load - p.r1 * a - p.r2 * b)

    return ns.System(
        states=["x1", "x2"],
        parameters={"r1": 10.0, "r2": 3.0, "load": 0.0},
        modes={"pp": field(1, 1), "pm": field(1, -1), "mp": field(-1, 1), "mm": field(-1, -1)},
        indicators={"h1": lambda t, u, p: u.x1, "h2": lambda t, u, p: u.x2},
        transitions=quadrants("h1", "h2", "pp", "pm", "mp", "mm"),
    )


@pytest.mark.parametrize(("load", "holds"), [(8.9, True), (9.1, False)])
def test_strengths_that_changed_since_the_definition_hold_what_they_can_bear(load, holds):
    run = ns.simulate(with_strengths().with_parameters(r1=4.0, r2=5.0, load=load), duration=1.0)
    assert float(run.u[-1, 0]) == pytest.approx(0.0 if holds else 0.05, abs=1e-12)


def test_a_relay_that_would_push_away_is_refused():
    system = with_strengths()
    assert system.with_parameters(r1=4.0).values["r1"] == 4.0
    with pytest.raises(ns.SystemDefinitionError, match="relay at 'h1' pushes towards its surface"):
        system.with_parameters(r1=-1.0)
    again = ns.System.from_text(system.to_text())
    assert again.to_text() == system.to_text()
