"""The pressure relief valve (Hos and Champneys; test problem of MPGOS) integrated by heyoka.

y1' = y2, y2' = -k y2 - (y1 + delta) + y3, y3' = beta (q - y1 sqrt(y3)); seat at y1 = 0 with y2+ = -r y2-;
section: maxima of y1 (y2 falls through zero). The impact is a terminal event whose callback applies the restitution
and lets the integration go on; the maxima are a non-terminal event. One compiled integrator serves all parameters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

NAMES = ("k", "delta", "beta", "r", "q")
DEFAULTS = {"k": 1.25, "delta": 10.0, "beta": 20.0, "r": 0.8, "q": 5.0}


@dataclass
class Run:
    section: NDArray[np.float64]  # (n, 3) states at the maxima of y1
    section_time: NDArray[np.float64]
    impact_time: list[float]
    impact_speed: list[float]  # y2 before the impact
    minima: list[float]  # y1 at interior minima (y2 rising through zero)
    end: NDArray[np.float64]
    n_steps: int


class _Impact:
    """Restitution at the seat; a start or an event with y2 >= 0 is no impact."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.speeds: list[float] = []

    def __deepcopy__(self, _memo: Any) -> _Impact:
        return self

    def __call__(self, ta: Any, _direction: int) -> bool:
        state = ta.state
        self.times.append(ta.time)
        self.speeds.append(float(state[1]))
        state[0] = 0.0
        state[1] *= -ta.pars[3]
        return True


class _Maximum:
    def __init__(self) -> None:
        self.points: list[tuple[float, NDArray[np.float64]]] = []

    def __deepcopy__(self, _memo: Any) -> _Maximum:
        return self

    def __call__(self, ta: Any, time: float, _direction: int) -> None:
        self.points.append((time, np.array(ta.update_d_output(time))))


@cache
def compiled(tolerance: float) -> tuple[Any, _Impact, _Maximum, _Maximum]:
    y1, y2, y3 = hy.make_vars("y1", "y2", "y3")
    k, delta, beta, _, q = (hy.par[i] for i in range(5))
    impact, maxima, minima = _Impact(), _Maximum(), _Maximum()
    falling, rising = hy.event_direction.negative, hy.event_direction.positive
    ta = hy.taylor_adaptive(
        [(y1, y2), (y2, -k * y2 - (y1 + delta) + y3), (y3, beta * (q - y1 * hy.sqrt(y3)))],
        [1.0, 0.0, 1.0],
        pars=[0.0] * 5,
        tol=tolerance,
        t_events=[hy.t_event(y1, callback=impact, direction=falling, cooldown=1e-10)],
        nt_events=[hy.nt_event(y2, maxima, direction=falling), hy.nt_event(y2, minima, direction=rising)],
    )
    return ta, impact, maxima, minima


def run(
    parameters: Mapping[str, float], start: NDArray[np.float64], duration: float, *, tolerance: float = 1e-10
) -> Run:
    """March `duration` units of time from `start` (y1 > 0)."""
    ta, impact, maxima, minima = compiled(tolerance)
    for notes in (impact.times, impact.speeds, maxima.points, minima.points):
        notes.clear()
    ta.time = 0.0
    ta.state[:] = start
    ta.pars[:] = [(DEFAULTS | dict(parameters))[name] for name in NAMES]
    ta.reset_cooldowns()
    outcome = ta.propagate_until(float(duration))
    if int(outcome[0]) != int(hy.taylor_outcome.time_limit):
        raise RuntimeError(f"heyoka stopped with {outcome[0]} at t = {ta.time}")
    points = maxima.points
    return Run(
        np.array([u for _, u in points]).reshape(-1, 3),
        np.array([t for t, _ in points]),
        list(impact.times),
        list(impact.speeds),
        [float(u[0]) for _, u in minima.points],
        np.array(ta.state),
        outcome[3],
    )


def equilibrium(parameters: Mapping[str, float]) -> NDArray[np.float64]:
    """Rest point: y1 sqrt(y1 + delta) = q."""
    p = DEFAULTS | dict(parameters)
    roots = np.roots([1.0, p["delta"], 0.0, -(p["q"] ** 2)])
    y1 = float(max(r.real for r in roots if abs(r.imag) < 1e-9))
    return np.array([y1, 0.0, y1 + p["delta"]])


def linearisation(parameters: Mapping[str, float]) -> NDArray[np.float64]:
    """Jacobian of the field at the rest point."""
    p = DEFAULTS | dict(parameters)
    y1, _, y3 = equilibrium(parameters)
    return np.array(
        [
            [0.0, 1.0, 0.0],
            [-1.0, -p["k"], 1.0],
            [-p["beta"] * np.sqrt(y3), 0.0, -p["beta"] * y1 / (2 * np.sqrt(y3))],
        ]
    )
