"""The signature of a periodic orbit, the modes it visits and the transitions that end the visits; and once round it.

The first visit begins, and the last one ends, at the section: phase 0 of the forcing, or for an autonomous system a
point within a visit. Two orbits that are read from different points of the same cycle have the same ``cycle``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

SECTION = -1
AT_ONCE = -2  # a row: the condition holds already where the transition before has led


@dataclass(frozen=True)
class Visit:
    """Motion in ``mode`` until ``transition`` fires because row ``row`` of its condition becomes true.

    ``transition`` is -1 for the visit that ends at the section; ``row`` is -1 there and for a transition at a phase,
    which then happens in the forcing period ``turn`` (0 ... n) after the section. ``row`` is -2 where the transition
    follows another one at the same instant, because the reset has led behind its boundary.
    """

    mode: int
    transition: int = SECTION
    row: int = -1
    turn: int = 0


@dataclass(frozen=True)
class Signature:
    """Visits in their order from the section; the last one ends at the section.

    Attributes
    ----------
    visits : tuple of Visit
    """

    visits: tuple[Visit, ...]

    @property
    def crossings(self) -> tuple[Visit, ...]:
        """The visits that end with a transition."""
        return self.visits[:-1]

    @property
    def data(self) -> list[list[int]]:
        """The visits as lists of integers."""
        return [[v.mode, v.transition, v.row, v.turn] for v in self.visits]

    @property
    def cycle(self) -> tuple[tuple[int, int, int], ...]:
        """(mode, transition, row) once round, begun where this is smallest: equal for all sections of one cycle."""
        word = [(v.mode, v.transition, v.row) for v in self.crossings]
        if not word:
            return ((self.visits[0].mode, SECTION, -1),)
        return min(tuple(word[i:] + word[:i]) for i in range(len(word)))

    def repeated(self, times: int, turns: int = 0) -> Signature:
        """The same orbit gone round several times; ``turns`` forcing periods are one round."""
        visits = [
            Visit(v.mode, v.transition, v.row, v.turn + turns * i if v.row == -1 else 0)
            for i in range(times)
            for v in self.crossings
        ]
        return Signature((*visits, self.visits[-1]))

    def rates(self, transitions: Sequence[Any], turns: int) -> tuple[float, float]:
        """Transitions, and entries into contact, per turn (0: once round)."""
        taken = [transitions[v.transition] for v in self.crossings]
        return len(taken) / max(turns, 1), sum(jump.contact for jump in taken) / max(turns, 1)

    def text(self, traced: Traced) -> str:
        """In words: ``free (penetration) contact (separation) free``."""
        names = traced.mode_names
        parts = []
        for visit in self.visits:
            parts.append(names[visit.mode])
            if visit.transition == SECTION:
                continue
            jump = traced.transitions[visit.transition]
            if visit.row == AT_ONCE:
                parts.append("(at once)")
            elif jump.at is not None:
                parts.append(f"(at {traced.phase_text(jump)})")
            else:
                row = jump.rows[visit.row]
                parts.append(f"({traced.indicator_names[row.indicator]} {'>' if row.sign > 0 else '<'} 0)")
        return " ".join(parts)


@dataclass
class Round:
    """Once round an orbit, or an interval of motion that nearly closes: all that its unknowns are made of."""

    period_number: int  # 0: autonomous
    period: float
    signature: Signature
    times: FloatArray  # of its crossings
    states: FloatArray  # (m + 1, n_z): at the section and after the crossings

    def with_inserted(self, place: int, visits: Sequence[Visit], t: float, after: Sequence[FloatArray]) -> Self:
        """With further visits that interrupt visit ``place`` at t, and the states after them."""
        old, times, states = self.signature.visits, self.times, self.states
        return replace(
            self,
            signature=Signature((*old[:place], *visits, *old[place:])),
            times=np.concatenate([times[:place], np.full(len(visits), t), times[place:]]),
            states=np.concatenate([states[: place + 1], after, states[place + 1 :]]),
        )

    def without(self, first: int, count: int) -> Self:
        """Without ``count`` visits from ``first`` on: what remains is one visit where they stood."""
        visits, gone = self.signature.visits, np.arange(first, first + count)
        return replace(
            self,
            signature=Signature((*visits[:first], *visits[first + count :])),
            times=np.delete(self.times, gone),
            states=np.delete(self.states, gone + 1, axis=0),
        )

    def begun(self, i: int, begin: float, z: FloatArray) -> Self:
        """The same round from visit i on: its section lies at the time ``begin``, in the state z."""
        visits, times, turns = self.signature.visits, self.times, self.period_number
        moved = [
            v if v.row != -1 else replace(v, turn=v.turn + turns * ((j < i) - (begin > 0.0)))
            for j, v in enumerate(visits[:-1])
        ]
        return replace(
            self,
            signature=Signature((*moved[i:], *moved[:i], Visit(visits[i].mode))),
            times=np.concatenate([times[i:] - begin, times[:i] + (self.period - begin)]),
            states=np.concatenate([z[None, :], self.states[i + 1 :], self.states[1 : i + 1]]),
        )
