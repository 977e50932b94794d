"""The paper's oscillator by SciPy's `solve_ivp` with terminal events, the way a careful user writes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import cos, pi

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

#: Absolute tolerance: rtol times the size of the states (millimetres).
RTOL, ATOL = 1e-8, 1e-11
Event = Callable[[float, NDArray[np.float64]], float]


def boundaries(g: float, tau: float) -> tuple[Event, Event, Event]:
    """Terminal events of a state that begins with x, v: entry, separation, entry from beyond the gap; tau = c_s/k_s."""

    def entry(_t: float, u: NDArray[np.float64]) -> float:
        return u[0] - g

    def separation(_t: float, u: NDArray[np.float64]) -> float:
        return g - u[0] - tau * u[1]

    def second_entry(t: float, u: NDArray[np.float64]) -> float:
        return -separation(t, u) if u[0] > g else -1.0

    for event in (entry, separation, second_entry):
        event.terminal, event.direction = True, 1
    return entry, separation, second_entry


def march(
    p: Mapping[str, float], u: NDArray[np.float64], n_periods: int, method: str = "DOP853"
) -> NDArray[np.float64]:
    """State after `n_periods` from `u` at phase 0.

    The events' zeros at the very start of a piece (the crossing just handled) are not events: SciPy looks for
    sign changes between step ends and takes a zero there for none. DOP853 needs the fewest evaluations here.
    """
    m, k, k_s, c, c_s, g, rho, omega = (p[n] for n in ("m", "k", "k_s", "c", "c_s", "g", "rho", "omega"))
    tau, period = c_s / k_s, 2 * pi / omega

    def free(t: float, u: NDArray[np.float64]) -> tuple[float, float]:
        x, v = u
        return v, (rho * cos(omega * t) - 2 * k * x - c * v) / m

    def contact(t: float, u: NDArray[np.float64]) -> tuple[float, float]:
        x, v = u
        return v, (rho * cos(omega * t) - 2 * k * x - c * v - k_s * (x - g) - c_s * v) / m

    entry, separation, second_entry = boundaries(g, tau)
    inside = u[0] > g and separation(0.0, u) < 0
    t, end = 0.0, n_periods * period
    while t < end:
        field, events = (contact, [separation]) if inside else (free, [entry, second_entry])
        s = solve_ivp(field, (t, end), u, method=method, rtol=RTOL, atol=ATOL, events=events)
        t, u = float(s.t[-1]), s.y[:, -1]
        if s.status == 1:
            inside = not inside
    return np.asarray(u)
