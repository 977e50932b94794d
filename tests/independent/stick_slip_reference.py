"""The map from one end of a stick to the next, by an independent program: many trajectories at once, fixed steps.

A mass on a spring rubs on a belt. While it sticks its speed is the belt's, and the stick ends where the force that
holds it reaches the static friction: an onset, at which the time alone determines the state. Classical Runge-Kutta,
events by sign and bisection; derivatives of the map are differences of neighbours. None of it is taken from the
package: no tangent equations, no saltation matrices, no events isolated on polynomials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
HALVINGS = 45
APART = 1e-6  # of neighbours in time, at an onset


@dataclass(frozen=True)
class StickSlip:
    """x'' + x = amplitude cos(w t) - friction(|v|) sgn v, v = x' - belt; it sticks up to the force ``static``."""

    amplitude: float
    w: float
    friction: Callable[[Array], Array]
    static: float
    belt: float
    h: float = 0.01

    def pull(self, t: Array, x: Array) -> Array:
        return self.amplitude * np.cos(self.w * t) - x

    def step(self, t: Array, u: Array, side: Array, h: Array) -> Array:
        """One classical Runge-Kutta step; ``side``: 1 or -1 where the mass slips forward or back, 0 where it sticks."""

        def field(t: Array, u: Array) -> Array:
            x, v = u
            a = self.pull(t, x) - side * self.friction(np.maximum(side * (v - self.belt), 0.0))
            return np.array([v, np.where(side == 0, 0.0, a)])

        a = field(t, u)
        b = field(t + h / 2, u + h / 2 * a)
        c = field(t + h / 2, u + h / 2 * b)
        return u + h / 6 * (a + 2 * b + 2 * c + field(t + h, u + h * c))

    def ahead(self, t: Array, u: Array, side: Array) -> Array:
        """Positive until the phase ends: relative speed of a slip, room below the static friction of a stick."""
        return np.where(side == 0, self.static - np.abs(self.pull(t, u[0])), side * (u[1] - self.belt))

    def next_onset(self, t: Array, side: Array) -> Array:
        """Times of the next onsets behind those at ``t`` into slips to ``side``."""
        t, side = t.copy(), side.copy()
        u = np.array([self.amplitude * np.cos(self.w * t) - side * self.static, np.full(len(t), self.belt)])
        begun, on = np.ones(len(t), bool), np.ones(len(t), bool)  # just begun: the relative speed is 0 and grows
        while on.any():
            i = np.flatnonzero(on)
            after = self.step(t[i], u[:, i], side[i], np.full(len(i), self.h))
            over = (self.ahead(t[i] + self.h, after, side[i]) <= 0) & ~begun[i]
            begun[i] = False
            j, k = i[over], i[~over]
            low, high = np.zeros(len(j)), np.full(len(j), self.h)
            for _ in range(HALVINGS if len(j) else 0):
                middle = (low + high) / 2
                inside = self.ahead(t[j] + middle, self.step(t[j], u[:, j], side[j], middle), side[j]) > 0
                low, high = np.where(inside, middle, low), np.where(inside, high, middle)
            u[:, j], t[j] = self.step(t[j], u[:, j], side[j], high), t[j] + high
            u[:, k], t[k] = after[:, ~over], t[k] + self.h
            pull, ended = self.pull(t[j], u[0, j]), side[j] == 0
            on[j[ended]] = False
            side[j] = np.where(ended | (np.abs(pull) > self.static), np.sign(pull), 0.0)
            begun[j] = side[j] != 0
        return t

    def slope(self, t: Array, side: Array) -> Array:
        """The derivative of the map: how far apart two onsets are when they follow such a distance apart."""
        return (self.next_onset(t + APART, side) - self.next_onset(t - APART, side)) / (2 * APART)
