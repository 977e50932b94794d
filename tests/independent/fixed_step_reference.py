"""Reference without located crossings: a fixed-step Fehlberg method that switches fields by sign inside its stages.

Also the truth for the nonlinear switched case, from heyoka with terminal events.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

# Fehlberg (1969), RK4(5) formula 2: the nodes, matrix and fourth-order weights.
NODES = np.array([0, 1 / 4, 3 / 8, 12 / 13, 1, 1 / 2])
MATRIX = [
    [],
    [1 / 4],
    [3 / 32, 9 / 32],
    [1932 / 2197, -7200 / 2197, 7296 / 2197],
    [439 / 216, -8, 3680 / 513, -845 / 4104],
    [-8 / 27, 2, -3544 / 2565, 1859 / 4104, -11 / 40],
]
WEIGHTS = np.array([25 / 216, 0, 1408 / 2565, 2197 / 4104, -1 / 5, 0])

Field = Callable[[float, NDArray[np.float64]], NDArray[np.float64]]


def march(field: Field, u: NDArray[np.float64], duration: float, step: float) -> NDArray[np.float64]:
    """Fixed steps of at most `step` (as many equal ones as fit `duration`), order 4, no crossing looked for."""
    n = int(np.ceil(duration / step - 1e-9))
    h = duration / n
    for i in range(n):
        slopes: list[NDArray[np.float64]] = []
        for node, row in zip(NODES, MATRIX, strict=True):
            slopes.append(
                field(i * h + node * h, u + h * sum((a * s for a, s in zip(row, slopes, strict=True)), 0 * u))
            )
        u = u + h * sum(w * s for w, s in zip(WEIGHTS, slopes, strict=True))
    return u


# ------------------------------------------------------------------------------------------- problem L (after nosnoc)

TURN = 2 * np.pi
SPIRALS = (np.array([[1.0, -TURN], [TURN, 1.0]]), np.array([[1.0, TURN], [-TURN, 1.0]]))
SPIRAL_START = np.array([np.exp(-1.0), 0.0])
SPIRAL_DURATION = np.pi / 2
SPIRAL_END = np.exp(SPIRAL_DURATION - 1) * np.array(
    [np.cos(TURN * (SPIRAL_DURATION - 1)), -np.sin(TURN * (SPIRAL_DURATION - 1))]
)


def spiral(_t: float, u: NDArray[np.float64]) -> NDArray[np.float64]:
    return SPIRALS[int(u @ u > 1)] @ u


# ------------------------------------------------------------------- a Duffing oscillator with a stiffer side (x > g)

DUFFING = {"damping": 0.1, "force": 2.0, "omega": 1.3, "g": 0.4, "support": 25.0, "dashpot": 0.5}
DUFFING_START = np.array([0.1, 0.2])


def duffing(t: float, u: NDArray[np.float64]) -> NDArray[np.float64]:
    p = DUFFING
    x, v = u
    support = p["support"] * (x - p["g"]) + p["dashpot"] * v if x > p["g"] else 0.0
    return np.array([v, p["force"] * np.cos(p["omega"] * t) - x - x**3 - p["damping"] * v - support])


@cache
def duffing_truth(duration: float) -> tuple[tuple[float, float], tuple[float, ...], float]:
    """State at `duration`, the crossing times of x = g and the least speed there (heyoka, tolerance 1e-18)."""
    p = DUFFING
    x, v = hy.make_vars("x", "v")
    free = p["force"] * hy.cos(p["omega"] * hy.time) - x - x**3 - p["damping"] * v
    times: list[float] = []
    speeds: list[float] = []

    class Switch:
        def __call__(self, ta: object, direction: int) -> bool:
            ta.pars[0] = float(direction > 0)
            times.append(float(ta.time))
            speeds.append(abs(float(ta.state[1])))
            return True

        def __deepcopy__(self, _memo: object) -> Switch:
            return self

    ta = hy.taylor_adaptive(
        [(x, v), (v, free - hy.par[0] * (p["support"] * (x - p["g"]) + p["dashpot"] * v))],
        list(DUFFING_START),
        pars=[0.0],
        tol=1e-18,
        high_accuracy=True,
        t_events=[hy.t_event(x - p["g"], callback=Switch(), cooldown=1e-10)],
    )
    ta.propagate_until(duration)
    return (float(ta.state[0]), float(ta.state[1])), tuple(times), min(speeds)
