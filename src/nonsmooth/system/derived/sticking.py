"""A system with modes, indicators and transitions added, or without the modes that stick to a surface."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import sympy as sp

from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.symbolic.traced import ASKED, Traced, TracedCondition, TracedTransition, along

LEVEL = 1e-9  # of 1: by how much a static friction may differ from the kinetic one, given as another number


def without_sticking(traced: Traced) -> tuple[Traced, list[tuple[sp.Expr, str]]]:
    """The system without the modes that stick to a surface, and (expression, message) that must not be negative.

    A mode sticks to h = 0 between P and Q where a transition from P when h rises and one from Q when h falls lead to
    it. There P and Q change into each other then, whatever else is asked for today."""
    if traced.decider is not None:  # what is asked of elements that hold each other
        jumps_left = tuple(jump for jump in traced.transitions if jump.fires and jump.kind != ASKED)
        traced = replace(traced, transitions=jumps_left, decider=None)
    rising: dict[tuple[int, int], dict[int, int]] = {}  # (mode, indicator) -> sign of the row -> source
    for jump in traced.transitions:
        if jump.reset is not None and jump.source != jump.target:
            for row in jump.rows:
                rising.setdefault((jump.target, row.indicator), {}).setdefault(row.sign, jump.source)
    sticks = {key: found for key, found in rising.items() if len(found) == 2 and found[1] != found[-1]}
    dropped = {mode for mode, _ in sticks}
    if not dropped:
        return traced, []
    apart = [needed for (mode, h), ends in sticks.items() for needed in _equal_friction(traced, mode, h, ends)]
    between = {frozenset(ends.values()): h for (_, h), ends in sticks.items() if not set(ends.values()) & dropped}
    left = [jump for jump in traced.transitions if not {jump.source, jump.target} & dropped]
    every = [{mode} for mode in range(len(traced.mode_names)) if mode not in dropped]
    regions = joined([*every, *({jump.source, jump.target} for jump in left)])
    # Where two stick at once, a question led there and back: other surfaces alone are left to stick to.
    freed = [len({h for (_, h), ends in sticks.items() if one & {*ends.values()}}) for one in regions]
    kept = sorted(set.union(*(one for one, own in zip(regions, freed, strict=True) if own == max(freed))))
    jumps: dict[tuple[int, int, tuple[TracedCondition, ...]], TracedTransition] = {}
    for jump in left:
        if jump.source not in kept:
            continue
        rows, h = jump.rows, between.get(frozenset((jump.source, jump.target)))
        if h is not None and jump.reset is None:
            rows = tuple(row for row in rows if row.indicator == h)
            if not rows:
                continue
        source, target = kept.index(jump.source), kept.index(jump.target)
        jumps.setdefault(
            (source, target, rows),
            replace(jump, source=source, target=target, rows=rows),
        )
    return replace(
        traced,
        mode_names=tuple(traced.mode_names[i] for i in kept),
        fields=tuple(traced.fields[i] for i in kept),
        lacking=tuple(traced.lacking[i] for i in kept),
        transitions=tuple(jumps.values()),
        outputs=tuple(tuple(row[i] for i in kept) for row in traced.outputs),
        along=(),
        idle=(),
    ), apart


def joined(sets: Iterable[set[int]]) -> list[set[int]]:
    """Sets, those that share an entry as one."""
    found: list[set[int]] = []
    for own in sets:
        found = [*(one for one in found if not one & own), own.union(*(one for one in found if one & own))]
    return found


def _equal_friction(traced: Traced, mode: int, h: int, ends: Mapping[int, int]) -> list[tuple[sp.Expr, str]]:
    """Conditions, with their messages, under which the friction that holds is the kinetic one: not negative.

    Then the rate of h in the mode behind, on the surface, vanishes just where sticking ends."""
    surface, moving = traced.indicators[h], {traced.t, *traced.u}
    symbol = next(u for u in traced.u if surface.diff(u) != 0)
    (at,) = sp.solve(surface, symbol)
    names = traced.mode_names
    says = (
        f"{traced.name!r} cannot be smoothed between {names[ends[1]]!r} and {names[ends[-1]]!r}: the friction that "
        f"holds in {names[mode]!r} is not the kinetic one, and a band has no other; make them equal"
    )
    rates = {sp.expand(along(surface, traced.t, traced.u, traced.fields[end])) for end in ends.values()}
    if len(rates) == 1:  # a place, whose rate no force changes at once: a preloaded spring
        return []
    found = []
    for jump in traced.transitions:
        if jump.source != mode or jump.target not in ends.values() or len(jump.rows) != 1:
            continue
        end = traced.indicators[jump.rows[0].indicator]
        rate = along(surface, traced.t, traced.u, traced.fields[jump.target])
        rate, end = (sp.expand(e.subs(symbol, at)) for e in (rate, end))
        shared = sorted(rate.free_symbols & end.free_symbols, key=lambda s: (s not in moving, str(s)))
        if not shared:
            continue  # a state beyond the surface
        ratio = sp.cancel(rate.diff(shared[0]) / end.diff(shared[0]))
        largest = LEVEL * max(abs(number) for number in rate.as_coefficients_dict().values())
        terms = sp.expand(rate - ratio * end).as_coefficients_dict().items()  # those of rounding are none
        excess = sp.simplify(sp.Add(*(number * term for term, number in terms if abs(number) > largest)))
        if excess == 0:
            continue
        if excess.free_symbols & moving or (excess.is_number and abs(excess) > LEVEL):
            raise SystemDefinitionError(says)
        found.append((LEVEL - sp.Abs(excess), says))
    return found


class Additions:
    """A system as lists that grow; its own transitions are left out."""

    def __init__(self, traced: Traced) -> None:
        self.traced = traced
        self.modes, self.fields, self.lacking = list(traced.mode_names), list(traced.fields), list(traced.lacking)
        self.outputs = [list(row) for row in traced.outputs]
        self.indicator_names, self.indicators = list(traced.indicator_names), list(traced.indicators)
        self.jumps: list[TracedTransition] = []

    def indicator(self, expression: sp.Expr, name: str) -> int:
        """Index of a derived indicator, added where it is new."""
        if name not in self.indicator_names:
            self.indicator_names.append(name)
            self.indicators.append(expression)
        return self.indicator_names.index(name)

    def mode(self, name: str, like: int, field: Sequence[sp.Expr], outputs: Iterable[sp.Expr]) -> None:
        """Add a mode with its field and outputs; it lacks the states that another one lacks."""
        self.modes.append(name)
        self.fields.append(tuple(field))
        self.lacking.append(self.lacking[like])
        for row, entry in zip(self.outputs, outputs, strict=True):
            row.append(entry)

    def jump(
        self,
        source: int,
        target: int,
        *rows: TracedCondition,
        writes: tuple[tuple[int, sp.Expr], ...] = (),
        contact: bool | None = None,
    ) -> None:
        """Add a transition; without ``contact`` one begins where it leaves the first mode."""
        label, begins = f"{self.modes[source]} -> {self.modes[target]}", source == 0 if contact is None else contact
        self.jumps.append(TracedTransition(source, target, rows, None, None, writes, begins, label))

    def put_in(self, **more: Any) -> Traced:
        """The derived system; ``more``: its other fields that differ."""
        return replace(
            self.traced,
            mode_names=tuple(self.modes),
            fields=tuple(self.fields),
            lacking=tuple(self.lacking),
            indicator_names=tuple(self.indicator_names),
            indicators=tuple(self.indicators),
            transitions=tuple(self.jumps),
            outputs=tuple(tuple(row) for row in self.outputs),
            **more,
        )
