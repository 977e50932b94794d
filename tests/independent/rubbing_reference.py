"""One rigid contact that rubs, between two or three coupled coordinates: events by SciPy, phases written out.

x is the slip and y the gap. Normal and tangential forces are those of the phase: none in flight; ``lambda_t = -mu s
lambda_n`` with y'' = 0 in slip; y'' = x'' = 0 in stick. An impact is Stronge's (``contact_impacts``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from contact_elements import Array
from contact_impacts import stronge
from scipy.integrate import solve_ivp

FLIGHT, STICK = "flight", "stick"
Phase = str | float  # the sign of the slip


@dataclass(frozen=True)
class Rubbing:
    """M q'' + C q' + K q = c + a cos wt + b sin wt, with y >= 0."""

    seed: int
    mass: Array
    damping: Array
    stiffness: Array
    loads: Array  # (n, 3)
    frequency: float
    friction: float
    restitution: float
    belt: float
    creep: float
    q: Array
    v: Array

    @property
    def period(self) -> float:
        return float(2 * np.pi / self.frequency)


def random_rubbing(seed: int) -> Rubbing:
    """Draw a system; with a third coordinate the contact's forces act through its coupling as well."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 4))
    root = rng.normal(size=(n, n)) * (0.0 if rng.random() < 0.3 else 0.4)
    inverse = np.diag(rng.uniform(0.5, 2.0, n)) + root @ root.T
    friction = float(rng.choice([0.1, 0.3, 0.6]))
    if friction * abs(inverse[0, 1]) > 0.8 * inverse[1, 1]:
        friction = 0.5 * float(inverse[1, 1] / abs(inverse[0, 1]))  # no paradox
    spring = np.zeros((n, n)) if rng.random() < 0.3 else np.diag(rng.uniform(0.0, 3.0, n))
    loads = rng.normal(size=(n, 3)) * rng.choice([0.0, 1.0], (n, 1))
    loads[1] = [-rng.uniform(1, 3), *(rng.normal(size=2) * rng.choice([0.0, 0.5, 2.0]))]
    rests = rng.random() < 0.5
    return Rubbing(
        seed,
        np.linalg.inv(inverse),
        np.diag(rng.choice([0.0, 0.1, 0.5], n)),
        spring,
        loads,
        float(rng.uniform(0.5, 2)),
        friction,
        float(rng.choice([0.0, 0.3, 0.6])),
        float(rng.choice([0.0, 0.0, 0.4])),
        1e-4,
        np.array([0.0, 0.0 if rests else 0.4, 0.1][:n]),
        np.array([float(rng.choice([0.0, 1.0, -0.7])), 0.0, 0.2][:n]),
    )


class Motion:
    """The motion of one system from event to event."""

    def __init__(self, system: Rubbing) -> None:
        self.s, self.n = system, len(system.q)
        self.inverse = np.linalg.inv(system.mass)
        self.G = self.inverse[:2, :2]  # of (x, y)

    def free(self, t: float, z: Array) -> Array:
        """Accelerations without the contact."""
        s, w = self.s, self.s.frequency
        load = s.loads @ [1.0, np.cos(w * t), np.sin(w * t)]
        found: Array = self.inverse @ (load - s.damping @ z[self.n :] - s.stiffness @ z[: self.n])
        return found

    def forces(self, phase: Phase, t: float, z: Array) -> tuple[float, float]:
        """Tangential and normal force."""
        a, G = self.free(t, z), self.G
        if phase == FLIGHT:
            return 0.0, 0.0
        if phase == STICK:
            tangential, normal = np.linalg.solve(G, -a[:2])
            return float(tangential), float(normal)
        share = -self.s.friction * float(phase)
        normal = -a[1] / (G[1, 1] + share * G[1, 0])
        return float(share * normal), float(normal)

    def accelerations(self, phase: Phase, t: float, z: Array) -> Array:
        found: Array = self.free(t, z) + self.inverse[:, :2] @ np.array(self.forces(phase, t, z))
        return found

    def slip(self, z: Array) -> float:
        return float(z[self.n] - self.s.belt)

    def closed(self, t: float, z: Array, slip: float) -> Phase:
        """The phase behind an instant at which the contact is closed and does not approach."""
        if slip:
            phase = float(np.sign(slip))
            return phase if self.forces(phase, t, z)[1] > 0 else FLIGHT
        tangential, normal = self.forces(STICK, t, z)
        if normal > 0 and abs(tangential) <= self.s.friction * normal:
            return STICK
        for phase in (1.0, -1.0):
            if self.forces(phase, t, z)[1] > 0 and phase * self.accelerations(phase, t, z)[0] > 0:
                return phase
        return FLIGHT

    def events(self, phase: Phase) -> list[Callable[[float, Array], float]]:
        """Functions that fall through zero where a phase ends."""
        if phase == FLIGHT:
            return [lambda t, z: z[1]]
        if phase == STICK:

            def cone(t: float, z: Array) -> float:
                tangential, normal = self.forces(STICK, t, z)
                return self.s.friction * normal - abs(tangential)

            return [cone]
        return [lambda t, z: self.forces(phase, t, z)[1], lambda t, z: float(phase) * self.slip(z)]

    def behind(self, phase: Phase, event: int, t: float, z: Array) -> tuple[Phase, Array]:
        """The phase and the states behind the event of a phase."""
        z, n, s = z.copy(), self.n, self.s
        if phase == STICK:
            z[n] = s.belt
            tangential = self.forces(STICK, t, z)[0]
            if self.forces(STICK, t, z)[1] <= 0:
                return FLIGHT, z
            return -float(np.sign(tangential)), z
        if phase != FLIGHT:
            if event == 0:
                return FLIGHT, z
            z[n] = s.belt
            return self.closed(t, z, 0.0), z
        z[1] = 0.0
        approach, slip = z[n + 1], self.slip(z)
        order = np.array([[self.G[1, 1], self.G[1, 0]], [self.G[0, 1], self.G[0, 0]]])
        for restitution in (0.0, s.restitution) if -approach < s.creep else (s.restitution,):
            after, impulses = stronge(order, approach, slip, restitution, s.friction)
            y = z.copy()
            y[n:] += self.inverse[:, 1] * impulses[0] + self.inverse[:, 0] * impulses[1]
            y[n + 1] = after[0]
            if after[1] == 0.0:
                y[n] = s.belt
            if restitution == 0.0:
                y[n + 1] = 0.0
                there = self.closed(t, y, after[1])
                if there != FLIGHT:
                    return there, y
        return FLIGHT, y

    def run(self, times: Array) -> Array:
        """States at some instants."""
        s, n = self.s, self.n
        z, t = np.concatenate((s.q, s.v)), float(times[0])
        phase: Phase = FLIGHT if z[1] > 0 else self.closed(t, z, self.slip(z))
        found = np.empty((len(times), 2 * n))
        while True:
            some: list[Any] = []
            for one in self.events(phase):
                zero = abs(one(t, z)) < 1e-12  # it rises from there: that is no event

                def event(
                    at: float, z: Array, one: Callable[[float, Array], float] = one, begun: float = t, zero: bool = zero
                ) -> float:
                    return one(at, z) if not zero else one(at, z) / (at - begun) if at > begun else 1.0

                event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
                some.append(event)

            def field(t: float, z: Array, phase: Phase = phase) -> Array:
                return np.concatenate((z[n:], self.accelerations(phase, t, z)))

            out = solve_ivp(
                field,
                (t, times[-1]),
                z,
                "DOP853",
                events=some,
                rtol=1e-12,
                atol=1e-14,
                dense_output=True,
                max_step=s.period / 100,
            )
            here = (times >= t) & (times <= out.t[-1])
            if here.any():
                found[here] = out.sol(times[here]).T
            t, z = float(out.t[-1]), out.y[:, -1]
            if out.status == 0:
                return found
            which = next(i for i, one in enumerate(out.t_events) if len(one))
            phase, z = self.behind(phase, which, t, z)


def off(system: Rubbing, part: float = 1e-12) -> Rubbing:
    """The same from a start a little off."""
    return replace(system, v=system.v * (1 + part), loads=system.loads * (1 + part))
