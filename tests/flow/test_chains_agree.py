"""Random chains of masses with contacts, belts, plays and preloads: the exact flow, Taylor series, and restarted runs.

The exact flow and the series share the loop over transitions, and nothing of a step, a crossing or a zero. A course
given by samples is compared with runs that begin anew at each sample, the course being a function of time there. Closed
forms of single cases stand in ``test_inputs`` and ``system/test_elements_by_hand``.
"""

from __future__ import annotations

from itertools import pairwise
from math import factorial
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, PPoly

import nonsmooth as ns

E = ns.elements
BY_METHOD = (0, 6, 13, 1)  # all but the last disagreed, or ended, before zero was judged by the size of terms
BY_RESTARTS = (0, 2, 11, 12, 1)  # before jumps of inputs were followed


def chain(rng: np.random.Generator, plate: Any, belt: Any, swing: float, **options: Any) -> ns.System:
    """One to three masses between springs, under loads that swing, with one to four of the elements."""
    n = int(rng.integers(1, 4))
    names = [f"q{i + 1}" for i in range(n)] if n > 1 else ["q"]
    k, loads = rng.uniform(0.5, 3, n + 1), rng.uniform(-1, 2, n)
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    M, e, mu = np.diag(rng.uniform(0.5, 2, n)), rng.choice([0, 0.3, 0.7], 3), rng.uniform(0.1, 0.6, 2)
    first, last = names[0], names[-1]
    elements = {
        "plate": E.Stop(at=first, side=-1, position=plate, restitution=float(e[0])),
        "wall": E.Stop(at=last, side=1, position=0.5, restitution=float(e[1])),
        "belt": E.Coulomb(at=last, friction=float(2 * mu[0]), belt=belt),
        "rail": E.Coulomb(at=first, friction=float(mu[1])),
        "soft": E.ElasticStop(at=first, side=-1, position=plate, stiffness=20.0, damping=0.5),
        "preload": E.PreloadedSpring(at=first, preload=0.3, stiffness=1.0),
        "play": E.Backlash(at=last, half_width=0.2, stiffness=10.0),
    }
    if n > 1:
        between = {first: 1.0, names[1]: -1.0}
        elements["between"] = E.Stop(at=between, side=1, position=0.3, restitution=float(e[2]))
        elements["joint"] = E.Coulomb(at=between, friction=0.2, static=0.3)
    chosen = rng.choice(list(elements), size=int(rng.integers(1, 5)), replace=False)
    forcing = {
        q: lambda t, p, load=load: -load + (swing * np.cos(p.w * t) if swing else 0.0)
        for q, load in zip(names, loads, strict=True)
    }
    return ns.mechanical(M, 0.1 * K, K, forcing=forcing, elements={name: elements[name] for name in chosen}, **options)


def start_of(rng: np.random.Generator, system: ns.System) -> dict[str, float]:
    """Each mass at .2, the edge of the play, with a speed of its own."""
    own = [name for name in system.states if name.strip("v_").startswith("q")]
    return {name: float(rng.uniform(-0.3, 0.3)) if name.startswith("v_") else 0.2 for name in own}


def driven_chain(seed: int) -> tuple[ns.System, dict[str, float]]:
    """A chain whose loads, plate and belt swing together, and its start."""
    rng = np.random.default_rng(seed)
    far, speed = rng.uniform(0.05, 0.4), rng.uniform(0.1, 1)
    plate, belt = lambda t, u, p: -0.6 + far * np.cos(p.w * t), lambda t, u, p: speed * np.sin(p.w * t)
    system = chain(rng, plate, belt, 0.7, parameters={"w": float(rng.uniform(0.8, 2.5))})
    return system, start_of(rng, system)


def apart_by_method(seed: int, method: str = "taylor") -> float:
    """The distance of a motion of 12 time units by the exact flow from that by a series method."""
    system, start = driven_chain(seed)
    exact, series = (ns.simulate(system, duration=12.0, start=start, method=one) for one in ("exact", method))
    return float(np.abs(exact.u.values[-1] - series.u.values[-1]).max())


def apart_by_restarts(seed: int, smooth: bool = False) -> float:
    """The distance of a motion under sampled courses from that of runs that begin anew at each sample."""
    rng = np.random.default_rng(seed)
    steps = bool(rng.random() < 0.5) and not smooth
    times = [np.append(0.0, np.cumsum(rng.uniform(0.3, 1.2, 6))) for _ in range(2)]
    values = rng.uniform(-1.0, -0.4, 7), rng.uniform(-0.5, 0.5, 7)
    seeds = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 1])
    declared = dict.fromkeys("yb", ("", "smooth") if smooth else "")
    driven = chain(seeds[0], lambda t, u, p: p.y, lambda t, u, p: p.b, 0.0, inputs=declared)
    known = {name + str(power): 0.0 for name in "yb" for power in range(4 if smooth else 2)}

    def course(name: str) -> Any:
        return lambda t, u, p: sum(p[one] * t ** int(one[1]) for one in known if one[0] == name)

    alone = chain(seeds[1], course("y"), course("b"), 0.0, parameters=known)
    start, end = start_of(rng, driven), min(one[-1] for one in times)
    inputs = {"y": (times[0], values[0]), "b": ns.Input(times[1], values[1], between="steps" if steps else None)}
    run = ns.simulate(driven, duration=end, start=start, inputs=inputs)
    curves = {name: (CubicSpline if smooth else line)(*at) for name, *at in zip("yb", times, values, strict=True)}
    if steps:
        curves["b"] = PPoly(values[1][None, :-1], times[1])
    for begin, until in pairwise(np.unique([t for one in times for t in one if t <= end])):
        now = {one: float(curves[one[0]](begin, int(one[1])) / factorial(int(one[1]))) for one in known}
        piece = ns.simulate(alone.with_parameters(**now), duration=until - begin, start=start)
        start = dict(zip(start, piece.u.values[-1].tolist(), strict=True))
    return float(np.abs(run.u.values[-1, : len(start)] - list(start.values())).max())


def line(times: np.ndarray, values: np.ndarray) -> Any:
    return PPoly(np.array([np.diff(values) / np.diff(times), values[:-1]]), times)


@pytest.mark.parametrize("seed", BY_METHOD)
def test_the_exact_flow_and_taylor_series(seed: int) -> None:
    assert apart_by_method(seed) < 1e-8


@pytest.mark.parametrize("seed", BY_RESTARTS)
def test_sampled_courses_and_restarted_runs(seed: int) -> None:
    assert apart_by_restarts(seed) < 1e-9


@pytest.mark.parametrize("seed", [3, pytest.param(169, marks=pytest.mark.slow)])
def test_smooth_courses_and_restarted_runs(seed: int) -> None:
    assert apart_by_restarts(seed, smooth=True) < 1e-9


@pytest.mark.parametrize("method", ["taylor", "rkf45"])
def test_a_run_that_goes_on_where_a_belt_turns_round(method: str) -> None:
    """The belt stands still at whole periods, where friction holds the mass: what it does then is still to come."""
    system, start = driven_chain(46)
    whole, rest = (
        ns.simulate(system, periods=10 - n, transient=n, start=start, method=method).u.values[-1] for n in (0, 9)
    )
    assert np.abs(whole - rest).max() < 1e-7


@pytest.mark.slow
def test_two_hundred_of_each() -> None:
    far = [("method", seed) for seed in range(200) if not apart_by_method(seed) < 1e-8]
    both = [(seed, smooth) for smooth in (False, True) for seed in range(200)]
    assert not far + [one for one in both if not apart_by_restarts(*one) < 1e-9]
