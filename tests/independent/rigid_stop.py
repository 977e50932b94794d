r"""A forced linear oscillator against a rigid stop, from closed-form pieces: a truth that shares nothing with kernels.

Between impacts x'' + c x' + k x = A cos(w t) is solved in closed form; an impact is found by bisection between nodes of
a 48th of a period (a maximum in between is found by bisection of v first); then v -> -e v. With e = 0 the mass stays at
the stop while the force presses it there, A cos(w t) > k d, and leaves in the closed form of that instant; so it does
after 100 impacts between two nodes, when they have accumulated.
All starts are followed at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES = 48
HALVINGS = 50
ACCUMULATED = 100  # impacts between two nodes that count as infinitely many


class RigidStop:
    """Many runs of one oscillator; parameters k, c, omega, d, e, A."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.p = p = dict(parameters)
        self.decay = 0.5 * p["c"]
        self.turn = np.sqrt(p["k"] - self.decay**2)
        self.response = p["A"] / (p["k"] - p["omega"] ** 2 + 1j * p["c"] * p["omega"])
        self.period = 2 * np.pi / p["omega"]

    def forced(self, t: Array) -> tuple[Array, Array]:
        z = self.response * np.exp(1j * self.p["omega"] * t)
        return z.real, (1j * self.p["omega"] * z).real

    def flow(self, t: Array, x: Array, v: Array, s: Array) -> tuple[Array, Array]:
        """State a time s after (t, x, v), the stop ignored."""
        return self.leg(t, x, v)(s)

    def leg(self, t: Array, x: Array, v: Array) -> Callable[[Array], tuple[Array, Array]]:
        """The flow from (t, x, v) as a function of the time since."""
        x0, v0 = self.forced(t)
        a = x - x0
        b = (v - v0 + self.decay * a) / self.turn

        def after(s: Array) -> tuple[Array, Array]:
            x1, v1 = self.forced(t + s)
            e, cos, sin = np.exp(-self.decay * s), np.cos(self.turn * s), np.sin(self.turn * s)
            own = e * (a * cos + b * sin)
            return x1 + own, v1 - self.decay * own + self.turn * e * (b * cos - a * sin)

        return after

    def step(self, t: Array, x: Array, v: Array, stuck: NDArray[np.bool_], until: float) -> None:
        """All runs on to one time, in place."""
        d, e, k = self.p["d"], self.p["e"], self.p["k"]
        todo = t < until
        impacts = np.zeros(len(t), dtype=np.int64)
        while todo.any():
            i = np.flatnonzero(todo & stuck)
            if len(i):  # at the stop until the force lets go
                hold = self.p["A"] * np.cos(self.p["omega"] * until) > k * d

                def pressing(time: Array) -> Array:
                    return self.p["A"] * np.cos(self.p["omega"] * time) - k * d

                if hold:
                    t[i] = until
                else:
                    t[i] = _bisect(pressing, t[i], np.full(len(i), until))
                    stuck[i] = False
            i = np.flatnonzero(todo & ~stuck & (t < until))
            if len(i):
                self._fly(i, t, x, v, stuck, until, d, e, impacts)
            todo = t < until

    def _fly(
        self,
        i: Any,
        t: Array,
        x: Array,
        v: Array,
        stuck: NDArray[np.bool_],
        until: float,
        d: float,
        e: float,
        impacts: NDArray[np.int64],
    ) -> None:
        begin, x0, v0 = t[i], x[i], v[i]
        last = until - begin
        x1, v1 = self.flow(begin, x0, v0, last)
        # a maximum between the nodes
        top = last.copy()
        peak = (v0 > 0) & (v1 < 0)
        if peak.any():
            rising = self.leg(begin[peak], x0[peak], v0[peak])
            top[peak] = _bisect(lambda s: rising(s)[1], np.zeros(peak.sum()), last[peak])
        highest = self.flow(begin, x0, v0, top)[0]
        hit = (highest > d) & ((v0 > 0) | (x1 > d))
        free = ~hit
        t[i[free]], x[i[free]], v[i[free]] = until, x1[free], v1[free]
        if not hit.any():
            return
        b, x0, v0 = begin[hit], x0[hit], v0[hit]
        towards = self.leg(b, x0, v0)
        s = _bisect(lambda s: d - towards(s)[0], np.zeros(len(b)), top[hit])
        speed = towards(s)[1]
        j = i[hit]
        t[j], x[j], v[j] = b + s, d, -e * speed
        pressed = self.p["A"] * np.cos(self.p["omega"] * t[j]) > self.p["k"] * d
        impacts[j] += 1
        ended = impacts[j] > ACCUMULATED
        v[j[ended]] = 0.0
        stuck[j] = ((e == 0.0) | ended) & pressed

    def sections(self, starts: Array, transient: int, keep: int) -> Array:
        """(keep, S, 2): the states at the beginning of periods after ``transient`` of them."""
        n = len(starts)
        t, x, v = np.zeros(n), starts[:, 0].copy(), starts[:, 1].copy()
        stuck = np.zeros(n, dtype=bool)
        kept = []
        for turn in range(transient + keep):
            t[:] = 0.0
            for node in range(1, NODES + 1):
                self.step(t, x, v, stuck, node * self.period / NODES)
            if turn >= transient:
                kept.append(np.column_stack([x, v]))
        return np.stack(kept)


def _bisect(f: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Return the places at which f goes from positive to negative, elementwise."""
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        positive = f(middle) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    return np.asarray(0.5 * (low + high))
