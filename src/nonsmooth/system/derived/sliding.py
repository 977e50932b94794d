r"""Sliding along surfaces (Filippov 1988) as further modes of a derived hybrid system.

A surface h = 0 with the fields :math:`f_-` (h < 0) and :math:`f_+` (h > 0) attracts where

    L_- h > 0 > L_+ h,    L h = h_t + h_u f.

There motion goes on in a mode of its own, with the convex combination

    f_s = (1 - a) f_- + a f_+,    a = (L_- h + kappa h) / (L_- h - L_+ h),

so that dh/dt = -kappa h: on the surface this is Filippov's field, and what rounding takes off it decays (kappa is the
forcing frequency, 1 without forcing). Where :math:`f_+ - f_-` has a constant direction e, as with friction and relays,
its length cancels, :math:`f_s = f_- - e (L_- h + \kappa h) / (h_u e)`: linear wherever the rest of the field is.

Sliding ends where L_+ h rises or L_- h falls through zero, never by the quotient a. Behind such an end h and its rate
vanish together; a return to the surface therefore also needs the rate of h in its own mode, whose sign is known there.
A state beyond the surface (a start, a reset) changes sides without sliding.

Where L_- h - L_+ h vanishes in sliding (a two-fold) both fields turn away at once and motion is not unique: a
transition leads to a mode whose name ends in ``NOT_UNIQUE``, and there the run ends with that status.

Two surfaces that both pairs of modes share give sliding along both: the same construction, with sliding modes in the
places of the two modes.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.derived.sticking import Additions
from nonsmooth.system.equations import TracedSurface
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.scalar import as_written
from nonsmooth.system.symbolic.traced import NOT_UNIQUE, Traced, TracedCondition, TracedTransition, along

if TYPE_CHECKING:
    from nonsmooth.system.system import System

BEYOND = 10**9  # a state farther from the surface than the indicator's scale over this is not on it
ON_SURFACE = 1e-12  # of the indicator's size: a start so near lies on the surface
SEEDS = 3  # random points at which the orders of two surfaces are compared
AGREE = 1e-9  # of their size: by how much values differ that are the same

Field = tuple[sp.Expr, ...]
Rows = tuple[TracedCondition, ...]


def slide(traced: Traced, surfaces: Sequence[TracedSurface], scale: Mapping[str, float]) -> Traced:
    """Return the system with its sliding modes and, at each surface, the transitions between below, above and sliding,
    in place of the two plain ones, one each way."""
    build = _SlidingModes(traced, scale)
    pairs, level = list(surfaces), list(surfaces)
    while level:
        build.add_modes(level)
        level = [pair for pair in dict.fromkeys(build.meetings(pairs)) if pair not in pairs]
        pairs += level
    build.inherit(surfaces)
    asked = [pair for pair in pairs if not build.meets(pair)]
    for pair in asked:
        build.add_transitions(pair)
    build.add_meetings(surfaces, {(pair.indicator, mode) for pair in asked for mode in (pair.below, pair.above)})
    return build.put_in(along=tuple(build.along), idle=tuple(build.idle()))


@lru_cache(maxsize=256)
def _both_rates(traced: Traced, surface: TracedSurface, scale: tuple[float, ...]) -> Callable[..., FloatArray]:
    """Function of p, t, u, m: the indicator, its size, its rates below and above."""
    build = _SlidingModes(traced, dict(zip(traced.state_names, scale, strict=True)))
    rates = (build.rate(surface, mode) for mode in (surface.below, surface.above))
    return numeric(traced, (traced.indicators[surface.indicator], build.size(surface), *rates))


def repelled(system: System, states: FloatArray) -> tuple[str, int] | None:
    """Return the surface on which one of the starts (S, n) lies at t = 0, both fields pointing away from it, and which
    start; else None."""
    traced, scale = system.declared, tuple(system.scale.values())
    for surface in system.surfaces:
        both = _both_rates(traced, surface, scale)
        h, size, below, above = both(system.parameter_vector(), 0.0, states, system.memory_vector()).T
        found = (np.abs(h) <= ON_SURFACE * size) & (below < 0) & (above > 0)
        if found.any():
            return traced.indicator_names[surface.indicator], int(np.argmax(found))
    return None


class _SlidingModes(Additions):
    """The sliding modes that are added to the declared system."""

    def __init__(self, traced: Traced, scale: Mapping[str, float]) -> None:
        super().__init__(traced)
        self.scale = [sp.Float(scale[name]) for name in traced.state_names]
        self.moving = {traced.t, *traced.u, *traced.m}
        self.kappa = sp.Integer(1) if traced.period is None else 2 * sp.pi / traced.period
        #: The mode in which motion slides along a surface; none where it cannot.
        self.sliding: dict[TracedSurface, int] = {}
        self.cells = [frozenset({mode}) for mode in range(len(self.modes))]  # declared modes that meet in each mode
        self.along = [frozenset[int]() for _ in self.modes]  # the indicators that each mode keeps at zero
        self.quotients: list[
            sp.Expr
        ] = []  # those of fields that Filippov combines, one over the difference of two rates

    # Expressions

    def rate(self, pair: TracedSurface, mode: int) -> sp.Expr:
        """Lie derivative of the pair's indicator in a mode."""
        return self.short(along(self.indicators[pair.indicator], self.traced.t, self.traced.u, self.fields[mode]))

    def short(self, expression: sp.Expr) -> sp.Expr:
        """The expression as a sum; as it is where it holds Filippov's quotients, which a sum would repeat."""
        return expression if expression.has(*self.quotients) else sp.expand(expression)

    def at_surface(self, pair: TracedSurface, expression: sp.Expr) -> sp.Expr:
        """The expression without a state that the surface determines: a field may have no value far beyond it."""
        h = self.indicators[pair.indicator]
        slopes = {u: sp.expand(h.diff(u)) for u in self.traced.u}
        usable = [u for u, slope in slopes.items() if slope != 0 and not slope.free_symbols & self.moving]
        if not usable:
            return expression
        u = min(usable, key=lambda u: len(slopes[u].free_symbols))
        on_it = expression.subs(u, sp.expand(u - h / slopes[u]))
        return on_it if expression.has(*self.quotients) else sp.expand(on_it)

    def size(self, pair: TracedSurface) -> sp.Expr:
        """Typical size of the indicator, from the states' scales."""
        h, at = self.indicators[pair.indicator], dict(zip(self.traced.u, self.scale, strict=True))
        at |= {self.traced.t: sp.Integer(0)}
        size = sum(sp.Abs(h.diff(u).subs(at)) * s for u, s in zip(self.traced.u, self.scale, strict=True))
        usable = size != 0 and size.is_finite is not False and not size.free_symbols & self.moving
        return size if usable else sp.Integer(1)

    def ratio(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """a / b, reduced where that may free it of the state and the time."""
        quotient = a / b
        return sp.cancel(quotient) if quotient.free_symbols & self.moving else quotient

    def turns(self, quotients: Field) -> bool:
        """Return whether values say that they change with the state or the time: quick where ``ratio`` is not."""
        values = numeric(self.traced, quotients)(*_somewhere(self.traced, parameters=1))
        return bool((np.ptp(values, axis=0) > AGREE * np.abs(values).max(axis=0)).any())

    def direction(self, pair: TracedSurface) -> tuple[Field, sp.Expr, sp.Expr] | None:
        """(e, h_u e, length) of the difference of both fields, length * e with e constant; None where it turns."""
        below, above = self.fields[pair.below], self.fields[pair.above]
        if any(entry.has(*self.quotients) for entry in (*below, *above)):
            return None
        d = [sp.expand(a - b) for a, b in zip(above, below, strict=True)]
        length = min((entry for entry in d if entry != 0), key=sp.count_ops)
        if self.turns(tuple(entry / length for entry in d)):
            return None
        e = tuple(sp.Integer(0) if entry == 0 else self.ratio(entry, length) for entry in d)
        if any(entry.free_symbols & self.moving for entry in e):
            return None
        h = self.indicators[pair.indicator]
        return e, sp.expand(sum(h.diff(u) * x for u, x in zip(self.traced.u, e, strict=True))), length

    # Modes

    def add_modes(self, pairs: Sequence[TracedSurface]) -> None:
        """Add the modes in which motion slides along the surfaces of pairs, where their fields differ in crossing them.

        Sliding along the same surfaces in another order is the same mode; where the order matters there is none.
        """
        found: dict[tuple[frozenset[int], frozenset[int]], list[tuple[TracedSurface, Field, list[sp.Expr]]]] = {}
        for pair in pairs:
            below, above = self.rate(pair, pair.below), self.rate(pair, pair.above)
            jump = self.short(below - above)
            if jump == 0 or (jump.has(*self.quotients) and _agree(self.traced, (below,), (above,))):
                continue
            key = self.cells[pair.below] | self.cells[pair.above], self.along[pair.below] | {pair.indicator}
            field, shown = self._filippov(pair, below, above)
            if pair.field is not None:
                field = self._given(pair, pair.field)
            found.setdefault(key, []).append((pair, field, shown))
        for (cell, held), ways in found.items():
            first, field, shown = ways[0]
            if not all(_agree(self.traced, field, other) for _, other, _ in ways[1:]):
                continue
            name = first.mode or "_".join(self.indicator_names[i] for i in sorted(held)) + "_sliding"
            if name in self.modes:
                name += "".join(f"_{self.modes[mode]}" for mode in sorted(cell))
            self.sliding |= {pair: len(self.modes) for pair, _, _ in ways}
            self.mode(name, first.below, field, shown)
            self.cells.append(cell)
            self.along.append(held)

    def _filippov(self, pair: TracedSurface, below: sp.Expr, above: sp.Expr) -> tuple[Field, list[sp.Expr]]:
        """The convex combination that stays on the surface: vector field, outputs."""
        first, second = self.fields[pair.below], self.fields[pair.above]
        ends = [(row[pair.below], row[pair.above]) for row in self.outputs]
        off = self.kappa * self.indicators[pair.indicator]
        found = self.direction(pair)
        if found is None:
            quotient = 1 / (below - above)
            self.quotients.append(quotient)
            a, b = (below + off) * quotient, below * quotient
            field = tuple(x if x == y else x + a * (y - x) for x, y in zip(first, second, strict=True))
            return field, [x if x == y else x + b * (y - x) for x, y in ends]
        e, slope, length = found
        field = tuple(
            x if way == 0 else sp.expand(x - way * (below + off) / slope) for x, way in zip(first, e, strict=True)
        )
        shown = [x if x == y else sp.expand(x - self.ratio(y - x, length) * below / slope) for x, y in ends]
        return field, shown

    def _given(self, pair: TracedSurface, given: Field) -> Field:
        """The field that was given for the surface, with the same decay beside it."""
        h = self.indicators[pair.indicator]
        slopes = [h.diff(u) for u in self.traced.u]
        rate = sp.expand(along(h, self.traced.t, self.traced.u, given))
        remainder = sp.simplify(self.at_surface(pair, rate))
        if remainder != 0 and sp.fraction(sp.cancel(rate / h))[1].free_symbols & self.moving:
            raise SystemDefinitionError(
                f"{self.traced.name!r}: the field given for {pair.mode!r} leaves the surface "
                f"{self.indicator_names[pair.indicator]!r}: along it the indicator has the rate "
                f"{shortened(as_written(remainder))}, which must vanish on the surface"
            )
        norm = sum(s * s for s in slopes)
        off = self.kappa * h
        return tuple(f if s == 0 else f - off * s / norm for f, s in zip(given, slopes, strict=True))

    def meetings(self, pairs: Sequence[TracedSurface]) -> Iterator[TracedSurface]:
        """Surfaces between two sliding modes: where both sides of one surface slide along another."""
        known = {(pair.indicator, pair.below, pair.above): pair for pair in pairs}
        slid = [pair for pair in pairs if pair in self.sliding]
        for one in slid:
            for two in slid:
                if one.indicator != two.indicator or one is two:
                    continue
                for other in pairs:
                    if (other.below, other.above) != (one.below, two.below) or other.indicator == one.indicator:
                        continue
                    if (other.indicator, one.above, two.above) not in known:
                        continue
                    ends = self.sliding[one], self.sliding[two]
                    if (other.indicator, *ends) not in known and ends[0] != ends[1]:
                        yield TracedSurface(other.indicator, *ends, "", other.static)

    # Transitions

    def add_transitions(self, pair: TracedSurface) -> None:
        """Add the transitions between below, above and sliding."""
        h, name = pair.indicator, self.indicator_names[pair.indicator]
        size, value = self.size(pair), BEYOND * self.indicators[pair.indicator]
        beyond = {
            1: TracedCondition(self.indicator(value - size, f"{name} beyond"), 1),
            -1: TracedCondition(self.indicator(value + size, f"{name} behind"), -1),
        }
        mode = {-1: pair.below, 1: pair.above}
        rates = {s: self.at_surface(pair, self.rate(pair, mode[s])) for s in mode}
        rate = {s: self.indicator(rates[s], f"{name} rate in {self.modes[mode[s]]}") for s in mode}
        leave = dict(rate)
        if pair.static is not None:
            middle, half = (rates[1] + rates[-1]) / 2, (rates[1] - rates[-1]) / 2
            leave = {
                s: self.indicator(
                    sp.expand(middle + s * pair.static * half), f"{name} static rate in {self.modes[mode[s]]}"
                )
                for s in mode
            }
        slid = self.sliding.get(pair)
        for s in (1, -1):  # upward: from below; and the other way round
            source, target = mode[-s], mode[s]
            self.jump(source, target, beyond[s])
            if slid is None:
                self.jump(source, target, TracedCondition(h, s))
                continue
            self.jump(source, target, TracedCondition(h, s), TracedCondition(leave[s], s))
            # Behind the end of sliding the rate in its own mode vanishes, and its sign is known.
            self.jump(source, slid, TracedCondition(h, s), TracedCondition(leave[s], -s), TracedCondition(rate[-s], s))
            self.jump(slid, target, TracedCondition(leave[s], s))
        attraction = self.short(rates[-1] - rates[1])
        if slid is not None and attraction.free_symbols & self.moving:
            least = self.size(pair) * self.kappa / BEYOND
            gone = TracedCondition(
                self.indicator(
                    attraction - least, f"{name} attraction between {self.modes[mode[-1]]} and {self.modes[mode[1]]}"
                ),
                -1,
            )
            self.jump(slid, self.undetermined(slid), gone)

    # Where two surfaces meet

    def meets(self, pair: TracedSurface) -> bool:
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
        acts = (pair, low.below, low.above), (low, low.below, high.below)
        return all(sp.expand(self.rate(on, a) - self.rate(on, b)) != 0 for on, a, b in acts)

    def add_meetings(self, surfaces: Sequence[TracedSurface], asked: Collection[tuple[int, int]]) -> None:
        """Add the transitions from sliding along one surface at each other one, but those ``asked`` (indicator, mode).

        Of the ways that may lead on, off both surfaces or along one of them, just one is taken. Where there are two, or
        one along a surface that both fields leave, motion is not unique; where there is none it stays on both."""
        known = {(one.indicator, one.below, one.above): one for one in surfaces}
        behind = {(1, one.indicator, one.below): one.above for one in surfaces}
        behind |= {(-1, one.indicator, one.above): one.below for one in surfaces}
        left: set[tuple[int, int, Rows]] = set()
        for pair in [one for one in surfaces if one in self.sliding]:
            slid, sides = self.sliding[pair], (pair.below, pair.above)
            for s, h in dict.fromkeys((s, h) for s, h, near in behind if near in sides and h != pair.indicator):
                if (h, slid) in asked:
                    continue
                far = [behind.get((s, h, mode), mode) for mode in sides]
                beyond = known.get((pair.indicator, far[0], far[1]))
                ways: list[tuple[int | None, Rows]] = [(far[0], (self.sign(h, far[0], s),))]
                if far[0] != far[1]:
                    both_ways = zip(far, (-1, 1), strict=True)
                    ways = [(end, (self.sign(h, end, s), self.sign(pair.indicator, end, i))) for end, i in both_ways]
                ways += self.along_one(beyond, h, s)
                for near, end, side in zip(sides, far, (-1, 1), strict=True):
                    low, high = (near, end)[::s]
                    ways += self.along_one(known.get((h, low, high)), pair.indicator, side)
                at = TracedCondition(h, s), self.across(pair, h, s)[0]
                cell, held = {*sides, *far}, {h, pair.indicator}
                for one, two in combinations(ways, 2):
                    either = (*dict.fromkeys((*one[1], *two[1])),)
                    if self.possible(either):
                        self.jump(slid, self.undetermined(slid), *at, *either)
                for target, rows in ways:
                    if target is not None and self.possible(rows):
                        self.jump(slid, target, *at, *rows)
                both = [m for m in self.sliding.values() if self.along[m] == held and self.cells[m] == cell]
                on = self.sliding[beyond] if beyond in self.sliding else far[0]
                self.jump(slid, both[0] if both else on, *at)
                left |= {(both[0], target, (*sorted(rows),)) for target, rows in ways if both and target is not None}
        for mode, target, rows in sorted(left):
            self.jump(mode, target, *rows)

    def possible(self, rows: Rows) -> bool:
        """Return whether conditions may hold together: not opposite ones, nor signs that a number excludes."""
        up, down = ({self.indicators[row.indicator] for row in rows if row.sign == s} for s in (1, -1))
        return not any((more := low - high).is_number and more >= 0 for high in up for low in down)

    def sign(self, h: int, mode: int, s: int) -> TracedCondition:
        """The condition that an indicator's rate in a mode, on its surface, has the sign s."""
        pair = TracedSurface(h, mode, mode, "")
        rate = self.at_surface(pair, self.rate(pair, mode))
        return TracedCondition(self.indicator(rate, f"{self.indicator_names[h]} rate in {self.modes[mode]}"), s)

    def across(self, pair: TracedSurface, h: int, s: int) -> tuple[TracedCondition, bool]:
        """The condition that an indicator has a rate of the sign s where motion slides along another surface.

        Where that rate has a pole it is its numerator, which is told: the denominator is positive where the surface
        attracts."""
        slid, (below, above) = self.sliding[pair], (pair.below, pair.above)
        if not self.has_pole(self.rate(TracedSurface(h, slid, slid, ""), slid)):
            return self.sign(h, slid, s), False
        (a, b), (c, d) = (
            [self.indicators[self.sign(of, mode, 1).indicator] for mode in (below, above)] for of in (pair.indicator, h)
        )
        name = f"{self.indicator_names[h]} way in {self.modes[slid]}"
        return TracedCondition(self.indicator(a * d - b * c, name), s), True

    def along_one(self, pair: TracedSurface | None, h: int, s: int) -> list[tuple[int | None, Rows]]:
        """The way along a surface on the side s of another one, and that where both fields leave it: no target."""
        if pair is None or pair not in self.sliding:
            return []
        below, above = (self.sign(pair.indicator, mode, 1) for mode in (pair.below, pair.above))
        on, turned = self.across(pair, h, s)
        attracts = below, above._replace(sign=-1), on
        leaves = below._replace(sign=-1), above, on._replace(sign=-s if turned else s)
        return [(self.sliding[pair], attracts), (None, leaves)]

    def has_pole(self, expression: sp.Expr) -> bool:
        """Return whether an expression has a moving denominator."""
        powers = expression.atoms(sp.Pow)
        return any(power.base.free_symbols & self.moving and not power.exp.is_nonnegative for power in powers)

    def idle(self) -> Iterator[frozenset[int]]:
        """Of each mode the derived indicators with a moving denominator that no transition of it asks for: a pole
        beyond another mode's surface is no place at which a run of this one may end."""
        derived = range(len(self.traced.indicators), len(self.indicators))
        poles = {i for i in derived if self.has_pole(self.indicators[i])}
        for mode in range(len(self.modes)):
            yield frozenset(poles - {row.indicator for jump in self.jumps if jump.source == mode for row in jump.rows})

    def undetermined(self, slid: int) -> int:
        """The mode that says that motion is not unique behind the end of a sliding mode."""
        name = self.modes[slid] + NOT_UNIQUE
        if name not in self.modes:
            self.mode(name, slid, self.fields[slid], [row[slid] for row in self.outputs])
            self.along.append(self.along[slid])
        return self.modes.index(name)

    def inherit(self, pairs: Sequence[TracedSurface]) -> None:
        """Keep the transitions of the declared system and give the sliding modes those of the modes that meet there."""
        surfaces = {(pair.below, pair.above, TracedCondition(pair.indicator, 1)) for pair in pairs}
        surfaces |= {(pair.above, pair.below, TracedCondition(pair.indicator, -1)) for pair in pairs}
        self.jumps = [
            jump for jump in self.traced.transitions if (jump.source, jump.target, *jump.rows) not in surfaces
        ]
        plain = list(self.jumps)
        for slid in range(len(self.traced.mode_names), len(self.modes)):
            alike: dict[tuple[tuple[TracedCondition, ...], float | None], list[TracedTransition]] = {}
            for jump in plain:
                if jump.source in self.cells[slid]:
                    alike.setdefault((jump.rows, jump.at), []).append(jump)
            for group in alike.values():
                self.jumps.append(self._inherited(slid, group))

    def _inherited(self, slid: int, group: Sequence[TracedTransition]) -> TracedTransition:
        """The transition out of a sliding mode that the modes meeting there have, all with the same condition.

        Without a reset what slides goes on sliding, between the targets; behind one the first target finds its side."""
        first, targets = group[0], frozenset(jump.target for jump in group)
        other = [jump for jump in group if (jump.reset, jump.writes) != (first.reset, first.writes)]
        if targets not in self.cells:
            other = other or [jump for jump in group if jump.target != first.target]
        if other:
            raise SystemDefinitionError(
                f"{self.traced.name!r}: {first.label} and {other[0].label} have the same condition, but other resets "
                f"or targets, so that nothing says what happens while {self.modes[slid]!r} slides between their modes; "
                "give both the same, or different conditions"
            )
        target = self.cells.index(targets) if first.reset is None else first.target
        label = f"{self.modes[slid]} -> {self.modes[target]}"
        return replace(first, source=slid, target=target, label=label, contact=first.reset is not None)


def _agree(traced: Traced, one: Field, two: Field) -> bool:
    """Return whether two vector fields are the same, by their values at fixed pseudo-random points."""
    both = numeric(traced, (*one, *two))(*_somewhere(traced))
    return np.allclose(both[:, : len(one)], both[:, len(one) :], rtol=AGREE, atol=AGREE)


def _somewhere(traced: Traced, parameters: int = SEEDS) -> tuple[FloatArray, ...]:
    """Fixed pseudo-random parameters (as many), times, states and memories."""
    random, sizes = np.random.default_rng(11), ((), (len(traced.u),), (len(traced.m),))
    p = random.uniform(0.5, 1.5, (parameters, len(traced.p)))
    return p, *(random.uniform(0.5, 1.5, (SEEDS, *size)) for size in sizes)
