"""The ways on where motion that slides along one surface comes to another one (`sliding`).

Each surface is a switch of its own. Off both surfaces, along either of them on its far side, or on both: which ways are
open is told by the signs of rates, and each way is a transition. Where just one is open it is taken. Where there are
two, or one along a surface that both fields leave, motion is not unique; where there is none it stays on both.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import combinations

import sympy as sp

from nonsmooth.system.derived.sliding_modes import SlidingModes
from nonsmooth.system.equations import TracedSurface
from nonsmooth.system.symbolic.traced import TracedCondition

Rows = tuple[TracedCondition, ...]
Way = tuple[int | None, Rows]  # its mode (none of one along a surface that both fields leave), and when it is open


class Meetings(SlidingModes):
    """Sliding modes with the ways on from those along one surface at each other one."""

    def several(self, pair: TracedSurface) -> bool:
        """Return whether several ways may lead on where motion that slides comes to the surface of a pair.

        Just one does where one of two relays that add up does not act on the other's rate, as with friction on masses;
        static friction has rules of its own. There each surface is asked by itself."""
        slid = {mode: one for one, mode in self.sliding.items()}
        if pair.static is not None or pair.below not in slid or len(self.along[pair.below]) != 1:
            return False
        low, high = slid[pair.below], slid[pair.above]
        if low.static is not None:
            return False
        near, far = ([self.fields[mode] for mode in (one.below, one.above)] for one in (low, high))
        if any(sp.expand(b - a - d + c) != 0 for a, b, c, d in zip(*near, *far, strict=True)):
            return True
        acts = (pair.indicator, low.below, low.above), (low.indicator, low.below, high.below)
        return all(sp.expand(self.rate(h, a) - self.rate(h, b)) != 0 for h, a, b in acts)

    def add_meetings(self, surfaces: Sequence[TracedSurface], asked: Collection[tuple[int, int]]) -> None:
        """Add the transitions, but those that are ``asked`` for by each surface itself (indicator, mode)."""
        known = {(one.indicator, one.below, one.above): one for one in surfaces if one in self.sliding}
        behind = {(1, one.indicator, one.below): one.above for one in surfaces}
        behind |= {(-1, one.indicator, one.above): one.below for one in surfaces}
        off: set[tuple[int, int, Rows]] = set()
        for pair in known.values():
            slid, sides = self.sliding[pair], (pair.below, pair.above)
            for s, h in dict.fromkeys((s, h) for s, h, near in behind if near in sides and h != pair.indicator):
                if (h, slid) in asked:
                    continue
                far = [behind.get((s, h, mode), mode) for mode in sides]
                beyond = known.get((pair.indicator, far[0], far[1]))
                ways = [*self.off_both(pair, far, h, s), *self.along_one(beyond, h, s)]
                for near, end, side in zip(sides, far, (-1, 1), strict=True):
                    low, high = (near, end)[::s]
                    ways += self.along_one(known.get((h, low, high)), pair.indicator, side)
                at = TracedCondition(h, s), self.across(pair, h, s)[0]
                for one, two in combinations(ways, 2):
                    either = (*dict.fromkeys((*one[1], *two[1])),)
                    if self.possible(either):
                        self.jump(slid, self.undetermined(slid), *at, *either)
                for target, rows in ways:
                    if target is not None and self.possible(rows):
                        self.jump(slid, target, *at, *rows)
                cell, held = {*sides, *far}, {h, pair.indicator}
                both = [m for m in self.sliding.values() if self.along[m] == held and self.cells[m] == cell]
                self.jump(slid, both[0] if both else self.sliding[beyond] if beyond else far[0], *at)
                off |= {(both[0], target, (*sorted(rows),)) for target, rows in ways if both and target is not None}
        for mode, target, rows in sorted(off):
            self.jump(mode, target, *rows)

    def off_both(self, pair: TracedSurface, far: Sequence[int], h: int, s: int) -> Iterator[Way]:
        """The ways off a pair's surface where the indicator h passes zero with the sign s."""
        if far[0] == far[1]:
            yield far[0], (self.sign(h, far[0], s),)
        else:
            for end, i in zip(far, (-1, 1), strict=True):
                yield end, (self.sign(h, end, s), self.sign(pair.indicator, end, i))

    def along_one(self, pair: TracedSurface | None, h: int, s: int) -> list[Way]:
        """The way along a surface on the side s of another one, and that where both fields leave it."""
        if pair is None:
            return []
        below, above = (self.sign(pair.indicator, mode, 1) for mode in (pair.below, pair.above))
        on, turned = self.across(pair, h, s)
        attracts = below, above._replace(sign=-1), on
        leaves = below._replace(sign=-1), above, on._replace(sign=-s if turned else s)
        return [(self.sliding[pair], attracts), (None, leaves)]

    def sign(self, h: int, mode: int, s: int) -> TracedCondition:
        """The condition that an indicator's rate in a mode, on its surface, has the sign s."""
        return TracedCondition(self.rate_in(h, mode), s)

    def across(self, pair: TracedSurface, h: int, s: int) -> tuple[TracedCondition, bool]:
        """The condition that an indicator has a rate of the sign s where motion slides along another surface.

        Where that rate has a pole it is its numerator, which is told: the denominator is positive where the surface
        attracts."""
        slid, (below, above) = self.sliding[pair], (pair.below, pair.above)
        if not self.has_pole(self.rate(h, slid)):
            return self.sign(h, slid, s), False
        (a, b), (c, d) = (
            [self.indicators[self.sign(of, mode, 1).indicator] for mode in (below, above)] for of in (pair.indicator, h)
        )
        name = f"{self.indicator_names[h]} way in {self.modes[slid]}"
        return TracedCondition(self.indicator(a * d - b * c, name), s), True

    def possible(self, rows: Rows) -> bool:
        """Return whether conditions may hold together: not opposite ones, nor signs that a number excludes."""
        up, down = ({self.indicators[row.indicator] for row in rows if row.sign == s} for s in (1, -1))
        return not any((more := low - high).is_number and more >= 0 for high in up for low in down)
