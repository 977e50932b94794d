"""Impacts at one instant of a motion: places and rates, what counts as zero there, contacts closed, friction.

Newton's law over all of them at once, one after the other, or with friction.

Along the normal impulse p the rates v of the contact (n), of its slip (t) and of other closed contacts (o) change by

    dv / dp = G_n + k G_t + G_o y,      k = -mu sgn v_t,    or |k| <= mu with v_t = 0,    0 <= y complementary to v_o.

Compression ends where v_n = 0, with the work W = int v_n dp; the impact ends where the work since then is e^2 |W|
(Stronge 1990). k and y do not change along a piece, which ends where a rate becomes zero: all roots are closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.system.derived.elements.element import CREEP, SMALL
from nonsmooth.system.derived.faces import least, linked
from nonsmooth.system.derived.instants import ZERO

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.elements.element import Place
    from nonsmooth.system.derived.instants import Numbers


ROUNDS = 10_000  # of impacts one after the other


class Instant:
    """One instant: what elements are asked there, with what counts as zero, and their impacts."""

    def __init__(
        self, numbers: Numbers, pattern: Pattern, met: Sequence[int] = (), some: Collection[int] | None = None
    ) -> None:
        self.numbers, self.make, self.mode, self.pattern = numbers, numbers.make, numbers.mode, pattern
        self.parts = self.make.parts
        self.others = [] if some is None else [k for k in range(len(self.parts)) if k not in some]
        bearing = [k for k, part in enumerate(self.parts) if part.element.held and k not in self.others]
        self.contacts = [k for k in bearing if self.parts[k].element.bears]
        self.frictions = [k for k in bearing if not self.parts[k].element.bears]
        self.rates = {k: self.make.rate(k, self.mode) for k in bearing}
        self.still = still = {k for k in bearing if self.holds(k) and self._is_still(k)}
        zero = {k for k in bearing if k in met and self.parts[k].where is self.rates[k]} | still
        self.speeds = {k: 0.0 if k in zero else numbers.number(self.rates[k]) for k in bearing}
        self.places = {k: 0.0 if k in still or k in met else numbers.number(self.parts[k].where) for k in bearing}
        self.pressed: dict[int, bool] = {}
        self.stops = {r: k for k, r in self.make.rubbing.items()}
        self.rubbed: tuple[tuple[int, ...], FloatArray] | None = None
        self.ends = ""

    def _is_still(self, k: int) -> bool:
        """Return whether what is held has stayed where it was: a reset of the system's own, or an input, may have moved
        it."""
        both = ((self.rates[k], CREEP), (self.parts[k].where, SMALL))
        return all(abs(self.numbers.value(one)) <= part * float(self.make.size(one)) for one, part in both)

    def place(self, k: int) -> Place:
        return self.make.place(k, self.mode, self.pattern)

    def holds(self, k: int) -> bool:
        return self.place(k).phase in self.parts[k].element.held

    def put(self, k: int, phase: str) -> None:
        self.pattern = self.place(k).put(phase).pattern

    def law(self, k: int, name: str) -> float:
        return self.numbers.value(self.place(k).law(name))

    def creep(self, k: int) -> float:
        """The speed of approach below which impacts are not followed."""
        given = getattr(self.parts[k].element, "creep", None)
        return float(given) if given is not None else CREEP * float(self.make.size(self.rates[k]))

    def apart(self, contacts: list[int]) -> list[list[int]]:
        """Contacts that approach, with closed ones that feel them; beside those that rub apart by whose impulses change
        whose rates."""
        if not self.make.rubbing or len(contacts) == 1:
            return [contacts]
        own = [[k, *([self.make.rubbing[k]] if k in self.make.rubbing else [])] for k in contacts]
        felt = np.array([[self.numbers.effects(one, other).any() for other in own] for one in own])
        blocks = [[contacts[i] for i in some] for some in linked(felt)]
        return [block for block in blocks if any(self.speeds[k] < 0.0 for k in block)]

    def strike(self, contacts: list[int], restitution: dict[int, float]) -> tuple[int, ...]:
        """The impacts of all contacts that are closed; returns those that bore an impulse (see :class:`Outcome`)."""
        struck = tuple[int, ...]()
        rubs = {k for k in contacts if self.speeds[k] < 0.0 and k in self.make.rubbing}
        for block in self.apart(contacts):
            one = next((k for k in block if k in rubs), None)
            if one is not None:
                struck += self._rub(one, block, restitution[one])
            elif self.make.sequential and len(block) > 1:
                struck += self._in_sequence(block, restitution)
            else:
                struck += self._at_once(block, restitution, bool(rubs))
        return struck

    def _at_once(self, contacts: list[int], restitution: dict[int, float], with_slopes: bool) -> tuple[int, ...]:
        """Newton's law over all of them."""
        before = np.array([self.speeds[k] for k in contacts])
        given_back = np.array([restitution[k] if self.speeds[k] < 0.0 else 0.0 for k in contacts])
        G = self.numbers.effects(contacts, contacts)
        size = len(contacts)
        impulses = least(G, before * (1.0 + given_back), np.zeros(size), np.full(size, np.inf))
        bore = {k: e for k, e, impulse in zip(contacts, given_back, impulses, strict=True) if impulse > 0.0}
        if with_slopes:
            some, slopes = impulses > 0.0, np.zeros((size, size))
            slopes[some] = -np.linalg.pinv(G[np.ix_(some, some)], rcond=1e-10) @ np.diag(1.0 + given_back)[some]
            self._keep(contacts, slopes)
        self._struck(contacts, impulses, {k: max(0.0, -e * self.speeds[k]) for k, e in bore.items()})
        return tuple(k if e == self.law(k, "restitution") else ~k for k, e in bore.items())

    def _keep(self, some: list[int], slopes: FloatArray) -> None:
        """Put the derivatives of impulses in the rates of some elements beside those of others."""
        from scipy.linalg import block_diag

        others, known = self.rubbed or ((), np.zeros((0, 0)))
        self.rubbed = (*others, *some), block_diag(known, slopes)

    def _rub(self, k: int, contacts: list[int], restitution: float) -> tuple[int, ...]:
        """The impact of one contact that rubs, the others that are closed without friction."""
        r = self.make.rubbing[k]
        some = [k, r, *(j for j in contacts if j != k)]
        rates = np.array([self.speeds[j] for j in some])
        found = stronge(self.numbers.effects(some, some), rates, restitution, self.law(r, "friction"), least)
        if found is None:
            self.ends = "no_motion"
            return ()
        impulses, slopes, after = found
        self._struck(some, impulses, dict(zip(some, map(float, after), strict=True)))
        self._keep(some, slopes)
        return (k,)

    def _struck(self, some: list[int], impulses: FloatArray, after: dict[int, float]) -> None:
        """Put in the impulses of some elements; of those ``after`` the rates behind them are known."""
        self.speeds = self._behind(self.speeds, some, impulses) | after
        for j, impulse in zip(some, impulses, strict=True):
            self.numbers.shift(self.numbers.direction(j) * impulse)

    def _in_sequence(self, contacts: list[int], restitution: dict[int, float]) -> tuple[int, ...]:
        """Impacts one after the other, the fastest approach first, those of one speed at once; a plastic one of all
        contacts ends them where no approach is faster than rest."""
        G, count = self.numbers.effects(contacts, contacts), len(contacts)
        v, e = np.array([self.speeds[k] for k in contacts]), np.array([restitution[k] for k in contacts])
        rest = np.array([self.creep(k) for k in contacts])
        impulses, slopes, rates = np.zeros(count), np.zeros((count, count)), np.eye(count)  # of the rates at first
        for _ in range(ROUNDS):
            last = bool((-v <= rest).all())
            some = list(range(count)) if last else [i for i in range(count) if v[i] <= v.min() * (1 - ZERO)]
            factor = np.where(v[some] < 0.0, 1.0 if last else 1.0 + e[some], 1.0)
            found = least(G[np.ix_(some, some)], v[some] * factor, np.zeros(len(some)), np.full(len(some), np.inf))
            bearing = [i for i, impulse in zip(some, found, strict=True) if impulse > 0.0]
            if bearing:
                inverse = np.linalg.pinv(G[np.ix_(bearing, bearing)], rcond=1e-10)
                back = np.array([0.0 if last else e[i] for i in bearing])
                change = -inverse @ ((1.0 + back)[:, None] * rates[bearing])
                slopes[bearing] += change
                push = found[found > 0.0]
                impulses[bearing] += push
                after = -back * v[bearing]
                v, rates = v + G[:, bearing] @ push, rates + G[:, bearing] @ change
                v[bearing] = after
            if last:
                break
        else:
            self.ends = "no_motion"
            return ()
        v = np.where(np.abs(v) <= ZERO * np.abs(G) @ impulses, 0.0, v)
        self._struck(contacts, impulses, dict(zip(contacts, map(float, v), strict=True)))
        self._keep(contacts, slopes)
        return tuple(k for k, impulse in zip(contacts, impulses, strict=True) if impulse > 0.0)

    def _behind(self, speeds: dict[int, float], some: list[int], impulses: FloatArray) -> dict[int, float]:
        """All rates behind impulses of some elements, 0 where they are rounding."""
        found = {}
        for k, effects in zip(speeds, self.numbers.effects(list(speeds), some), strict=True):
            total, terms = speeds[k] + effects @ impulses, abs(speeds[k]) + np.abs(effects) @ np.abs(impulses)
            found[k] = float(total) if abs(total) > ZERO * terms else 0.0
        return found


Least = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
TURNS = 1000  # pieces of one impact, at most
TINY = 1e-40  # of the rates: steps of derivatives, in the imaginary part


def stronge(
    G: FloatArray, rates: FloatArray, restitution: float, friction: float, least: Least
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return the impulses, their derivatives in the rates and the rates behind an impact; None where the slip does not
    fall while the contact is not slowed down.

    Places 0 and 1 of ``G`` and ``rates`` are those of the contact and its slip, the others of closed contacts. Rates
    that the impact ends are exactly zero. ``least`` solves for impulses between bounds."""
    size, scale = len(rates), float(np.abs(rates).max())
    impulses, after = np.zeros(size), rates
    slopes = np.zeros((size, size))
    for j in range(size):  # impulses are functions of the rates that are analytic along the pieces
        disturbed = rates / scale + 1j * TINY * np.eye(size)[j]
        found = _followed(G, disturbed, restitution, friction, least)
        if found is None:
            return None
        impulses, after = found[0].real * scale, found[1].real * scale
        slopes[:, j] = found[0].imag / TINY
    return impulses, slopes, after


def _followed(
    G: FloatArray, v: FloatArray, restitution: float, friction: float, least: Least
) -> tuple[FloatArray, FloatArray] | None:
    """Impulses and rates behind the impact, of complex rates whose real parts say what happens."""
    size = len(v)
    v, total = v.copy(), np.zeros(size, dtype=complex)
    work, left = 0.0 + 0.0j, None  # of compression; what is left of restitution
    for _ in range(TURNS):
        ways, dv = _piece(G, v.real, friction, least)
        step, first = np.inf + 0j, -1
        for i in range(1, size):  # the slip, or an open contact, comes to its end
            if v[i].real * dv[i] < 0.0 and (-v[i] / dv[i]).real < step.real:
                step, first = -v[i] / dv[i], i
        if left is None:
            done = -v[0] / dv[0] if dv[0] > 0.0 else np.inf + 0j
        elif left.real <= 0.0:
            done = 0j
        else:
            square = v[0] ** 2 + 2.0 * dv[0] * left
            done = 2.0 * left / (v[0] + np.sqrt(square)) if square.real >= 0.0 else np.inf + 0j
        ended = done.real <= step.real
        step = done if ended else step
        if np.isinf(step.real):
            return None
        gained = v[0] * step + dv[0] * step**2 / 2.0
        v, total = v + dv * step, total + ways * step
        if first > 0 and not ended:
            v[first] = 0.0
        if left is None:
            work += gained
            if ended:
                v[0], left = 0.0, -(restitution**2) * work
        else:
            left = left - gained
            if ended:
                return total, v
    return None


def _piece(G: FloatArray, v: FloatArray, friction: float, least: Least) -> tuple[FloatArray, FloatArray]:
    """Impulses for a unit of the normal one, and the changes of the rates by them."""
    ways = np.zeros(len(v))
    ways[0] = 1.0
    some = [i for i in range(1, len(v)) if v[i] == 0.0]
    if v[1]:
        ways[1] = -friction * np.sign(v[1])
    if some:
        low = np.array([-friction if i == 1 else 0.0 for i in some])
        high = np.array([friction if i == 1 else np.inf for i in some])
        ways[some] = least(G[np.ix_(some, some)], (G @ ways)[some], low, high)
    dv = G @ ways
    terms = np.abs(G) @ np.abs(ways)
    return ways, np.where(np.abs(dv) <= 1e-13 * terms, 0.0, dv)
