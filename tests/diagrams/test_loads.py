"""Loads of elements: impulses, impact speeds, energies and work against closed forms; energy in is energy out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.elements import Backlash, Coulomb, ElasticStop, PreloadedSpring, Stop
from nonsmooth.flow.loads import _highest, _rule


def balance(loads: Any) -> Any:
    """Work of forcing and base less what damping, an unsymmetric stiffness and the elements take."""
    names = list(loads)
    given = [loads[name] for name in ("work_of_forcing", "work_of_base") if name in names]
    taken = [loads[name] for name in names if str(name).endswith("_energy")]
    taken += [loads[name] for name in ("work_of_damping", "work_of_stiffness") if name in names]
    return sum(given) - sum(taken)


def between_stops(e: float, m: float = 1.0) -> ns.System:
    """A mass m under m cos t between stops at -1 and 1."""
    return ns.mechanical(
        "m",
        0.0,
        0.0,
        parameters={"m": (m, "kg"), "w": (1.0, "rad/s"), "e": e},
        coordinates={"q": "m"},
        forcing={"q": lambda t, p: p.m * np.cos(p.w * t)},
        elements={
            "right": Stop(at="q", position=1.0, restitution="e"),
            "left": Stop(at="q", position=-1.0, side=-1, restitution="e"),
        },
    )


def speed_between_stops(e: float) -> float:
    """Impact speed v of the symmetric motion with an impact each half period (w = 1): with the phase f of the impact,
    sin f = (1 - e) v / 2 and cos f = pi (1 + e) v / 4 - 1, so that v = 2 b / (a^2 + b^2)."""
    a, b = 0.5 * (1.0 - e), 0.25 * np.pi * (1.0 + e)
    return float(2.0 * b / (a**2 + b**2))


@pytest.mark.parametrize("e", [0.4, 0.5, 0.6])
def test_impacts_between_two_stops(e: float) -> None:
    m = 2.0
    system, v = between_stops(e, m), speed_between_stops(e)
    f = np.arctan2(0.5 * (1 - e) * v, 0.25 * np.pi * (1 + e) * v - 1)
    # half a period after phase 0 the mass is at the mirror image; the symmetric motion need not be stable
    start = {"q": -1 - 1 - np.cos(f) + (e * v + np.sin(f)) * (np.pi - f), "v_q": e * v + np.sin(f)}
    orbit = ns.find_orbit(system, start=start, transient=0, period_number=1, loads=True, progress=False)
    expected = {
        "impact_speed_maximum": v,
        "impacts": 1.0,
        "impulse": m * (1 + e) * v,
        "energy": 0.5 * m * (1 - e**2) * v**2,
        "force_maximum": 0.0,
        "force_minimum": 0.0,
    }
    for name in ("left", "right"):
        found = {key: orbit.loads[f"{name}_{key}"] for key in expected}
        assert found == pytest.approx(expected, rel=1e-11), orbit
    assert orbit.loads["work_of_forcing"] == pytest.approx(m * (1 - e**2) * v**2, rel=1e-11)
    assert orbit.loads["work_of_damping"] == 0.0
    data = orbit.to_dataset()
    assert data["left_impulse"].attrs["units"] == "N s" and data["left_energy"].attrs["units"] == "J"
    assert data["left_impact_speed_maximum"].attrs["units"] == "m/s"
    assert ns.Orbit.from_dataset(data).loads == pytest.approx(dict(orbit.loads))
    run = ns.simulate(system, periods=4, start=orbit.u, transient=0)
    struck = run["right_impulse"].values > 0
    assert struck.sum() == 4 and (struck ^ (run["left_impulse"].values > 0)).all()
    assert run["right_impulse"].values[struck] == pytest.approx(m * (1 + e) * v, rel=1e-9)
    assert run["right_impact_speed"].values[struck] == pytest.approx(v, rel=1e-9)
    assert np.isnan(run["right_impact_speed"].values[~struck]).all()
    assert run["right_energy_lost"].values[struck] == pytest.approx(0.5 * m * (1 - e**2) * v**2, rel=1e-9)
    assert run["right_force"].attrs["units"] == "N" and run["right_impulse"].attrs["units"] == "N s"


def test_a_ball_on_a_table_takes_from_it_what_impacts_dissipate() -> None:
    """Once a period the speed g T / 2 is turned: approach g T / (1 + e), impulse g T, no energy for the ball."""
    g, e = 9.81, 0.5
    ball = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"A": 1.7 / (2 * np.pi), "w": 2 * np.pi, "g": g, "e": e, "m": (3.0, "kg")},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        elements={
            "table": Stop(
                gap=lambda t, u, p: u.x - p.A * np.cos(p.w * t), on={"v": lambda t, u, p: 1 / p.m}, restitution="e"
            )
        },
    )
    A, up = 1.7 / (2 * np.pi), (1 - e) / (1 + e) * g / 2  # the speed of the table at the impact
    late = np.arcsin(up / 1.7) / (2 * np.pi)
    for left in (0.5 - late, late):  # from the impact to the end of the period; one of the two motions is stable
        at = 1 - left
        start = {"x": A * np.cos(2 * np.pi * at) + g * left / 2 - g * left**2 / 2, "v": g / 2 - g * left}
        found = ns.sweep(ball, "m", [3.0], start=start, loads=True, transient=300, progress=False).isel(m=0)
        if int(found["period_number"]) == 1:
            break
    assert float(found["table_impact_speed_maximum"]) == pytest.approx(g / (1 + e), rel=1e-9)
    assert float(found["table_impulse"]) == pytest.approx(3.0 * g, rel=1e-9)
    assert float(found["table_energy"]) == pytest.approx(0.0, abs=1e-9)
    assert "work_of_forcing" not in found
    run = ns.simulate(ball, periods=3, start=dict(zip(("x", "v"), found["section"].values[-1], strict=True)))
    assert run["table_energy_lost"].values == pytest.approx(3.0 * g**2 * (1 - e) / (2 * (1 + e)), rel=1e-9)
    assert run["table_impulse"].attrs["units"] == "N s"


def test_a_ball_that_rests_on_its_table_for_a_part_of_the_period_gets_no_energy_either() -> None:
    ball = ns.System(
        states=["x", "v"],
        parameters={"A": 0.3, "w": 2 * np.pi, "g": 9.81, "e": 0.5},
        modes={"fly": lambda t, u, p: (u.v, -p.g)},
        scale={"x": 0.1},
        elements=[Stop(gap=lambda t, u, p: u.x - p.A * np.cos(p.w * t), on={"v": 1.0}, restitution="e")],
    )
    found = ns.sweep(ball, "A", [0.27, 0.3], start={"x": 1.0}, direction=None, loads=True, progress=False)
    assert (found["period_number"] == 1).all() and (found["stop_impacts"] >= 2).all()
    force, impulse = found["stop_force_maximum"].values, found["stop_impulse"].values
    assert force == pytest.approx(9.81 + 4 * np.pi**2 * found["A"].values, rel=1e-2)  # at rest, where the table is low
    assert ((impulse > 0) & (impulse < 9.81)).all()  # the force bears the rest of the momentum g T
    assert abs(found["stop_energy"].values).max() < 1e-9
    assert found["stop_force_maximum"].attrs["units"] == "1"  # of a number in on= nothing is known


@pytest.mark.parametrize("w", [0.7, 0.8, 1.3, 2.0])
def test_dry_friction_takes_four_times_friction_and_amplitude(w: float) -> None:
    """Continuous sliding under cos(w t) with friction 0.3 (Den Hartog 1931), k = m = 1."""
    rig = ns.mechanical(
        1.0,
        0.0,
        1.0,
        parameters={"w": w},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={"rub": Coulomb(at="q", friction=0.3)},
    )
    turn = np.pi / w
    amplitude = np.sqrt((1 / (1 - w**2)) ** 2 - (0.3 * np.sin(turn) / (w * (1 + np.cos(turn)))) ** 2)
    orbit = ns.find_orbit(rig, loads=True, progress=False)
    assert float(orbit.to_dataset()["maximum"].sel(state="q")) == pytest.approx(amplitude, rel=1e-13)
    loads = orbit.loads
    assert loads["rub_energy"] == pytest.approx(4 * 0.3 * amplitude, rel=1e-12)
    assert loads["work_of_forcing"] == pytest.approx(4 * 0.3 * amplitude, rel=1e-12)
    assert loads["rub_force_maximum"] == pytest.approx(0.3, rel=1e-14) and "rub_impacts" not in loads


def test_a_belt_gives_what_a_damper_takes() -> None:
    """Stick-slip: with damping the belt's energy goes there, without it none is given on the whole."""
    for c in (0.0, 0.02):
        rig = ns.mechanical(
            1.0,
            "c",
            1.0,
            parameters={"c": c},
            elements={"belt": Coulomb(at="q", friction=0.6, static=1.0, belt=0.5)},
        )
        orbit = ns.find_orbit(rig, start={"q": 0.0, "v_q": 0.5}, loads=True, progress=False)
        assert orbit.period_number == 0 and set(orbit.signature.text(rig.traced).split()) & {"belt_stick"}
        assert orbit.loads["belt_energy"] == pytest.approx(-orbit.loads["work_of_damping"], abs=1e-12)
        assert (orbit.loads["work_of_damping"] > 0.01) == (c > 0)
        assert orbit.loads["belt_force_maximum"] == pytest.approx(1.0, rel=1e-11)  # where it lets go
        # without damping the mass leaves at q = 1 with the belt's speed and slips on a circle about q = 0.6
        angle = 2 * np.pi - 2 * np.arctan2(0.4, 0.5)
        stick = 2 * 0.4 / 0.5
        if c == 0:
            assert orbit.period == pytest.approx(angle + stick, rel=1e-12)


def test_work_of_base_and_damping_of_a_linear_oscillator() -> None:
    """A resonance curve: the damper takes pi c w X^2 a period."""
    c, Y = 0.3, 2.0
    rig = ns.mechanical(
        "m",
        c,
        4.0,
        parameters={"m": (1.0, "kg"), "w": 1.0},
        coordinates={"q": "m"},
        base=lambda t, p: -Y * p.w**2 * np.cos(p.w * t),
    )
    w = np.linspace(0.5, 3.0, 6)
    found = ns.frequency_response(rig, w, parameter="w", direction="up", loads=True, progress=False)
    X = Y * w**2 / np.hypot(4.0 - w**2, c * w)
    assert found["work_of_base"].values == pytest.approx(np.pi * c * w * X**2, rel=1e-9)
    assert found["work_of_damping"].values == pytest.approx(np.pi * c * w * X**2, rel=1e-9)
    assert found["work_of_forcing"].values == pytest.approx(np.zeros(6), abs=1e-15)
    assert found["work_of_base"].attrs["units"] == "J"


EVERY: dict[str, dict[str, Any]] = {
    "stops": {
        "wall": Stop(at="q2", position=0.3, restitution="e"),
        "bumper": Stop(at={"q2": 1, "q1": -1}, position=-0.5, side=-1, restitution=0.7),
    },
    "plastic": {"wall": Stop(at="q2", position=0.2), "rub": Coulomb(at="q1", friction=0.2, static=0.25, belt=0.3)},
    "elastic": {
        "soft": ElasticStop(at="q1", position=0.2, stiffness=20.0, damping=1.0),
        "pull": ElasticStop(at="q2", position=-0.3, side=-1, stiffness=8.0, damping=0.5, pulls=True),
    },
    "play": {
        "play": Backlash(at={"q1": 1, "q2": -1}, half_width=0.1, stiffness=5.0, damping=0.2),
        "spring": PreloadedSpring(at="q1", preload=0.2, stiffness=1.0),
    },
    "moving": {"hammer": Stop(at="q1", position=lambda t, u, p: 0.2 + 0.1 * np.sin(p.w * t), restitution="e")},
    "many": {f"s{k}": ElasticStop(at="q1", position=0.1 * k, stiffness=3.0, damping=0.1) for k in range(1, 10)}
    | {"wall": Stop(at="q2", position=0.2, restitution="e")},
}


@pytest.mark.parametrize("kind", list(EVERY))
def test_energy_in_is_energy_out(kind: str) -> None:
    """On every cycle of a sweep, from outputs alone; K is not symmetric in one of them."""
    stiffness = [[2.0, -1.0], [-0.9 if kind == "play" else -1.0, 1.0]]
    pair = ns.mechanical(
        np.diag([1.0, 0.5]),
        [[0.3, -0.1], [-0.1, 0.2]],
        stiffness,
        parameters={"w": 1.1, "e": 0.6},
        forcing={"q1": lambda t, p: np.cos(p.w * t)},
        base=lambda t, p: 0.2 * np.cos(p.w * t),
        elements=EVERY[kind],
    )
    found = ns.sweep(pair, "w", np.linspace(0.7, 1.5, 9), loads=True, progress=False)
    cycles = found["period_number"].values > 0
    assert cycles.sum() >= 5
    size = abs(found["work_of_forcing"].values)[cycles]
    assert (size > 0.01).all() and (abs(balance(found).values[cycles]) < 1e-9 * np.maximum(size, 1.0)).all()
    taken = sum(found[f"{name}_energy"].values for name in EVERY[kind])
    assert np.count_nonzero(abs(taken) > 1e-3) >= 5
    assert ("work_of_stiffness" in found) == (kind == "play")
    assert (found["work_of_damping"] > 0).all()


def test_sweep_chart_and_orbit_give_the_same_loads(tmp_path: Path) -> None:
    rig = ns.mechanical(
        1.0,
        0.05,
        1.0,
        parameters={"w": 0.9, "mu": 0.5},
        forcing={"q": lambda t, p: 0.3 * np.cos(p.w * t)},
        elements={
            "rub": Coulomb(at="q", friction="mu", static=0.8, belt=-0.37),
            "soft": ElasticStop(at="q", position=-0.4, side=-1, stiffness=30.0, damping=0.4),
        },
    )
    w = [1.0, 1.3]
    swept = ns.sweep(rig, "w", w, direction=None, loads=True, progress=False)
    charts = [
        ns.chart(rig, {"w": w, "mu": [0.4, 0.5]}, loads=True, progress=False, store=store)
        for store in (None, tmp_path / "loads.zarr")
    ]
    xr.testing.assert_identical(charts[0].drop_attrs(), charts[1].drop_attrs())
    names = [name for name in charts[0] if str(name) in swept and str(name).startswith(("rub", "soft", "work"))]
    assert len(names) == 8
    for name in names:
        assert charts[0][name].values[:, 1] == pytest.approx(swept[name].values, rel=1e-10, abs=1e-11)
        assert charts[0][name].attrs["units"] == swept[name].attrs["units"]
    for i, value in enumerate(w):
        assert swept["period_number"].values[i] > 0
        orbit = ns.find_orbit(rig.with_parameters(w=value), loads=True, progress=False)
        for name in names:
            assert orbit.loads[name] == pytest.approx(float(swept[name][i]), rel=1e-8, abs=1e-9)
    read = ns.System.from_text(rig.to_text())
    again = ns.sweep(read, "w", w, direction=None, loads=True, progress=False)
    for name in names:
        assert again[name].values == pytest.approx(swept[name].values, rel=1e-10, abs=1e-11)


def test_a_section_at_the_impact_counts_it_once() -> None:
    """An autonomous rattle, and a section that lies on the surface of impacts: before and after them."""
    rig = ns.mechanical(
        1.0, -0.2, 1.0, parameters={"e": 0.5}, elements={"wall": Stop(at="q", position=1.0, restitution="e")}
    )
    for side in ("before", "after"):
        section = ns.Poincare("wall_gap", rising=False, side=side)
        found = ns.sweep(rig, "e", [0.5], start={"q": 0.5}, section=section, loads=True, progress=False).isel(e=0)
        assert int(found["period_number"]) == 1 and float(found["wall_impacts"]) == 1.0
        v = float(found["wall_impact_speed_maximum"])
        # free flight of x'' - 0.2 x' + x = 0 from (1, -e v) to (1, v)
        rate = np.sqrt(1 - 0.01)
        time = float(ns.find_orbit(rig, start={"q": 0.5}, progress=False).period)
        a = (-0.5 * v - 0.1) / rate
        assert np.exp(0.1 * time) * (np.cos(rate * time) + a * np.sin(rate * time)) == pytest.approx(1.0, rel=1e-8)
        assert float(found["wall_energy"]) == pytest.approx(0.5 * 0.75 * v**2, rel=1e-10)
        assert float(found["work_of_damping"]) == pytest.approx(-0.5 * 0.75 * v**2, rel=1e-8)


def test_a_motion_without_a_period_has_averages() -> None:
    """Over the kept window energy in and energy out differ by what the masses have more at its end."""
    system = ns.mechanical(
        1.0,
        0.2,
        0.0,
        parameters={"w": 0.55, "e": 0.5},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements={
            "right": Stop(at="q", position=1.0, restitution="e"),
            "left": Stop(at="q", position=-1.0, side=-1, restitution="e"),
        },
    )
    found = ns.sweep(system, "e", [0.5], start={"v_q": 0.3}, keep=40, loads=True, progress=False).isel(e=0)
    assert int(found["period_number"]) == 0
    largest = max(float(found["maximum"].sel(state="v_q")), -float(found["minimum"].sel(state="v_q")))
    assert 1e-9 < abs(float(balance(found))) < 0.5 * largest**2 / 40
    assert 1.0 < float(found["left_impacts"]) < 10.0


def test_a_nonlinear_system_with_elements() -> None:
    """A damper in a contact takes the integral of c v^2 while it is closed."""
    system = ns.System(
        states=["x", "v"],
        parameters={"w": 1.2},
        modes={"all": lambda t, u, p: (u.v, 0.7 * np.cos(p.w * t) - 0.2 * u.v - u.x - u.x**3)},
        elements={
            "soft": ElasticStop(gap=lambda t, u, p: 0.3 - u.x, on={"v": -1.0}, stiffness=10.0, damping=0.8, pulls=True)
        },
    )
    orbit = ns.find_orbit(system, loads=True, progress=False)
    run = orbit.trajectory(20001)
    closed = run["mode"].values == list(system.modes).index("soft_contact")
    power = np.where(closed, 0.8 * run["u"].values[:, 1] ** 2, 0.0)
    assert closed.any() and not closed.all()
    assert orbit.loads["soft_energy"] == pytest.approx(np.trapezoid(power, run["time"].values), rel=1e-6)
    assert set(orbit.loads) == {"soft_force_maximum", "soft_force_minimum", "soft_energy"}
    assert orbit.loads["soft_force_minimum"] == pytest.approx(run["soft_force"].values.min(), abs=1e-6)


def test_three_balls_and_two_stops_at_one_place_share_impulses() -> None:
    """Newton's law at once: (1, 0, 0) becomes (-1/3, 2/3, 2/3) by the impulses 4/3 and 2/3, no energy lost."""
    balls = ns.mechanical(
        np.eye(3),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        coordinates=["a", "b", "c"],
        parameters={},
        elements={
            "ab": Stop(at={"b": 1, "a": -1}, side=-1, restitution=1.0),
            "bc": Stop(at={"c": 1, "b": -1}, side=-1, restitution=1.0),
        },
    )
    run = ns.simulate(balls, duration=1.0, start={"a": -0.5, "v_a": 1.0})
    assert run["ab_impulse"].values == pytest.approx([4 / 3]) and run["bc_impulse"].values == pytest.approx([2 / 3])
    for name, speed in (("ab", 1.0), ("bc", 0.0)):
        assert run[f"{name}_energy_lost"].values == pytest.approx([0.0])
        assert run[f"{name}_impact_speed"].values == pytest.approx([speed])
    double = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={},
        elements={name: Stop(at="q", position=1.0, restitution=0.5) for name in ("one", "other")},
    )
    run = ns.simulate(double, duration=2.0, start={"v_q": 1.0})
    assert run["one_impulse"].values == pytest.approx([0.75]) and run["other_impulse"].values == pytest.approx([0.75])


def test_loads_are_refused_where_there_are_none() -> None:
    plain = ns.System(states=["x"], parameters={"a": 1.0}, modes={"all": lambda t, u, p: -p.a * u.x + np.cos(t)})
    for verb in (
        lambda: ns.sweep(plain, "a", [1.0], loads=True),
        lambda: ns.find_orbit(plain, loads=True),
        lambda: ns.find_orbit(plain).with_loads(),
    ):
        with pytest.raises(ValueError, match="loads are those of elements"):
            verb()
    with pytest.raises(TypeError, match="loads = 'yes'; allowed: True, False"):
        ns.sweep(between_stops(0.5), "e", [0.5], loads="yes")


@pytest.mark.parametrize(("friction", "stop", "rub"), [(0.3, 1.2, -0.25), (2.0, 0.75, -0.25)])
def test_a_load_that_two_elements_share_stays_within_their_bounds(friction: float, stop: float, rub: float) -> None:
    """1 + cos(t) / 2 presses a block onto a stop, where it sticks: each bears half, but friction no more than it can.

    Without ``loads`` the extremes are those of halves, and unknown where friction cannot bear its own."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"omega": 1.0},
        forcing={"q": lambda t, p: 1.0 + 0.5 * np.cos(p.omega * t)},
        elements={
            "stop": Stop(at="q", position=0.0, restitution=0.5),
            "rub": Coulomb(at="q", friction=friction),
        },
    )
    options: dict[str, Any] = {"direction": None, "transient": 5, "keep": 4, "progress": False}
    swept = ns.sweep(system, "omega", [1.0], loads=True, **options).squeeze()
    assert [float(swept[f"{name}_force_maximum"]) for name in ("stop", "rub")] == pytest.approx([stop, rub], abs=1e-6)
    run = ns.simulate(system, periods=3, samples=301)
    assert [run[f"{name}_force"].values.max() for name in ("stop", "rub")] == pytest.approx([stop, rub], abs=1e-9)
    bare = ns.sweep(system, "omega", [1.0], **options).squeeze()
    ends = [float(bare[f"{name}_force_{end}"]) for name in ("stop", "rub") for end in ("maximum", "minimum")]
    if friction > 0.75:
        assert ends == pytest.approx([0.75, 0.25, -0.25, -0.75], abs=1e-9)
    else:
        assert np.isnan(ends).all()


def test_two_frictions_that_slide_are_at_their_bounds_and_share_what_holds() -> None:
    """At rest each has half of the force; in motion each has its own friction, which is within its bound."""
    rubs = {"a": ns.elements.Coulomb(at="q", friction=0.3), "b": ns.elements.Coulomb(at="q", friction=0.2)}
    rig = ns.mechanical(
        1.0,
        0.1,
        1.0,
        coordinates=["q"],
        parameters={"F": 1.5, "w": 1.0},
        forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
        elements=rubs,
    )
    line = ns.sweep(rig, "F", [0.3, 1.5], transient=50, keep=20, progress=False)
    for name, most in (("a", 0.3), ("b", 0.2)):
        np.testing.assert_allclose(line[f"{name}_force_maximum"], [0.15, most], rtol=1e-12)
        np.testing.assert_allclose(line[f"{name}_force_minimum"], [-0.15, -most], rtol=1e-12)


@pytest.mark.parametrize(("phase", "lift"), [(0.0, 0.0), (0.7, 0.05), (1.9, 0.0), (4.1, 0.05)])
def test_a_contact_at_rest_takes_impulses_without_impacts(phase: float, lift: float) -> None:
    """A mass that lies on a floor (it may move) is struck from above: the floor takes the same impulse, at no speed."""
    rig = ns.mechanical(
        np.diag([2.0, 1.0]),
        np.diag([0.0, 0.1]),
        np.diag([0.0, 1.0]),
        coordinates=["a", "b"],
        parameters={"P": 1.0, "omega": 0.8, "phase": phase},
        forcing={"a": lambda t, p: -5.0, "b": lambda t, p: p.P * np.cos(p.omega * t + p.phase)},
        elements={
            "floor": ns.elements.Stop(
                at="a", position=lambda t, u, p: lift * np.sin(p.omega * t), side=-1, restitution=0.3
            ),
            "strike": ns.elements.Stop(at={"b": 1.0, "a": -1.0}, position=-0.3, side=-1, restitution=0.6),
        },
    )
    found = ns.sweep(rig, "P", [1.0], direction=None, transient=200, loads=True, progress=False).isel(P=0)
    assert int(found["period_number"]) > 0
    assert float(found["strike_impacts"]) > 0.0 and float(found["strike_impact_speed_maximum"]) > 0.1
    assert float(found["floor_impacts"]) == float(found["floor_impact_speed_maximum"]) == 0.0
    assert float(found["floor_impulse"]) == pytest.approx(float(found["strike_impulse"]), rel=1e-12)
    run = ns.simulate(rig, periods=4, transient=200)
    struck = np.isfinite(run["strike_impact_speed"].values)
    assert struck.any() and (run["floor_impact_speed"].values[struck] == 0.0).all()
    np.testing.assert_allclose(run["floor_impulse"], run["strike_impulse"], rtol=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_the_largest_of_several_peaks_is_found_between_the_samples(seed: int) -> None:
    """A stop that never opens: its force is k (q - d), q'' + c q' + (1 + k) q = k d + the sum of f_n cos(n t + a_n)."""
    rng = np.random.default_rng(seed)
    f, a, c, k, d = rng.uniform(0.5, 1.0, 4), rng.uniform(0.0, 2 * np.pi, 4), 0.1, 2.0, -20.0
    system = ns.mechanical(
        1.0,
        c,
        1.0,
        forcing={"q": lambda t, p: sum(f[n] * np.cos((3 * n + 9) * t + a[n]) for n in range(4))},
        coordinates=["q"],
        elements={"stop": ns.elements.ElasticStop(at="q", position=d, stiffness=k)},
        period=2 * np.pi / 3,
    )
    n = 3 * np.arange(4) + 9
    size = f * np.exp(1j * a) / (1 + k - n**2 + 1j * c * n)

    def force(t: np.ndarray) -> np.ndarray:
        return k * ((size * np.exp(1j * np.multiply.outer(t, n))).real.sum(axis=-1) + k * d / (1 + k) - d)

    t = np.linspace(0.0, 2 * np.pi / 3, 200_001)
    found = ns.find_orbit(system, loads=True, progress=False).loads["stop_force_maximum"]
    assert found == pytest.approx(force(t).max(), abs=1e-8)


def test_a_peak_between_samples_is_found_though_another_piece_has_a_larger_sample() -> None:
    """x ends at 1; 1.001 - x^2 is at most .992 at the nodes beside its peak; a kink is what its samples say."""
    x, _, back = _rule()
    values = np.stack([x, 1.001 - x**2, 2.0 - np.abs(x - 0.01)])[:, :, None]
    fine = np.array([True, True, False])[:, None]
    assert _highest(values[:2], back, fine[:2]) == pytest.approx([1.001], abs=1e-14)
    assert _highest(values, back, fine) == [values[2].max()]
