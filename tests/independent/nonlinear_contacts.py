"""Contacts and frictions of nonlinear mechanical systems by SciPy: events, linear programs and enumeration.

Written from `contacts.md` alone. Masses M q'' = f(t, q, v); a friction has a constant row and a belt, a stop a gap
g(q) with gradient and curvature. What is held has constraint forces; whether forces within their bounds exist is a
linear program, whose margin is an event. At an instant all combinations of the candidates are enumerated, and the one
with most held is taken. No ties: generic systems only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

Array = NDArray[np.float64]
ZERO, REST = 1e-9, 1e-7


@dataclass(frozen=True)
class Friction:
    row: tuple[float, ...]
    kinetic: float
    static: float | None = None
    belt: float = 0.0

    @property
    def most(self) -> float:
        return self.kinetic if self.static is None else self.static


@dataclass(frozen=True)
class Wall:
    """A rigid stop: gap, its gradient and v' H v."""

    gap: Callable[[Array], float]
    gradient: Callable[[Array], Array]
    curvature: Callable[[Array, Array], float] = lambda q, v: 0.0
    restitution: float = 0.0


@dataclass
class Masses:
    mass: Array
    force: Callable[[float, Array, Array], Array]
    elements: Sequence[Friction | Wall]
    state: list[int] = field(default_factory=list)  # friction: -1, 0 (stick), 1; wall: 0 closed, 1 open

    # Rows and rates

    def rows(self, q: Array) -> Array:
        return np.array([e.row if isinstance(e, Friction) else e.gradient(q) for e in self.elements])

    def rates(self, q: Array, v: Array) -> Array:
        belts = [e.belt if isinstance(e, Friction) else 0.0 for e in self.elements]
        return self.rows(q) @ v - belts

    def drift(self, q: Array, v: Array) -> Array:
        """Derivatives of the rates at zero acceleration."""
        return np.array([0.0 if isinstance(e, Friction) else e.curvature(q, v) for e in self.elements])

    # Motion in one combination

    def loads(self, t: float, q: Array, v: Array, state: Sequence[int]) -> Array:
        found = self.force(t, q, v)
        for e, s in zip(self.elements, state, strict=True):
            if isinstance(e, Friction) and s:
                found = found - s * e.kinetic * np.array(e.row)
        return found

    def held(self, t: float, q: Array, v: Array, state: Sequence[int]) -> tuple[Any, ...]:
        """Accelerations without held forces, what is held, its rows, effects and needed rates."""
        free = np.linalg.solve(self.mass, self.loads(t, q, v, state))
        some = [i for i, s in enumerate(state) if s == 0]
        W = self.rows(q)[some]
        G = W @ np.linalg.solve(self.mass, W.T)
        return free, some, W, G, -(W @ free + self.drift(q, v)[some])

    def accelerations(self, t: float, q: Array, v: Array, state: Sequence[int]) -> Array:
        free, some, W, G, needed = self.held(t, q, v, state)
        if not some:
            return free
        return free + np.linalg.solve(self.mass, W.T @ np.linalg.lstsq(G, needed, rcond=1e-9)[0])

    def margin(self, t: float, q: Array, v: Array, state: Sequence[int]) -> float:
        """By how much the forces that hold lie within their bounds (below zero: there are none)."""
        _, some, _, G, needed = self.held(t, q, v, state)
        if not some:
            return 1.0
        if np.abs(G @ np.linalg.lstsq(G, needed, rcond=1e-9)[0] - needed).max() > 1e-8 * (1 + np.abs(needed).max()):
            return -1.0
        return self._margin(G, needed, [self.elements[i] for i in some])

    @staticmethod
    def _margin(G: Array, needed: Array, held: Sequence[Friction | Wall]) -> float:
        count = len(held)
        upper, right = [], []
        for i, e in enumerate(held):
            unit = np.eye(count)[i]
            upper.append([*-unit, 1.0])
            right.append(e.most if isinstance(e, Friction) else 0.0)
            if isinstance(e, Friction):
                upper.append([*unit, 1.0])
                right.append(e.most)
        found = linprog(
            [*np.zeros(count), -1.0],
            A_ub=upper,
            b_ub=right,
            A_eq=np.hstack([G, np.zeros((count, 1))]),
            b_eq=needed,
            bounds=(None, None),
        )
        return float(-found.fun) if found.status == 0 else -1.0

    # Instants

    def decide(self, t: float, q: Array, v: Array) -> None:
        """The contact states just behind an instant."""
        rates, gaps = self.rates(q, v), self.gaps(q)
        choices: list[list[int]] = []
        for i, e in enumerate(self.elements):
            if isinstance(e, Friction):
                choices.append([0, 1, -1] if abs(rates[i]) < ZERO else [int(np.sign(rates[i]))])
            else:
                choices.append([0, 1] if abs(gaps[i]) < ZERO and abs(rates[i]) < ZERO else [1])
        found = []
        for state in product(*choices):
            margin = self.margin(t, q, v, state)
            a = self.accelerations(t, q, v, state)
            change = self.rows(q) @ a + self.drift(q, v)
            moves = all(
                s == 0 or len(c) == 1 or (s if isinstance(e, Friction) else 1) * x > -ZERO
                for e, s, c, x in zip(self.elements, state, choices, change, strict=True)
            )
            if margin > ZERO and moves:
                found.append((sum(s == 0 for s in state), state))
        self.state = list(max(found)[1])

    def gaps(self, q: Array) -> Array:
        return np.array([np.inf if isinstance(e, Friction) else e.gap(q) for e in self.elements])

    def strike(self, q: Array, v: Array) -> Array:
        """Speeds behind the impact of all walls with zero gap; slow ones rest."""
        rates, gaps = self.rates(q, v), self.gaps(q)
        closed = [i for i, gap in enumerate(gaps) if gap < ZERO]
        if not closed or rates[closed].min() > -1e-12:
            return v
        slow = rates[closed].min() > -REST
        back = {i: e.restitution for i, e in enumerate(self.elements) if isinstance(e, Wall)}
        goal = np.array([-(0.0 if slow else back[i]) * min(rates[i], 0.0) for i in closed])
        W = self.rows(q)[closed]
        G = W @ np.linalg.solve(self.mass, W.T)
        for some in product([True, False], repeat=len(closed)):
            on = np.flatnonzero(some)
            impulse = np.zeros(len(closed))
            impulse[on] = np.linalg.lstsq(G[np.ix_(on, on)], (goal - rates[closed])[on], rcond=1e-9)[0]
            after = rates[closed] + G @ impulse
            if impulse.min() > -1e-12 and (after - goal).min() > -1e-9:
                return v + np.linalg.solve(self.mass, W.T @ impulse)
        raise RuntimeError("no impact")

    # A run

    def run(self, q: Array, v: Array, times: Array) -> Array:
        """States (times, 2 n)."""
        n, t, y = len(q), float(times[0]), np.concatenate([q, v])
        out = np.full((len(times), 2 * n), np.nan)
        out[0] = y
        self.decide(t, y[:n], y[n:])
        while t < times[-1]:
            state = tuple(self.state)

            def flow(t: float, y: Array, state: Any = state) -> Array:
                return np.concatenate([y[n:], self.accelerations(t, y[:n], y[n:], state)])

            events: list[Any] = []
            for i, (e, s) in enumerate(zip(self.elements, state, strict=True)):
                if s == 0:
                    continue
                event: Any
                if isinstance(e, Friction):

                    def event(t: float, y: Array, i: int = i, s: int = s, begin: float = t) -> float:
                        return float(s * self.rates(y[:n], y[n:])[i]) if t > begin else 1.0
                else:

                    def event(t: float, y: Array, i: int = i, begin: float = t) -> float:
                        return float(self.gaps(y[:n])[i]) if t > begin else 1.0

                events.append(event)
            if 0 in state:

                def held(t: float, y: Array, state: Any = state) -> float:
                    return self.margin(t, y[:n], y[n:], state)

                events.append(held)
            for event in events:
                event.terminal, event.direction = True, -1
            ahead = times[times > t + 1e-13]
            run = solve_ivp(
                flow, (t, times[-1]), y, "DOP853", t_eval=ahead, events=events, rtol=1e-12, atol=1e-13, max_step=0.05
            )
            if len(run.t):
                out[np.searchsorted(times, run.t)] = np.transpose(run.y)
            if run.status == 0:
                break
            ended = zip(run.t_events, run.y_events, strict=True)
            t, y = max((when[-1], where[-1]) for when, where in ended if len(when))
            y = np.concatenate([y[:n], self.strike(y[:n], y[n:])])
            y = self._on_constraints(y, n)
            self.decide(t, y[:n], y[n:])
        return out

    def _on_constraints(self, y: Array, n: int) -> Array:
        """Gaps and rates that are zero set to zero: else the next events would come at once."""
        q, v = y[:n].copy(), y[n:].copy()
        closed = [i for i, gap in enumerate(self.gaps(q)) if abs(gap) < ZERO]
        if closed:
            W = self.rows(q)[closed]
            q -= np.linalg.lstsq(W, self.gaps(q)[closed], rcond=1e-9)[0]
        rates = self.rates(q, v)
        bear = [i for i, e in enumerate(self.elements) if isinstance(e, Friction) or i in closed]
        zero = [i for i in bear if abs(rates[i]) < ZERO]
        if zero:
            v -= np.linalg.lstsq(self.rows(q)[zero], rates[zero], rcond=1e-9)[0]
        return np.concatenate([q, v])
