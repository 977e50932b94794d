"""Decisions by trying all combinations of contact states, where no convex problem says what happens.

Friction at a rigid contact is bounded by a force that is not known, and forces may act on rates as no positive
factors make symmetric: then there may be no motion, or several. A combination is right if all its conditions hold just
behind the instant along its own flow, each by its first derivative that is not zero; those whose rates have equal
derivatives to all orders are one motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError

if TYPE_CHECKING:
    from nonsmooth.system.derived.instants import Ahead

__all__ = ["Candidates", "moving_by_trial"]

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

    def states(self) -> Iterator[dict[int, int]]:
        """All combinations of contact states that may be; a contact that is open does not rub."""
        own = {r: k for k, r in self.rubbing.items()}
        free = [k for k in self.elements if k not in self.slipping]
        choices = [(HELD, OPEN) if k in self.contacts else (HELD, 1, -1, *([OPEN] if k in own else [])) for k in free]
        if np.prod([float(len(one)) for one in choices]) > MOST:
            raise SolveError(
                f"{len(free)} contacts and frictions that decide together have too many combinations to try"
            )
        for states in product(*choices):
            found = dict(zip(free, states, strict=True))
            found |= {r: side if found[own[r]] == HELD else OPEN for r, side in self.slipping.items()}
            if all((found[r] == OPEN) == (found[own[r]] == OPEN) for r in own if r in found):
                yield found


def moving_by_trial(who: Candidates, G: FloatArray, begin: Any) -> tuple[dict[int, int], str]:
    """The contact states just behind the instant, and nothing, "no_motion" or "not_unique".

    ``G``: effects of unit forces; ``begin()`` gives the derivatives of rates and bounds along a flow yet unknown."""
    valid = [states for states in who.states() if _followed(who, states, G, begin(), True) is not None]
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


def _followed(
    who: Candidates, states: dict[int, int], G: FloatArray, ahead: Ahead, early: bool
) -> list[tuple[FloatArray, FloatArray]] | None:
    """Derivatives of the rates along the flow of a combination, with their sizes; None where a condition fails.

    ``early``: as few as its conditions need."""
    at = {k: i for i, k in enumerate(who.elements)}
    held = [k for k in who.elements if states[k] == HELD]
    push = np.zeros((len(at), len(held)))  # of forces that hold, with the friction that they bring along
    for j, k in enumerate(held):
        push[at[k], j] = 1.0
        r = who.rubbing.get(k)
        if r is not None and abs(states[r]) == 1:
            push[at[r], j] = -states[r] * who.shares[r]
    rows = [at[k] for k in held]
    matrix = G[rows] @ push
    if held and np.linalg.matrix_rank(matrix, tol=1e-10 * np.abs(matrix).max()) < len(held) and who.rubbing:
        return None
    pending = {
        (k, s) for k, state in states.items() for s in ((1, -1) if state == HELD and k not in who.contacts else (1,))
    }
    pending -= {(k, s) for k, s in pending if k in who.slipping or (states[k] == OPEN and k not in who.contacts)}
    found: list[tuple[FloatArray, FloatArray]] = []
    for _ in range(ORDERS):
        free, sizes, bounds = ahead.rates()
        forces = np.zeros(len(at))
        for k, i in at.items():
            if k not in who.contacts and k not in who.shares and abs(states[k]) == 1:
                forces[i] = bounds[3 * i + (1 if states[k] > 0 else 2)]
        if held:
            forces += push @ np.linalg.lstsq(matrix, -(free + G @ forces)[rows], rcond=1e-12)[0]
        a = free + G @ forces
        size = sizes + np.abs(G) @ np.abs(forces)
        if (np.abs(a[rows]) > SAME * size[rows]).any():
            return None  # dependent rates that cannot all be held
        a[rows] = 0.0
        found.append((a, size))
        for k, s in list(pending):
            i, state = at[k], states[k]
            rounding = ZERO * size[i]
            if state == HELD:
                rounding = ZERO * (abs(forces[i]) + size[i] / max(abs(G[i, i]), 1e-300))
                if k in who.contacts:
                    value = forces[i]
                elif k in who.shares:
                    normal = who.shares[k] * forces[at[next(j for j, r in who.rubbing.items() if r == k)]]
                    value, rounding = normal - s * forces[i], rounding + ZERO * abs(normal)
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
        if early and not pending:
            break
        ahead.put(forces)
    return found
