"""Steep terms that are below rounding where a Taylor step begins: found, whatever their width and the tolerance.

The truth is SciPy's LSODA, made to stop where a layer begins and to take small steps inside it, or a closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nonsmooth as ns
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.layers import layers
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.kernels.hybrid import codes as at

WIDTHS = (1e-2, 1e-3, 1e-4, 1e-5)
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)
K, F, START, END = 100.0, 0.2, 0.02, 1.5  # stiffness and force per mass, first elongation; five passes of v = 0

# Force over F as a function of v / w, and how many widths its steep part reaches.
SHAPES: dict[str, tuple[Callable[[Any], Any], float]] = {
    "step": (lambda s: np.tanh(s), 25.0),
    "bell": (lambda s: np.exp(-(s**2)), 8.0),
    "resonance": (lambda s: 1.0 / (1.0 + s**2), 50.0),
    "kink": (lambda s: s / np.sqrt(1.0 + s**2), 50.0),
}


def block(shape: str) -> ns.System:
    f = SHAPES[shape][0]
    return ns.System(
        states=("x", "v"),
        parameters={"w": 1.0},
        modes={"slip": lambda t, u, p: (u.v, -K * u.x - F * f(u.v / p.w))},
    )


BLOCKS = {shape: block(shape) for shape in SHAPES}


def in_stretches(f: Callable[..., Any], u: Any, end: float, level: float, inside: float, relative: Any) -> Any:
    """LSODA in stretches that end where relative(t, u) passes +-level; between the two steps of at most ``inside``."""
    t, u = 0.0, np.array(u, dtype=float)
    within = abs(relative(t, u)) < level
    while t < end:
        edges = [lambda t, u, s=s: s * relative(t, u) - level for s in (1.0, -1.0)]
        for edge in edges:
            edge.terminal, edge.direction = True, 1.0 if within else -1.0
        step = inside if within else 1e-2
        run = solve_ivp(f, (t, end), u, method="LSODA", rtol=1e-13, atol=1e-15, max_step=step, events=edges)
        t, u, within = run.t[-1], run.y[:, -1], not within
    return u


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_layer_of_any_width_is_seen(shape: str, width: float) -> None:
    f, reach = SHAPES[shape]
    system = BLOCKS[shape].with_parameters(w=width)
    field = lambda t, u: (u[1], -K * u[0] - F * float(f(u[1] / width)))
    # At v = 0 the acceleration is about K * START = 2: the steep part lasts for width / 2.
    truth = in_stretches(field, (START, 0.0), END, reach * width, 0.1 * width, lambda t, u: u[1])
    for rtol in TOLERANCES:
        end = ns.simulate(system, duration=END, start={"x": START}, method="taylor", rtol=rtol, samples=2)
        assert np.abs(end["u"].values[-1] - truth).max() <= rtol + 2e-11


@pytest.mark.parametrize("rtol", TOLERANCES)
def test_dry_friction_in_its_limit_loses_the_same_amplitude_every_half_period(rtol: float) -> None:
    """Coulomb: |x| falls by 2 F / K from one turning point to the next. A layer of width w changes that by O(w)."""
    width, turns = 1e-6, 4
    end = ns.simulate(
        BLOCKS["step"].with_parameters(w=width),
        duration=turns * np.pi / np.sqrt(K),
        start={"x": START},
        method="taylor",
        rtol=rtol,
        samples=2,
    )
    assert end["u"].values[-1, 0] == pytest.approx(START - turns * 2.0 * F / K, abs=rtol + turns * width / np.sqrt(K))


def test_a_block_that_comes_to_rest_in_the_layer_creeps() -> None:
    """At last K x is less than F: v = -w artanh(K x / F) up to terms of the size of w (K / F) w."""
    width, end = 1e-3, 4.0
    system = BLOCKS["step"].with_parameters(w=width)
    field = lambda t, u: (u[1], -K * u[0] - F * np.tanh(u[1] / width))
    truth = solve_ivp(field, (0.0, end), (START, 0.0), method="LSODA", rtol=1e-12, atol=1e-15, max_step=1e-3).y[:, -1]
    x, v = ns.simulate(system, duration=end, start={"x": START}, method="taylor", rtol=1e-9, samples=2)["u"].values[-1]
    assert abs(x) < F / K
    assert v == pytest.approx(-width * np.arctanh(K * x / F), rel=0.02)
    assert np.abs((x, v) - truth).max() < 1e-9


@pytest.mark.parametrize("speed", [0.05, 0.17, 0.19, 0.199, 0.2, 0.3])
def test_friction_on_a_moving_belt(speed: float) -> None:
    """The layer moves with the belt; about speed 0.2 the free motion only just overtakes it."""
    width = 1e-4
    belt = lambda t: 1.0 + 0.1 * np.cos(7.0 * t)
    system = ns.System(
        states=("x", "v"),
        parameters={"s": 1.0},
        modes={"slip": lambda t, u, p: (u.v, -K * u.x - F * np.tanh((u.v - p.s * belt(t)) / width))},
    ).with_parameters(s=speed)
    field = lambda t, u: (u[1], -K * u[0] - F * np.tanh((u[1] - speed * belt(t)) / width))
    relative = lambda t, u: u[1] - speed * belt(t)
    truth = in_stretches(field, (START, 0.0), END, 25.0 * width, 0.1 * width, relative)
    for rtol in (1e-6, 1e-9):
        end = ns.simulate(system, duration=END, start={"x": START}, method="taylor", rtol=rtol, samples=2)
        assert np.abs(end["u"].values[-1] - truth).max() <= 2.0 * rtol


@pytest.mark.parametrize("rtol", TOLERANCES)
def test_an_indicator_with_a_hidden_kink(rtol: float) -> None:
    """Straight flights through a disc that pass its centre at 1e-9: the distance to it turns over there."""
    radius, first, miss = 0.5, 0.2, 1e-9
    system = ns.System(
        states=("x", "y", "v"),
        parameters={"r": radius},
        modes={"flight": lambda t, u, p: (u.v, 0.0, 0.0)},
        indicators={"outside": lambda t, u, p: np.sqrt(u.x**2 + u.y**2) - p.r},
        transitions=[
            ns.Transition("flight", "flight", when="outside > 0", reset=lambda t, u, p: (u.x, u.y, -u.v)),
        ],
    )
    start = {"x": -first, "y": miss, "v": 1.0}
    run = ns.simulate(system, duration=5.0, start=start, method="taylor", rtol=rtol, samples=2)
    half = np.sqrt(radius**2 - miss**2)
    assert run["crossing_time"].values == pytest.approx(first + half + 2.0 * half * np.arange(5), abs=1e-9)


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_a_wall_that_is_felt_only_near_by(rtol: float) -> None:
    """x'' = c / x^3 from x = 1, x' = -1: x^2 = 1 - 2 t + (1 + c) t^2 turns at x = sqrt(c), here 1e-4."""
    c, end = 1e-8, 4.0
    system = ns.System(states=("x", "v"), parameters={"c": c}, modes={"flight": lambda t, u, p: (u.v, p.c / u.x**3)})
    run = ns.simulate(
        system, duration=end, start={"x": 1.0, "v": -1.0}, method="taylor", rtol=rtol, atol=1e-12, samples=2
    )
    truth = np.sqrt(1.0 - 2.0 * end + (1.0 + c) * end**2)
    assert run["u"].values[-1, 0] == pytest.approx(truth, rel=10.0 * rtol)


# --- what is watched, and that smooth systems do not pay ----------------------------------------------------------


def guards(field: Callable[..., Any], **parameters: float) -> set[str]:
    system = ns.System(states=("x", "v"), parameters=parameters, modes={"m": field})
    found = layers(system.traced)
    return {str(row[0]) for row in found.model.outputs} if found.checked else set()


@pytest.mark.parametrize(
    ("force", "watched"),
    [
        (lambda t, u, p: np.tanh(u.v / p.w), {"u_v"}),
        (lambda t, u, p: 3.0 * np.exp(-((u.v / p.w) ** 2)), {"u_v"}),
        (lambda t, u, p: np.arctan(2.0 * u.x) + np.tanh(u.x), {"u_x"}),
        (lambda t, u, p: u.x**41, {"u_x"}),
        (lambda t, u, p: 1.0 / u.x**2, {"u_x"}),
        (lambda t, u, p: np.sin(p.w * t) * u.x**3 - u.v * np.sqrt(u.x) + np.cos(u.x), set()),
    ],
)
def test_what_is_watched(force: Callable[..., Any], watched: set[str]) -> None:
    assert guards(lambda t, u, p: (u.v, force(t, u, p)), w=1.0) == watched


def test_a_base_that_never_vanishes_is_watched_with_what_moves_it() -> None:
    found = guards(lambda t, u, p: (u.v, 1.0 / (1.0 + (u.v / p.w) ** 2)), w=1.0)
    assert "u_v" in found and len(found) == 2


def test_systems_without_such_terms_run_as_they_stand() -> None:
    for system in (ns.models.discontinuous_support().smoothed(eta=1e-5), ns.models.relief_valve()):
        found = layers(system.traced)
        assert found.model == system.traced and not found.checked


class Counting(SeriesEngine):
    """Counts the steps of its last run."""

    watchful = True
    work: Any = None

    @property
    def steps(self) -> int:
        return int(self.work.tally[at.STEPS])

    @property
    def layers(self) -> Any:
        found = layers(self.traced)
        return found if self.watchful else type(found)(self.traced, 0, False)

    def _work(self) -> Any:
        self.work = super()._work()
        return self.work


SMOOTH: dict[str, tuple[Callable[..., Any], list[float]]] = {
    "Toda": (lambda t, u, p: (u.v, 1.0 - np.exp(u.x)), [1.0, 0.0]),
    "soft friction": (lambda t, u, p: (u.v, -u.x - 0.1 * np.tanh(u.v) + np.cos(1.3 * t)), [1.0, 0.0]),
}


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("case", SMOOTH)
def test_smooth_problems_take_the_steps_they_took(case: str, rtol: float) -> None:
    field, start = SMOOTH[case]
    system = ns.System(states=("x", "v"), parameters={}, modes={"m": field})
    steps = []
    for watchful in (False, True):
        engine = Counting(system.traced, system.scale_vector(), "taylor", rtol)
        engine.watchful = watchful
        state = State(np.array(start), system.memory_vector())
        engine.record(engine.prepare(system.parameter_vector()[None]), state, 100.0, np.empty(0))
        steps.append(engine.steps)
    assert steps[0] <= steps[1] <= 1.02 * steps[0] + 1
