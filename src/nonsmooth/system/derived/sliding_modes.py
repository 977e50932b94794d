"""Modes in which motion slides along surfaces, and the transitions at each surface (`sliding`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError, shortened
from nonsmooth.system.derived.sticking import Additions
from nonsmooth.system.equations import TracedSurface
from nonsmooth.system.symbolic.numeric import numeric
from nonsmooth.system.symbolic.scalar import as_written
from nonsmooth.system.symbolic.traced import NOT_UNIQUE, Traced, TracedCondition, TracedTransition, along

BEYOND = 10**9  # a state farther from the surface than the indicator's scale over this is not on it
SEEDS = 3  # random points at which the orders of two surfaces are compared
AGREE = 1e-9  # of their size: by how much values differ that are the same

Field = tuple[sp.Expr, ...]


class SlidingModes(Additions):
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
        #: One over the difference of two rates: those of fields that Filippov combines.
        self.quotients: list[sp.Expr] = []

    # Expressions

    def rate(self, h: int, mode: int) -> sp.Expr:
        """Lie derivative of an indicator in a mode."""
        return self.short(along(self.indicators[h], self.traced.t, self.traced.u, self.fields[mode]))

    def rate_in(self, h: int, mode: int) -> int:
        """The indicator that is the rate of another one in a mode, on its surface."""
        rate = self.at_surface(h, self.rate(h, mode))
        return self.indicator(rate, f"{self.indicator_names[h]} rate in {self.modes[mode]}")

    def short(self, expression: sp.Expr) -> sp.Expr:
        """The expression as a sum; as it is where it holds Filippov's quotients, which a sum would repeat."""
        return expression if expression.has(*self.quotients) else sp.expand(expression)

    def at_surface(self, indicator: int, expression: sp.Expr) -> sp.Expr:
        """The expression without a state that the surface determines: a field may have no value far beyond it."""
        h = self.indicators[indicator]
        slopes = {u: sp.expand(h.diff(u)) for u in self.traced.u}
        usable = [u for u, slope in slopes.items() if slope != 0 and not slope.free_symbols & self.moving]
        if not usable:
            return expression
        u = min(usable, key=lambda u: len(slopes[u].free_symbols))
        on_it = expression.subs(u, sp.expand(u - h / slopes[u]))
        return on_it if expression.has(*self.quotients) else sp.expand(on_it)

    def size(self, indicator: int) -> sp.Expr:
        """Typical size of an indicator, from the states' scales."""
        h, at = self.indicators[indicator], dict(zip(self.traced.u, self.scale, strict=True))
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
            below, above = (self.rate(pair.indicator, mode) for mode in (pair.below, pair.above))
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
        remainder = sp.simplify(self.at_surface(pair.indicator, rate))
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
        size, value = self.size(h), BEYOND * self.indicators[pair.indicator]
        beyond = {
            1: TracedCondition(self.indicator(value - size, f"{name} beyond"), 1),
            -1: TracedCondition(self.indicator(value + size, f"{name} behind"), -1),
        }
        mode = {-1: pair.below, 1: pair.above}
        rate = {s: self.rate_in(h, mode[s]) for s in mode}
        rates = {s: self.indicators[rate[s]] for s in mode}
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
            least = self.size(h) * self.kappa / BEYOND
            gone = TracedCondition(
                self.indicator(
                    attraction - least, f"{name} attraction between {self.modes[mode[-1]]} and {self.modes[mode[1]]}"
                ),
                -1,
            )
            self.jump(slid, self.undetermined(slid), gone)

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
        return replace(first, source=slid, target=target, label=label, contact=all(jump.contact for jump in group))


def _agree(traced: Traced, one: Field, two: Field) -> bool:
    """Return whether two vector fields are the same, by their values at fixed pseudo-random points."""
    both = numeric(traced, (*one, *two))(*_somewhere(traced))
    return np.allclose(both[:, : len(one)], both[:, len(one) :], rtol=AGREE, atol=AGREE)


def _somewhere(traced: Traced, parameters: int = SEEDS) -> tuple[FloatArray, ...]:
    """Fixed pseudo-random parameters (as many), times, states and memories."""
    random, sizes = np.random.default_rng(11), ((), (len(traced.u),), (len(traced.m),))
    p = random.uniform(0.5, 1.5, (parameters, len(traced.p)))
    return p, *(random.uniform(0.5, 1.5, (SEEDS, *size)) for size in sizes)
