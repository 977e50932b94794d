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
from nonsmooth.system.derived.faces import as_sums, independent, linked, weakest
from nonsmooth.system.derived.instants import ZERO

MOST = 4096  # combinations that are tried
SAME = 1e-9  # of the sizes of rates: two motions that differ by less are one
ORDERS = 24  # derivatives that are looked at where all before are zero
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
        at, every = {k: i for i, k in enumerate(self.elements)}, self.choices()
        own = [[at[k] for k in one[0]] for one in every]
        acts = np.array([[G[np.ix_(one, other)].any() for other in own] for one in own])
        return [[every[i] for i in some] for some in linked(acts)]


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
    ]
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


@dataclass
class _Held:
    """Forces that a combination needs: the places of the rates that are held, what unit forces bring along, the forces
    for unit rates; the weights of the forces (:func:`weakest`), the places of those with two bounds of their own."""

    rows: list[int]
    push: FloatArray
    inverse: FloatArray
    weights: FloatArray  # (sums, held)
    bounded: dict[int, int]  # of those that are held

    def __post_init__(self) -> None:
        self.sizes = np.abs(self.push) @ np.abs(self.inverse)
        self.ways = np.clip(self.weights, 0.0, None)

    def left(
        self, who: Candidates, forces: FloatArray, off: FloatArray, bounds: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The distance of each sum of forces from its bound, and its rounding."""
        high, low = np.zeros((2, len(self.rows)))
        for j, i in self.bounded.items():
            static, forward, back = bounds[3 * i : 3 * i + 3]
            high[j], low[j] = (back, -forward) if who.elements[i] in who.kinetic else (static, static)
        most = self.ways @ high + (self.ways - self.weights) @ low
        own = off[self.rows] + ZERO * np.maximum(np.abs(high), np.abs(low))
        return most - self.weights @ forces[self.rows], np.abs(self.weights) @ own


def _holds(who: Candidates, states: dict[int, int], G: FloatArray, at: dict[int, int]) -> _Held | None:
    """The forces that a combination needs; None where friction leaves undetermined how it moves."""
    key = tuple(at), tuple(states.items())
    if key not in who.known:
        who.known[key] = _found(who, states, G, at)
    found: _Held | None = who.known[key]
    return found


def _found(who: Candidates, states: dict[int, int], G: FloatArray, at: dict[int, int]) -> _Held | None:
    held = [k for k in at if states.get(k) == HELD]
    rows, count = [at[k] for k in held], len(held)
    push = np.zeros((len(at), count))
    push[rows, range(count)] = 1.0
    sides = {j: r for j, k in enumerate(held) if (r := who.rubbing.get(k)) is not None}
    for j, r in sides.items():
        if states[r] != HELD:
            push[at[r], j] = -states[r] * who.shares[r]
    effects = G @ push
    matrix = effects[rows]
    rank = np.linalg.matrix_rank(matrix, tol=1e-10 * np.abs(matrix).max(initial=0.0)) if held else 0
    sums = np.eye(count)
    if rank < count:
        ways = (effects / np.maximum(np.linalg.norm(effects, axis=0), 1e-300)).T
        chosen = independent(ways, sorted(range(count), key=lambda j: held[j] not in who.contacts))[0]
        if rank == len(chosen):
            sums = as_sums(effects.T, chosen)
        elif who.rubbing:
            return None
    bounded = {j: at[k] for j, k in enumerate(held) if k not in who.contacts and k not in who.shares}
    cones = [(j, held.index(r), who.shares[r]) for j, r in sides.items() if states[r] == HELD]
    weights = weakest(sums, bounded, cones) if held else []
    inverse = np.asarray(np.linalg.pinv(matrix, rcond=1e-12), dtype=float)
    inverse[np.abs(inverse) < 1e-13 * np.abs(inverse).max(initial=0.0)] = 0.0  # rates apart stay apart
    return _Held(rows, push, inverse, np.reshape(weights, (len(weights), count)), bounded)


def _followed(
    who: Candidates, states: dict[int, int], G: FloatArray, ahead: Any, early: bool, orders: int = ORDERS
) -> list[tuple[FloatArray, FloatArray]] | None:
    """Derivatives of the rates along the flow of a combination, with their sizes; None where a condition fails.

    ``early``: as few as its conditions need. Elements without a state bear no force."""
    at = {k: i for i, k in enumerate(who.elements)}
    here = _holds(who, states, G, at)
    if here is None:
        return None
    rows, count, effects = here.rows, len(here.weights), np.abs(G)
    own = np.maximum(np.diag(effects), 1e-300)
    moves = [
        k for k, state in states.items() if state != HELD and k not in who.slipping and (state or k in who.contacts)
    ]
    places, signs = [at[k] for k in moves], np.array([states[k] or 1 for k in moves])
    pending = np.ones(count + len(moves), dtype=bool)
    found: list[tuple[FloatArray, FloatArray]] = []
    for order in range(orders):
        free, sizes, bounds = ahead.rates()
        forces = np.zeros(len(at))
        for k, i in at.items():
            if k not in who.contacts and k not in who.shares and abs(states.get(k, 0)) == 1:
                forces[i] = bounds[3 * i + (1 if states[k] > 0 else 2)]
        terms = np.abs(forces)
        if rows:
            terms += here.sizes @ (sizes + effects @ terms)[rows]
            forces -= here.push @ (here.inverse @ (free + G @ forces)[rows])
        a = free + G @ forces
        size = sizes + effects @ terms
        if (np.abs(a[rows]) > SAME * size[rows]).any():
            return None  # dependent rates that cannot all be held
        a[rows] = 0.0
        found.append((a, size))
        off = ZERO * (terms + size / own)  # to which forces are known
        values, rounding = here.left(who, forces, off, bounds)
        values, rounding = np.append(values, signs * a[places]), np.append(rounding, ZERO * size[places])
        if (values < -rounding)[pending].any():
            return None
        pending &= values <= rounding
        if (early and not pending.any()) or order == orders - 1:
            break
        ahead.put(forces)
    return found
