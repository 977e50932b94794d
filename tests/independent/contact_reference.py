"""Event-driven simulation of affine mechanical systems with contacts: the independent reference.

Within a mode z' = A z is followed by its Taylor series, in steps on which the series is exact to rounding. Events
are the first zeros (and touches) of polynomials; at an event come elastic transitions, impacts, then the rules.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from contact_elements import Array, System
from contact_impacts import sequential, simultaneous
from contact_modes import ZERO, Mode, NoAnswerError, Rules
from numpy.polynomial import chebyshev
from scipy.optimize import brentq

DEGREE = 22
POWERS = np.arange(DEGREE + 1)
SLOW = 1e-5  # preloaded springs are held where s = 0 is crossed slower
NODES = 0.5 + 0.5 * np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
TO_CHEBYSHEV = chebyshev.chebfit(2 * NODES - 1, np.vander(NODES, DEGREE + 1, increasing=True), DEGREE)


def first_event(c: Array, order: int, zero: float) -> float | None:
    """Return the first x in (0, 1] where sum c_k x^(k + order) is zero or touches zero, c_0 > 0."""
    if c[0] <= 0:
        return 0.0
    if c[0] - (0.0 if order else zero) > np.abs(c[1:]).sum():
        return None

    def value(x: float) -> float:
        return float(np.polynomial.polynomial.polyval(x, c))

    full = np.concatenate((np.zeros(order), c))[: DEGREE + 1]
    slope = np.concatenate((full[1:] * np.arange(1, len(full)), [0.0]))

    def slope_at(x: float) -> float:
        return float(np.polynomial.polynomial.polyval(x, slope))

    series = TO_CHEBYSHEV @ slope
    series = chebyshev.chebtrim(series, 1e-16 * np.abs(series).max(initial=0.0))
    roots = (chebyshev.chebroots(series) + 1) / 2 if len(series) > 1 else np.zeros(0)
    turns = sorted(float(x.real) for x in roots if abs(x.imag) < 1e-6 and 0 < x.real < 1)
    previous = 0.0
    for x in [*turns, 1.0]:
        if value(x) <= 0:
            return float(brentq(value, previous, x, xtol=1e-300, rtol=8.9e-16, maxiter=5000))
        if x < 1 and value(x) * x**order <= zero:
            low, high = x * (1 - 1e-6), x * (1 + 1e-6)
            if slope_at(low) < 0 < slope_at(high):
                return float(brentq(slope_at, low, high, xtol=1e-300, rtol=8.9e-16, maxiter=5000))
        previous = x
    return None


@dataclass
class Event:
    """Time, the states of contact behind it, and the impulses of the rigid stops that were hit."""

    time: float
    states: tuple[str, ...]
    impulses: dict[str, float] = field(default_factory=dict)
    approach: dict[str, float] = field(default_factory=dict)
    rest_time: dict[str, float] = field(default_factory=dict)


@dataclass
class Run:
    """States (q, v) at the instants asked for, and all events; ``failure`` names what ended it early."""

    times: Array
    states: Array
    events: list[Event]
    failure: str = ""


class Reference:
    """One system with its rules of impact and of rest."""

    def __init__(self, system: System, impacts: str = "simultaneous", rest_speed: float = 1e-7) -> None:
        self.system, self.impacts, self.rest_speed = system, impacts, rest_speed
        self.rules = Rules(system)
        self.parts, self.n = self.rules.parts, self.rules.n
        self.stops = self.rules.of("stop")
        self.size = np.zeros(2 * self.n + 3)  # largest absolute values of the states so far

    # instants

    def state(self, t: float, q: Array, v: Array) -> Array:
        w = self.system.frequency
        return np.concatenate((q, v, [1.0, np.cos(w * t), np.sin(w * t)]))

    def grown(self, z: Array) -> None:
        """Take z into the sizes: one of all coordinates and one of all speeds, as one that rests is of size zero."""
        n = self.n
        size = np.maximum(self.size, np.abs(z))
        self.size = np.concatenate((np.full(n, size[:n].max()), np.full(n, size[n : 2 * n].max()), size[2 * n :]))

    def is_zero(self, row: Array, z: Array) -> bool:
        return bool(abs(row @ z) <= ZERO * (np.abs(row) @ self.size))

    def settled(self, t: float, z: Array) -> tuple[Array, Mode, Event]:
        """Return state, mode and event behind an instant: impacts, then the rules."""
        self.grown(z)
        touching = [i for i in self.stops if self.is_zero(self.parts[i].zero, z)]
        for i in self.stops:
            if i not in touching and self.parts[i].zero @ z < 0:
                raise NoAnswerError(f"{self.parts[i].name} is penetrated")
        rates = [self.parts[i].rate for i in touching]
        hit = {i: -float(r @ z) for i, r in zip(touching, rates, strict=True) if r @ z < 0 and not self.is_zero(r, z)}
        booked = {self.parts[i].name: speed for i, speed in hit.items()}
        if not hit:
            z, mode = self.rules_at(z)
            return z, mode, Event(t, mode.states)
        own = np.array([self.parts[i].numbers["e"] for i in touching])
        if max(hit.values()) >= self.rest_speed:
            after, impulse = self.impact(z, touching, own, self.impacts)
            after, mode = self.rules_at(after)
            return after, mode, Event(t, mode.states, self.named(touching, impulse), booked)
        plastic = set(hit)
        while True:
            e = np.array([0.0 if i in plastic else x for i, x in zip(touching, own, strict=True)])
            after, impulse = self.impact(z, touching, e, "simultaneous")
            after, mode = self.rules_at(after)
            loose = {i for i in plastic if self.parts[i].numbers["e"] > 0 and not self.pressed(mode, i, after)}
            if not loose:
                break
            plastic -= loose
        event = Event(t, mode.states, self.named(touching, impulse), booked)
        for i in plastic:
            opened = self.rules.mode(
                tuple("open" if j == i else s for j, s in enumerate(mode.states)), ("static",) * len(self.parts)
            )
            e_i, push = self.parts[i].numbers["e"], 0.0 if opened is None else -self.parts[i].rate @ opened.A @ after
            if push > 0 and e_i < 1:
                event.rest_time[self.parts[i].name] = t + 2 * e_i * hit[i] / (push * (1 - e_i))
        return after, mode, event

    def named(self, touching: list[int], impulse: Array) -> dict[str, float]:
        return {self.parts[i].name: float(x) for i, x in zip(touching, impulse, strict=True)}

    def impact(self, z: Array, touching: list[int], restitution: Array, law: str) -> tuple[Array, Array]:
        rows = np.array([self.parts[i].rate for i in touching])
        W = rows[:, self.n : 2 * self.n]
        before = np.array([0.0 if self.is_zero(r, z) else r @ z for r in rows])
        if law == "sequential":
            change, impulse = sequential(self.rules.inverse, W, before, restitution, self.rest_speed)
        else:
            change, impulse = simultaneous(self.rules.inverse, W, before, restitution)
        terms = np.abs(z)
        terms[self.n : 2 * self.n] += np.abs(self.rules.inverse) @ np.abs(W.T) @ impulse
        self.grown(terms)  # speeds that cancel leave the rounding of what they were made of
        z = z.copy()
        z[self.n : 2 * self.n] += change
        return z, impulse

    def pressed(self, mode: Mode, i: int, z: Array) -> bool:
        """Closed with a force that is not zero: by rule 5 where it is unique, else the one of least norm now."""
        if mode.states[i] != "closed":
            return False
        k = mode.held.index(i)
        others = np.delete(mode.generators, k, axis=0)
        if np.linalg.matrix_rank(others) == mode.generators.shape[1]:
            return mode.forces(z)[i] > ZERO * float(np.abs(mode.needed).max(axis=0) @ self.size)
        force = np.linalg.lstsq(mode.generators.T, mode.needed, rcond=None)[0][k]
        return mode.signs(force[None], z, self.size)[0] > 0

    def projected(self, z: Array, held: list[int]) -> Array:
        """Set the rates of the parts to zero, and the gaps of the closed and held ones, in the metric of M."""
        z, n = z.copy(), self.n
        for block, rows in (
            (slice(n, 2 * n), [self.parts[i].rate for i in held]),
            (slice(0, n), [self.parts[i].zero for i in held if self.parts[i].kind != "friction"]),
        ):
            if rows:
                R = np.array(rows)
                W = R[:, block]
                if np.any(R @ z):
                    z[block] -= self.rules.inverse @ W.T @ np.linalg.pinv(W @ self.rules.inverse @ W.T, 1e-11) @ R @ z
                for row in R:  # a rate that is one speed is exactly zero
                    (single,) = np.nonzero(row)[:1]
                    if len(single) == 1:
                        z[single[0]] = 0.0
        return z

    def rules_at(self, z: Array) -> tuple[Array, Mode]:
        """Ask the rules; slow preloaded springs are candidates as long as all of them can be held."""
        slow = []
        for i in self.rules.of("preload"):
            part = self.parts[i]
            if self.is_zero(part.zero, z) and not self.is_zero(part.rate, z) and abs(part.rate @ z) < SLOW:
                slow.append(i)
        while True:
            after, mode = self.asked(z, slow)
            loose = [i for i in slow if mode.states[i] != "stick"]
            if not loose:
                return after, mode
            slow = [i for i in slow if i not in loose]

    def asked(self, z: Array, slow: list[int]) -> tuple[Array, Mode]:
        states, candidates = [""] * len(self.parts), []
        for i, part in enumerate(self.parts):
            zero, still = self.is_zero(part.zero, z), self.is_zero(part.rate, z) or i in slow
            if part.kind != "elastic" and zero and still:
                candidates.append(i)
        z = self.projected(z, candidates)
        undecided = []
        for i, part in enumerate(self.parts):
            zero, still = self.is_zero(part.zero, z), self.is_zero(part.rate, z)
            if part.kind == "stop":
                states[i] = "open"
            elif part.kind != "elastic":
                states[i] = "+" if (part.rate if zero else part.zero) @ z > 0 else "-"
            else:
                force = self.rules.elastic_force(i)
                inside = (part.rate if zero else part.zero) @ z < 0
                unclear = self.is_zero(force, z) and not part.numbers["pulls"]
                if (zero and still) or (inside and unclear and not zero):
                    undecided.append(i)
                states[i] = "on" if inside and (part.numbers["pulls"] or zero or force @ z > 0) else "off"
        first: Mode | None = None
        for chosen in product(("off", "on"), repeat=len(undecided)):
            for i, state in zip(undecided, chosen, strict=True):
                states[i] = state
            mode = self.rules.looks(list(states), candidates, z, self.size)
            first = first or mode
            if all((states[i] == "on") == self.in_contact(mode, i, z) for i in undecided):
                return z, mode
        assert first is not None
        return z, first

    def in_contact(self, mode: Mode, i: int, z: Array) -> bool:
        part = self.parts[i]
        gap, force = mode.signs(np.array([part.zero, self.rules.elastic_force(i)]), z, self.size)
        return gap < 0 and bool(part.numbers["pulls"] or force > 0)

    # segments

    def watched(self, mode: Mode, z: Array) -> Array:
        """Rows that are positive in this mode and end it at zero."""
        rows = list(mode.feasible)
        for i, (part, state) in enumerate(zip(self.parts, mode.states, strict=True)):
            if state == "open":
                rows.append(part.zero)
            elif part.kind == "friction" and state in "+-":
                rows.append(part.rate if state == "+" else -part.rate)
            elif part.kind == "preload" and state in "+-":
                rows.append(part.zero if state == "+" else -part.zero)
            elif part.kind == "elastic":
                force = self.rules.elastic_force(i)
                inside = state == "on" or mode.signs(part.zero[None], z, self.size)[0] < 0
                rows.append(-part.zero if inside else part.zero)
                if inside and not part.numbers["pulls"]:
                    rows.append(force if state == "on" else -force)
        return np.array(rows).reshape(-1, len(z))

    def simulate(self, q: Array, v: Array, times: Array, max_events: int = 20_000) -> Run:
        """Simulate from t = 0; at an instant of an event the state behind it is recorded."""
        times = np.asarray(times, float)
        out, events, done = np.full((len(times), 2 * self.n), np.nan), [], 0
        t, end = 0.0, float(times[-1])
        self.size = np.zeros(2 * self.n + 3)
        try:
            z = self.state(t, np.asarray(q, float), np.asarray(v, float))
            while True:
                z, mode, event = self.settled(t, z)
                events.append(event)
                if len(events) > max_events:
                    raise NoAnswerError("more events than the limit")

                def record(upto: float, at: Callable[[float], Array]) -> None:
                    nonlocal done
                    while done < len(times) and times[done] < upto:
                        out[done] = at(times[done])[: 2 * self.n]
                        done += 1

                t, z = self.segment(t, z, mode, end, record)
                if t >= end:
                    record(np.inf, lambda _, z=z: z)
                    return Run(times, out, events)
        except (NoAnswerError, ArithmeticError) as problem:
            return Run(times, out, events, f"t = {t:.6g}: {problem}")

    def segment(
        self, t: float, z: Array, mode: Mode, end: float, record: Callable[[float, Callable[[float], Array]], None]
    ) -> tuple[float, Array]:
        """Follow one mode to its first event, or to the end."""
        rows = self.watched(mode, z)
        orders = mode.orders(rows, z, self.size)
        if any(sign < 0 for sign, _ in orders):
            raise NoAnswerError("a mode that does not hold where it begins")
        rows = rows[[i for i, (sign, _) in enumerate(orders) if sign]]
        order = [k for sign, k in orders if sign]
        longest = self.longest_step(mode)
        while t < end:
            step = min(longest, end - t)
            series = np.empty((len(z), DEGREE + 1))
            series[:, 0] = z
            for k in range(DEGREE):
                series[:, k + 1] = mode.A @ series[:, k] * (step / (k + 1))
            values, nearest = rows @ series, None
            for row, c, k in zip(rows, values, order, strict=True):
                x = first_event(c[k:], k, ZERO * float(np.abs(row) @ self.size))
                if x is not None and (nearest is None or x < nearest):
                    nearest = x
            share = 1.0 if nearest is None else nearest
            t_next = end if nearest is None and step == end - t else t + share * step

            def at(time: float, t: float = t, step: float = step, series: Array = series) -> Array:
                return series @ ((time - t) / step) ** POWERS

            record(t_next, at)
            z = series @ share**POWERS
            z = self.state(t_next, z[: self.n], z[self.n : 2 * self.n])
            self.grown(z)
            t, order = t_next, [0] * len(rows)
            if nearest is not None:
                break
        return t, z

    def longest_step(self, mode: Mode) -> float:
        """A step on which the last terms of the series are below rounding."""
        A = np.linalg.matrix_power(mode.A, 8)
        return 0.8 / max(float(np.abs(A).sum(axis=0).max()) ** 0.125, self.system.frequency, 1e-3)

    # one instant

    def behind(self, q: Array, v: Array, t: float = 0.0) -> tuple[Array, Array, dict[str, float]]:
        """Return velocities and accelerations behind an instant, and the forces of what is held."""
        self.size = np.zeros(2 * self.n + 3)
        z, mode, _ = self.settled(t, self.state(t, np.asarray(q, float), np.asarray(v, float)))
        named = {self.parts[i].name: f for i, f in mode.forces(z).items()}
        return z[self.n : 2 * self.n], (mode.A @ z)[self.n : 2 * self.n], named


def simulate(
    system: System,
    q: Array,
    v: Array,
    times: Array,
    impacts: str = "simultaneous",
    rest_speed: float = 1e-7,
    max_events: int = 20_000,
) -> Run:
    """Simulate a system of :mod:`contact_elements`; see :meth:`Reference.simulate`."""
    return Reference(system, impacts, rest_speed).simulate(q, v, times, max_events)
