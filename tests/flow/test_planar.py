"""The exact flow of two states against matrix exponentials by 40 digits and formulas of the textbook."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from linear_flow import LinearFlow

import nonsmooth as ns
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.methods import engine_for

METHODS = {"exact": {}, "taylor": {"rtol": 1e-14}, "rkf45": {"rtol": 1e-13}}


def field(t, u, p):
    force = p.f0 + p.f1 * np.cos(p.omega * t) + p.f3 * np.sin(3 * p.omega * t)
    return u.v, force - p.k * u.x - p.c * u.v


@pytest.fixture(scope="module")
def oscillator() -> ns.System:
    names = {"k": 1.0, "c": 0.1, "f0": 0.0, "f1": 1.0, "f3": 0.0, "omega": 1.3}
    return ns.System(states=["x", "v"], parameters=names, modes={"only": field})


CASES = {
    "underdamped": {"k": 1.0, "c": 0.1, "f0": 0.3, "f3": -0.7},
    "overdamped": {"k": 1.0, "c": 5.0, "f0": 0.3, "f3": -0.7},
    "critically damped": {"k": 1.0, "c": 2.0, "f0": 0.3, "f3": -0.7},
    "nearly critically damped": {"k": 1.0, "c": 2.0 + 1e-9, "f0": 0.3, "f3": -0.7},
    "stiff and damped": {"k": 4e4, "c": 3.0, "f0": 0.3, "f3": -0.7},
    "free mass": {"k": 0.0, "c": 0.0, "f0": 0.3, "f1": 0.2, "f3": -0.7},
    "damped free mass": {"k": 0.0, "c": 0.3, "f0": 0.3, "f3": -0.7},
    "nearly free mass": {"k": 1e-13, "c": 1e-13, "f0": 0.3, "f3": -0.7},
    "constant force only": {"k": 0.0, "c": 0.0, "f0": 0.3, "f1": 0.0},
    "resonant": {"k": 1.69, "c": 0.0, "f1": 0.4},
    "resonant in the third harmonic": {"k": 1.0, "c": 0.0, "omega": 1 / 3, "f3": 0.5},
    "nearly resonant": {"k": 1.69 * (1 + 1e-10), "c": 0.0, "f1": 0.4},
    "negative damping": {"k": 1.0, "c": -0.2, "f0": 0.3, "f3": -0.7},
    "negative stiffness": {"k": -0.3, "c": 0.1, "f0": 0.3, "f3": -0.7},
    "unforced": {"k": 1.0, "c": 0.1, "f1": 0.0},
}


@pytest.mark.parametrize("case", CASES)
def test_every_kind_of_linear_mode(case: str, oscillator: ns.System) -> None:
    system = oscillator.with_parameters(CASES[case])
    p = system.values
    assert isinstance(engine_for(system), PlanarEngine)
    truth = LinearFlow(
        [[0, 1], [-p["k"], -p["c"]]],
        [0, p["f0"]],
        {1: ([0, p["f1"]], [0, 0]), 3: ([0, 0], [0, p["f3"]])},
        p["omega"],
    )
    run = ns.simulate(system, periods=6, start={"x": 0.7, "v": -0.4}, samples=14)
    assert run.attrs["nonsmooth"].count('"method": "exact"') == 1
    states = np.array([truth.exactly(0.0, (0.7, -0.4), t) for t in run["time"].values])
    size = np.abs(states).max(axis=0)
    assert np.max(np.abs(run["u"].values - states) / size) < 2e-13 * max(1.0, np.sqrt(abs(p["k"])))


def test_secular_growth_at_resonance(oscillator: ns.System) -> None:
    """x'' + w^2 x = f cos(w t) from rest: x = f t sin(w t) / (2 w)."""
    w, f = 1.3, 0.4
    run = ns.simulate(oscillator.with_parameters(k=w**2, c=0.0, f1=f), periods=200, samples=401)
    t = run["time"].values
    assert np.max(np.abs(run["u"].sel(state="x") - f * t * np.sin(w * t) / (2 * w))) < 1e-12 * f * t[-1]


def test_critical_damping_by_formula(oscillator: ns.System) -> None:
    """x = (x0 + (v0 + a x0) t) exp(-a t)."""
    run = ns.simulate(oscillator.with_parameters(k=0.49, c=1.4, f1=0.0), duration=12.0, start=[1.0, -3.0], samples=50)
    t = run["time"].values
    assert np.max(np.abs(run["u"].sel(state="x") - (1.0 + (-3.0 + 0.7) * t) * np.exp(-0.7 * t))) < 1e-14


@pytest.mark.parametrize("seed", range(5))
def test_any_matrix_with_both_equations_forced(seed: int) -> None:
    """Two harmonics, as the other systems here have: each number of them is a compiled module of its own."""
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(2, 2)) - 0.5 * np.eye(2), rng.normal(size=2)
    waves = {k: (rng.normal(size=2), rng.normal(size=2)) for k in (2, 5)}
    w = 1.7

    def forced(t, u, p):
        total = A @ np.array([u.a, u.b]) + b
        for k, (c, s) in waves.items():
            total = total + c * np.cos(k * p.w * t) + s * np.sin(k * p.w * t)
        return total

    system = ns.System(states=["a", "b"], parameters={"w": w}, modes={"only": forced})
    assert isinstance(engine_for(system), PlanarEngine)
    truth = LinearFlow(A, b, waves, w)
    run = ns.simulate(system, periods=3, start=[0.2, -1.0], samples=13)
    states = np.array([truth.exactly(0.0, (0.2, -1.0), t) for t in run["time"].values])
    assert np.max(np.abs(run["u"].values - states)) < 1e-13 * np.abs(states).max()


def ball() -> ns.System:
    return ns.System(
        states={"x": "m", "v": "m/s"},
        parameters={"g": (9.81, "m/s^2"), "e": 0.7},
        modes={"flight": lambda t, u, p: (u.v, -p.g)},
        indicators={"floor": lambda t, u, p: u.x},
        transitions=[ns.Transition("flight", "flight", when="floor < 0", reset=lambda t, u, p: (0.0, -p.e * u.v))],
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("e", [0.3, 0.7, 0.95])
def test_a_bouncing_ball_until_its_bounces_accumulate(method: str, e: float) -> None:
    """From a height h: t_n = t_0 (1 + 2 (e + e^2 + ... + e^n)), t_0 = sqrt(2 h / g), accumulating at
    t_0 (1 + e) / (1 - e)."""
    system, h, g = ball().with_parameters(e=e), 1.5, 9.81
    t0 = np.sqrt(2 * h / g)
    n = int(np.log(1e-6) / np.log(e))
    exact = t0 * (1 + 2 * np.cumsum([0.0] + [e**k for k in range(1, n)]))
    zeno = t0 * (1 + e) / (1 - e)
    run = ns.simulate(system, duration=0.5 * (exact[-1] + exact[-2]), start={"x": h}, method=method, **METHODS[method])
    times = run["crossing_time"].values
    assert len(times) == n - 1
    assert np.max(np.abs(times - exact[:-1])) < 1e-12 * zeno
    speed = run["u_after"].sel(state="v").values
    assert np.max(np.abs(speed / (g * t0 * e ** np.arange(1, n)) - 1)) < 1e-8
    with pytest.raises(ns.SolveError, match="infinite number in finite time") as caught:
        ns.simulate(system, duration=2 * zeno, start={"x": h}, method=method, **METHODS[method])
    assert caught.value.status == "chatter"
    assert caught.value.time == pytest.approx(zeno, rel=1e-8)
    assert abs(caught.value.state["x"]) < 1e-8


@pytest.mark.parametrize("method", METHODS)
def test_impacts_of_a_forced_oscillator(method: str) -> None:
    """Between impacts the closed form from the state after the last one; at each, x = d and v+ = -e v- to the bit."""
    p = {"k": 1.0, "c": 0.1, "omega": 0.8, "d": 0.4, "e": 0.7, "A": 1.0}
    run = ns.simulate(ns.models.impact_oscillator(**p), periods=12, start={"x": 0.1}, method=method, **METHODS[method])
    times = run["crossing_time"].values
    before, after = run["u_before"].values, run["u_after"].values
    assert len(times) > 20
    assert np.max(np.abs(before[:, 0] - p["d"])) < 1e-12
    assert np.array_equal(after[:, 0], before[:, 0])
    assert np.max(np.abs(after[:, 1] + p["e"] * before[:, 1])) <= 2e-16 * np.abs(before[:, 1]).max()
    truth = LinearFlow([[0, 1], [-p["k"], -p["c"]]], [0, 0], {1: ([0, p["A"]], [0, 0])}, p["omega"])
    t0, u0 = 0.0, np.array([0.1, 0.0])
    for t, here, there in zip(times, before, after, strict=True):
        assert np.max(np.abs(truth.at(t0, u0, t) - here)) < 1e-11
        _, states = truth.along(t0, u0, t, 400)
        assert (states[2:-1, 0] < p["d"]).all()
        t0, u0 = t, there
    assert np.max(np.abs(truth.at(t0, u0, run["time"].values[-1]) - run["u"].values[-1])) < 1e-11


@pytest.mark.parametrize("method", METHODS)
def test_a_bang_bang_force_switched_at_phases(method: str) -> None:
    """x'' + x = F or -F by turns: every stretch is a rotation about (F, 0) or (-F, 0)."""
    force, period = 0.6, 2.3
    system = ns.System(
        states=["x", "v"],
        parameters={"F": force, "T": period},
        modes={"push": lambda t, u, p: (u.v, p.F - u.x), "pull": lambda t, u, p: (u.v, -p.F - u.x)},
        transitions=[ns.Transition("push", "pull", at=0.25), ns.Transition("pull", "push", at=0.75)],
        period=lambda p: p.T,
    )
    run = ns.simulate(system, periods=20, start=[0.3, 0.1], method=method, **METHODS[method])
    times = period * (0.25 + 0.5 * np.arange(40))
    assert np.allclose(run["crossing_time"], times, rtol=1e-15, atol=0)
    z, t, centre = 0.3 + 0.1j, 0.0, force
    for k, instant in enumerate(times):
        z, t = centre + (z - centre) * np.exp(-1j * (instant - t)), instant
        found = run["u_before"].values[k]
        assert abs(complex(*found) - z) < (5e-12 if method == "rkf45" else 1e-12)
        centre = -centre
    assert run["crossing_transition"].values.tolist() == [0, 1] * 20
    sections = ns.poincare(system, n=3, section=ns.Stroboscopic(0.25), start=[0.3, 0.1], method=method)
    assert np.allclose(sections["time"], period * (0.25 + np.arange(3)), rtol=1e-15)


def two_harmonics() -> ns.System:
    """A motion x = a1 cos(w t + s) + a3 cos(3 (w t + s)) through a gate at g that changes nothing but the mode."""

    def motion(t, u, p):
        force = (
            p.c1 * np.cos(p.w * t) + p.s1 * np.sin(p.w * t) + p.c3 * np.cos(3 * p.w * t) + p.s3 * np.sin(3 * p.w * t)
        )
        return u.v, force - p.k * u.x

    return ns.System(
        states=["x", "v"],
        parameters={"k": 0.05, "w": 1.0, "c1": 0.0, "s1": 0.0, "c3": 0.0, "s3": 0.0, "g": 0.0},
        modes={"low": motion, "high": motion},
        indicators={"gate": lambda t, u, p: u.x - p.g},
        transitions=[ns.Transition("low", "high", when="gate > 0"), ns.Transition("high", "low", when="gate < 0")],
    )


A1, A3 = 1.0, 0.6


def on_its_orbit(system: ns.System, shift: float, g: float) -> tuple[ns.System, dict[str, float]]:
    """The system forced so that x = A1 cos(t + shift) + A3 cos(3 (t + shift)) solves it, and the state at t = 0."""
    k = system.values["k"]
    f1, f3 = A1 * (k - 1.0), A3 * (k - 9.0)
    forced = system.with_parameters(
        c1=f1 * np.cos(shift), s1=-f1 * np.sin(shift), c3=f3 * np.cos(3 * shift), s3=-f3 * np.sin(3 * shift), g=g
    )
    start = {"x": A1 * np.cos(shift) + A3 * np.cos(3 * shift), "v": -A1 * np.sin(shift) - 3 * A3 * np.sin(3 * shift)}
    return forced, start


def passages(g: float, shift: float) -> np.ndarray:
    """All instants in (0, 2 pi) at which the orbit is at g, from the cubic 4 A3 c^3 + (A1 - 3 A3) c = g, c = cos."""
    roots = np.roots([4 * A3, 0.0, A1 - 3 * A3, -g])
    real = roots[np.abs(roots.imag) < 1e-9].real
    angles = np.arccos(real[np.abs(real) <= 1])
    return np.sort(np.concatenate([(angles - shift) % (2 * np.pi), (-angles - shift) % (2 * np.pi)]))


LOW = np.sqrt((3 * A3 - A1) / (12 * A3))  # the cosine at the inner extrema
INNER = 4 * A3 * LOW**3 + (A1 - 3 * A3) * LOW  # and the height of the inner minimum; the maximum is -INNER


@pytest.fixture(scope="module")
def orbit() -> ns.System:
    return two_harmonics()


@pytest.mark.parametrize("method", METHODS)
def test_two_crossings_and_two_extrema_within_a_step(method: str, orbit: ns.System) -> None:
    """Levels from well below to just within the inner wave: six passages in a period, two of them 1e-4 apart."""
    rng = np.random.default_rng(11)
    for depth in (0.3, 1e-2, 1e-4, 1e-6, 1e-8):
        for shift in rng.uniform(0, 2 * np.pi, 5):
            level = -INNER - depth
            system, start = on_its_orbit(orbit, shift, level)
            run = ns.simulate(system, duration=2 * np.pi, start=start, method=method, **METHODS[method])
            expected = passages(level, shift)
            assert len(expected) == 6
            times = run["crossing_time"].values
            assert len(times) == 6, (depth, shift, times, expected)
            assert np.max(np.abs(times - expected)) < 3e-12 / np.sqrt(depth)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_the_inner_maxima_graze_the_gate_by_a_picometre(side: float, orbit: ns.System) -> None:
    """100 random phases: 1e-12 below the gate two touches with that clearance, 1e-12 above it four crossings."""
    wrong = []
    for shift in np.random.default_rng(5).uniform(0, 2 * np.pi, 100):
        tops = np.sort([(a - shift) % (2 * np.pi) for a in (np.pi - np.arccos(LOW), np.pi + np.arccos(LOW))])
        system, start = on_its_orbit(orbit, shift, -INNER - side * 1e-12)
        begin = 0.05 if tops[0] < 0.01 or tops[1] > 2 * np.pi - 0.01 else 0.0
        run = ns.simulate(system, duration=2 * np.pi + begin, transient=begin, start=start)
        near = np.array([np.abs(((run["crossing_time"].values[:, None] - tops) + np.pi) % (2 * np.pi) - np.pi) < 1e-4])
        low = run["touch_clearance"].values < 1e-6
        touched = low & (run["touch_indicator"].values == 0)
        if side < 0:
            fine = near.sum() == 0 and touched.sum() == 2
            fine = fine and np.max(np.abs(run["touch_clearance"].values[touched] - 1e-12)) < 2e-13
        else:
            fine = near.sum() == 4
        if not fine:
            wrong.append((shift, near.sum(), touched.sum()))
    assert not wrong, f"{len(wrong)} of 100: {wrong[:5]}"


@pytest.mark.parametrize("method", METHODS)
def test_touches_of_a_damped_free_motion(method: str) -> None:
    """x = exp(-a t) cos(w t) + exp(-a t) (a / w) sin(w t): maxima exp(-a t_k) at t_k = 2 pi k / w."""
    a, w, g = 0.05, 1.1, 1.0
    system = ns.System(
        states=["x", "v"],
        parameters={"k": a**2 + w**2, "c": 2 * a, "g": g},
        modes={"only": lambda t, u, p: (u.v, -p.k * u.x - p.c * u.v)},
        indicators={"stop": lambda t, u, p: u.x - p.g},
        transitions=[ns.Transition("only", "only", when="stop > 0", reset=lambda t, u, p: (u.x, -u.v))],
    )
    run = ns.simulate(system, duration=30.0, start={"x": -1.0}, method=method, **METHODS[method])
    t = np.pi / w * np.arange(1, 30, 2)
    t = t[t < 30.0]
    assert run["crossing_time"].size == 0
    assert np.max(np.abs(run["touch_time"] - t)) < 1e-7
    assert np.max(np.abs(run["touch_clearance"] - (g - np.exp(-a * t)))) < (5e-12 if method == "rkf45" else 1e-12)
    assert np.max(np.abs(run["touch_u"].sel(state="x") - np.exp(-a * t))) < (5e-12 if method == "rkf45" else 1e-12)


@pytest.mark.parametrize("method", ["exact", "taylor"])
def test_touches_of_a_friction_are_where_its_limit_is_nearly_reached(method: str) -> None:
    """Held by friction under F cos w t the limit mu is missed by mu - F at each t = pi k / w, by either sign in turn;
    with F > mu it slips and sticks again, and where it slips nothing is merely touched."""

    def run(F: float) -> xr.Dataset:
        system = ns.mechanical(
            1.0,
            0.1,
            1.0,
            parameters={"F": F, "w": 0.5},
            forcing={"q": lambda t, p: p.F * np.cos(p.w * t)},
            elements={"rub": ns.elements.Coulomb(at="q", friction=0.6)},
        )
        return ns.simulate(system, duration=60.0, start={"q": 0.0}, method=method, **METHODS[method])

    held = run(0.59)
    assert held["crossing_time"].size == 0
    np.testing.assert_allclose(held["touch_time"], 2 * np.pi * np.arange(1, 10), atol=1e-6)
    np.testing.assert_allclose(held["touch_clearance"], 0.01, atol=1e-10)
    assert (np.diff(held["touch_indicator"]) != 0).all()
    slips = run(1.0)
    assert slips["crossing_time"].size > 15
    assert slips["touch_time"].size == 0


def test_an_impact_that_meets_the_end_of_a_step_every_period_is_no_chatter():
    """With the forcing as fast as the mode five steps make one period; a settled impact may lie on a step's end."""
    run = ns.simulate(ns.models.impact_oscillator(A=0.12), periods=300)
    gaps = np.diff(run["crossing_time"].values[-40:])
    assert len(gaps) == 39
    assert gaps == pytest.approx(2.0 * np.pi, abs=1e-8)  # one impact in each period of the forcing (omega = 1)


def test_a_step_never_passes_two_ends_of_a_period() -> None:
    """A slow mode, its own step far longer than the period, and then a transition at a quarter of a period."""
    system = ns.System(
        states=["x", "y"],
        parameters={"a": 0.3},
        period=1.0,
        modes={"waiting": lambda t, u, p: (p.a * u.x, -p.a * u.y), "ready": lambda t, u, p: (p.a * u.x, -p.a * u.y)},
        indicators={"level": lambda t, u, p: u.x - 5.0},
        transitions=[
            ns.Transition("waiting", "ready", when="level > 0"),
            ns.Transition("ready", "waiting", at=0.25, reset=lambda t, u, p: (u.x / 5.0, u.y + 0.0)),
        ],
    )
    run = ns.simulate(system, periods=7, start={"x": 1.0, "y": 1.0}, method="exact")
    assert np.abs(run.crossing_time.values - [np.log(5.0) / 0.3, 6.25]).max() < 1e-12
    assert abs(run.u_before.values[1, 0] - np.exp(0.3 * 6.25)) < 1e-12


def test_a_condition_on_what_is_identically_zero_does_not_hold() -> None:
    """``speed > 0`` is strict: where a mode holds v at zero it never holds, at a start or after a transition."""
    held = ns.System(
        states=["x", "v"],
        parameters={"k": 1.0},
        modes={"slip": lambda t, u, p: (u.v, -p.k * u.x), "stick": lambda t, u, p: (0 * u.x, 0 * u.v)},
        indicators={"speed": lambda t, u, p: u.v},
        transitions=[
            ns.Transition("slip", "stick", when="speed < 0", reset=lambda t, u, p: (u.x, 0 * u.v)),
            ns.Transition("stick", "slip", when="speed > 0"),
        ],
    )
    resting = ns.simulate(held, duration=5.0, start={"x": 0.3}, mode="stick", method="exact", samples=3)
    assert not resting.sizes["crossing"] and (resting["u"].values == [0.3, 0.0]).all()
    run = ns.simulate(held, duration=9.0, start={"v": 1.0}, method="exact", samples=3)
    assert run["crossing_time"].values == pytest.approx([np.pi / 2], abs=1e-13)  # sin t stops at its top
    assert run["u"].values[-1] == pytest.approx([1.0, 0.0], abs=1e-13)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("when", ["pull >= 0 and high > 0", "high > 0 and pull <= 0"])
def test_a_condition_that_is_not_strict_holds_where_its_indicator_stays_zero(method: str, when: str) -> None:
    """``pull`` is a x + (the speed of a mass at rest), with a = 0 nothing: the load comes each time sin t passes 1/2.

    Past it the mass swings about -1/2 and, let go where it falls below -0.9, about 0 again. Of another pull the other
    sign keeps it out."""
    system = ns.System(
        states=["x", "v", "still"],
        parameters={"a": 0.0},
        modes={
            "free": lambda t, u, p: (u.v, -u.x, -u.still),
            "loaded": lambda t, u, p: (u.v, -u.x - 0.5, -u.still),
        },
        indicators={
            "pull": lambda t, u, p: p.a * u.x + u.still,
            "high": lambda t, u, p: u.x - 0.5,
            "low": lambda t, u, p: u.x + 0.9,
        },
        transitions=[
            ns.Transition("free", "loaded", when=when),
            ns.Transition("loaded", "free", when="low < 0 and pull >= 0"),
        ],
    )
    run = ns.simulate(system, duration=16.0, start={"v": 1.0}, method=method, samples=3, **METHODS[method])
    radius = np.hypot(1.0, np.sqrt(0.75))  # about -1/2, from x = 1/2 with v = sqrt(3)/2
    low = np.pi / 6 + np.arccos(-0.4 / radius) + np.pi / 2 - np.arcsin(1.0 / radius)
    wide = np.sqrt(0.81 + radius**2 - 0.16)  # about 0, from x = -0.9
    again = low + 2 * np.pi - np.arccos(0.5 / wide) - np.arccos(-0.9 / wide)
    assert run["crossing_time"].values[:3] == pytest.approx([np.pi / 6, low, again], abs=1e-12)
    sign = 1.0 if ">= 0" in when else -1.0
    other = ns.simulate(system.with_parameters(a=-sign), duration=9.0, start={"v": 1.0}, method=method, samples=3)
    assert not other.sizes["crossing"]


@pytest.mark.parametrize("method", METHODS)
def test_a_start_from_which_modes_lead_back_to_each_other_is_refused(method: str) -> None:
    """Between -1 and 1 both modes are left at once; the run began in one of them, against its own condition."""
    relay = ns.System(
        states=["x"],
        parameters={"a": 1.0},
        modes={"up": lambda t, u, p: (p.a,), "down": lambda t, u, p: (-p.a,)},
        indicators={"high": lambda t, u, p: u.x + 1.0, "low": lambda t, u, p: u.x - 1.0},
        transitions=[ns.Transition("up", "down", when="high > 0"), ns.Transition("down", "up", when="low < 0")],
    )
    for mode in ("up", "down"):
        with pytest.raises(ns.SolveError, match="followed each other in ever shorter times"):
            ns.simulate(relay, duration=5.0, start={"x": 0.0}, mode=mode, method=method, **METHODS[method])
    above = ns.simulate(relay, duration=1.0, start={"x": 2.5}, mode="up", method=method, samples=2, **METHODS[method])
    assert above["mode"].values[0] == 1 and above["u"].values[0] == [2.5]


@pytest.mark.parametrize("method", METHODS)
def test_a_kick_at_a_phase_comes_once_each_period(method: str) -> None:
    """v grows by K at a quarter of each period and x moves on straight lines; the mode stays the same."""
    kick, period = 0.4, 2.0
    kicked = ns.System(
        states=["x", "v"],
        parameters={"K": kick, "T": period},
        modes={"drift": lambda t, u, p: (u.v, 0 * u.x)},
        transitions=[ns.Transition("drift", "drift", at=0.25, reset=lambda t, u, p: (u.x, u.v + p.K))],
        period=lambda p: p.T,
    )
    run = ns.simulate(kicked, periods=5, start=[0.0, 0.1], method=method, **METHODS[method])
    assert run["crossing_time"].values == pytest.approx(period * (0.25 + np.arange(5)), rel=1e-14)
    assert run["u_after"].values[:, 1] == pytest.approx(0.1 + kick * np.arange(1, 6), rel=1e-12)
    x = 0.1 * 5 * period + kick * sum(period * (5 - 0.25 - k) for k in range(5))
    assert run["u"].values[-1, 0] == pytest.approx(x, rel=1e-12)


def test_one_state_beside_one_memory_is_not_planar() -> None:
    """x' = a cos t - x + d: x = d + a (cos t + sin t) / 2 + (x(0) - d - a / 2) exp(-t); d is 0.5 beyond x = 2."""

    def field(t, u, p):
        return p.a * np.cos(t) - u.x + p.d

    system = ns.System(
        states=["x"],
        parameters={"a": 0.4},
        memory={"d": 0.3},
        modes={"before": field, "behind": field},
        indicators={"far": lambda t, u, p: u.x - 2.0},
        transitions=[ns.Transition("before", "behind", when="far > 0", write={"d": lambda t, u, p: 0.5})],
    )
    run = ns.simulate(system, periods=2, start={"x": 1.4}, method="exact")
    t = run["time"].values
    wanted = 0.3 + 0.2 * (np.cos(t) + np.sin(t)) + (1.4 - 0.3 - 0.2) * np.exp(-t)
    np.testing.assert_allclose(run["u"].values[:, 0], wanted, rtol=0, atol=1e-13)
    for start, d in ((1.4, 0.3), (2.5, 0.5)):
        found = ns.sweep(system, "a", [0.4, 0.6], start={"x": start}, keep=5, progress=False)
        np.testing.assert_allclose(found["section"].values[:, :, 0], [[d + 0.2] * 5, [d + 0.3] * 5], rtol=0, atol=1e-12)
