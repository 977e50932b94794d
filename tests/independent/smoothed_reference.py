"""The paper's smoothed switch (Eqs. 6-10) written out a second time, region by region, with SciPy.

Regions: G- free, S_a entering, S_b leaving, G+ contact. The force in S_a holds the velocity v_a at which the band was
entered; coming from S_b (v = 0) it is 0. Every border is a terminal event.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

FREE, ENTERING, LEAVING, CONTACT = "G-", "S_a", "S_b", "G+"


def region(p: Mapping[str, float], eta: float, x: float, v: float) -> str:
    """Eqs. 9-10."""
    h_a, h_b = x - p["g"], -(x - p["g"]) - p["c_s"] / p["k_s"] * v
    if h_a <= -eta or h_b >= eta:
        return FREE
    if h_a >= eta and h_b <= -eta:
        return CONTACT
    return ENTERING if -eta < h_a < eta and h_b <= -h_a else LEAVING


def support_force(p: Mapping[str, float], eta: float, where: str, v_a: float, x: float, v: float) -> float:
    """Return what the support adds to m x'' (Eqs. 7-8)."""
    depth = x - p["g"]
    if where == CONTACT:
        return -p["k_s"] * depth - p["c_s"] * v
    if where == ENTERING:
        q = (depth + eta) / (2 * eta)
        return -p["c_s"] * v - p["k_s"] / 2 * (depth + eta) + p["c_s"] * v_a * (1 - q)
    if where == LEAVING:
        return -p["k_s"] / 2 * (depth + eta) - p["c_s"] / 2 * v
    return 0.0


def march(
    p: Mapping[str, float], eta: float, start: tuple[float, float] | NDArray[np.float64], n_periods: int
) -> tuple[NDArray[np.float64], list[tuple[float, str, str]]]:
    """State after `n_periods` from phase 0, and the border crossings (time, from, to). rtol 1e-12."""
    tau, end = p["c_s"] / p["k_s"], n_periods * 2 * np.pi / p["omega"]
    h_a: Callable[[float, float], float] = lambda x, v: x - p["g"]
    h_b: Callable[[float, float], float] = lambda x, v: -(x - p["g"]) - tau * v
    # Border: value that rises through zero, whether it counts at (x, v), the region beyond.
    borders: dict[str, list[tuple[Callable, Callable, str]]] = {
        FREE: [
            (lambda x, v: h_a(x, v) + eta, lambda x, v: v >= 0, ENTERING),
            (lambda x, v: eta - h_b(x, v), lambda x, v: v < 0, LEAVING),
        ],
        ENTERING: [
            (lambda x, v: h_a(x, v) - eta, lambda x, v: True, CONTACT),
            (lambda x, v: -v, lambda x, v: True, LEAVING),
            (lambda x, v: -eta - h_a(x, v), lambda x, v: True, FREE),
        ],
        LEAVING: [
            (lambda x, v: h_b(x, v) - eta, lambda x, v: True, FREE),
            (lambda x, v: -eta - h_b(x, v), lambda x, v: True, CONTACT),
            (lambda x, v: v, lambda x, v: True, ENTERING),
        ],
        CONTACT: [(lambda x, v: h_b(x, v) + eta, lambda x, v: True, LEAVING)],
    }
    t, u = 0.0, np.array(start, dtype=float)
    where, v_a = region(p, eta, *start), float(start[1])
    crossings: list[tuple[float, str, str]] = []
    while t < end:
        events = []
        for value, counts, _ in borders[where]:
            # A border that does not count here is kept below zero.
            event = lambda t, u, value=value, counts=counts: value(*u) if counts(*u) else -1.0
            event.terminal, event.direction = True, 1
            events.append(event)

        def field(t: float, u: NDArray[np.float64], where: str = where, v_a: float = v_a) -> list[float]:
            x, v = u
            free = p["rho"] * np.cos(p["omega"] * t) - 2 * p["k"] * x - p["c"] * v
            return [v, (free + support_force(p, eta, where, v_a, x, v)) / p["m"]]

        # In the bands (transit about eta / v) steps are bounded by a fraction of the transit.
        slow = 2 * np.pi / p["omega"] / 200
        limit = slow if where in (FREE, CONTACT) else min(slow, max(eta / max(abs(u[1]), 1e-3), 1e-7))
        s = solve_ivp(field, (t, end), u, method="DOP853", rtol=1e-12, atol=1e-16, events=events, max_step=limit)
        t, u = float(s.t[-1]), s.y[:, -1]
        if s.status != 1:
            break
        (index,) = (i for i, times in enumerate(s.t_events) if len(times))
        to = borders[where][index][2]
        if to == ENTERING:
            v_a = 0.0 if where == LEAVING else float(u[1])
        crossings.append((t, where, to))
        where = to
    return u, crossings
