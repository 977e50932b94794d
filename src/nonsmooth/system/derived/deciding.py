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

Their numbers are those of :class:`nonsmooth.system.derived.instants.Numbers`, of affine systems and any other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.kernels.series.crossing import NOISE  # by which a march judges
from nonsmooth.system.derived.enumerating import HELD, ORDERS, Candidates, moving_by_trial
from nonsmooth.system.derived.faces import is_symmetric, least
from nonsmooth.system.derived.impacts import Instant
from nonsmooth.system.derived.instants import ZERO

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.instants import Ahead, Numbers

PARTING = 1e-10  # of the scale of a rate: what parts faster is followed


@dataclass(frozen=True)
class Outcome:
    """The phases behind an instant and the states there; the contacts that bore an impulse, ~k for a contact k that
    gave back nothing of its approach although it has a restitution, and with the number of elements added those that
    hold from then on although their rate behind the impact was not zero, but slow, or although they bore no impulse.

    ``rubbed``: of an impact that rubs the elements that bore impulses, and the derivatives of these in their rates;
    ``ends`` and ``names``: the status of a run that cannot go on, and the elements for which it cannot."""

    pattern: Pattern
    states: FloatArray
    struck: tuple[int, ...] = ()
    rubbed: tuple[tuple[int, ...], FloatArray] | None = None
    ends: str = ""
    names: str = ""


def decide(numbers: Numbers, pattern: Pattern, met: Sequence[int] = (), some: Collection[int] | None = None) -> Outcome:
    """The phases and the states just behind an instant, with the numbers there; of ``some`` elements alone where no
    force of the others changes a rate of theirs.

    Elastic elements keep their phases. What rests or sticks before the instant is a candidate, and so is each contact
    whose gap and each friction whose slip is zero within ``ZERO`` of its terms, those of its change on the last step
    too; that of the elements ``met`` is, whatever its rounding."""
    here = _Instant(numbers, pattern, met, some)
    contacts = [k for k in here.contacts if here.places[k] <= 0.0]
    approaching = [k for k in contacts if here.speeds[k] < 0.0]
    if not approaching:
        return here.outcome(contacts, ())
    for block in here.apart(contacts):
        together = [k for k in block if here.speeds[k] < 0.0]
        if len(together) > 1 and any(k in here.make.rubbing for k in together):
            return here.end("not_unique", together)
    own = {k: here.law(k, "restitution") for k in contacts}
    if all(-here.speeds[k] < here.creep(k) for k in approaching):
        still = _Instant(numbers.copy(), pattern, met, some)
        struck = still.strike(contacts, dict.fromkeys(contacts, 0.0))
        found = still.outcome(contacts, struck)
        if all(still.pressed[k] for k in approaching):
            return found
    return here.outcome(contacts, here.strike(contacts, own))


def begun(numbers: Numbers, pattern: Pattern) -> Outcome:
    """The phases and the states where a run begins, from the states alone.

    An elastic element begins in the phase to which its conditions lead; what it does afterwards they say as well."""
    parts = numbers.make.parts
    others = [k for k, part in enumerate(parts) if not part.element.held]
    for k, part in enumerate(parts):
        if part.element.held:
            free = next(i for i, phase in enumerate(part.element.phases) if phase not in part.element.held)
            pattern = (*pattern[:k], free, *pattern[k + 1 :])
    here = _Instant(numbers, pattern)
    for _ in range(3):
        for k in others:
            for way in parts[k].element.leaving(here.place(k)):
                if all(one.sign * numbers.value(one.value) > 0.0 for one in way.conditions):
                    here.put(k, str(way.phase))
                    break
    return decide(numbers, here.pattern)


class _Instant(Instant):
    """One instant with the contacts that hold there and those that let go."""

    def end(self, status: str, elements: Sequence[int]) -> Outcome:
        """The run ends here."""
        names = ", ".join(repr(self.parts[k].name) for k in sorted(elements))
        return Outcome(self.pattern, self.numbers.u.copy(), ends=status, names=names)

    def outcome(self, contacts: list[int], struck: tuple[int, ...]) -> Outcome:
        """Those that hold and those that let go, with the rates as they are now.

        Where a place decides, or contacts part by less than rounding, a slow rate may hold as zero does: the others are
        asked as if it did, and again with its own where it does not. A slip that the march takes for none is none."""
        still = [k for k in self.frictions if abs(self.speeds[k]) <= NOISE * float(self.make.size(self.rates[k]))]
        own = self.speeds = self.speeds | dict.fromkeys(still, 0.0)
        slow = [k for k in self.frictions if own[k] and not self._side(k)]
        near = [k for k in contacts if 0.0 < own[k] < PARTING * float(self.make.size(self.rates[k])) and self._meets(k)]
        while True:
            self.speeds = self._stilled(own, slow) | dict.fromkeys(near, 0.0)
            candidates, slips = self._candidates(contacts, slow)
            states = self._states(candidates, slips) if candidates and not self.ends else {}
            if self.ends:
                return self.end(self.ends, [*candidates, *slips] or contacts)
            if all(states[k] == HELD for k in (*slow, *near)):
                break
            slow, near = ([k for k in some if states[k] == HELD] for some in (slow, near))
        for k, state in states.items():
            element = self.parts[k].element
            self.put(k, element.held[0] if state == HELD else element.sides[state < 0] if state else element.phases[0])
        self.pressed = {k: states.get(k) == HELD for k in self.contacts}
        at = {k for k in self.frictions if self.places[k] == 0.0 and self.parts[k].where is not self.rates[k]}
        self._set_to_zero([self.parts[k].where for k in candidates if self.pressed.get(k) or k in at], None)
        self._set_to_zero([self.rates[k] for k in candidates], candidates)
        landed = [k for k in candidates if self.pressed.get(k) and k not in self.still and not {k, ~k} & {*struck}]
        if (struck and slow) or landed:
            struck += tuple(len(self.parts) + k for k in self._independent([*slow, *landed, *candidates]))
        return Outcome(self.pattern, self.numbers.u.copy(), struck, self.rubbed)

    def _meets(self, k: int) -> bool:
        """Return whether a contact that parts would be no farther than rounding before it meets again."""
        element = self.parts[k].element
        if element.held[0] not in element.phases:
            return False
        pull = float(self._ahead([k]).rates()[1][0])
        return self.speeds[k] ** 2 <= 2.0 * NOISE * self.numbers.terms(self.parts[k].where) * pull

    def _side(self, k: int, may_be_slow: bool = True) -> int:
        """The side on which a friction slips; 0 where it may hold."""
        element = self.parts[k].element
        slow = element.slow * float(self.make.size(self.rates[k])) if may_be_slow else 0.0
        return element.lies(self.places[k], self.speeds[k], slow)

    def _stilled(self, speeds: dict[int, float], slow: list[int]) -> dict[int, float]:
        """The rates behind impulses that take those of some elements to zero; what holds holds on."""
        if not slow:
            return speeds
        some = [*slow, *(k for k in speeds if k in self.still and k not in slow and speeds[k] == 0.0)]
        off = -np.array([speeds[k] for k in some])
        amounts = np.linalg.lstsq(self.numbers.effects(some, some), off, rcond=1e-10)[0]
        return self._behind(speeds, some, amounts) | dict.fromkeys(some, 0.0)

    def _candidates(self, contacts: list[int], slow: list[int]) -> tuple[list[int], dict[int, int]]:
        """Those that may hold, and the sides of frictions that slip at contacts that may; others get their phases."""
        may_rest = [k for k in contacts if self.parts[k].element.held[0] in self.parts[k].element.phases]
        candidates = [k for k in may_rest if self.speeds[k] == 0.0]
        slips: dict[int, int] = {}
        for k in self.contacts:
            self.put(k, "open")
        for k in self.frictions:
            element, side = self.parts[k].element, 0 if k in slow else self._side(k, False)
            if k in self.stops and self.stops[k] not in candidates:
                self.put(k, element.phases[0])
                continue
            self.put(k, element.sides[side < 0])  # one that may hold is asked below
            if not side:
                candidates.append(k)
            elif k in self.stops:
                slips[k] = side
        return candidates, slips

    def _independent(self, some: list[int]) -> list[int]:
        """Those of some elements, the first of them first, whose rates do not depend on each other."""
        found: list[int] = []
        for k in dict.fromkeys(some):
            G = self.numbers.effects([*found, k], [*found, k])
            if np.linalg.matrix_rank(G, tol=1e-10 * np.abs(G).max(initial=0.0)) == len(G):
                found.append(k)
        return found

    def _set_to_zero(self, expressions: list[Any], by: list[int] | None) -> None:
        """Set gaps or rates that are zero to zero: by impulses of some elements, or the shortest way."""
        if not expressions:
            return
        for _ in range(2):  # what the first leaves is rounding of it, and one term has no other size than its own
            off = np.array([self.numbers.value(one) for one in expressions])
            if by is None:
                slopes = np.array([self.numbers.slopes(one) for one in expressions])
                self.numbers.shift(-np.linalg.lstsq(slopes, off, rcond=1e-10)[0])
                continue
            key = "to zero", *by
            if key not in self.numbers.known:
                self.numbers.known[key] = np.linalg.pinv(self.numbers.effects(by, by), rcond=1e-10)
            amounts = self.numbers.known[key] @ -off
            self.numbers.shift(sum(self.numbers.direction(k) * x for k, x in zip(by, amounts, strict=True)))
        for _ in range(2):  # of one state no rounding is left, which would move what rests
            for one in expressions:
                slopes = self.numbers.slopes(one)
                if np.count_nonzero(slopes) == 1:
                    alone = slopes != 0.0
                    self.numbers.shift(np.where(alone, -self.numbers.value(one) / np.where(alone, slopes, 1.0), 0.0))

    def _states(self, candidates: list[int], slips: dict[int, int]) -> dict[int, int]:
        """The contact states of the candidates, and of frictions that slip at a contact: those of the convex problem,
        or of all that are tried where there is none."""
        every = [*candidates, *slips]
        G = self.numbers.effects(every, every)
        tried = any(k in self.make.rubbing for k in candidates) or not is_symmetric(G)
        kinetic: set[int] = set()
        while True:
            if tried:
                rubbing = {k: self.make.rubbing[k] for k in candidates if k in self.make.rubbing}
                shares = {r: self.law(r, "friction") for r in rubbing.values()}
                held = {*self.contacts} & {*candidates}
                who = Candidates(every, held, rubbing, shares, slips, kinetic, self.numbers.known)
                states, self.ends = moving_by_trial(who, G, lambda: self._ahead(every))
            else:
                moving = self._moving(candidates, kinetic, G)
                states = {k: HELD if k not in moving else 0 if k in self.contacts else moving[k] for k in candidates}
            fresh = {k for k, one in states.items() if one != HELD} - {*self.contacts, *self.stops} - kinetic
            if not fresh or self.ends:
                return states
            kinetic |= fresh

    def _moving(self, candidates: list[int], kinetic: set[int], G: FloatArray) -> dict[int, int]:
        """One look: those that move with the static bounds, but for some that have the kinetic ones."""
        count = len(candidates)
        ahead = self._ahead(candidates)
        at: dict[int, str] = dict.fromkeys(candidates, "both")  # bounds on which the forces lie so far
        moving: dict[int, int] = {}
        for _ in range(ORDERS):
            free, sizes, bounds = ahead.rates()
            low, high = np.full(count, -np.inf), np.full(count, np.inf)
            for i, k in enumerate(candidates):
                static, *sides = bounds[3 * i : 3 * i + 3]
                least_, most = sides if k in kinetic else (-static, static)
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
            forces = least(G, free, low, high)
            a = free + G @ forces
            sizes = sizes + np.abs(G) @ np.abs(forces)
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
            ahead.put(forces)
        return moving

    def _ahead(self, candidates: list[int]) -> Ahead:
        """Derivatives of the rates and the bounds of the candidates; of each the static one and the two kinetic ones.

        Others have the forces by their laws, or those that hold them."""
        away = {*candidates, *self.others}
        others = [k for k in range(len(self.parts)) if k not in away and not self.holds(k)]
        forces = [(k, self.parts[k].element.force(self.place(k))) for k in others]
        if self.others:
            held = self.make.flow(self.mode, self.pattern)[1]
            forces += [(k, held[k]) for k in self.others]
        laws: list[Any] = []
        for k in candidates:
            element, here = self.parts[k].element, self.place(k)
            if k in self.contacts:
                laws += [0.0, 0.0, 0.0]
            else:
                laws += [element.most(here), *(element.force(here.put(side)) for side in element.sides)]
        return self.numbers.ahead(candidates, forces, laws)
