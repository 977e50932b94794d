"""The questions of a system whose combinations of phases are written out, and the answers found so far.

Where several elements decide together (:mod:`nonsmooth.system.derived.deciding`), a transition says when they are asked
but not what follows: an answer becomes a transition of its own when it is first found. Numbers are shared by all copies
of a system.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.system.derived.instants import Numbers, RowNumbers, SeriesCode, SeriesNumbers
from nonsmooth.system.symbolic.traced import FOUND, Traced, TracedCondition, TracedTransition
from nonsmooth.system.transition import read_condition

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.expressions import Expressions
    from nonsmooth.system.derived.patterns import Patterns


class Decider:
    """Questions and answers of one system.

    ``modes`` are the mode without elements and the phases of each of its modes; ``rows`` those of an affine system."""

    def __init__(self, make: Expressions, modes: Sequence[tuple[str, Pattern]], rows: Patterns | None) -> None:
        self.make, self.modes, self.rows = make, list(modes), rows
        self.numbers = {one: number for number, one in enumerate(self.modes)}
        self.code = SeriesCode(make, {})
        self._lock = threading.Lock()
        self._found: dict[Any, int] = {}
        self._written: Traced | None = None
        self._origin: Decider | None = None
        self.owners: dict[int, int] = {}  # of each question the element; -1 where those that meet are asked
        self.idle: list[set[int]] = []  # of each mode, the conditions of elements that are not asked for in it

    def bind(self, traced: Traced, kinds: Sequence[str], asked: Sequence[tuple[str, str, str, int]]) -> Traced:
        """The system with all its combinations written out, with the questions (mode, kind, condition, element or -1)
        behind its transitions, which have these ``kinds``.

        The impact of the stop that is met is there from the first, and so are the conditions of each group of elements
        that are asked apart, so that nothing is compiled anew for them."""
        jumps = [replace(jump, kind=kind) for jump, kind in zip(traced.transitions, kinds, strict=True)]
        numbers = {name: i for i, name in enumerate(traced.indicator_names)}
        for name, kind, text, k in asked:
            here = traced.mode_names.index(name)
            signs = read_condition(text, traced.indicator_names, name) if text else ()
            rows = tuple(TracedCondition(numbers[one], sign, strict) for one, sign, strict in signs)
            self.owners[len(jumps)] = k
            jumps.append(TracedTransition(here, here, rows, label=name, kind=kind))
            if k >= 0 and self.make.parts[k].element.strikes and k not in self.make.held(self.modes[here][1]):
                reset, contact = (
                    tuple(self.make.impact((k,), self.modes[here][0])),
                    self._begins_contact(here, here, (k,)),
                )
                jumps.append(TracedTransition(here, here, rows, None, reset, (), contact, name, FOUND))
            for some in self.make.apart(self.modes[here][0]) if k < 0 else ():
                if 0 < len(own_rows := self._conditions(traced, rows, some)) < len(rows):
                    jumps.append(TracedTransition(here, here, own_rows, label=name, kind=FOUND))
        places = {number for name, number in numbers.items() if self.met(name, traced.indicators[number])}
        own = {number for name, number in numbers.items() if name not in self.make.indicators}
        self.idle = [{*range(len(numbers))} - places - own for _ in self.modes]
        for jump in jumps:
            self.idle[jump.source] -= {row.indicator for row in jump.rows}
        self._written = replace(traced, transitions=tuple(jumps), decider=self)
        return self._written

    def _conditions(
        self, traced: Traced, rows: tuple[TracedCondition, ...], some: Sequence[int] | None
    ) -> tuple[TracedCondition, ...]:
        """Those of the conditions that are of ``some`` elements, or of no element's place; None: all."""
        owners = [self.met(traced.indicator_names[row.indicator], traced.indicators[row.indicator]) for row in rows]
        return tuple(row for row, own in zip(rows, owners, strict=True) if some is None or not own or {*own} & {*some})

    def _begins_contact(self, source: int, target: int, struck: tuple[int, ...]) -> bool:
        return self.make.begins_contact(self.modes[source][1], self.modes[target][1], struck)

    def with_changes(self, traced: Traced, changes: Mapping[sp.Basic, sp.Expr]) -> Traced:
        """The equations with functions of time put in place of parameters; its answers are numbered as here."""
        other = Decider(self.make, self.modes, None)
        other.code, other.idle, other._origin = SeriesCode(self.make, changes), self.idle, self
        other.owners = self.owners
        other._written = replace(traced, decider=other)
        return other._written

    def known(self) -> Traced:
        """The system written out, with all that was found so far."""
        assert self._written is not None
        return self._written

    def concerned(self, asked: int, mode: int, met: Sequence[int]) -> list[int] | None:
        """The group of elements to which a question is put in a mode, that of the first of those ``met`` where it is no
        element's own; None: all. Others are asked next, at the same instant."""
        k = self.owners.get(asked, -1)
        some = [k] if k >= 0 else met
        return self.make.with_group_of(some[0], self.modes[mode][0]) if some else None

    def found(self, asked: int, target: int, struck: tuple[int, ...], some: Sequence[int] | None = None) -> int:
        """The number of the transition to which a question to ``some`` elements has led, by their conditions: to a
        mode, by an impact of some of them."""
        if self._origin is not None:
            number, written, changes = self._origin.found(asked, target, struck, some), self.known(), self.code.changes
            more = [
                replace(jump, reset=jump.reset and tuple(e.xreplace(changes) for e in jump.reset))
                for jump in self._origin.known().transitions[len(written.transitions) :]
            ]
            self._written = replace(written, transitions=(*written.transitions, *more))
            return number
        with self._lock:
            key, written = (asked, target, struck, some if some is None else tuple(some)), self.known()
            if key not in self._found:
                question, names = written.transitions[asked], written.mode_names
                reset = tuple(self.make.impact(struck, self.modes[question.source][0])) if struck else None
                self._found[key] = len(written.transitions)
                jump = TracedTransition(
                    question.source,
                    target,
                    self._conditions(written, question.rows, some),
                    reset=reset,
                    kind=FOUND,
                    contact=self._begins_contact(question.source, target, struck),
                    label=f"{names[question.source]} -> {names[target]}",
                )
                self._written = replace(written, transitions=(*written.transitions, jump))
            return self._found[key]

    def told_mode(self, mode: int) -> int:
        """A mode as data: all of them are there from the first."""
        return mode

    retold_mode = told_mode

    def told(self, k: int) -> list[Any] | None:
        """An answer as data: its number is that of one process; None for a transition that stands from the first."""
        return next(([*key] for key, number in self._found.items() if number == k), None)

    def retold(self, asked: int, target: int, struck: Any, some: Any = None) -> int:
        """The number of an answer that was told."""
        return self.found(int(asked), int(target), tuple(map(int, struck)), some and tuple(map(int, some)))

    def sent(self) -> Any:
        """All answers found so far, as data: in another process they get the same numbers."""
        return [*self._found]

    def receive(self, sent: Any) -> None:
        """Number what was sent, in its order."""
        for answer in sent:
            self.found(*answer)

    def number(self, mode: str, pattern: Pattern) -> int:
        """The number of a combination of phases."""
        if (mode, pattern) not in self.numbers:
            held = ", ".join(repr(self.make.parts[k].name) for k in self.make.held(pattern))
            raise SolveError(
                f"elements {held} hold at once, which they cannot at the parameters with which the system was defined: "
                "define it with those of this run"
            )
        return self.numbers[mode, pattern]

    def met(self, name: str, where: sp.Expr) -> list[int]:
        """The elements whose place is an indicator that was made for them, by its name and expression."""
        if name not in self.make.indicators:
            return []
        return [k for k, part in enumerate(self.make.parts) if part.where in (where, -where)]

    def at_point(self, values: FloatArray) -> Callable[[int, float, FloatArray, FloatArray, float], Numbers]:
        """The numbers at an instant, of one parameter point: by the mode, the time, states, memory, and a time in which
        states change as from step to step."""
        if self.rows is None:
            return lambda mode, time, u, memory, step: SeriesNumbers(
                self.code,
                self.modes[mode][0],
                time,
                u,
                np.concatenate([values, memory]),
                step,
                self.known().fields[mode],
            )
        rows = self.rows.rows_at(values)
        return lambda mode, time, u, memory, step: RowNumbers(
            rows, rows.mode, rows.augmented(u, time), step, self.modes[mode][1]
        )
