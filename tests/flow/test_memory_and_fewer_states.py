"""Memory, and modes that lack a state, by the exact flow: closed forms, and the series of the same flow beside it."""

from __future__ import annotations

import numpy as np
import pytest
from random_systems import Template, draw, growing

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.linear import LinearEngine, PlanarEngine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.kernels.hybrid.kept import Section


def yielding() -> Template:
    """A mass strikes a wall that gives way by a part of the speed of each impact, and pulls towards where it stands."""
    ranges = {
        "k": (0.5, 2.0),
        "c": (0.05, 0.4),
        "F": (0.5, 2.0),
        "w": (0.6, 1.8),
        "e": (0.5, 0.9),
        "d": (0.02, 0.1),
        "a": (-0.3, 0.3),
        "r": (0.3, 0.9),
        "low": (-0.8, -0.4),
    }

    def motion(t, u, p):
        return u.v, p.F * np.cos(p.w * t) - p.k * u.x - p.c * u.v + p.a * p.wall

    system = ns.System(
        name="yielding wall",
        states=["x", "v"],
        memory={"wall": 0.3},
        parameters={name: 0.5 * (low + high) for name, (low, high) in ranges.items()},
        modes={"near": motion, "far": motion},
        indicators={"reach": lambda t, u, p: u.x - p.wall, "back": lambda t, u, p: u.x - p.low},
        transitions=[
            ns.Transition(
                "near",
                "near",
                when="reach > 0",
                reset=lambda t, u, p: (u.x, -p.e * u.v),
                write={"wall": lambda t, u, p: p.wall + p.d * u.v},
            ),
            ns.Transition("near", "far", when="back < 0", write={"wall": lambda t, u, p: p.r * p.wall}),
            ns.Transition("far", "near", when="back > 0"),
        ],
        outputs={"room": lambda t, u, p: p.wall - u.x},
    )
    return Template(system, (), ranges, (-0.3, 0.2), (12.0, 20.0))


def engines(system: ns.System) -> tuple[LinearEngine, SeriesEngine]:
    ours = engine_for(system)
    assert isinstance(ours, LinearEngine) and not isinstance(ours, PlanarEngine)
    return ours, SeriesEngine(system.traced, system.scale_vector(), "taylor", rtol=1e-15)


@pytest.mark.parametrize("template", [yielding, growing])
def test_runs_and_sweeps_as_by_the_series_of_the_same_flow(template) -> None:
    """Random draws: transitions, limits, samples, memory; section points, extremes and counts of a sweep."""
    seen = 0
    for seed in range(12):
        system, start, duration = draw(template(), np.random.default_rng(seed))
        samples, logs, chains, ends = np.linspace(0.0, duration, 50), [], [], []
        for engine in engines(system):
            tables = engine.prepare(system.parameter_vector()[None, :])
            state = State(start.copy(), system.memory_vector())
            logs.append(engine.record(tables, state, duration, samples))
            ends.append(np.concatenate([state.u, state.memory, state.clock[:1]]))
            out, plain, again = engine.kept(1, 3), engine.kept(1, 3), state.copy()
            engine.chain(tables, 0, 1, state, None, Section(), 2, 3, out)
            chains.append((out, np.concatenate([state.u, state.memory])))
            engine.chain(tables, 0, 1, again, None, Section(extremes=0), 2, 3, plain)
            np.testing.assert_allclose([out.elapsed[0], plain.elapsed[0]], 3 * tables.period[0], rtol=1e-13)
            np.testing.assert_allclose(plain.section, out.section, rtol=0, atol=1e-10)
        ours, theirs = logs
        assert ours.status == theirs.status == 0
        assert ours.crossing_transition.tolist() == theirs.crossing_transition.tolist()
        assert ours.sample_mode.tolist() == theirs.sample_mode.tolist()
        for name in ("crossing_time", "u_before", "u_after", "memory_after", "sample_u", "sample_memory"):
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=0, atol=1e-10, err_msg=name)
        np.testing.assert_allclose(*ends, rtol=0, atol=1e-10)
        (a, end), (b, their_end) = chains
        assert (a.status, a.crossings, a.contacts) == (b.status, b.crossings, b.contacts)
        np.testing.assert_allclose(end, their_end, rtol=0, atol=1e-10)
        for name in ("section", "high", "low", "elapsed", "section_time", "section_mode"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0, atol=1e-10, err_msg=name)
        seen += len(ours.crossing_time)
    assert seen > 20


def test_a_ball_on_a_floor_that_sinks() -> None:
    """Free falls between a floor that each impact lowers by a tenth of its speed: flights and speeds by hand."""
    e, d = 0.6, 0.1
    ball = ns.System(
        states=["x", "v"],
        parameters={"e": e, "d": d, "A": 0.0, "w": 1.0},
        memory={"floor": 0.0},
        modes={"flight": lambda t, u, p: (u.v, -1.0 + p.A * np.cos(p.w * t))},
        indicators={"above": lambda t, u, p: u.x - p.floor},
        transitions=[
            ns.Transition(
                "flight",
                "flight",
                when="above < 0",
                reset=lambda t, u, p: (u.x, -p.e * u.v),
                write={"floor": lambda t, u, p: p.floor + p.d * u.v},
            )
        ],
    )
    assert isinstance(engine_for(ball), LinearEngine)
    run = ns.simulate(ball, duration=5.0, start={"x": 0.5}, samples=11)
    t, x, v, floor, fall = 0.0, 0.5, 0.0, 0.0, []
    while True:
        hit = v + np.sqrt(v**2 + 2 * (x - floor))  # x + v s - s^2 / 2 = floor
        t += hit
        if t > 5.0:
            break
        x, v, floor = floor, e * (hit - v), floor - d * (hit - v)
        fall.append((t, x, v, floor))
    assert len(fall) >= 3
    np.testing.assert_allclose(run.crossing_time, [row[0] for row in fall], rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.u_after, [row[1:3] for row in fall], rtol=0, atol=1e-13)
    assert run["floor"].values[0] == 0.0
    np.testing.assert_allclose(run["floor"].values[-1], floor, rtol=0, atol=1e-13)


def test_a_start_takes_what_holds_and_writes_its_memory() -> None:
    """Beyond the far threshold at the start: that transition is taken at t = 0 and writes."""
    system = yielding().system
    engine = engine_for(system)
    state = State(np.array([-1.0, 0.0]), system.memory_vector())
    log = engine.record(engine.prepare(system.parameter_vector()[None, :]), state, 1e-6, np.array([0.0]))
    assert log.sample_mode[0] == 1 and len(log.crossing_time) == 0
    assert log.sample_memory[0, 0] == state.memory[0] == 0.3 * system.values["r"]


def test_a_lacking_state_has_no_value_and_no_part_in_extremes() -> None:
    """The block rides on the belt without a velocity of its own: its slip alone has speeds."""

    def slip(t, u, p):
        return u.v, 0.5 - u.x + p.A * np.cos(p.w * t)

    belt = ns.System(
        states=["x", "v"],
        parameters={"A": 0.0, "w": 1.0, "v_b": 0.2},
        modes={"stick": ns.Mode(lambda t, u, p: (p.v_b,), states=["x"]), "slip": slip},
        indicators={"strain": lambda t, u, p: u.x - 1.0, "catch": lambda t, u, p: u.v - p.v_b},
        transitions=[
            ns.Transition("stick", "slip", when="strain > 0", reset=lambda t, u, p: (u.x, p.v_b)),
            ns.Transition("slip", "stick", when="catch > 0", reset=lambda t, u, p: (u.x,)),
        ],
    )
    engine = engine_for(belt)
    assert isinstance(engine, LinearEngine) and not isinstance(engine, PlanarEngine)
    run = ns.simulate(belt, duration=20.0, start={"v": 7.0}, samples=400)
    stuck = run["mode"].values == 0
    assert stuck.any() and np.isnan(run.u.sel(state="v").values[stuck]).all()
    assert np.isfinite(run.u.sel(state="v").values[~stuck]).all()
    state = State(np.array([0.0, 7.0]), np.zeros(0))  # a speed that the first mode does not have
    out = engine.kept(1, 3)
    engine.chain(engine.prepare(belt.parameter_vector()[None, :]), 0, 1, state, None, Section(), 0, 3, out)
    speed = np.hypot(0.5, 0.2)  # of the arc about the spring's equilibrium
    np.testing.assert_allclose([out.low[0, 1], out.high[0, 1]], [-speed, 0.2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(out.high[0, 2 + 1], 0.0, rtol=0, atol=1e-13)


@pytest.mark.parametrize("method", ["auto", "taylor"])
def test_a_cycle_within_a_mode_that_lacks_a_state(method: str) -> None:
    """x' = a cos t - x alone: x = a (cos t + sin t) / 2 with the multiplier exp(-2 pi), whatever v a start names."""
    system = ns.System(
        states=["x", "v"],
        parameters={"a": 0.5, "c": 0.2},
        modes={
            "creep": ns.Mode(lambda t, u, p: (p.a * np.cos(t) - u.x,), states=["x"]),
            "free": lambda t, u, p: (u.v, p.a * np.cos(t) - u.x - p.c * u.v),
        },
        indicators={"far": lambda t, u, p: u.x - 5.0},
        transitions=[ns.Transition("creep", "free", when="far > 0", reset=lambda t, u, p: (u.x, 0.0))],
    )
    options, there = {"method": method, "progress": False}, {"rtol": 0, "atol": 1e-9}
    points = ns.poincare(system, n=3, transient=20, start={"v": 1.0}, method=method)
    np.testing.assert_allclose(points["section"], [[0.25, np.nan]] * 3, **there)
    found = ns.sweep(system, "a", [0.5, 1.0], start={"v": 1.0}, keep=5, **options)
    assert found["status"].values.tolist() == [0, 0] and found["period_number"].values.tolist() == [1, 1]
    np.testing.assert_allclose(found["section"][:, 0], [[0.25, np.nan], [0.5, np.nan]], **there)
    np.testing.assert_allclose(found["maximum"], np.array([[0.5, np.nan], [1.0, np.nan]]) / np.sqrt(2), **there)
    np.testing.assert_allclose(found["minimum"], -found["maximum"], **there)
    lines = ns.amplitude_spectrum(system, start={"v": 1.0}, method=method)["amplitude"]  # without a warning
    np.testing.assert_allclose(lines.values[:2], [[0.0, np.nan], [0.5 / np.sqrt(2), np.nan]], **there)
    counted = ns.sweep(system, "a", [0.5, 1.0], start={"v": 1.0}, keep=5, density={"v": (-1, 1)}, bins=4, **options)
    assert counted["density"].sel(state="v").values.sum() == 0
    assert counted["outside"].sel(state="v").values.tolist() == [5, 5]
    plane = ns.basins(system, {"x": [-1.0, 1.0], "v": [-1.0, 0.5]}, **options)
    assert (plane["label"] == 0).all() and plane["confirmed"].values.tolist() == [1]
    np.testing.assert_allclose(plane["lyapunov"], [-1.0], **there)
    np.testing.assert_allclose(plane["section"], [[0.25, np.nan]], **there)
    shares = ns.basin_fractions(system, "a", [0.5], n_starts=4, box={"x": (-1, 1), "v": (-1, 1)}, **options)
    np.testing.assert_allclose(shares["section"], [[[0.25, np.nan]]], **there)
    grid = {"a": [0.5, 1.0], "c": [0.1, 0.2]}
    chart = ns.chart(system, grid, start=[{"v": -1.0}, {"x": 1.0, "v": 2.0}], lyapunov=40, **options)
    assert (chart["n_attractors"] == 1).all() and (chart["period_number"] == 1).all()
    np.testing.assert_allclose(chart["lyapunov"], -1.0, rtol=0, atol=1e-5)


@pytest.mark.parametrize(("length", "rate"), [(1.0, 2 * np.pi), (1e-3, 200.0)])
def test_a_contact_lifts_off_where_its_force_vanishes(length: float, rate: float) -> None:
    """A ball that chatters and rests on a vibrating table: it flies off where the table falls as fast as the ball.

    Distance, speed and acceleration vanish together there; the flight from there is a parabola."""
    g = length * rate**2 * 9.81 / (4 * np.pi**2)
    system = ns.System(
        states=["x", "v"],
        parameters={"A": 0.3 * length, "w": rate, "e": 0.4, "g": g, "creep": 1e-6 * length * rate},
        modes={
            "fly": lambda t, u, p: (u.v, -p.g),
            "rest": ns.Mode(lambda t, u, p: (-p.A * p.w * np.sin(p.w * t),), states=["x"]),
        },
        indicators={
            "gap": lambda t, u, p: u.x - p.A * np.cos(p.w * t),
            "lift": lambda t, u, p: p.g - p.w**2 * u.x,
            "away": lambda t, u, p: u.v + p.A * p.w * np.sin(p.w * t) + p.creep,
        },
        transitions=[
            ns.Transition(
                "fly",
                "fly",
                when="gap < 0 and away < 0",
                reset=lambda t, u, p: (p.A * np.cos(p.w * t), -p.e * u.v - (1 + p.e) * p.A * p.w * np.sin(p.w * t)),
            ),
            ns.Transition("fly", "rest", when="gap < 0 and away > 0", reset=lambda t, u, p: (p.A * np.cos(p.w * t),)),
            ns.Transition(
                "rest",
                "fly",
                when="lift < 0",
                reset=lambda t, u, p: (p.A * np.cos(p.w * t), -p.A * p.w * np.sin(p.w * t)),
            ),
        ],
        scale={"x": 0.1 * length, "v": 0.1 * length * rate},
    )
    amplitudes = np.linspace(0.26, 0.31, 26) * length
    found = ns.sweep(system, "A", amplitudes, start={"x": length}, direction=None, progress=False)
    assert (found["period_number"] == 1).all() and (found["status"] == 0).all()
    off = -np.arccos(g / (amplitudes * rate**2)) / rate
    x, v = amplitudes * np.cos(rate * off), -amplitudes * rate * np.sin(rate * off)
    expected = np.stack([x - v * off - g * off**2 / 2, v + g * off], axis=1)
    assert np.allclose(found["section"].values[:, -1], expected, atol=1e-13 * length * max(rate, 1.0))
