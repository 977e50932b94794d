"""Patterns of phases of a system with many elements: a mode is made when it is first visited.

Twenty-five contacts have more combinations of phases than can be written out, and a motion visits few of them. Where
every expression is affine in the states, a combination needs no algebra (:mod:`nonsmooth.system.derived.rows`). The
phases visited so far are numbered in the order of their first visit; all copies of a system share that numbering.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SystemDefinitionError
from nonsmooth.system.codegen.linear import SHAPES
from nonsmooth.system.derived.assembly import Pattern
from nonsmooth.system.derived.elements.element import THROWN, words_of
from nonsmooth.system.derived.leads import Conditions, Lead, Out, Reset
from nonsmooth.system.derived.rows import Row, Rows
from nonsmooth.system.symbolic.domain import forcing_period
from nonsmooth.system.symbolic.traced import ALONE, ASKED, ENDS, TOGETHER, Traced, TracedCondition, TracedTransition
from nonsmooth.system.symbolic.tracing import call_scalar

if TYPE_CHECKING:
    from nonsmooth.system.codegen.linear import LinearForm
    from nonsmooth.system.derived.expressions import Expressions

KEPT = 8  # parameter points, and derivatives there, whose numbers are kept by a thread
STEP = 1e-30  # of the imaginary parts that carry derivatives: its square is nothing


@dataclass(eq=False)
class Patterns:
    """The elements of a system whose patterns are made when they are visited, and those visited so far.

    ``expressions`` are all that the elements need of the equations, ``at`` the place there of each: (element, "where" |
    "on" | name of a law, state | side).
    """

    make: Expressions
    mode: str
    why: str = ""  # modes are made when they are visited
    expressions: list[sp.Expr] = field(default_factory=list)
    at: dict[tuple[int, str, int | None], int] = field(default_factory=dict)
    visited: list[Pattern] = field(default_factory=list)
    jumps: list[TracedTransition] = field(default_factory=list)
    changes: list[Reset | None] = field(default_factory=list)  # of the states, by each of the transitions
    led: set[Pattern] = field(default_factory=set)  # patterns whose ways out all have numbers
    equations: Traced = field(init=False)  # without elements; the expressions are its indicators

    def __post_init__(self) -> None:
        self.scale = np.array(list(self.make.scale.values()))
        self.acts_on = [[i for i, d in part.direction.items() if d != 0] for part in self.make.parts]
        for k, part in enumerate(self.make.parts):
            self._keep((k, "where", None), part.where)
            for i in self.acts_on[k]:
                self._keep((k, "on", i), part.direction[i])
            for name, side in part.element.needs(set(self.elements)):
                self._keep((k, name, side), self.make.law(k, name, side))
        self._lock, self._local = threading.Lock(), threading.local()
        self._known: dict[Pattern, int] = {}
        self._jumped: dict[Lead, int] = {}
        self._seen: tuple[tuple[int, int], Any] = (0, 0), None
        self.number((0,) * len(self.make.parts))

    def _keep(self, key: tuple[int, str, int | None], expression: Any) -> None:
        self.at[key] = len(self.expressions)
        self.expressions.append(sp.sympify(expression))

    @property
    def labels(self) -> list[str]:
        """A name for each of the expressions, for messages."""
        sides = {None: "", 1: "_forward", -1: "_back", 0: "_still"}
        names, parts = list(self.make.symbols.u), self.make.parts
        return [
            f"{parts[k].name}_{what}" + (f"_{names[i]}" if what == "on" and i is not None else sides[i])
            for k, what, i in self.at
        ]

    @cached_property
    def elements(self) -> dict[str, Any]:
        """The elements by name."""
        return {part.name: part.element for part in self.make.parts}

    @cached_property
    def conditions(self) -> tuple[str, ...]:
        """Names of the conditions of all elements, the indicators of the system."""
        return tuple(name for name, _ in self._owned)

    @cached_property
    def _owned(self) -> list[tuple[str, int]]:
        """The names of all conditions, each with its element."""
        make, found = self.make, []
        for k, (name, element) in enumerate(self.elements.items()):
            thrown = THROWN if element.held and make.driven(make.rate(k, self.mode)) else ()
            found += [(f"{name}_{one}", k) for one in (*element.conditions, *thrown)]
        return found

    @cached_property
    def slots(self) -> dict[str, int]:
        """The numbers of the conditions."""
        return {name: k for k, name in enumerate(self.conditions)}

    @cached_property
    def owners(self) -> list[int]:
        """The element of each condition."""
        return [k for _, k in self._owned]

    def ways_of(self, rows: Rows, pattern: Pattern, k: int) -> tuple[list[Out], dict[int, FloatArray], Conditions]:
        """The ways of an element out of its phase in a pattern, the rows of its conditions by their numbers, and the
        conditions at which it meets what it may be held by."""
        key = k, rows.phases(k, pattern)
        if key in rows.ways:
            return rows.ways[key]
        name, conditions = rows.parts[k].name, {}

        def armed(some: Sequence[Any]) -> Conditions:
            found = []
            for one in some:
                slot = self.slots[one.name if one.name in self.slots else f"{name}_{one.name}"]  # of which it is whole
                conditions[slot] = one.value.values
                found.append(TracedCondition(slot, one.sign, one.strict))
            return tuple(found)

        leaving = rows.leaving(k, self.mode, pattern)
        maps = [id(way.states) for way in leaving]
        outs = [Out(k, maps.index(id(way.states)), way, armed(way.conditions)) for way in leaving]
        here = rows.place(k, self.mode, pattern)
        ways = here.element.meeting(here) if here.phase not in here.element.held else []
        rows.ways[key] = outs, conditions, armed([way[0] for way in ways])
        return outs, conditions, rows.ways[key][2]

    def armed(self, values: FloatArray) -> list[TracedCondition]:
        """The conditions of all ways out of the contact states of each element, at given parameters."""
        rows, first = self.rows_at(values), [0] * len(self.elements)
        every = [(k, phase) for k, one in enumerate(self.elements.values()) for phase in range(len(one.phases))]
        ways = [self.ways_of(rows, (*first[:k], phase, *first[k + 1 :]), k)[0] for k, phase in every]
        return [row for some in ways for way in some for row in way.rows]

    def ways_out(self, rows: Rows, pattern: Pattern) -> tuple[FloatArray, list[Out], Conditions]:
        """The rows (conditions, M) of a pattern, NaN where one is not asked for; the ways out; the conditions at which
        elements meet what they may be held by."""
        every = np.zeros((len(self.slots), rows.field.shape[1]), dtype=rows.field.dtype)
        every[:, rows.n] = np.nan
        found: list[Out] = []
        meets: Conditions = ()
        for k in range(len(rows.parts)):
            outs, conditions, met = self.ways_of(rows, pattern, k)
            found += outs
            meets += met
            for slot, values in conditions.items():
                every[slot] = values
        return every, found, meets

    def leads_of(self, rows: Rows, pattern: Pattern) -> tuple[FloatArray, list[Lead], list[Any], list[int]]:
        """The rows of a pattern's conditions; its ways out as transitions, what is asked where several elements meet
        last; the states behind each; the conditions at which elements meet what they may be held by."""
        conditions, outs, meets = self.ways_out(rows, pattern)
        found, states = [], []
        for k, i, way, given in outs:
            part = rows.parts[k]
            target = pattern if way.phase is None else rows.place(k, self.mode, pattern).put(way.phase).pattern
            kind = ASKED if way.phase is None else ALONE if part.element.held else ""
            found.append(Lead(pattern, target, part.name, given, kind, None if way.states is None else Reset((k,), i)))
            states.append(way.states)
        together = Lead(pattern, pattern, "", tuple(dict.fromkeys(meets)), TOGETHER)
        return conditions, [*found, together], [*states, None], [slot for slot, _, _ in meets]

    def look_at(self, rows: Rows, pattern: Pattern) -> None:
        """Give all ways out of a pattern their numbers."""
        for lead in self.leads_of(rows, pattern)[1]:
            self.transition(lead)
        self.led.add(pattern)

    @cached_property
    def outputs(self) -> tuple[str, ...]:
        """Names of the elements' forces."""
        return tuple(f"{name}_force" for name in self.elements)

    def is_affine(self, period: Any) -> bool:
        """Return whether all that the elements need is affine in the states with harmonics in time."""
        from nonsmooth.system.codegen.linear import linear_form

        symbols, fields = self.make.symbols, (tuple(self.make.base(self.mode)),)
        if period is None:
            period = forcing_period((*fields[0], *self.expressions), symbols.t, self.make.values)
        elif callable(period):
            period = call_scalar(period, (symbols.parameters(),), "`period`")
        self.equations = Traced(
            name="",
            **symbols.of_traced(),
            mode_names=(self.mode,),
            indicator_names=tuple(self.labels),
            output_names=(),
            fields=fields,
            lacking=((False,) * len(self.make.u),),
            indicators=tuple(self.expressions),
            transitions=(),
            outputs=(),
            period=None if period is None else sp.sympify(period),
        )
        form = linear_form(self.equations)
        return form is not None and form.affine_indicators

    def bind(self, traced: Traced) -> Traced:
        """The equations, which from here on know their patterns."""
        self.equations = traced
        return replace(traced, patterns=self)

    @cached_property
    def plain(self) -> Traced:
        """The equations without elements."""
        return replace(self.equations, indicators=(), indicator_names=())

    @cached_property
    def form(self) -> LinearForm:
        """The matrices of the equations without elements and the rows of all expressions, at parameter points."""
        from nonsmooth.system.codegen.linear import linear_form

        form = linear_form(self.equations)
        if form is None or not form.affine_indicators:
            raise SystemDefinitionError(
                f"{self.equations.name!r}: its elements {self.why}, and a mode can be made when it is first visited "
                "only where everything is affine in the states with harmonics in time; take fewer elements, or elastic "
                "contacts in place of rigid ones that rub, or write the nonlinear ones as modes"
            )
        return form

    def rows_at(self, values: FloatArray, place: int | None = None) -> Rows:
        """The calculus at given parameters; with a parameter's ``place`` that of numbers whose imaginary parts are
        ``STEP`` times their derivatives in it. A thread keeps those of the last few."""
        kept: dict[tuple[bytes, int | None], Rows] = self._local.__dict__.setdefault("rows", {})
        key = values.tobytes(), place
        if key not in kept:
            found = self._made(values[None, :], place)
            while len(kept) >= KEPT:
                del kept[next(iter(kept))]
            kept[key] = found
        return kept[key]

    def _made(self, point: FloatArray, place: int | None) -> Rows:
        tables = self.form.evaluate(point)
        if place is not None:
            slopes = self.form.evaluate(point, place)
            both = {name: (getattr(tables, name), getattr(slopes, name)) for name in SHAPES}
            tables = tables._replace(**{name: one + 1j * STEP * slope for name, (one, slope) in both.items()})
        still = [getattr(tables, name).tobytes() for name in SHAPES if name != "omega"]
        for like in self._local.rows.values():
            if like.still == still and not like.turned:
                return like.at_rates(tables.omega[0] * tables.multiples)
        return Rows(self, tables, still)

    def number(self, pattern: Pattern) -> int:
        """The number of a pattern; the next one where it is visited for the first time."""
        with self._lock:
            if pattern not in self._known:
                self._known[pattern] = len(self.visited)
                self.visited.append(pattern)
            return self._known[pattern]

    def transition(self, lead: Lead) -> int:
        """The number of a transition; the next one where it is new."""
        ends = self.number(lead.source), self.number(lead.target)
        with self._lock:
            if lead not in self._jumped:
                names = self.name(lead.source), self.name(lead.target)
                self._jumped[lead] = len(self.jumps)
                label = lead.element if lead.kind in ENDS else " -> ".join(names)
                contact = self.begins_contact(lead)
                self.jumps.append(TracedTransition(*ends, lead.rows, contact=contact, label=label, kind=lead.kind))
                self.changes.append(lead.change)
            return self._jumped[lead]

    def begins_contact(self, lead: Lead) -> bool:
        """Return whether a contact begins by a transition."""
        return self.make.begins_contact(lead.source, lead.target, lead.change.elements if lead.change else ())

    def told_mode(self, mode: int) -> Pattern:
        """A mode as data, as :meth:`told`."""
        return self.visited[mode]

    def retold_mode(self, data: Sequence[Any]) -> int:
        """The number of a mode that was told."""
        if len(data) != len(self.make.parts):
            raise ValueError(f"{len(data)} phases of {len(self.make.parts)} elements")
        return self.number(tuple(map(int, data)))

    def told(self, k: int) -> list[Any]:
        """A transition as data, by the contact states of its ends: its number is that of one process."""
        return [*list(self._jumped)[k]]

    def retold(self, source: Any, target: Any, element: str, rows: Any, kind: str, change: Any) -> int:
        """The number of a transition that was told."""
        ends = [self.visited[self.retold_mode(phases)] for phases in (source, target)]
        given = tuple(TracedCondition(int(i), int(sign), bool(strict)) for i, sign, strict in rows)
        change = change and Reset(tuple(map(int, change[0])), int(change[1]), bool(change[2]))
        return self.transition(Lead(ends[0], ends[1], str(element), given, str(kind), change))

    def sent(self) -> Any:
        """All transitions and modes found so far, as data: in another process they get the same numbers."""
        return [*self._jumped], [*self.visited]

    def receive(self, sent: Any) -> None:
        """Number what was sent, in its order."""
        for pattern in sent[1]:
            self.number(pattern)
        for lead in sent[0]:
            self.transition(lead)

    def named(self, name: str) -> int | None:
        """The number of the pattern of a name; None where there is none."""
        found = re.fullmatch(words_of(self.elements), name)
        if found is None:
            return None
        phases = zip(self.elements.values(), found.groups(), strict=True)
        pattern = tuple(element.phases.index(phase) for element, phase in phases)
        return self.number(pattern) if self.make.may_hold(self.make.held(pattern), self.mode) else None

    def name(self, pattern: Pattern) -> str:
        """The phases of all elements as one name."""
        phases = zip(self.elements.items(), pattern, strict=True)
        return "_".join(f"{name}_{element.phases[k]}" for (name, element), k in phases)

    def seen(self) -> Traced:
        """The equations as far as they are known: names and transitions of the patterns visited; what elements add has
        no expressions."""
        size = count, jumps = len(self.visited), len(self.jumps)
        if self._seen[0] == size:
            return self._seen[1]
        traced, unknown = self.equations, sp.nan
        names = (*traced.output_names, *self.outputs)
        acted = {i for some in self.acts_on for i in some}
        field = tuple(unknown if i in acted else e for i, e in enumerate(traced.fields[0]))
        own = tuple((output[0],) * count for output in traced.outputs)
        seen = replace(
            traced,
            patterns=self,
            mode_names=tuple(map(self.name, self.visited[:count])),
            indicator_names=self.conditions,
            indicators=(unknown,) * len(self.conditions),
            transitions=tuple(self.jumps[:jumps]),
            output_names=names,
            outputs=(*own, *(((unknown,) * count,) * len(self.outputs))),
            fields=(field,) * count,
            lacking=(traced.lacking[0],) * count,
        )
        self._seen = size, seen
        return seen

    def forces(self, parameters: FloatArray, time: FloatArray, u: FloatArray, mode: Any) -> FloatArray:
        """Forces (N, elements) at N samples, each in the pattern of its mode."""
        rows = self.rows_at(parameters)
        w = rows.augmented(u, time)
        found = np.zeros((len(time), len(self.elements)))
        for m in np.unique(mode):
            here, pattern = np.flatnonzero(mode == m), self.visited[int(m)]
            for k, force in rows.flow(self.mode, pattern)[1].items():
                if isinstance(force, Row):
                    found[here, k] = w[here] @ force.values
            found[here] = rows.shared(self.mode, pattern, found[here], partial(_values, w[here]))
        return found


def _values(w: FloatArray, law: Row) -> FloatArray:
    """The values of a row at N instants."""
    found: FloatArray = w @ law.values
    return found
