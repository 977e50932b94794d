r"""Decisions of several contacts and frictions at one instant: which hold and which let go.

Candidates are the rigid contacts with g = g' = 0 and the frictions whose slip is zero. Their forces :math:`\lambda` and
the derivatives a of their rates are those of the convex problem

    minimise 1/2 lambda' G lambda + a_free' lambda,    lambda_n >= 0,  |lambda_t| <= b,    a = a_free + G lambda,

with G = W M^-1 W' and the accelerations a_free without these forces (Gauss's principle with dry friction; a is unique).
Each friction is asked with its static bound first; those that move then get the kinetic one, for this instant, and all
are asked again. Where a force lies on its bound and the rate stands still, the same problem is asked for the next
derivatives: a contact state holds if its conditions hold just behind the instant along its own flow, and what is zero
to all orders holds. Impacts come before: Newton's law over all contacts that are closed, with an impulse for each that
pushes only. Frictions bear no impulse.

Numbers are rows over w = (u, 1, cos, sin, ...), the calculus of :mod:`nonsmooth.system.derived.patterns`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.kernels import convex
from nonsmooth.system.derived.elements.element import CREEP, SLOW

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern, Place
    from nonsmooth.system.derived.patterns import Row, Rows

__all__ = ["Outcome", "begun", "decide", "least"]

ZERO = 1e-11  # of the sum of the terms of a row: what is smaller is zero
ORDERS = 24  # derivatives that are looked at where all before are zero


@dataclass(frozen=True)
class Outcome:
    """The phases behind an instant and the states there; the contacts that bore an impulse, each with the part of its
    approach that it gave back."""

    pattern: Pattern
    states: FloatArray
    struck: tuple[tuple[int, float], ...] = ()


def decide(rows: Rows, mode: str, pattern: Pattern, w: FloatArray, step: float = 0.0) -> Outcome:
    """The phases and the states just behind an instant, with w = (u, 1, cos, sin, ...), found by a step of the flow.

    Elastic elements keep their phases. What rests or sticks before the instant is a candidate, and so is each contact
    whose gap and each friction whose slip is zero within ``ZERO`` of its terms, those of its change on the step too."""
    here = _Instant(rows, mode, pattern, w.copy(), step)
    contacts = [k for k in here.contacts if here.places[k] <= 0.0]
    approaching = [k for k in contacts if here.speeds[k] < 0.0]
    if not approaching:
        return here.outcome(contacts, ())
    own = {k: here.restitution(k) for k in contacts}
    if all(-here.speeds[k] < here.creep(k) for k in approaching):
        still = _Instant(rows, mode, pattern, w.copy(), step)
        struck = still.strike(contacts, dict.fromkeys(contacts, 0.0))
        found = still.outcome(contacts, struck)
        if all(still.pressed[k] for k in approaching):
            return found
    return here.outcome(contacts, here.strike(contacts, own))


def begun(rows: Rows, mode: str, pattern: Pattern, w: FloatArray) -> Outcome:
    """The phases and the states where a run begins, from the states alone.

    An elastic element begins in the phase to which its conditions lead; what it does afterwards they say as well."""
    parts, others = rows.parts, [k for k, part in enumerate(rows.parts) if not part.element.held]
    for k, part in enumerate(parts):
        if part.element.held:
            free = next(i for i, phase in enumerate(part.element.phases) if phase not in part.element.held)
            pattern = (*pattern[:k], free, *pattern[k + 1 :])
    here = _Instant(rows, mode, pattern, w, 0.0)
    for _ in range(3):
        for k in others:
            for way in parts[k].element.leaving(here.place(k)):
                if all(one.sign * here.value(one.value) > 0.0 for one in way.conditions):
                    here.put(k, str(way.phase))
                    break
    return decide(rows, mode, here.pattern, w)


class _Instant:
    """One instant: numbers of the rows there, with what counts as zero."""

    def __init__(self, rows: Rows, mode: str, pattern: Pattern, w: FloatArray, step: float) -> None:
        self.rows, self.mode, self.pattern, self.w = rows, mode, pattern, w
        self.size = np.abs(w)
        self.size[: rows.n] += 0.25 * step * np.abs(rows.base(mode)) @ self.size
        bearing = [k for k, part in enumerate(rows.parts) if part.element.held]
        self.contacts = [k for k in bearing if rows.parts[k].element.bears]
        self.frictions = [k for k in bearing if not rows.parts[k].element.bears]
        self.rates = {k: rows.rate(k, mode).values for k in bearing}
        self.speeds = {k: 0.0 if self.holds(k) else self.number(self.rates[k]) for k in bearing}
        self.places = {k: 0.0 if self.holds(k) else self.number(rows.parts[k].where.values) for k in bearing}
        self.pressed: dict[int, bool] = {}

    def number(self, row: FloatArray) -> float:
        """The value of a row, 0 where it is rounding."""
        total = float(row @ self.w)
        return total if abs(total) > ZERO * float(np.abs(row) @ self.size) else 0.0

    def place(self, k: int) -> Place:
        return self.rows.place(k, self.mode, self.pattern)

    def holds(self, k: int) -> bool:
        return self.place(k).phase in self.rows.parts[k].element.held

    def put(self, k: int, phase: str) -> None:
        self.pattern = self.place(k).put(phase).pattern

    def value(self, law: Row | float) -> float:
        return float(law.values @ self.w) if hasattr(law, "values") else float(law)

    def restitution(self, k: int) -> float:
        return self.value(self.place(k).law("restitution"))

    def creep(self, k: int) -> float:
        """The speed of approach below which impacts are not followed."""
        given = getattr(self.rows.parts[k].element, "creep", None)
        return float(given) if given is not None else CREEP * self.rows.size(self.rows.rate(k, self.mode))

    def effects(self, some: Sequence[int], by: Sequence[int]) -> FloatArray:
        """Changes of the derivatives of the rates of some elements by unit forces of others."""
        return self.rows.changes[np.ix_(some, by)]

    def strike(self, contacts: list[int], restitution: dict[int, float]) -> tuple[tuple[int, float], ...]:
        """The impact of all contacts that are closed; returns those that bore an impulse."""
        before = np.array([self.speeds[k] for k in contacts])
        given_back = np.array([restitution[k] if self.speeds[k] < 0.0 else 0.0 for k in contacts])
        G = self.effects(contacts, contacts)
        size = len(contacts)
        impulses = least(G, before * (1.0 + given_back), np.zeros(size), np.full(size, np.inf))
        bearing = sorted({*self.contacts, *self.frictions})
        changes, terms = (f(self.effects(bearing, contacts)) @ impulses for f in (np.array, np.abs))
        for k, change, of in zip(bearing, changes, terms, strict=True):
            total = self.speeds[k] + change
            self.speeds[k] = total if abs(total) > ZERO * (abs(self.speeds[k]) + of) else 0.0
        for k, speed, e, impulse in zip(contacts, before, given_back, impulses, strict=True):
            if impulse > 0.0:
                self.speeds[k] = max(0.0, -e * speed)
            self.w[: self.rows.n] += self.rows.parts[k].direction * impulse
        return tuple((k, float(e)) for k, e, p in zip(contacts, given_back, impulses, strict=True) if p > 0.0)

    def outcome(self, contacts: list[int], struck: tuple[tuple[int, float], ...]) -> Outcome:
        """Those that hold and those that let go, with the rates as they are now."""
        candidates = [k for k in contacts if self.speeds[k] == 0.0]
        for k in self.contacts:
            self.put(k, "open")
        for k in self.frictions:
            part = self.rows.parts[k]
            slow = SLOW * self.rows.size(self.rows.rate(k, self.mode))
            side = part.element.lies(self.places[k], self.speeds[k], slow)
            self.put(k, part.element.sides[side < 0])  # one that may hold is asked below
            if not side:
                candidates.append(k)
        moving = self._let_go(candidates) if candidates else {}
        held = [k for k in candidates if k not in moving]
        for k in candidates:
            if k in self.contacts:
                self.pressed[k] = k in held
            if k in held:
                self.put(k, self.rows.parts[k].element.held[0])
            elif k in self.frictions:
                self.put(k, self.rows.parts[k].element.sides[moving[k] < 0])
        for k in self.contacts:
            self.pressed.setdefault(k, False)
        closed = [self.rows.parts[k].where.values for k in held if k in self.contacts]
        if closed:  # gaps and rates that are zero are set to zero
            gaps = np.array(closed)
            self.w[: self.rows.n] -= np.linalg.lstsq(gaps[:, : self.rows.n], gaps @ self.w, rcond=1e-10)[0]
        if candidates:
            off = np.array([self.rates[k] @ self.w for k in candidates])
            amounts = np.linalg.lstsq(self.effects(candidates, candidates), -off, rcond=1e-10)[0]
            for k, amount in zip(candidates, amounts, strict=True):
                self.w[: self.rows.n] += self.rows.parts[k].direction * amount
        return Outcome(self.pattern, self.w[: self.rows.n].copy(), struck)

    def _let_go(self, candidates: list[int]) -> dict[int, int]:
        """Of the candidates those that move, each with the sign of its rate behind the instant."""
        kinetic: set[int] = set()
        while True:
            moving = self._moving(candidates, kinetic)
            fresh = {k for k in moving if k in self.frictions} - kinetic
            if not fresh:
                return moving
            kinetic |= fresh

    def _moving(self, candidates: list[int], kinetic: set[int]) -> dict[int, int]:
        """One look: those that move with the static bounds, but for some that have the kinetic ones."""
        n, count = self.rows.n, len(candidates)
        field = self.rows.base(self.mode).copy()
        for k, part in enumerate(self.rows.parts):
            if k not in candidates and not self.holds(k):
                force = part.element.force(self.place(k))
                if hasattr(force, "values"):
                    field += np.outer(part.direction, force.values)
        R = np.array([self.rates[k] for k in candidates])
        G = self.effects(candidates, candidates)
        own = {k: self._bounds(k, k in kinetic) for k in candidates}
        w, size = self.w, np.abs(self.w)
        at: dict[int, str] = dict.fromkeys(candidates, "both")  # bounds on which the forces lie so far
        moving: dict[int, int] = {}
        for _ in range(ORDERS):
            ahead, size_ahead = self._onward(field, w), self._onward(np.abs(field), size, 1.0)
            low, high = np.full(count, -np.inf), np.full(count, np.inf)
            for i, k in enumerate(candidates):
                least_, most = (float(row @ w) for row in own[k])
                if k in moving:
                    low[i] = high[i] = most if moving[k] < 0 else least_
                    continue
                if at[k] in ("both", "low"):
                    low[i] = least_
                if at[k] in ("both", "high"):
                    high[i] = most
                if k in self.contacts:
                    high[i] = np.inf
                high[i] = max(low[i], high[i])
            free = R @ ahead
            forces = least(G, free, low, high)
            a = free + G @ forces
            sizes = np.abs(R) @ size_ahead + np.abs(G) @ np.abs(forces)
            begun = set(moving)
            for i, k in enumerate(candidates):
                if k in begun or at[k] == "none":
                    continue
                if abs(a[i]) > ZERO * sizes[i]:
                    moving[k] = 1 if a[i] > 0 else -1
                    continue
                rounding = ZERO * (abs(forces[i]) + sizes[i] / max(abs(G[i, i]), 1e-300))
                on = [one for one, bound in (("low", low[i]), ("high", high[i])) if abs(forces[i] - bound) <= rounding]
                at[k] = "both" if len(on) == 2 else on[0] if on else "none"
            if all(k in moving or at[k] == "none" for k in candidates):
                break
            w, size = ahead, size_ahead
            for i, k in enumerate(candidates):
                direction = self.rows.parts[k].direction
                w[:n] += direction * forces[i]
                size[:n] += np.abs(direction * forces[i])
        return moving

    def _bounds(self, k: int, kinetic: bool) -> tuple[FloatArray, FloatArray]:
        """Rows of the least and the greatest force of a candidate."""
        element, here, nothing = self.rows.parts[k].element, self.place(k), np.zeros(len(self.w))
        if k in self.contacts:
            return nothing, nothing

        def row(law: Row | float) -> FloatArray:
            if hasattr(law, "values"):
                return law.values
            found = nothing.copy()
            found[self.rows.n] = law
            return found

        if kinetic:
            low, high = (row(element.force(here.put(side))) for side in element.sides)
            return low, high
        most = row(element.most(here))
        return -most, most

    def _onward(self, field: FloatArray, w: FloatArray, sign: float = -1.0) -> FloatArray:
        """The derivative in time of w; with ``sign`` 1 a bound on its size."""
        n, rates, ahead = self.rows.n, self.rows.rates, np.zeros_like(w)
        ahead[:n] = field @ w
        ahead[n + 1 :: 2] = sign * rates * w[n + 2 :: 2]
        ahead[n + 2 :: 2] = rates * w[n + 1 :: 2]
        return ahead


def least(G: FloatArray, a: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Minimise 1/2 x' G x + a' x between bounds, for G not negative and symmetric by factors (:mod:`.convex`)."""
    size, scale = len(a), _symmetric(G)
    x, sets, factor = np.empty((2, size)), np.empty((2, size), dtype=np.int64), np.empty((size, size + 1))
    status = convex.least(G * scale, a + 0.0, low / scale, high / scale, x[0], *sets, factor, x[1])
    if status:
        raise SolveError(
            "the forces of contacts and frictions that decide together were not found: "
            + ("no set is the last" if status == 1 else "contacts close on what cannot give way")
        )
    return x[0] * scale


def _symmetric(G: FloatArray) -> FloatArray:
    """Positive factors s of the columns that make G symmetric; ones where there are none."""
    size = len(G)
    scale = np.zeros(size)
    for first in range(size):
        if scale[first]:
            continue
        scale[first], known = 1.0, [first]
        for i in known:
            for j in range(size):
                if not scale[j] and G[i, j] and G[i, j] * G[j, i] > 0:
                    scale[j] = G[j, i] * scale[i] / G[i, j]
                    known.append(j)
    return scale
