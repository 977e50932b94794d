"""Decisions by trying all combinations of contact states, where no convex problem says what happens.

Friction at a rigid contact is bounded by a force that is not known, and forces may act on rates as no positive
factors make symmetric: then there may be no motion, or several. A combination is right if all its conditions hold just
behind the instant along its own flow, each by its first derivative that is not zero; those whose rates have equal
derivatives to all orders are one motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError

MOST = 4096  # combinations that are tried
ZERO = 1e-11  # of the sum of the terms
SAME = 1e-9  # of the sizes of rates: two motions that differ by less are one
ORDERS = 24
OPEN, HELD = 0, 2  # contact states; a slip is 1 or -1


@dataclass
class Candidates:
    """Who is asked: numbers of the elements, which are contacts, the friction of those that rub and its coefficient,
    the frictions whose slip has a sign already, and those that have the kinetic bound."""

    elements: list[int]
    contacts: set[int]
    rubbing: Mapping[int, int]
    shares: Mapping[int, float]
    slipping: Mapping[int, int] = field(default_factory=dict)
    kinetic: set[int] = field(default_factory=set)
    known: dict[Any, Any] = field(default_factory=dict)  # what holds forces, as long as G does not change

    def choices(self) -> list[list[dict[int, int]]]:
        """Of each element, with the friction under it, the contact states that may be; an open one does not rub."""
        found: list[list[dict[int, int]]] = []
        for k in self.elements:
            r = self.rubbing.get(k)
            if k in self.shares:
                continue
            if k not in self.contacts:
                found.append([{k: HELD}, {k: 1}, {k: -1}])
            elif r is None:
                found.append([{k: HELD}, {k: OPEN}])
            else:
                sides = (self.slipping[r],) if r in self.slipping else (HELD, 1, -1)
                found.append([*({k: HELD, r: side} for side in sides), {k: OPEN, r: OPEN}])
        return found

    def blocks(self, G: FloatArray) -> list[list[list[dict[int, int]]]]:
        """The choices apart by whose forces change whose rates."""
        acts, at = (G != 0.0) | (G.T != 0.0), {k: i for i, k in enumerate(self.elements)}
        left, found = self.choices(), []
        while left:
            block = [left.pop(0)]
            for one in block:
                mine = [at[k] for k in one[0]]
                near = [other for other in left if acts[np.ix_(mine, [at[k] for k in other[0]])].any()]
                left = [other for other in left if other not in near]
                block += near
            found.append(block)
        return found


@dataclass
class _Now:
    """Derivatives of the rates at the instant itself, the same for all combinations."""

    found: tuple[FloatArray, FloatArray, FloatArray]

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.found


def _combined(choices: Sequence[Sequence[dict[int, int]]]) -> Iterator[dict[int, int]]:
    """All combinations of one of each."""
    if np.prod([float(len(one)) for one in choices]) > MOST:
        raise SolveError(f"{len(choices)} contacts and frictions that decide together: too many combinations to try")
    for some in product(*choices):
        yield {k: state for one in some for k, state in one.items()}


def moving_by_trial(who: Candidates, G: FloatArray, begin: Any) -> tuple[dict[int, int], str]:
    """The contact states just behind the instant, and nothing, "no_motion" or "not_unique".

    ``G``: effects of unit forces; ``begin()`` gives the derivatives of rates and bounds along a flow yet unknown. What
    each block may do at the instant is asked first; only what is left of them is combined and followed."""
    now = _Now(begin().rates())
    may_be = [
        [states for states in _combined(block) if _followed(who, states, G, now, True, 1) is not None]
        for block in who.blocks(G)
    ]  # fmt: skip
    valid = [states for states in _combined(may_be) if _followed(who, states, G, begin(), True) is not None]
    if not valid:
        return {}, "no_motion"
    valid.sort(key=lambda states: -sum(one == HELD for one in states.values()))
    if len(valid) == 1:
        return valid[0], ""
    first, *others = (_followed(who, states, G, begin(), False) for states in valid)
    for other in others:
        for (one, size), (two, other_size) in zip(first or (), other or (), strict=True):
            if (np.abs(one - two) > SAME * (size + other_size)).any():
                return valid[0], "not_unique"
    return valid[0], ""


def _holds(
    who: Candidates, states: dict[int, int], G: FloatArray, at: dict[int, int]
) -> tuple[list[int], FloatArray, FloatArray] | None:
    """Whose rates are held, what unit forces that hold bring along, and the forces for unit rates; None where friction
    leaves them undetermined."""
    key = tuple(at), tuple(states.items())
    if key not in who.known:
        held = [k for k in at if states.get(k) == HELD]
        push = np.zeros((len(at), len(held)))
        for j, k in enumerate(held):
            push[at[k], j] = 1.0
            r = who.rubbing.get(k)
            if r is not None and abs(states[r]) == 1:
                push[at[r], j] = -states[r] * who.shares[r]
        rows = [at[k] for k in held]
        matrix = G[rows] @ push
        full = not held or np.linalg.matrix_rank(matrix, tol=1e-10 * np.abs(matrix).max()) == len(held)
        who.known[key] = None
        if full or not who.rubbing:
            who.known[key] = rows, push, np.linalg.pinv(matrix, rcond=1e-12) if held else matrix
    found: tuple[list[int], FloatArray, FloatArray] | None = who.known[key]
    return found


def _followed(
    who: Candidates, states: dict[int, int], G: FloatArray, ahead: Any, early: bool, orders: int = ORDERS
) -> list[tuple[FloatArray, FloatArray]] | None:
    """Derivatives of the rates along the flow of a combination, with their sizes; None where a condition fails.

    ``early``: as few as its conditions need. Elements without a state bear no force."""
    at = {k: i for i, k in enumerate(who.elements)}
    holds = _holds(who, states, G, at)
    if holds is None:
        return None
    rows, push, inverse = holds
    pending = {
        (k, s) for k, state in states.items() for s in ((1, -1) if state == HELD and k not in who.contacts else (1,))
    }
    pending -= {(k, s) for k, s in pending if k in who.slipping or (states[k] == OPEN and k not in who.contacts)}
    found: list[tuple[FloatArray, FloatArray]] = []
    for order in range(orders):
        free, sizes, bounds = ahead.rates()
        forces = np.zeros(len(at))
        for k, i in at.items():
            if k not in who.contacts and k not in who.shares and abs(states.get(k, 0)) == 1:
                forces[i] = bounds[3 * i + (1 if states[k] > 0 else 2)]
        terms = np.abs(forces)
        if rows:
            terms += np.abs(push) @ (np.abs(inverse) @ (sizes + np.abs(G) @ terms)[rows])
            forces -= push @ (inverse @ (free + G @ forces)[rows])
        a = free + G @ forces
        size = sizes + np.abs(G) @ terms
        if (np.abs(a[rows]) > SAME * size[rows]).any():
            return None  # dependent rates that cannot all be held
        a[rows] = 0.0
        found.append((a, size))
        off = ZERO * (terms + size / np.maximum(np.abs(np.diag(G)), 1e-300))  # to which forces are known
        for k, s in list(pending):
            i, state = at[k], states[k]
            rounding = off[i] if state == HELD else ZERO * size[i]
            if state == HELD:
                if k in who.contacts:
                    value = forces[i]
                elif k in who.shares:
                    share, normal = who.shares[k], at[next(j for j, r in who.rubbing.items() if r == k)]
                    value, rounding = share * forces[normal] - s * forces[i], rounding + share * off[normal]
                else:
                    static, forward, back = bounds[3 * i : 3 * i + 3]
                    bound = static if k not in who.kinetic else (back if s > 0 else -forward)
                    value, rounding = bound - s * forces[i], rounding + ZERO * abs(bound)
            else:
                value = a[i] * (state or 1)
            if value < -rounding:
                return None
            if value > rounding:
                pending.discard((k, s))
        if (early and not pending) or order == orders - 1:
            break
        ahead.put(forces)
    return found
