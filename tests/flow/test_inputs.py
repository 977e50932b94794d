"""Systems driven by samples: closed forms, SciPy between the same breakpoints, and derivatives against differences."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, make_interp_spline

import nonsmooth as ns

pytestmark = pytest.mark.physics
MORE = sorted({3, *range(4, 24)} - {6, 17})  # the load of 17 presses the mass on the stop


def at(run: Any, times: np.ndarray, count: int) -> np.ndarray:
    """The first states at some instants, behind what happens there."""
    return run.u.values[np.searchsorted(run.time.values, times, side="right") - 1, :count]


def test_a_cart_under_held_and_linear_forces() -> None:
    cart = ns.mechanical(2.0, 0.0, 0.0, forcing={"q": lambda t, p: p.force}, inputs={"force": "N"})
    held = ns.simulate(cart, duration=3.0, inputs={"force": ns.Input([0, 1, 2], [4, 0, -4], between="steps")})
    np.testing.assert_allclose(held.u.values[-1], [4.0, 0.0, -4.0, 0.0], atol=1e-14)
    times = np.linspace(0, 2, 9)
    ramp = ns.simulate(cart, duration=2.0, samples=times, inputs={"force": ([0, 2], [0, 6])})
    exact = np.transpose([times**3 / 4, 0.75 * times**2, 3 * times, 0 * times + 3])
    np.testing.assert_allclose(at(ramp, times, 4)[:-1], exact[:-1], atol=1e-13)


def test_a_block_with_friction_under_steps() -> None:
    """It holds up to mu = .5, slides under .8 with a = .3 from t = 1, and under 0 stops at t = 2 + .3 / .5."""
    block = ns.mechanical(
        1.0,
        0.0,
        0.0,
        forcing={"q": lambda t, p: p.load},
        inputs={"load": ""},
        elements={"floor": ns.elements.Coulomb(at="q", friction=0.5)},
    )
    run = ns.simulate(
        block,
        duration=4.0,
        samples=[0.5, 1.5, 2.3, 3.5],
        inputs={"load": ns.Input([0, 1, 2, 3], [0.4, 0.8, 0.0, -0.45], between="steps")},
    )
    half = 0.15 + 0.3 * 0.3 - 0.25 * 0.09
    np.testing.assert_allclose(at(run, np.array([0.5, 1.5, 2.3, 3.5]), 1)[:, 0], [0, 0.0375, half, 0.24], atol=1e-13)
    np.testing.assert_allclose(run.crossing_time, [1.0, 2.6], atol=1e-13)
    force = run["floor_force"].values[np.searchsorted(run.time.values, [0.5, 3.5], side="right") - 1]
    np.testing.assert_allclose(force, [-0.4, 0.45], atol=1e-13)


def test_a_step_that_lets_a_block_go_does_so_at_its_own_time() -> None:
    """x(2) = (.8 - mu) (2 - 1 - late)^2 / 2, whatever the friction was before; derivatives in mu and in the delay."""
    block = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"mu": 0.5, "late": 0.1},
        forcing={"q": lambda t, p: p.load},
        inputs={"load": ""},
        elements={"floor": ns.elements.Coulomb(at="q", friction="mu")},
    )
    load = ns.Input([0, 1], [0.4, 0.8], between="steps", delay="late")
    found = ns.sensitivity(block, duration=2.0, parameters=["mu", "late"], inputs={"load": load})
    np.testing.assert_allclose(found.end[:2], [0.3 * 0.81 / 2, 0.27], atol=1e-13)
    np.testing.assert_allclose(found.P.sel(parameter="mu")[:2], [-0.405, -0.9], atol=1e-12)
    np.testing.assert_allclose(found.P.sel(parameter="late")[:2], [-0.27, -0.3], atol=1e-12)


def test_a_delay_moves_a_ramp_from_the_start_on() -> None:
    """v(2) = (1/m) times the integral of 3 (t - late) + 3 over 0 < t < 2."""
    cart = ns.mechanical(
        2.0, 0.0, 0.0, parameters={"late": 0.1}, forcing={"q": lambda t, p: p.force}, inputs={"force": "N"}
    )
    force = ns.Input([-1, 5], [0, 18], delay="late")
    found = ns.sensitivity(cart, duration=2.0, parameters=["late"], inputs={"force": force})
    np.testing.assert_allclose(found.end[:2], [(3 * 8 / 6 + 2.7 * 2) / 2, (6 + 2.7 * 2) / 2], atol=1e-13)
    np.testing.assert_allclose(found.P.sel(parameter="late"), [-3.0, -3.0, -3.0, 0.0], atol=1e-13)


def test_delays_of_two_ramps() -> None:
    """v(2) is the integral of 3 (t - late) + 3 and of 5 (t - other): each delay moves its own."""
    cart = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"late": 0.1, "other": 0.2},
        forcing={"q": lambda t, p: p.a + p.b},
        inputs={"a": "N", "b": "N"},
    )
    inputs = {"a": ns.Input([-1, 5], [0, 18], delay="late"), "b": ns.Input([-1, 5], [-5, 25], delay="other")}
    found = ns.sensitivity(cart, duration=2.0, parameters=["late", "other"], inputs=inputs)
    assert found.end[1] == pytest.approx((6.0 - 0.6 + 6.0) + (10.0 - 2.0), abs=1e-12)
    np.testing.assert_allclose(found.P[:2], [[-6.0, -10.0], [-6.0, -10.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("delays", "sizes"), [(("late", "late"), (3, 0)), (("late", "other"), (1, 2)), (("late", 0.1), (1, 0))]
)
def test_steps_of_two_inputs_at_one_time(delays: tuple[Any, Any], sizes: tuple[float, float]) -> None:
    """v(2) = 1 (1 - late of a) + 2 (1 - late of b), with one delay or two that are equal; sizes: -dv/d(delays)."""
    cart = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"late": 0.1, "other": 0.1},
        forcing={"q": lambda t, p: p.a + p.b},
        inputs={"a": "N", "b": "N"},
    )
    inputs = {
        name: ns.Input([0, 1], [0.0, size], between="steps", delay=delay)
        for name, size, delay in zip("ab", (1.0, 2.0), delays, strict=True)
    }
    found = ns.sensitivity(cart, duration=2.0, parameters=["late", "other"], inputs=inputs)
    np.testing.assert_allclose(found.end[:2], [3 * 0.81 / 2, 2.7], atol=1e-13)
    np.testing.assert_allclose(found.P[:2], [-0.9 * np.array(sizes), -np.array(sizes)], atol=1e-12)
    assert not np.any(found.P[2:])


def test_a_step_that_brings_a_reset_about() -> None:
    """v is halved where the force rises above 1, at t = 1 + late: v(2) = (1 + (1 + late)/2)/2 + 2 (1 - late)."""
    rig = ns.System(
        states=["x", "v"],
        parameters={"late": 0.1},
        inputs={"f": ""},
        modes={"low": lambda t, u, p: [u.v, p.f], "high": lambda t, u, p: [u.v, p.f]},
        indicators={"level": lambda t, u, p: p.f - 1},
        transitions=[ns.Transition("low", "high", when="level > 0", reset=lambda t, u, p: [u.x, u.v / 2])],
    )
    step = ns.Input([0, 1], [0.5, 2.0], between="steps", delay="late")
    found = ns.sensitivity(rig, duration=2.0, start={"v": 1.0}, parameters=["late"], inputs={"f": step})
    assert abs(found.end[1] - (0.5 + 0.25 * 1.1 + 1.8)) < 1e-13
    np.testing.assert_allclose(found.P.sel(parameter="late")[1], 0.25 - 2.0, atol=1e-12)


def test_steps_of_two_inputs_that_bring_a_reset_about_are_warned_of() -> None:
    rig = ns.System(
        states=["x", "v"],
        parameters={"late": 0.1, "other": 0.1},
        inputs={"f": "", "g": ""},
        modes={"low": lambda t, u, p: [u.v, p.f], "high": lambda t, u, p: [u.v, p.f]},
        indicators={"level": lambda t, u, p: p.f + p.g - 1},
        transitions=[ns.Transition("low", "high", when="level > 0", reset=lambda t, u, p: [u.x, u.v / 2])],
    )
    inputs = {
        name: ns.Input([0, 1], [0.3, 2.0], between="steps", delay=delay)
        for name, delay in (("f", "late"), ("g", "other"))
    }
    with pytest.warns(RuntimeWarning, match="two inputs with delays of their own change at one instant"):
        ns.sensitivity(rig, duration=2.0, start={"v": 1.0}, parameters=["late"], inputs=inputs)


def on_a_plate(kind: str, e: float) -> ns.System:
    """A mass under its weight 1 on a plate at y(t): alone, asked with a friction of zero, or with a law not linear."""
    elements: dict[str, Any] = {"plate": ns.elements.Stop(at="q", side=-1, position=lambda t, u, p: p.y, restitution=e)}
    if kind == "asked":
        elements["rail"] = ns.elements.Coulomb(at="q", friction=0.0)
    if kind == "nonlinear":
        elements["far"] = ns.elements.ElasticStop(at="q", position=9.0, stiffness=lambda t, u, p: 1 + u.q**2)
    return ns.mechanical(1.0, 0.0, 0.0, forcing={"q": -1.0}, inputs={"y": ""}, elements=elements)


def flight(times: np.ndarray, places: np.ndarray, e: float, q: float, v: float, until: float) -> tuple[float, float]:
    """Place and speed at the end, parabola by parabola; the mass strikes or leaves where the plate's speed jumps."""
    t, rests, slow = 0.0, False, 1e-7
    speeds = np.append(np.diff(places) / np.diff(times), 0.0)
    for piece, end in enumerate([*times[1:], until]):
        r = speeds[piece]
        w = v - r
        if rests and w > slow:
            rests = False
        elif rests:
            v, rests = (r, True) if -w < slow or e == 0.0 else (r - e * w, False)
        while t < end:
            here = places[piece] + r * (t - times[piece])
            if rests:
                t, q, v = end, here + r * (end - t), r
                break
            w = v - r
            fall = w + np.sqrt(max(w * w + 2 * max(q - here, 0.0), 0.0))
            if t + fall >= end:
                q, v, t = q + v * (end - t) - (end - t) ** 2 / 2, v - (end - t), end
                break
            t, q, v = t + fall, here + r * fall, v - fall
            w = v - r
            v, rests = (r, True) if -w < slow else (r - e * w, False)
    return q, v


@pytest.mark.parametrize("kind", ["alone", "asked", "nonlinear"])
def test_a_mass_on_a_plate_whose_speed_jumps_strikes_it_or_leaves_it(kind: str) -> None:
    seen = set()
    for e in (0.0, 0.3, 0.6):
        system = on_a_plate(kind, e)
        for seed in range(6):
            rng = np.random.default_rng(seed)
            times = np.append(0.0, np.cumsum(rng.uniform(0.3, 1.2, 6)))
            places = rng.uniform(-0.5, 0.5, 7)
            q, v, until = places[0] + rng.uniform(0, 0.3), rng.uniform(-0.5, 0.5), float(times[-1]) + 0.5
            run = ns.simulate(system, duration=until, start={"q": q, "v_q": v}, inputs={"y": (times, places)})
            np.testing.assert_allclose(run.u.values[-1, :2], flight(times, places, e, q, v, until), atol=1e-11)
            seen |= {"rest" in str(system.modes[int(m)]) for m in run.mode.values}
    assert seen == {True, False}


def test_derivatives_through_an_impact_that_a_jump_of_speed_begins() -> None:
    """At rest on a plate until t = 1 + late, which then moves up with .5: the mass is thrown up with (1 + e) .5."""
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        forcing={"q": -1.0},
        parameters={"e": 0.5, "late": 0.1},
        inputs={"y": ""},
        elements={"plate": ns.elements.Stop(at="q", side=-1, position=lambda t, u, p: p.y, restitution="e")},
    )
    plate = {"y": ns.Input([0, 1, 3], [0.0, 0.0, 1.0], delay="late")}
    found = ns.sensitivity(system, duration=1.3, parameters=["e", "late"], inputs=plate)
    left = 1.3 - 1.1
    np.testing.assert_allclose(found.end[:2], [0.75 * left - left**2 / 2, 0.75 - left], atol=1e-13)
    np.testing.assert_allclose(found.P.sel(parameter="e")[:2], [0.5 * left, 0.5], atol=1e-12)
    np.testing.assert_allclose(found.P.sel(parameter="late")[:2], [-0.75 + left, 1.0], atol=1e-12)


def test_derivatives_of_a_start_at_rest_on_a_plate_that_comes_up() -> None:
    """It is struck at once: v = (1 + e) .5 - t behind it, where it begins at rest by name."""
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        forcing={"q": -1.0},
        parameters={"e": 0.5},
        inputs={"y": ""},
        elements={"plate": ns.elements.Stop(at="q", side=-1, position=lambda t, u, p: p.y, restitution="e")},
    )
    plate = {"y": ([0, 2], [0.0, 1.0])}
    found = ns.sensitivity(system, duration=0.2, mode="plate_rest", parameters=["e"], inputs=plate)
    np.testing.assert_allclose(found.end[:2], [0.75 * 0.2 - 0.02, 0.75 - 0.2], atol=1e-13)
    np.testing.assert_allclose(found.P.sel(parameter="e")[:2], [0.5 * 0.2, 0.5], atol=1e-12)


def test_a_mass_leaves_a_smooth_plate_where_that_falls_faster() -> None:
    """The mass lifts off where y = -b (t - late)^3, of samples from t = late on, falls with 6 b (t - late) = g.

    Behind it q = -b T^3 - 3 b T^2 s - g s^2 / 2 with T = g / (6 b) and the time s since then."""
    b, g, late = 1.5, 9.0, 0.1
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        forcing={"q": lambda t, p: -p.g},
        parameters={"g": g, "late": late},
        inputs={"y": ("m", "smooth")},
        coordinates={"q": "m"},
        elements={"plate": ns.elements.Stop(at="q", side=-1, position=lambda t, u, p: p.y, restitution=0.3)},
    )
    assert ns.System.from_text(system.to_text()).to_text() == system.to_text()
    assert list(system.states.items())[2:] == [
        ("y", "m"),
        ("y_rate", "m/s"),
        ("y_rate2", "m/s^2"),
        ("y_rate3", "m/s^3"),
    ]
    times = np.array([0.0, 0.31, 0.7, 1.2, 1.9, 2.0])
    inputs = {"y": ns.Input(times, -b * times**3, delay="late")}
    begin = {"duration": 1.7, "mode": "plate_rest", "inputs": inputs}
    found = ns.sensitivity(system, parameters=["g", "late"], **begin)
    T, s = g / (6 * b), 0.6
    end = [-b * T**3 - 3 * b * T**2 * s - g * s**2 / 2, -3 * b * T**2 - g * s]
    for method in ("exact", "taylor"):
        run = ns.simulate(system, method=method, **begin)
        np.testing.assert_allclose(run.crossing_time, [late + T], atol=1e-13)
        np.testing.assert_allclose(run.u.values[-1, :2], end, atol=1e-12)
    np.testing.assert_allclose(found.end[:2], end, atol=1e-12)
    np.testing.assert_allclose(found.P.sel(parameter="late")[:2], [3 * b * T**2 + g * s, g], atol=1e-11)
    np.testing.assert_allclose(found.P.sel(parameter="g")[:2], [-(s**2) / 2, -s], atol=1e-11)


def test_the_noise_of_a_smooth_input() -> None:
    """The spline passes readings of a slow swing by their noise, in few pieces, with its second derivative."""
    t = np.arange(0.0, 5.0, 0.001)
    noisy = ns.Input(t, np.sin(3 * t) + 1e-3 * np.random.default_rng(0).standard_normal(len(t)), noise=1e-3)
    probe = ns.System(states=["x"], parameters={}, inputs={"f": ("", "smooth")}, modes={"one": lambda t, u, p: [p.f]})
    run = ns.simulate(probe, duration=4.9, samples=np.linspace(0.2, 4.8, 99), inputs={"f": noisy})
    at = run.time.values[1:-1]
    for state, exact, off in (("f", np.sin(3 * at), 5e-4), ("f_rate2", -9 * np.sin(3 * at), 0.4)):
        assert np.sqrt(np.mean((run.u.sel(state=state).values[1:-1] - exact) ** 2)) < off
    given = json.loads(run.attrs["nonsmooth"])["options"]["inputs"]["f"]
    assert given["noise"] == 1e-3
    with pytest.raises(ValueError, match=r"noise = 0.1 is that of a smooth input; this one is 'steps'"):
        ns.Input([0, 1], [0, 1], between="steps", noise=0.1)
    with pytest.raises(ValueError, match=r"of an input of 2 values: at least 4 tell a curve from it"):
        ns.Input([0, 1], [0, 1], noise=0.1)
    with pytest.warns(RuntimeWarning, match=r"no spline was found that passes its 500 values by so much"):
        ns.simulate(probe, duration=0.4, inputs={"f": ns.Input(noisy.time[:500], noisy.values[:500], noise=1e-14)})
    plain = ns.mechanical(1.0, 0.0, 0.0, inputs={"f": "N"})
    with pytest.raises(ValueError, match=r"declare it with ns.System"):
        ns.simulate(plain, duration=1.0, inputs={"f": noisy})


def test_inputs_declared_smooth_or_not() -> None:
    """Inputs declared so are smooth unless it is said otherwise; no others can be."""
    smooth = ns.System(
        states=["x"], parameters={}, inputs={"f": ("", "smooth")}, modes={"one": lambda t, u, p: [p.f_rate]}
    )
    times = np.array([0.0, 1.0, 2.5, 4.0])
    for between, value in ((None, 2.0**3), ("linear", 1 + (2.5**3 - 1) / 1.5), ("steps", 0.0)):
        run = ns.simulate(smooth, duration=2.0, inputs={"f": ns.Input(times, times**3, between=between)})
        assert abs(run.u.values[-1, 0] - value) < 1e-12
    assert smooth.inputs == {"f": ""}
    for few in (1, 2, 3):
        run = ns.simulate(smooth, duration=1.0, inputs={"f": (times[:few], times[:few] ** (few - 1))})
        assert abs(run.u.values[-1, 0] - (few > 1)) < 1e-13
    plain = ns.mechanical(1.0, 0.0, 0.0, inputs={"f": "N"})
    with pytest.raises(ValueError, match=r"declare it with ns.System\(..., inputs={'f': \('N', 'smooth'\)}\)"):
        ns.simulate(plain, duration=1.0, inputs={"f": ns.Input([0, 1], [0, 1], between="smooth")})
    for wrong in (("N", "smoth"), ("N",), 3.0):
        with pytest.raises(ns.SystemDefinitionError, match="or as \\(unit, 'smooth'\\)"):
            ns.mechanical(1.0, 0.0, 0.0, inputs={"f": wrong})


def test_a_belt_whose_speed_jumps_past_that_of_the_block_turns_the_friction_at_once() -> None:
    """v falls by .5 t; the belt runs at 2 until t = 1 and then at -2: friction acts the other way at v = .5."""
    belt = ns.elements.Coulomb(at="q", friction=0.5, belt=lambda t, u, p: p.y)
    rig = ns.mechanical(1.0, 0.0, 0.0, inputs={"y": ""}, elements={"belt": belt})
    steps = {"y": ns.Input([0, 1], [2.0, -2.0], between="steps")}
    run = ns.simulate(rig, duration=2.5, samples=[1.0, 2.5], inputs=steps)
    np.testing.assert_allclose(run.u.values[-1, :2], [0.25 + 0.75 - 0.25 * 1.5**2, 0.5 - 0.75], atol=1e-13)


def test_an_elastic_stop_that_jumps_away_is_left() -> None:
    """From t = .3 on there is a gap of .04, in which a damper would still push: the mass crosses it at its speed."""
    stop = ns.elements.ElasticStop(at="q", position=lambda t, u, p: p.y, stiffness=4.0, damping=0.5)
    beside: dict[str, Any]
    for beside in ({}, {"wall": ns.elements.Stop(at="q", position=9.0)}):
        rig = ns.mechanical(1.0, 0.0, 0.0, inputs={"y": ""}, elements={"stop": stop, **beside})
        steps = {"y": ns.Input([0, 0.3], [0.0, 0.25], between="steps")}
        run = ns.simulate(rig, duration=0.35, samples=2, start={"v_q": 0.8}, inputs=steps)
        decay, w = 0.8 * np.exp(-0.075), np.sqrt(4 - 0.25**2)  # x'' + .5 x' + 4 x = 0 up to then
        x, v = decay * np.sin(0.3 * w) / w, decay * (np.cos(0.3 * w) - 0.25 / w * np.sin(0.3 * w))
        assert x + 0.05 * v < 0.25
        np.testing.assert_allclose(run.u.values[-1, :2], [x + 0.05 * v, v], atol=1e-13)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
def test_an_input_is_as_large_as_it_is(method: str) -> None:
    """A cubic whose third derivative is 6e12, and a step within 1e-12: inputs do not diverge."""
    cart = ns.mechanical(1.0, 0.0, 0.0, forcing={"q": lambda t, p: p.f + p.g}, inputs={"f": ("N", "smooth"), "g": "N"})
    t = np.linspace(0.0, 1e-3, 5)
    given = {"f": ns.Input(t, 1e12 * t**3), "g": ([0.0, 5e-4, 5e-4 + 1e-12], [0.0, 0.0, 7.0])}
    run = ns.simulate(cart, duration=1e-3, inputs=given, method=method)
    np.testing.assert_allclose(run.u.values[-1, :2], [1e12 * 1e-15 / 20 + 7 * 0.125e-6, 0.25 + 3.5e-3], rtol=1e-9)


def test_a_stop_that_would_jump_into_a_mass_is_refused() -> None:
    steps = {"y": ns.Input([0, 0.5], [0, 0.1], between="steps")}
    with pytest.raises(ValueError, match=r"moves the stop 'plate' and is held between its samples"):
        ns.simulate(on_a_plate("alone", 0.5), duration=1.0, start={"q": 0.5}, inputs=steps)


def test_a_mass_pressed_on_a_stop_lifts_where_the_load_turns() -> None:
    """Modes made when visited, too; the force on the stop is the load."""
    for rubs in (False, True):
        more: dict[str, Any] = {"friction": 0.3, "tangent": "y"} if rubs else {}
        box = ns.mechanical(
            np.eye(2),
            np.zeros((2, 2)),
            np.zeros((2, 2)),
            coordinates=["x", "y"],
            forcing={"x": lambda t, p: p.load},
            inputs={"load": ""},
            elements={"wall": ns.elements.Stop(at="x", position=0.0, **more)},
        )
        run = ns.simulate(box, duration=2.0, samples=[0.5, 2.0], inputs={"load": ([0, 2], [1, -1])})
        np.testing.assert_allclose(at(run, np.array([2.0]), 1), [[-1 / 6]], atol=1e-13)
        assert abs(run["wall_force"].values[np.searchsorted(run.time.values, 0.5)] - 0.5) < 1e-13


def drawn(seed: int) -> tuple[ns.System, dict[str, Any], Callable[..., Any], np.ndarray, float]:
    """A random oscillator with a rigid stop, driven by a force and a base (of even seeds smooth), each by its clock."""
    rng = np.random.default_rng(seed)
    cubic, wall = float(rng.random() < 0.5), float(rng.uniform(0.1, 0.2))
    k, c, e = rng.uniform(0.5, 2), rng.uniform(0.02, 0.2), rng.uniform(0.3, 0.9)
    parameters = {"k": k, "c": c, "e": e, "late": 0.031}
    system = ns.System(
        states={"x": "m", "v": "m/s"},
        parameters=parameters,
        inputs={"f": "N", "b": "m" if seed % 2 else ("m", "smooth")},
        modes={
            "one": lambda t, u, p: [u.v, -p.k * (u.x - p.b) - p.c * (u.v - p.b_rate) - (u.x**3 if cubic else 0) + p.f]
        },
        indicators={"gap": lambda t, u, p: u.x - wall},
        transitions=[ns.Transition("one", "one", when="gap > 0", reset=lambda t, u, p: [u.x, -p.e * u.v])],
    )
    clocks = np.cumsum(rng.uniform(0.02, 0.2, 120)), np.cumsum(rng.uniform(0.1, 0.4, 60))
    held = ns.Input(clocks[0], rng.standard_normal(120), between="steps", delay="late")
    base = ns.Input(clocks[1], 0.2 * rng.standard_normal(60))
    course = make_interp_spline(clocks[1], base.values, k=1) if seed % 2 else CubicSpline(clocks[1], base.values)

    def field(t: float, x: np.ndarray, middle: float) -> list[float]:
        i = np.searchsorted(held.time + 0.031, middle, "right") - 1
        b, rate = (
            (base.values[0], 0.0) if middle < base.time[0] else (course(t), course(t if seed % 2 == 0 else middle, 1))
        )
        force = held.values[max(i, 0)]
        return [x[1], -k * (x[0] - b) - c * (x[1] - rate) - cubic * x[0] ** 3 + force]

    breaks = np.unique(np.concatenate([held.time + 0.031, base.time]))
    return system, {"f": held, "b": base}, field, breaks, wall


def by_scipy(field: Any, breaks: np.ndarray, wall: float, e: float, times: np.ndarray) -> tuple[np.ndarray, int]:
    found, x, t, hits = np.full((len(times), 2), np.nan), np.array([0.1, 0.0]), 0.0, 0
    for end in [*breaks[(breaks > 0) & (breaks < times[-1])], times[-1]]:
        middle = 0.5 * (t + end)
        while t < end:

            def contact(t: float, x: np.ndarray, middle: float) -> float:
                return float(x[0] - wall)

            contact.terminal, contact.direction = True, 1  # type: ignore[attr-defined]
            one = solve_ivp(
                field, (t, end), x, "DOP853", args=(middle,), events=contact, rtol=1e-12, atol=1e-13, dense_output=True
            )
            here = (times >= t) & (times <= one.t[-1])
            if here.any():
                found[here] = one.sol(times[here]).T
            t, x = float(one.t[-1]), one.y[:, -1].copy()
            if one.status == 1:
                x[0], x[1], hits = wall, -e * x[1], hits + 1
    return found, hits


@pytest.mark.parametrize("seed", [1, 6, *(pytest.param(s, marks=pytest.mark.slow) for s in MORE)])
def test_random_systems_against_scipy(seed: int) -> None:
    system, inputs, field, breaks, wall = drawn(seed)
    times = np.linspace(0.0, 9.0, 91)
    expected, hits = by_scipy(field, breaks, wall, system.values["e"], times)
    run = ns.simulate(system, duration=9.0, samples=times, start={"x": 0.1}, inputs=inputs, rtol=1e-13)
    assert len(run.crossing_time) == hits
    away = np.abs(times[:, None] - run.crossing_time.values).min(axis=1, initial=1.0) > 1e-9
    np.testing.assert_allclose(at(run, times, 2)[away], expected[away], rtol=0, atol=1e-9)


@pytest.mark.parametrize("seed", [3, 8])
def test_derivatives_against_differences(seed: int) -> None:
    """In parameters, the start and a delay, through impacts."""
    system, inputs, *_ = drawn(seed)
    names = list(system.values)
    found = ns.sensitivity(system, duration=7.0, start={"x": 0.1}, parameters=names, inputs=inputs)

    def end(**changed: float) -> np.ndarray:
        start = {"x": changed.pop("x", 0.1)}
        run = ns.simulate(system.with_parameters(changed), duration=7.0, start=start, inputs=inputs, rtol=1e-14)
        return np.asarray(run.u.values[-1])

    assert len(found.crossing_time) > 0
    for name in [*names, "x"]:
        now, h = system.values.get(name, 0.1), 1e-6
        slope = (end(**{name: now + h}) - end(**{name: now - h})) / (2 * h)
        own = found.P.sel(parameter=name) if name in names else found.Phi.sel(initial_state=name)
        np.testing.assert_allclose(own, slope, rtol=0, atol=1e-6 * (1 + np.abs(slope).max()))


def test_text_and_what_is_refused() -> None:
    system, inputs, *_ = drawn(1)
    again = ns.System.from_text(system.to_text())
    assert again == system
    assert again.inputs == {"f": "N", "b": "m"}
    with pytest.raises(ValueError, match=r"has the inputs 'f', 'b': give inputs="):
        ns.simulate(system, duration=1.0)
    with pytest.raises(ValueError, match="'b' is missing"):
        ns.simulate(system, duration=1.0, inputs={"f": inputs["f"]})
    with pytest.raises(ValueError, match="force"):
        ns.simulate(system, duration=1.0, inputs={"force": ([0], [1])})
    with pytest.raises(ValueError, match="sample 1 of an input is not finite"):
        ns.Input([0, 1, 2], [0, np.nan, 1])
    with pytest.raises(ValueError, match="sample 2 is at 1 after 1"):
        ns.Input([0, 1, 1], [0, 2, 1])
    with pytest.raises(ValueError, match="start: 'f' is that of an input"):
        ns.simulate(system, duration=1.0, start={"f": 1.0}, inputs=inputs)
    with pytest.raises(ValueError, match="names the channel 'load cell'"):
        ns.simulate(system, duration=1.0, inputs=inputs | {"f": ns.Input("load cell")})
    with pytest.raises(ns.SystemDefinitionError, match="'f' is given to a state and to an input"):
        ns.System(states=["x", "f"], parameters={}, inputs=["f"], modes={"one": lambda t, u, p: [p.f, 0]})
    run = ns.simulate(system, duration=1.0, start=[0.1, 0.2], inputs=inputs)
    assert run.u.values[0, :2].tolist() == [0.1, 0.2]
    with pytest.raises(ValueError, match="sweep takes systems without inputs"):
        ns.sweep(system, "k", [1.0, 2.0], progress=False)
    with pytest.raises(ValueError, match="has no inputs"):
        ns.simulate(ns.models.discontinuous_support(), periods=1, inputs={"f": ([0], [1])})


def test_what_a_function_returns_by_name_has_its_input_beside_it() -> None:
    """A cart of 2 kg under 3 N t, whose speed is set to 1 m/s at a phase."""

    def cart(by_name: bool) -> ns.System:
        kind: Callable[..., Any] = dict if by_name else lambda **values: tuple(values.values())
        return ns.System(
            states={"x": "m", "v": "m/s"},
            parameters={"m": 2.0},
            modes={"all": lambda t, u, p: kind(x=u.v, v=p.force / p.m)},
            period=2.0,
            transitions=[ns.Transition("all", "all", at=0.5, reset=lambda t, u, p: kind(x=u.x, v=1.0))],
            inputs={"force": "N"},
        )

    for by_name in (True, False):
        run = ns.simulate(cart(by_name), duration=2.0, inputs={"force": ([0, 2], [0, 6])})
        np.testing.assert_allclose(run.u.values[-1, :2], [2.25, 3.25], atol=1e-13)
