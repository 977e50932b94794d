"""The tables of systems whose modes are made when they are first visited, which grow with every pattern that is met.

Each parameter point has tables of its own, and numbers its patterns as they come.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray, Points, State
from nonsmooth.flow.engines.linear import table_bytes
from nonsmooth.kernels.hybrid.codes import CONCERNS, DEAD_END, MODE, RESET, STARTS, TIME, WAITS
from nonsmooth.results.memory import free_memory, room_for
from nonsmooth.system.codegen.linear import apart, put_together
from nonsmooth.system.derived.deciding import Outcome, begun, decide
from nonsmooth.system.derived.instants import RowNumbers
from nonsmooth.system.derived.leads import Lead, Reset
from nonsmooth.system.symbolic.traced import ALONE, ASKED, ENDS, FOUND, TOGETHER

if TYPE_CHECKING:
    from nonsmooth.kernels.hybrid.records import Form
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.leads import Conditions
    from nonsmooth.system.derived.patterns import Patterns

MOST = 1024  # patterns for which room is made at first
SECTION = np.array([(0, 1, 1), (0, -1, 1)], dtype=np.int64)  # the last rows of a transition table


class PatternTables:
    """The tables of one parameter point: those of the patterns that were visited there, and room for more."""

    def __init__(self, patterns: Patterns, tables: Points, i: int) -> None:
        from nonsmooth.kernels.compile.assembly import linear_module

        self.patterns = patterns
        self.rows = patterns.rows_at(tables.points[i])
        n, width = self.rows.field.shape
        self.harmonics = (width - n - 1) // 2
        self.stand = linear_module().stand
        self.points, self.period = tables.points[i : i + 1], tables.period[i : i + 1]
        self.omega = np.ascontiguousarray(tables.form.omega[i : i + 1])
        self.multiples = tables.form.multiples
        self.own_outputs = self._outputs(tables.form, i)
        self.index: dict[Pattern, int] = {}
        self.numbers: list[int] = []  # of the patterns here among all that were visited
        self.waiting: dict[Pattern, list[int]] = {}
        self.leads: list[Lead] = []  # of each transition
        self.lists: list[list[int]] = []  # transitions out of each mode
        self.together: list[int] = []  # the transition of each mode that is asked where several elements meet
        self.watched: list[FloatArray] = []  # the rows of the conditions of each mode
        self.meets: list[list[int]] = []  # the conditions of each mode that are looked at then
        self.answers: dict[tuple[int, int, tuple[int, ...], str, Conditions], int] = {}
        self.maps: list[FloatArray] = [self.rows.identity()]
        self.known_maps: dict[int, int] = {}  # by the identity of an array, which the rows keep
        self.made: Any = None  # the maps as kernels take them, as long as none is changed
        self.transitions: IntArray = np.zeros((0, 5), dtype=np.int64)
        self.conditions: IntArray = np.zeros((0, 3), dtype=np.int64)
        self.lengths: list[int] = []  # conditions of each transition
        self.form: Any = None
        self.own: Any = None
        self.work: Any = None
        self.capacity = 0
        self.add(patterns.visited[0])

    def _outputs(self, linear: Form, i: int) -> FloatArray:
        """The user's own outputs as rows."""
        found = np.zeros((linear.oa.shape[1], self.rows.field.shape[1]))
        put_together(found, self.rows.n, linear.oa[i, :, 0], linear.ob[i, :, 0], linear.oc[i, :, 0], linear.os[i, :, 0])
        return found

    # What a run asks for

    def enter(self, state: State) -> None:
        """Put the number of the pattern here in place of the one that all points share."""
        state.counters[0] = self.place(self.patterns.visited[int(state.counters[0])])

    def leave(self, state: State) -> None:
        """The reverse of :meth:`enter`."""
        state.counters[0] = self.numbers[int(state.counters[0])]

    def transitions_of(self, taken: IntArray) -> IntArray:
        """The numbers that all points share of the transitions here."""
        every = np.zeros(len(self.leads), dtype=np.int64)
        for t in np.unique(taken):
            every[t] = self.patterns.transition(self.leads[t])
        return every[taken]

    def complete(self) -> None:
        """Make the mode for which a run waits, or say where what it has asked leads."""
        tally = self.work.tally
        waits = int(tally[WAITS]) - 1
        if waits < 0 or self.transitions[waits, 0] >= 0:  # answered: the run has paused for another reason
            return
        lead, rows, mode = self.leads[waits], self.rows, self.patterns.mode
        if lead.kind in ("", ALONE):
            self.add(lead.target)
            return
        w, here = rows.augmented(self.work.w[: rows.n], float(self.work.memo[TIME])), int(tally[MODE])
        pattern = self.patterns.visited[self.numbers[here]]
        if tally[STARTS]:
            found = begun(RowNumbers(rows, mode, w), pattern)
            target, taken = self.place(found.pattern), -1
            self.work.tally[MODE] = target
            if found.ends:
                self.work.tally[STARTS] = -1 - ENDS.index(found.ends)
        else:
            numbers = RowNumbers(rows, mode, w, float(self.own.info[here, 0]), pattern)
            fired = int(tally[CONCERNS])
            concerned = self._concerned(lead, fired)
            found = decide(numbers, pattern, self._met(here, fired), concerned)
            taken = self._answer(waits, found, concerned)
        if taken < 0 or not found.struck:
            self.work.w[: rows.n] = found.states
        self.work.tally[WAITS] = taken + 1

    def _met(self, here: int, fired: int) -> list[int]:
        """The elements whose place was met."""
        row = self.watched[here][fired] if fired >= 0 else np.nan
        places = self.rows.places
        return [*map(int, np.flatnonzero((places == row).all(axis=1) | (places == -row).all(axis=1)))]

    def _concerned(self, lead: Lead, fired: int) -> list[int] | None:
        """The group of elements of which a condition was met, None: all; others are asked next, at the same instant."""
        if lead.kind != TOGETHER:
            return self.rows.with_group_of([*self.patterns.elements].index(lead.element), self.patterns.mode)
        return self.rows.with_group_of(self.patterns.owners[fired], self.patterns.mode) if fired >= 0 else None

    def _answer(self, waits: int, found: Outcome, concerned: list[int] | None) -> int:
        """The transition to which a question has led, by the conditions of those that were asked; it is made where it
        is new."""
        lead, struck = self.leads[waits], found.struck
        owners = self.patterns.owners
        rows = tuple(row for row in lead.rows if concerned is None or owners[row.indicator] in concerned)
        key = waits, self.place(found.pattern), (found.rubbed is not None, *struck), found.ends, rows
        if key not in self.answers:
            self.answers[key] = len(self.leads)
            number = 0
            if found.rubbed is not None:
                number = self._keep(self.maps[0])
            elif struck:
                number = self._map(self.rows.impact(struck, self.patterns.mode))
            change = Reset(struck, rubs=found.rubbed is not None) if struck else None
            names, ends = found.names or lead.element, found.ends or FOUND
            to = Lead(lead.source, found.pattern, names, rows, ends, change)
            contact = ENDS.index(ends) + DEAD_END if found.ends else int(self.patterns.begins_contact(to))
            way = (key[1], RESET if struck else 0, contact, number, 0)
            self.transitions = np.concatenate([self.transitions, np.array([way], dtype=np.int64)])
            self._lead(to, lead.kind)
            self.form, self.net = self.form._replace(**self._maps()[0]), self._net()
        taken = self.answers[key]
        if found.rubbed is not None:  # of the rates that an impact had, of which its impulses depend as no row does
            self.maps[self.transitions[taken, 3]], self.made = self.rows.rubbed(*found.rubbed), None
            self.form, self.net = self.form._replace(**self._maps()[0]), self._net()
        return taken

    def place(self, pattern: Pattern) -> int:
        """The number of a pattern here; it is made where it is new."""
        if pattern not in self.index:
            self.add(pattern)
        return self.index[pattern]

    # The tables

    def add(self, pattern: Pattern) -> None:
        """Make the mode of a pattern: its tables, and the transitions out of it and into it."""
        here = len(self.numbers)
        self.index[pattern] = here
        self.numbers.append(self.patterns.number(pattern))
        rows, ways = self.rows, []
        flow, forces = rows.flow(self.patterns.mode, pattern)
        conditions, leads, states, meets = self.patterns.leads_of(rows, pattern)
        for lead, change in zip(leads, states, strict=True):
            asked = lead.kind in (ASKED, TOGETHER)
            to = -1 if asked else self.index.get(lead.target, -1)
            if to < 0 and not asked:
                self.waiting.setdefault(lead.target, []).append(len(self.leads))
            number = 0 if change is None else self._map(change)
            contact = int(self.patterns.begins_contact(lead))
            ways.append((to, 0 if change is None else RESET, contact, number, int(lead.kind == ALONE)))
            self._lead(lead, lead.kind)
        self.lists.append([*range(len(self.leads) - len(leads), len(self.leads) - 1)])
        self.together.append(len(self.leads) - 1)
        self.meets.append(meets)
        self.watched.append(conditions)
        self.transitions = np.concatenate([self.transitions, np.array(ways, dtype=np.int64).reshape(-1, 5)])
        for t in self.waiting.pop(pattern, []):
            self.transitions[t, 0] = here
        self._stand(flow, conditions, self._output_rows(forces))
        self.net = self._net()

    def _lead(self, lead: Lead, kind: str) -> None:
        """Put a transition behind the others, with the rows by which it, or the question of that ``kind``, is met."""
        rows = np.array(() if kind == TOGETHER else lead.rows, dtype=np.int64).reshape(-1, 3)
        self.conditions = np.concatenate([self.conditions, rows])
        self.lengths.append(len(rows))
        self.leads.append(lead)

    def _map(self, states: FloatArray) -> int:
        """The number of a map among those of the form; one array is kept once."""
        if id(states) not in self.known_maps:
            self.known_maps[id(states)] = self._keep(states)
        return self.known_maps[id(states)]

    def _keep(self, states: FloatArray) -> int:
        """Put a map behind the others."""
        self.maps.append(states)
        self.made = None
        return len(self.maps) - 1

    def _output_rows(self, forces: dict[int, Any]) -> FloatArray:
        found = np.zeros((len(self.rows.parts), self.rows.field.shape[1]))
        for k, force in forces.items():
            if hasattr(force, "values"):
                found[k] = force.values
        return np.concatenate([self.own_outputs, found])

    def _stand(self, flow: FloatArray, conditions: FloatArray, outputs: FloatArray) -> None:
        """Put the tables of a mode behind those that stand."""
        if len(self.numbers) > self.capacity:
            self._widen(len(conditions), len(outputs))
        self.form = self._form(flow, conditions, outputs)
        count = self.stand(self.form, self.own, self.work)
        self.standing = self.own._replace(info=self.own.info[:count])

    def _widen(self, conditions: int, outputs: int) -> None:
        """Make room; a table takes memory only where it is written, so that much may be asked for."""
        from nonsmooth.flow.engines.linear import scratch

        n, width = self.rows.field.shape
        of_one = table_bytes(n, self.harmonics, 1) + 8 * (conditions + n + outputs) * 13 * width
        self.capacity = 2 * self.capacity or max(8, min(MOST, (free_memory() or 2**32) // (4 * of_one)))
        room_for(
            float(of_one) * self.capacity,
            f"the tables of {self.capacity} patterns of {n} states",
            "take fewer elements or a shorter run: it visits more patterns than there is memory for",
        )
        most = 64 * len(self.rows.parts)
        own, work = scratch(n, self.harmonics, self.capacity, conditions, outputs, most, apart=True)
        if self.own is not None:
            for old, new in ((self.own, own), (self.work, work)):
                for one, other in zip(old, new, strict=True):
                    other[tuple(slice(size) for size in one.shape)] = one
        self.own, self.work = own, work

    def _form(self, flow: FloatArray, conditions: FloatArray, outputs: FloatArray) -> Any:
        """The record of one mode, its indicators and outputs, with the maps of all transitions."""
        from nonsmooth.kernels.hybrid.records import Form

        n = self.rows.n
        return Form(
            *_turned(flow[None, None], n),
            self.multiples,
            self.omega,
            self.period,
            *_contiguous(conditions[None], n),
            *_contiguous(outputs[None, :, None], n),
            **self._maps()[0],
            lacking=np.zeros((0, n), dtype=np.int64),
        )

    def _maps(self) -> tuple[dict[str, FloatArray], IntArray]:
        """The maps of all transitions, as fields of a form; of each how many states it changes, and which."""
        if self.made is None:
            every = np.array(self.maps)
            changed = np.zeros((len(every), 1 + self.rows.n), dtype=np.int64)
            for m, rows in enumerate((every != every[0]).any(axis=2)):
                moved = np.flatnonzero(rows)
                changed[m, 0], changed[m, 1 : len(moved) + 1] = len(moved), moved
            fields = zip(("ra", "rb", "rc", "rs"), _turned(every[None], self.rows.n), strict=True)
            self.made = dict(fields), changed
        found: tuple[dict[str, FloatArray], IntArray] = self.made
        return found

    def _net(self) -> Any:
        """The transition table of the patterns that stand."""
        from nonsmooth.kernels.hybrid.records import Net

        whole = np.int64
        return Net(
            self.transitions,
            np.concatenate([self.conditions, SECTION]),
            np.cumsum([0, *self.lengths], dtype=whole),
            *_joined(self.lists),
            np.full(len(self.leads), -1.0),
            self._maps()[1],
            *_joined(self.meets)[::-1],
            np.array(self.together, dtype=whole),
        )


def _joined(lists: list[list[int]]) -> tuple[IntArray, IntArray]:
    """The beginnings of lists that stand in one, and that one."""
    every = [one for some in lists for one in some]
    return np.cumsum([0, *map(len, lists)], dtype=np.int64), np.array(every, dtype=np.int64)


def _contiguous(rows: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rows in parts, as kernels take arrays."""
    a, b, c, s = map(np.ascontiguousarray, apart(rows, n))
    return a, b, c, s


def _turned(rows: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The same with the harmonics before the rows."""
    a, b, *waves = _contiguous(rows, n)
    c, s = (np.ascontiguousarray(np.swapaxes(one, -1, -2)) for one in waves)
    return a, b, c, s
