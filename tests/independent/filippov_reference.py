"""Sliding motion by SciPy: each vector field, and Filippov's on the surface, integrated by DOP853 from event to event.

Written apart from the package: a system is two fields, a function h and its derivatives, all plain NumPy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

BELOW, ABOVE, SLIDING = "below", "above", "sliding"


@dataclass
class Filippov:
    """Fields where h < 0 and h > 0; the surface h and its derivatives in u and t; ``static`` over kinetic."""

    below: Callable[[float, Any], Any]
    above: Callable[[float, Any], Any]
    h: Callable[[float, Any], float]
    h_u: Callable[[float, Any], Any]
    h_t: Callable[[float, Any], float]
    static: float = 1.0

    def rates(self, t: float, u: Any) -> tuple[float, float]:
        grad, moving = self.h_u(t, u), self.h_t(t, u)
        return moving + grad @ self.below(t, u), moving + grad @ self.above(t, u)

    def ends(self, t: float, u: Any) -> tuple[float, float]:
        """Numbers between which sliding holds: the first positive, the second negative."""
        one, two = self.rates(t, u)
        middle, half = 0.5 * (one + two), 0.5 * (one - two)
        return middle + self.static * half, middle - self.static * half

    def sliding(self, t: float, u: Any) -> Any:
        one, two = self.rates(t, u)
        return (one * self.above(t, u) - two * self.below(t, u)) / (one - two)


def integrate(system: Filippov, u: Any, duration: float, mode: str) -> tuple[list[tuple[float, str]], Any]:
    """Changes of mode (time, new mode) and the last state."""
    t, u, changes = 0.0, np.array(u, float), []
    while True:
        if mode == SLIDING:
            field = system.sliding
            events = [lambda t, u: system.ends(t, u)[0], lambda t, u: system.ends(t, u)[1]]
            events[0].direction, events[1].direction = -1, 1
        else:
            field = getattr(system, mode)
            events = [lambda t, u: system.h(t, u)]
            events[0].direction = 1 if mode == BELOW else -1
        for event in events:
            event.terminal = True
        run = solve_ivp(field, (t, duration), u, method="DOP853", rtol=1e-13, atol=1e-14, events=events, max_step=0.05)
        assert run.status >= 0, run.message
        t, u = float(run.t[-1]), run.y[:, -1]
        if run.status == 0:
            return changes, u
        first, second = system.ends(t, u)
        if mode == SLIDING:
            mode = BELOW if len(run.t_events[0]) else ABOVE
        elif mode == BELOW:
            mode = ABOVE if second > 0 else SLIDING
        else:
            mode = BELOW if first < 0 else SLIDING
        changes.append((t, mode))


@dataclass
class Contacts:
    """Masses x'' = force(t, x, v) + friction, friction of at most ``limit`` against belts of constant speed."""

    force: Callable[[float, Any, Any], Any]
    limit: Any
    belt: Any


def rub(system: Contacts, u: Any, duration: float) -> tuple[list[tuple[float, tuple[int, ...]]], Any]:
    """Changes of the signs of relative velocities (0: sticks), and the last state; starts off every belt."""
    n = len(system.limit)
    t, u = 0.0, np.array(u, float)
    signs = [int(np.sign(v - b)) for v, b in zip(u[n:], system.belt, strict=True)]
    changes: list[tuple[float, tuple[int, ...]]] = []

    def field(t: float, u: Any) -> Any:
        force = system.force(t, u[:n], u[n:])
        pulls = zip(signs, force, system.limit, strict=True)
        return np.array([*u[n:], *(0.0 if s == 0 else f - s * F for s, f, F in pulls)])

    while True:
        events = []
        for i, s in enumerate(signs):
            if s:
                events.append((i, lambda t, u, i=i, s=s: s * (u[n + i] - system.belt[i])))
            else:
                events.append((i, lambda t, u, i=i: system.limit[i] - abs(system.force(t, u[:n], u[n:])[i])))
        for _, event in events:
            event.terminal, event.direction = True, -1
        watched = [event for _, event in events]
        run = solve_ivp(field, (t, duration), u, method="DOP853", rtol=1e-13, atol=1e-14, events=watched, max_step=0.05)
        assert run.status >= 0, run.message
        t, u = float(run.t[-1]), run.y[:, -1]
        if run.status == 0:
            return changes, u
        i = next(i for (i, _), times in zip(events, run.t_events, strict=True) if len(times))
        force = system.force(t, u[:n], u[n:])[i]
        if signs[i]:
            u[n + i] = system.belt[i]
            signs[i] = 0 if abs(force) < system.limit[i] else int(np.sign(force))
        else:
            signs[i] = int(np.sign(force))
        changes.append((t, tuple(signs)))
