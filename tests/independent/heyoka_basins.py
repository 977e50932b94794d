"""Attractors that starts reach, by brute force with heyoka: a truth for basins that shares no code with `nonsmooth`.

The paper's oscillator with its support switched by a runtime parameter at terminal events, and the Duffing oscillator.
A run is followed over a long transient; its last section points give its period, or that it has none.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray
from where_runs_end import End, end_of

TABLE_1 = {"m": 0.838, "k": 8.47, "k_s": 1210.0, "c": 0.87, "c_s": 0.60}
ON = 8  # index of the mode among the runtime parameters
KEPT = 64


class Support:
    """The paper's oscillator: (x, v), contact begins where h_a > 0 and h_b < 0 and ends where h_b > 0."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        p = dict(TABLE_1, **parameters)
        x, v = hy.make_vars("x", "v")
        stiffness, damping, force, omega, gap, support, dashpot, tau, on = (hy.par[i] for i in range(9))
        depth = x - gap
        free = force * hy.cos(omega * hy.time) - stiffness * x - damping * v

        def switch(ta: Any, _direction: int) -> bool:
            ta.pars[ON] = 1.0 - ta.pars[ON]
            return True

        def begin_beyond(ta: Any, _direction: int) -> bool:
            if ta.state[0] > ta.pars[4]:
                ta.pars[ON] = 1.0
            return True

        rising = hy.event_direction.positive
        watched = [
            hy.t_event((1.0 - on) * depth - on * (depth + tau * v), callback=switch, direction=rising),
            hy.t_event((1.0 - on) * (depth + tau * v) - on, callback=begin_beyond, direction=rising),
        ]
        m, self.tau, self.gap = p["m"], p["c_s"] / p["k_s"], p["g"]
        self.period = 2 * np.pi / p["omega"]
        pars = [2 * p["k"] / m, p["c"] / m, p["rho"] / m, p["omega"], p["g"], p["k_s"] / m, p["c_s"] / m, self.tau, 0.0]
        self.ta = hy.taylor_adaptive(
            [(x, v), (v, free - on * (support * depth + dashpot * v))],
            [0.0, 0.0],
            pars=pars,
            tol=1e-14,
            t_events=watched,
        )

    def start(self, u: NDArray[np.float64]) -> None:
        depth = u[0] - self.gap
        self.ta.time = 0.0
        self.ta.state[:] = u
        self.ta.pars[ON] = float(depth > 0 and depth + self.tau * u[1] > 0)
        self.ta.reset_cooldowns()


class Duffing:
    """x'' = x - x^3 - damping x' + force cos(omega t)."""

    def __init__(self, damping: float, force: float, omega: float) -> None:
        x, v = hy.make_vars("x", "v")
        self.period = 2 * np.pi / omega
        self.ta = hy.taylor_adaptive(
            [(x, v), (v, x - x * x * x - damping * v + force * hy.cos(omega * hy.time))], [0.0, 0.0], tol=1e-14
        )

    def start(self, u: NDArray[np.float64]) -> None:
        self.ta.time = 0.0
        self.ta.state[:] = u


def ends(
    machine: Support | Duffing, starts: NDArray[np.float64], transient: int = 600, longest: int = 6000
) -> list[End]:
    """The end of every start. A run without a period is followed up to ``longest`` forcing periods."""
    return [_end(machine, u, transient, longest) for u in starts]


def _end(machine: Support | Duffing, u: NDArray[np.float64], transient: int, longest: int) -> End:
    machine.start(u)
    ta, waited = machine.ta, transient
    ta.propagate_until(transient * machine.period)
    while True:
        grid = ta.time + machine.period * np.arange(KEPT + 1)
        points = np.asarray(ta.propagate_grid(grid)[5])[1:]
        end = end_of(points)
        waited += 500
        if end.period_number or waited > longest:
            return end
        ta.propagate_until(ta.time + 500 * machine.period)
