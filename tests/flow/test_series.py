"""The series engine against closed forms: jumps, chains, triggers, sections, extremes, records and statuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State, TrajectoryLog
from nonsmooth.flow.engines.series import SeriesEngine, order_for
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.system.system import System
from nonsmooth.system.transition import Mode, Transition

TIGHT: dict[str, dict[str, Any]] = {"taylor": {"rtol": 1e-14}, "rkf45": {"rtol": 1e-13}}


def engine(system: System, method: str = "taylor", **options: Any) -> SeriesEngine:
    return SeriesEngine(system.traced, system.scale_vector(), method, **(options or TIGHT[method]))


def record(
    system: System, start: list[float], until: float, samples: Any = (), method: str = "taylor", **options: Any
) -> tuple[TrajectoryLog, State]:
    e = engine(system, method, **options)
    tables = e.prepare(system.parameter_vector()[None])
    state = State(np.array(start, dtype=float), system.memory_vector())
    return e.record(tables, state, until, np.array(samples, dtype=float)), state


def chain(
    system: System,
    start: list[float],
    plan: Section,
    keep: int,
    transient: int = 0,
    method: str = "taylor",
    **options: Any,
) -> Kept:
    e = engine(system, method, **options)
    out = e.kept(1, keep)
    state = State(np.zeros(len(system.states)), system.memory_vector())
    tables = e.prepare(system.parameter_vector()[None])
    e.chain(tables, 0, 1, state, np.array([start], dtype=float), plan, transient, keep, out)
    return out


def ball(e: float = 0.8) -> System:
    """A ball that falls with unit gravity and rebounds from y = 0."""
    return System(
        states=("y", "v"),
        parameters={"e": e},
        modes={"flight": lambda t, u, p: (u.v, -1.0)},
        indicators={"height": lambda t, u, p: u.y, "speed": lambda t, u, p: u.v},
        transitions=[Transition("flight", "flight", when="height < 0", reset=lambda t, u, p: (u.y, -p.e * u.v))],
    )


def rotor(**modes: Any) -> System:
    """(x, y) = (cos t, sin t), with indicators x and y."""
    turn = lambda t, u, p: (-u.y, u.x)
    return System(
        states=("x", "y"),
        parameters={"a": 1.0},
        modes={"only": turn} | modes,
        indicators={"right": lambda t, u, p: u.x, "up": lambda t, u, p: u.y},
        outputs={"radius": (lambda t, u, p: u.x**2 + u.y**2, ""), "corner": (lambda t, u, p: np.abs(u.x), "")},
    )


def forced(omega: float = 2.0) -> System:
    """x' = cos(omega t): x = sin(omega t) / omega."""
    return System(
        states=("x",),
        parameters={"omega": omega},
        modes={"only": lambda t, u, p: (np.cos(p.omega * t),)},
        indicators={"level": lambda t, u, p: u.x - 0.1},
    )


@pytest.fixture(scope="module")
def bouncing() -> System:
    return ball()


# --- jumps


@pytest.mark.parametrize("method", TIGHT)
def test_bouncing_ball_ends_as_chatter_at_the_zeno_time(method: str, bouncing: System) -> None:
    """Thrown up with v0: the k-th impact at 2 v0 (1 - e^k) / (1 - e), all of them before 2 v0 / (1 - e)."""
    v0, e = 0.7, 0.8
    log, state = record(bouncing, [0.0, v0], 10.0, method=method)
    k = np.arange(1, 100)
    assert log.status == codes.CHATTER
    np.testing.assert_allclose(log.crossing_time[:99], 2 * v0 * (1 - e**k) / (1 - e), rtol=1e-12)
    np.testing.assert_allclose(log.u_before[:60, 1], -v0 * e ** (k[:60] - 1), rtol=1e-9)
    np.testing.assert_allclose(log.u_after[:60, 1], v0 * e ** k[:60], rtol=1e-9)
    assert state.clock[0] == pytest.approx(2 * v0 / (1 - e), rel=1e-9)


def test_a_start_beyond_a_stop_is_refused(bouncing: System) -> None:
    assert record(bouncing, [-0.1, 1.0], 1.0)[0].status == codes.BEYOND_STOP
    thrown, struck = record(bouncing, [0.0, 0.8], 1.0), record(bouncing, [0.0, -1.0], 1.0)  # moving in: it rebounds
    assert thrown[0].status == struck[0].status == codes.OK
    np.testing.assert_array_equal(thrown[1].u, struck[1].u)


def test_the_impact_oscillator_between_impacts() -> None:
    """x'' = -x, wall at x = d: amplitude from the energy, rebound with -r v (test problem A without forcing)."""
    d, r, v0 = 0.5, 0.8, 1.0
    system = System(
        states=("x", "v"),
        parameters={"d": d, "r": r},
        modes={"free": lambda t, u, p: (u.v, -u.x)},
        indicators={"wall": lambda t, u, p: u.x - p.d},
        transitions=[Transition("free", "free", when="wall > 0", reset=lambda t, u, p: (u.x, -p.r * u.v))],
    )
    for method in TIGHT:
        log, _ = record(system, [0.0, v0], 7.0, method=method)
        times, energy, t = [np.arcsin(d / v0)], v0**2, np.arcsin(d / v0)
        for _ in range(2):
            energy = d**2 + r**2 * (energy - d**2)
            if energy <= d**2:
                break
            t += 2 * np.pi - 2 * np.arccos(d / np.sqrt(energy))
            times.append(t)
        times = [t for t in times if t < 7.0]
        np.testing.assert_allclose(log.crossing_time[: len(times)], times, atol=2e-12)


def test_simultaneous_transitions_go_in_declared_order_and_chains_are_logged() -> None:
    """x = t: two transitions hold at x = 1; the target of the first is left at once, as x > 1 holds there too."""
    fields = {name: (lambda t, u, p: (1.0,)) for name in "abcd"}
    system = System(
        states=("x",),
        parameters={"g": 1.0},
        modes=fields,
        indicators={"h": lambda t, u, p: u.x - p.g},
        transitions=[
            Transition("a", "b", when="h > 0"),
            Transition("a", "d", when="h > 0"),
            Transition("b", "c", when="h > 0"),
        ],
    )
    log, state = record(system, [0.0], 2.0, [0.5, 1.0, 1.5])
    np.testing.assert_array_equal(log.crossing_transition, [0, 2])
    np.testing.assert_allclose(log.crossing_time, 1.0, rtol=1e-15)
    np.testing.assert_array_equal(log.sample_mode, [0, 2, 2])  # a sample at a crossing is the limit after it
    np.testing.assert_array_equal(log.sample_segment, [0, 2, 2])
    assert state.counters[0] == 2


def test_an_endless_chain_is_chatter() -> None:
    """Two modes that hand a moving point to one another at the same instant."""
    field = lambda t, u, p: (1.0,)
    system = System(
        states=("x",),
        parameters={"g": 1.0},
        modes={"a": field, "b": field},
        indicators={"h": lambda t, u, p: u.x - p.g},
        transitions=[Transition("a", "b", when="h > 0"), Transition("b", "a", when="h > 0")],
    )
    assert record(system, [0.0], 2.0)[0].status == codes.CHATTER


def test_after_limits_to_the_third_order() -> None:
    """At (0, 0, 0) the indicator x vanishes with its first two derivatives; it rises like t^3 / 6 in mode b."""
    system = System(
        states=("x", "v", "w", "s"),
        parameters={"g": 1.0},
        modes={
            "a": lambda t, u, p: (0.0, 0.0, 0.0, 1.0),
            "b": lambda t, u, p: (u.v, u.w, 1.0, 1.0),
            "c": lambda t, u, p: (0.0, 0.0, 0.0, 1.0),
        },
        indicators={"clock": lambda t, u, p: u.s - p.g, "h": lambda t, u, p: u.x},
        transitions=[Transition("a", "b", when="clock > 0"), Transition("b", "c", when="h > 0")],
    )
    for method in TIGHT:
        log, _ = record(system, [0.0, 0.0, 0.0, 0.0], 2.0, method=method)
        np.testing.assert_array_equal(log.crossing_transition, [0, 1])
        np.testing.assert_allclose(log.crossing_time, 1.0, rtol=1e-14)


@pytest.mark.parametrize("method", TIGHT)
def test_transitions_at_a_phase_are_exact_stops(method: str) -> None:
    """Bang-bang: x' = -1 in the first half of each period, +1 in the second; x is a triangle wave."""
    system = System(
        states=("x",),
        parameters={"T": 0.7},
        modes={"down": lambda t, u, p: (-1.0,), "up": lambda t, u, p: (1.0,)},
        transitions=[Transition("down", "up", at=0.5), Transition("up", "down", at=0.0)],
        period=lambda p: p.T,
    )
    samples = np.linspace(0.0, 7.0, 41)
    log, _ = record(system, [0.0], 7.0, samples, method=method)
    np.testing.assert_allclose(log.crossing_time, 0.35 * np.arange(1, 21), rtol=1e-14)
    np.testing.assert_allclose(log.sample_u[:, 0], -0.35 + np.abs(samples % 0.7 - 0.35), atol=1e-13)


def test_a_mode_may_lack_a_state() -> None:
    """Sticking holds x and has no v: NaN there; the release gives it back."""
    system = System(
        states=("x", "v"),
        parameters={"T": 2.0},
        period=lambda p: p.T,
        modes={"slip": lambda t, u, p: (u.v, 0.0), "stick": Mode(lambda t, u, p: (0.5,), states=["x"])},
        transitions=[
            Transition("slip", "stick", at=0.5),
            Transition("stick", "slip", at=0.0, reset=lambda t, u, p: (u.x, 2.0)),
        ],
    )
    log, _ = record(system, [0.0, 1.0], 2.9, [0.5, 1.5, 2.5])
    np.testing.assert_allclose(log.sample_u, [[0.5, 1.0], [1.25, np.nan], [2.5, 2.0]], rtol=1e-14)
    np.testing.assert_allclose(log.u_before, [[1.0, 1.0], [1.5, np.nan]], rtol=1e-14)
    np.testing.assert_allclose(log.u_after, [[1.0, np.nan], [1.5, 2.0]], rtol=1e-14)


# --- records


def test_logs_grow() -> None:
    """More than a thousand crossings and touches in one record; every one at its place."""
    system = System(
        states=("x", "v"),
        parameters={"g": 0.5},
        modes={"a": lambda t, u, p: (u.v, -u.x), "b": lambda t, u, p: (u.v, -u.x)},
        indicators={"h": lambda t, u, p: u.x - p.g, "far": lambda t, u, p: u.x - 1.5 - 0 * p.g},
        transitions=[
            Transition("a", "b", when="h > 0"),
            Transition("b", "a", when="h < 0"),
            Transition("b", "a", when="far > 0"),
        ],
    )
    turns = 600
    log, _ = record(system, [0.0, 1.0], 2 * np.pi * turns)
    first = np.arcsin(0.5)
    expected = np.sort(
        np.concatenate([first + 2 * np.pi * np.arange(turns), np.pi - first + 2 * np.pi * np.arange(turns)])
    )
    np.testing.assert_allclose(log.crossing_time, expected, atol=1e-9)
    far = log.touch_indicator == 1
    np.testing.assert_allclose(log.touch_time[far], np.pi / 2 + 2 * np.pi * np.arange(turns), atol=1e-7)
    np.testing.assert_allclose(log.touch_clearance[far], 0.5, atol=1e-10)
    np.testing.assert_allclose(log.touch_u[far], [[1.0, 0.0]] * turns, atol=1e-7)


@pytest.mark.parametrize("method", TIGHT)
def test_dense_samples_lie_on_the_solution(method: str) -> None:
    samples = np.sort(np.random.default_rng(1).uniform(0, 12.0, 200))
    log, state = record(rotor(), [1.0, 0.0], 12.0, samples, method=method)
    np.testing.assert_allclose(log.sample_u, np.stack([np.cos(samples), np.sin(samples)], axis=1), atol=3e-12)
    np.testing.assert_allclose(state.u, [np.cos(12.0), np.sin(12.0)], atol=3e-12)


# --- sections


@pytest.mark.parametrize("method", TIGHT)
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.9])
def test_stroboscopic_section_at_any_phase(method: str, phase: float) -> None:
    omega = 2.0
    out = chain(forced(omega), [0.3], Section(phase=phase), keep=3, transient=2, method=method)
    first = 2 if phase == 0.0 else 1
    period = 2 * np.pi / omega
    times = (np.arange(first + 1, first + 4) + phase) * period
    np.testing.assert_allclose(out.section_time[0], times, rtol=1e-14)
    np.testing.assert_allclose(out.section[0, :, 0], 0.3 + np.sin(omega * times) / omega, atol=3e-12)
    np.testing.assert_allclose(out.high[0, :1], 0.3 + 1 / omega, rtol=1e-11)  # true extremes, between the samples
    np.testing.assert_allclose(out.low[0, :1], 0.3 - 1 / omega, rtol=1e-11)
    np.testing.assert_allclose(out.high[0, 1:], 0.2 + 1 / omega, rtol=1e-11)
    np.testing.assert_allclose(out.elapsed, 3 * period, rtol=1e-14)


@pytest.mark.parametrize("method", TIGHT)
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_returns_of_the_transient_are_counted_like_those_kept(method: str, phase: float) -> None:
    """In the transient no step ends at the section; the returns that follow are the same."""
    whole = chain(forced(), [0.3], Section(phase=phase), keep=9, method=method)
    last = chain(forced(), [0.3], Section(phase=phase), keep=2, transient=7, method=method)
    np.testing.assert_allclose(last.section_time[0], whole.section_time[0, 7:], rtol=1e-14)
    np.testing.assert_allclose(last.section[0], whole.section[0, 7:], atol=1e-11)


@pytest.mark.parametrize("method", TIGHT)
@pytest.mark.parametrize(
    ("rising", "every", "times"), [(1, 1, [2, 4, 6]), (-1, 1, [1, 3, 5]), (0, 1, [1, 2, 3]), (1, 2, [4, 8, 12])]
)
def test_poincare_section_of_a_rotation(method: str, rising: int, every: int, times: list[int]) -> None:
    """y = sin t vanishes at k pi; the start on the section is no return."""
    plan = Section(indicator=1, rising=rising, every=every, t_max=100.0)
    out = chain(rotor(), [1.0, 0.0], plan, keep=3, method=method)
    assert out.status[0] == codes.OK
    np.testing.assert_allclose(out.section_time[0], np.pi * np.array(times), rtol=1e-12)
    np.testing.assert_allclose(out.section[0, :, 1], 0.0, atol=1e-11)
    np.testing.assert_allclose(out.high[0, :2], 1.0, rtol=1e-11)
    np.testing.assert_allclose(out.low[0, 2:4], -1.0, rtol=1e-11)
    np.testing.assert_allclose(out.high[0, 4:], [1.0, 1.0], rtol=1e-3)  # one of them has a corner and is sampled


def test_a_section_may_be_bound_to_a_mode() -> None:
    """y = sin t; mode b from t = 4 on (x + t clock): only passes after that count."""
    turn = lambda t, u, p: (-u.y, u.x, 1.0)
    system = System(
        states=("x", "y", "s"),
        parameters={"g": 4.0},
        modes={"a": turn, "b": turn},
        indicators={"up": lambda t, u, p: u.y, "clock": lambda t, u, p: u.s - p.g},
        transitions=[Transition("a", "b", when="clock > 0")],
    )
    plan = Section(indicator=0, rising=0, mode=1)
    out = chain(system, [1.0, 0.0, 0.0], plan, keep=2)
    np.testing.assert_allclose(out.section_time[0], [2 * np.pi, 3 * np.pi], rtol=1e-12)
    np.testing.assert_array_equal(out.section_mode, [[1, 1]])


@pytest.mark.parametrize(("after", "sign"), [(0, -1), (1, 1)])
@pytest.mark.parametrize("rising", [1, -1, 0])
def test_a_section_on_the_impact_surface_has_two_sides(after: int, sign: int, rising: int) -> None:
    """An elastic ball (e = 1): y arrives falling and leaves rising; one return per impact, before or after it."""
    out = chain(ball(1.0), [0.5, 0.0], Section(indicator=0, rising=rising, after=after, t_max=10.0), keep=3)
    np.testing.assert_allclose(out.section_time[0], [1.0, 3.0, 5.0], rtol=1e-13)
    np.testing.assert_allclose(out.section[0, :, 1], sign, rtol=1e-13)
    assert out.crossings[0] == 3


def test_maxima_of_the_flight_are_sections_and_extremes_hold_both_sides_of_a_jump() -> None:
    """Kept from the first maximum (t = 1) to the second one of height e^2 / 2."""
    out = chain(ball(0.5), [0.0, 1.0], Section(indicator=1, rising=-1, t_max=10.0), keep=1, transient=1)
    np.testing.assert_allclose(out.section_time[0], [2.0 + 0.5], rtol=1e-13)
    np.testing.assert_allclose(out.section[0, 0], [0.125, 0.0], atol=1e-13)
    np.testing.assert_allclose(out.high[0, :2], [0.5, 0.5], rtol=1e-13)
    np.testing.assert_allclose(out.low[0, :2], [0.0, -1.0], atol=1e-13)
    assert (out.crossings[0], out.contacts[0]) == (1, 1)


def test_no_return_is_said_so() -> None:
    system = System(
        states=("x",),
        parameters={"a": 1.0},
        modes={"only": lambda t, u, p: (-p.a * u.x,)},
        indicators={"h": lambda t, u, p: u.x},
    )
    assert chain(system, [1.0], Section(indicator=0, t_max=20.0), keep=1).status[0] == codes.NO_CONVERGENCE


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
def test_divergence_has_a_status(method: str) -> None:
    """x' = x^2 from 1 ends at t = 1."""
    system = System(states=("x",), parameters={"a": 1.0}, modes={"only": lambda t, u, p: (p.a * u.x**2,)})
    assert record(system, [1.0], 2.0, method=method)[0].status == codes.DIVERGED


def test_a_failed_point_does_not_spoil_the_next_one() -> None:
    """x' = -a x + cos t: the second of three carried points diverges (a < 0)."""
    system = System(
        states=("x",),
        parameters={"a": 1.0},
        modes={"only": lambda t, u, p: (-p.a * u.x + np.cos(t),)},
    )
    e = engine(system)
    tables = e.prepare(np.array([[1.0], [-3.0], [1.0]]))
    out = e.kept(3, 2)
    e.chain(tables, 0, 3, State(np.zeros(1), np.zeros(0)), None, Section(), 20, 2, out)
    np.testing.assert_array_equal(out.status, [codes.OK, codes.DIVERGED, codes.OK])
    np.testing.assert_allclose(out.section[[0, 2], :, 0], 0.5, rtol=1e-12)  # (cos t + sin t) / 2 at t = 0


def test_points_do_not_depend_on_how_they_are_chunked() -> None:
    system = forced()
    e, points = engine(system), np.linspace(1.0, 3.0, 6)[:, None]
    starts = np.full((6, 1), 0.2)
    whole, parts = e.kept(6, 2), e.kept(6, 2)
    e.chain(e.prepare(points), 0, 6, State(np.zeros(1), np.zeros(0)), starts, Section(), 3, 2, whole)
    for first in range(0, 6, 2):
        e.chain(e.prepare(points), first, first + 2, State(np.zeros(1), np.zeros(0)), starts, Section(), 3, 2, parts)
    np.testing.assert_array_equal(whole.section, parts.section)
    np.testing.assert_array_equal(whole.high, parts.high)


# --- linear modes by series


def test_four_linear_states_against_the_matrix_exponential() -> None:
    from scipy.linalg import expm

    A = np.array([[0.1, 2.0, 0.0, 0.3], [-30.0, -0.2, 1.0, 0.0], [0.0, 0.5, -0.4, 5.0], [1.0, 0.0, -5.0, 0.0]])
    system = System(
        states=("a", "b", "c", "d"),
        parameters={"g": 1.0},
        modes={"only": lambda t, u, p: tuple(A @ np.array(u) * p.g)},
    )
    start = [1.0, -1.0, 0.5, 2.0]
    _, state = record(system, start, 3.0, method="taylor", rtol=1e-15)
    truth = expm(3.0 * A) @ start
    np.testing.assert_allclose(state.u, truth, rtol=0, atol=1e-13 * np.abs(truth).max() * 3)


def two_spirals(w: float) -> System:
    return System(
        states=("x", "y"),
        parameters={"w": w},
        modes={
            "inner": lambda t, u, p: (u.x - p.w * u.y, p.w * u.x + u.y),
            "outer": lambda t, u, p: (u.x + p.w * u.y, -p.w * u.x + u.y),
        },
        indicators={"circle": lambda t, u, p: u.x**2 + u.y**2 - 1.0},
        transitions=[Transition("inner", "outer", when="circle > 0"), Transition("outer", "inner", when="circle < 0")],
    )


def test_linear_modes_through_a_curved_surface() -> None:
    """Problem L: two spirals, switching on the unit circle at t = 1 exactly; an indicator that is not affine."""
    w = 2 * np.pi
    system = two_spirals(w)
    end = np.pi / 2
    truth = np.exp(end - 1) * np.array([np.cos(w * (end - 1)), -np.sin(w * (end - 1))])
    for method, tolerance in (("taylor", 1e-12), ("rkf45", 1e-10)):
        log, state = record(system, [np.exp(-1.0), 0.0], end, method=method)
        np.testing.assert_allclose(state.u, truth, rtol=0, atol=tolerance * np.abs(truth).max())
        assert log.crossing_time == pytest.approx([1.0], abs=tolerance)


def test_linear_modes_with_a_curved_surface_run_at_the_sharpest_tolerance() -> None:
    """The exact flow is refused with a sentence that says by what such a system runs, as exactly."""
    w = 2 * np.pi
    system = two_spirals(w)
    with pytest.raises(ValueError, match="some indicator is not affine: .* Taylor series at rtol = 1e-15"):
        ns.simulate(system, duration=1.0, method="exact")
    run = ns.simulate(system, duration=np.pi / 2, start=[np.exp(-1.0), 0.0])
    angle = w * (np.pi / 2 - 1)
    truth = np.exp(np.pi / 2 - 1) * np.array([np.cos(angle), -np.sin(angle)])
    np.testing.assert_allclose(run["u"].values[-1], truth, rtol=0, atol=1e-13 * np.abs(truth).max())
    assert float(run["crossing_time"].values[0]) == pytest.approx(1.0, abs=1e-13)


# --- options


def test_a_method_that_is_no_series_is_refused() -> None:
    system = forced()
    with pytest.raises(ValueError, match="allowed: taylor"):
        SeriesEngine(system.traced, system.scale_vector(), name="euler")


def test_order_follows_the_tolerance() -> None:
    assert [order_for(10.0**-k) for k in (2, 6, 10, 15)] == [7, 11, 16, 22]
    assert order_for(1e-10, fixed_step=True) == 13  # ceil(1 - ln(1e-10) / 2)


@pytest.mark.parametrize("method", ["rkf45", "taylor", "exact"])
def test_a_run_that_pauses_goes_on_where_it_stood(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from nonsmooth.flow.engines import engine

    system = ns.models.discontinuous_support(omega=3.69, g=-0.0045, rho=0.29)

    def runs() -> list[np.ndarray]:
        swept = ns.sweep(system, "rho", [0.29, 0.3], method=method, transient=20, keep=4, max_period=2, progress=False)
        run = ns.simulate(system, periods=5, method=method, samples=20)
        return [swept.section.values, run.u.values, run.crossing_time.values]

    whole = runs()
    monkeypatch.setattr(engine, "PATIENCE", 30)
    for one, two in zip(whole, runs(), strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("method", ["rkf45", "taylor", "exact"])
@pytest.mark.parametrize("load", [0.33, 0.303])
def test_what_sticks_under_a_load_leaves_at_its_limit(method: str, load: float) -> None:
    """States that stand still have no error, however long the step: the load is followed all the same."""
    system = ns.mechanical(
        1.0,
        0.1,
        1.0,
        parameters={"w": 1.7},
        forcing={"q": lambda t, p: load * np.cos(p.w * t + 1.0)},
        elements={"rail": ns.elements.Coulomb(at="q", friction=0.3)},
        scale={"q": 1e-3, "v_q": 1e-3},
    )
    run = ns.simulate(system, duration=9.0, start={"q": 0.0}, method=method)
    held = [system.modes[jump.source] == "rail_stick" for jump in system.transitions]
    leaves = np.array(held)[run.crossing_transition.values]
    t, q = run.crossing_time.values[leaves], run.u_before.sel(state="q").values[leaves]
    assert len(t) == 5 and np.diff(t).min() > 1.0
    np.testing.assert_allclose(np.abs(load * np.cos(1.7 * t + 1.0) - q), 0.3, rtol=1e-8)


@pytest.mark.parametrize("method", ["rkf45", "taylor", "exact"])
def test_a_wall_that_moves_faster_than_the_mass_is_met(method: str) -> None:
    """A free mass at 0.1 t before a wall at 1 + 0.5 cos(20 t): the first zero of their distance."""
    system = ns.mechanical(
        1.0,
        0.0,
        0.0,
        parameters={"w": 20.0},
        forcing={"q": lambda t, p: 0.0 * p.w},
        elements={
            "wall": ns.elements.Stop(at="q", position=lambda t, u, p: 1 + 0.5 * np.cos(p.w * t), restitution=0.5)
        },
    )
    t = np.linspace(0.0, 6.0, 600_001)
    first = t[np.argmax(1 + 0.5 * np.cos(20 * t) < 0.1 * t)]
    run = ns.simulate(system, duration=6.0, start=[0.0, 0.1], method=method)
    assert float(run.crossing_time[0]) == pytest.approx(first, abs=2e-5)
    assert float(run.crossing_time[0]) * 0.1 == pytest.approx(
        1 + 0.5 * np.cos(20 * float(run.crossing_time[0])), abs=1e-8
    )
