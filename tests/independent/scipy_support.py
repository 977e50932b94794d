"""A second independent integrator: SciPy's DOP853 with events, slow and careful, to check heyoka with.

Steps are limited to a 200th of a forcing period, so that two crossings of one indicator in one step need a contact
shorter than that.
"""

from __future__ import annotations

from collections.abc import Mapping

import heyoka_support as hs
import heyoka_valve as hv
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp


def run_oscillator(
    p: Mapping[str, float], n_periods: int, start: tuple[float, float] | NDArray[np.float64]
) -> tuple[NDArray[np.float64], list[tuple[float, str]]]:
    """States after each period and the crossings (time, kind), as `heyoka_support.run` names them."""
    period, tau = 2 * np.pi / p["omega"], p["c_s"] / p["k_s"]
    u, mode = np.array(start, dtype=float), hs.region(p, *start)
    states, crossings = [u], []

    def penetration(_t: float, u: NDArray[np.float64]) -> float:
        return u[0] - p["g"]

    def separation(_t: float, u: NDArray[np.float64]) -> float:
        return -(u[0] - p["g"]) - tau * u[1]

    for i in range(n_periods):
        t = 0.0
        while t < period:
            rows = [(separation, 1, "release")] if mode else [(penetration, 1, "enter_a"), (separation, -1, "enter_b")]
            events = []
            for function, direction, _ in rows:
                event = lambda t, u, function=function: function(t, u)
                event.direction = direction
                events.append(event)
            s = solve_ivp(
                lambda t, u, mode=mode: [u[1], hs.acceleration(p, t, u[0], u[1], mode)],
                (t, period),
                u,
                method="DOP853",
                rtol=1e-12,
                atol=1e-16,
                events=events,
                max_step=period / 200,
            )
            hits = [
                (when, kind, state)
                for (_, _, kind), times, points in zip(rows, s.t_events, s.y_events, strict=True)
                for when, state in zip(times, points, strict=True)
                if when - t > 1e-11 and (kind != "enter_b" or state[0] > p["g"])
            ]
            if not hits:
                t, u = period, s.y[:, -1]
                break
            t, kind, u = min(hits, key=lambda hit: hit[0])
            crossings.append((i * period + t, kind))
            mode = 1 - mode
        states.append(u)
    return np.array(states), crossings


def run_valve(
    parameters: Mapping[str, float], start: NDArray[np.float64], duration: float
) -> tuple[NDArray[np.float64], list[float], list[float]]:
    """End state, impact times and the times of the maxima of y1."""
    p = hv.DEFAULTS | dict(parameters)
    t, u = 0.0, np.array(start, dtype=float)
    impacts: list[float] = []
    maxima: list[float] = []

    def field(_t: float, u: NDArray[np.float64]) -> list[float]:
        return [u[1], -p["k"] * u[1] - u[0] - p["delta"] + u[2], p["beta"] * (p["q"] - u[0] * np.sqrt(u[2]))]

    def seat(_t: float, u: NDArray[np.float64]) -> float:
        return u[0]

    def top(_t: float, u: NDArray[np.float64]) -> float:
        return u[1]

    seat.terminal, seat.direction, top.direction = True, -1, -1
    while t < duration:
        s = solve_ivp(
            field, (t, duration), u, method="DOP853", rtol=1e-12, atol=1e-14, events=[seat, top], max_step=0.02
        )
        maxima += list(s.t_events[1])
        t, u = s.t[-1], s.y[:, -1]
        if len(s.t_events[0]):
            impacts.append(t)
            u = np.array([0.0, -p["r"] * u[1], u[2]])
    return u, impacts, maxima
