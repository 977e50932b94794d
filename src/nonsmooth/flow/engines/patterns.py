"""The engine of systems whose modes are made when they are first visited (:mod:`nonsmooth.system.derived.patterns`).

It is that of the exact flow; only the tables grow. A run that is about to enter a pattern without tables pauses, they
are put behind those that stand, and it goes on. Each parameter point has tables of its own, and numbers its patterns as
they come; what leaves the engine has the numbers that all points share.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray, Kept, Log, Section, State
from nonsmooth.flow.engines.linear import table_bytes
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.places import RESET, WAITS
from nonsmooth.results.memory import free_memory, room_for

if TYPE_CHECKING:
    from nonsmooth.system.codegen.linear import LinearTables
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.patterns import Patterns
    from nonsmooth.system.symbolic.traced import Traced

__all__ = ["PatternEngine"]

MOST = 1024  # patterns for which room is made at first
SECTION = np.array([(0, 1, 1), (0, -1, 1)], dtype=np.int64)  # the last rows of a transition table


@dataclass
class Points:
    """Parameter points, and for each thread the tables of the one that it is at."""

    points: FloatArray
    linear: LinearTables
    period: FloatArray
    local: threading.local = field(default_factory=threading.local)


@dataclass
class PatternEngine(Engine):
    """``Engine`` over ``kernels.linear`` for a system whose patterns are made when they are visited."""

    traced: Traced
    patterns: Patterns
    scale: FloatArray  # (n,)
    name: str = "exact"

    def prepare(self, points: FloatArray) -> Points:
        linear = self.patterns.form.evaluate(points)
        return Points(np.asarray(points, dtype=float), linear, linear.period)

    def module(self) -> ModuleType:
        from nonsmooth.kernels.linear.module import linear_module

        return linear_module()

    def given(self, tables: Any) -> tuple[Any, Any, Any]:
        return tables.form, tables.standing, tables.work

    def net_of(self, tables: Any, i: int) -> Any:
        return tables.net

    own_systems = True

    def enter(self, tables: Points, i: int, state: State) -> tuple[PatternTables, int]:
        here = self._at(tables, i)
        here.enter(state)
        return here, 0

    def leave(self, here: PatternTables, state: State) -> None:
        here.leave(state)

    def touches_of_a_leg(self) -> int:
        """None: an extremum of each condition of each element, in a hundred states, would fill the memory."""
        return 0

    def go_on(self, tables: Any) -> bool:
        tables.complete()
        return True

    def chain(
        self, tables: Points, first: int, last: int, state: State, starts: FloatArray | None,
        plan: Section, transient: int, keep: int, out: Kept,
    ) -> None:  # fmt: skip
        for i in range(first, last):
            here, _ = self.enter(tables, i, state)
            one = Kept(*[part[i : i + 1] for part in out])
            own = None if starts is None else starts[i : i + 1]
            super().chain(here, 0, 1, state, own, plan, transient, keep, one)
            here.leave(state)
            numbers = np.array(here.numbers, dtype=np.int64)
            if out.status[i] in (codes.OK, codes.NOT_GUARANTEED):
                out.section_mode[i] = numbers[out.section_mode[i]]

    def room(self, tables: Points) -> None:
        """None: a pattern that is met for the first time changes the memory."""

    def record(self, tables: Points, state: State, until: float, samples: FloatArray, room: Any = None) -> Log:
        here, _ = self.enter(tables, 0, state)
        log = super().record(here, state, until, samples)
        here.leave(state)
        numbers = np.array(here.numbers, dtype=np.int64)
        log.sample_mode = np.where(log.sample_mode < 0, -1, numbers[log.sample_mode])
        log.crossing_transition = here.transitions_of(log.crossing_transition)
        return log

    def _at(self, tables: Points, i: int) -> PatternTables:
        """The present thread's tables of point i; those of another point give way."""
        if getattr(tables.local, "i", None) != i:
            tables.local.tables = None
            tables.local.tables, tables.local.i = PatternTables(self, tables, i), i
        found: PatternTables = tables.local.tables
        return found


class PatternTables:
    """The tables of one parameter point: those of the patterns that were visited there, and room for more."""

    def __init__(self, engine: PatternEngine, tables: Points, i: int) -> None:
        from nonsmooth.kernels.linear.module import modes_module

        patterns = engine.patterns
        self.patterns = patterns
        self.rows = patterns.rows(tables.linear, i)
        n, width = self.rows.field.shape
        self.harmonics = (width - n - 1) // 2
        self.stand = modes_module().stand
        self.points, self.period = tables.points[i : i + 1], tables.period[i : i + 1]
        self.omega = np.ascontiguousarray(tables.linear.omega[i : i + 1])
        self.multiples = np.array(patterns.form.multiples, dtype=np.int64)
        self.slots = {name: k for k, name in enumerate(patterns.conditions)}
        self.own_outputs = self._outputs(tables.linear, i)
        self.index: dict[Pattern, int] = {}
        self.numbers: list[int] = []  # of the patterns here among all that were visited
        self.possible: dict[Pattern, bool] = {}
        self.waiting: dict[Pattern, list[int]] = {}
        self.leads: list[tuple[int, Pattern, str, tuple[tuple[int, int], ...]]] = []  # of each transition
        self.maps: list[FloatArray] = [self.rows.identity()]
        self.known_maps: dict[bytes, int] = {self.maps[0].tobytes(): 0}
        self.transitions: IntArray = np.zeros((0, 4), dtype=np.int64)
        self.conditions: IntArray = np.zeros((0, 3), dtype=np.int64)
        self.lengths: list[int] = []  # conditions of each transition
        self.starts: list[int] = [0]  # the first transition of each mode
        self.own: Any = None
        self.work: Any = None
        self.capacity = 0
        self.add(patterns.visited[0])

    def _outputs(self, linear: LinearTables, i: int) -> FloatArray | None:
        """The user's own outputs as rows; None where they are not affine."""
        if not self.patterns.form.affine_outputs:
            return None
        found = np.zeros((linear.oa.shape[1], self.rows.field.shape[1]))
        n = self.rows.n
        found[:, :n], found[:, n] = linear.oa[i, :, 0], linear.ob[i, :, 0]
        found[:, n + 1 :: 2], found[:, n + 2 :: 2] = linear.oc[i, :, 0], linear.os[i, :, 0]
        return found

    # What a run asks for

    def enter(self, state: State) -> None:
        """Put the number of the pattern here in place of the one that all points share."""
        pattern = self.patterns.visited[int(state.counters[0])]
        if pattern not in self.index:
            self.add(pattern)
        state.counters[0] = self.index[pattern]

    def leave(self, state: State) -> None:
        """The reverse of :meth:`enter`."""
        state.counters[0] = self.numbers[int(state.counters[0])]

    def transitions_of(self, taken: IntArray) -> IntArray:
        """The numbers that all points share of the transitions here."""
        every = np.zeros(len(self.leads), dtype=np.int64)
        for t in np.unique(taken):
            source, target, element, rows = self.leads[t]
            ends = self.numbers[source], self.numbers[self.index[target]]
            every[t] = self.patterns.transition(*ends, element, rows)
        return every[taken]

    def complete(self) -> None:
        """Make the mode for which a run waits."""
        waits = int(self.work.tally[WAITS]) - 1
        if waits >= 0 and self.transitions[waits, 0] < 0:
            self.add(self.leads[waits][1])

    # The tables

    def add(self, pattern: Pattern) -> None:
        """Make the mode of a pattern: its tables, and the transitions out of it and into it."""
        here = len(self.numbers)
        self.index[pattern] = here
        self.numbers.append(self.patterns.number(pattern))
        rows, mode = self.rows, self.patterns.mode
        flow, forces = rows.flow(mode, pattern)
        conditions = np.zeros((len(self.slots), flow.shape[1]))
        conditions[:, rows.n] = np.nan  # one that is not asked for in this pattern takes no part in extremes
        ways, lengths, armed = [], [], []
        for k, part in enumerate(rows.parts):
            for way in rows.leaving(k, mode, pattern):
                target = rows.place(k, mode, pattern).put(way.phase).pattern
                if not self._may_be(target):
                    continue  # more contacts than can be held by forces of their own
                these = []
                for one in way.conditions:
                    slot = self.slots[f"{part.name}_{one.name}"]
                    conditions[slot] = one.value.values
                    these.append((slot, one.sign))
                t = len(self.leads)
                self.leads.append((here, target, part.name, tuple(these)))
                to = self.index.get(target, -1)
                if to < 0:
                    self.waiting.setdefault(target, []).append(t)
                contact = way.states is not None or self.numbers[here] == 0
                change = 0 if way.states is None else RESET
                ways.append((to, change, int(contact), 0 if way.states is None else self._map(way.states)))
                lengths.append(len(these))
                armed += [(slot, sign, 1) for slot, sign in these]
        rows.forget()
        self.transitions = np.concatenate([self.transitions, np.array(ways, dtype=np.int64).reshape(-1, 4)])
        self.conditions = np.concatenate([self.conditions, np.array(armed, dtype=np.int64).reshape(-1, 3)])
        self.lengths += lengths
        self.starts.append(len(self.leads))
        for t in self.waiting.pop(pattern, []):
            self.transitions[t, 0] = here
        self._stand(flow, conditions, self._output_rows(forces))
        self.net = self._net()

    def _may_be(self, pattern: Pattern) -> bool:
        if pattern not in self.possible:
            self.possible[pattern] = self.rows.may_hold(self.rows.held(pattern), self.patterns.mode)
        return self.possible[pattern]

    def _map(self, states: FloatArray) -> int:
        """The number of a map among those of the form; equal ones are kept once."""
        key = states.tobytes()
        if key not in self.known_maps:
            self.known_maps[key] = len(self.maps)
            self.maps.append(states)
        return self.known_maps[key]

    def _output_rows(self, forces: dict[int, Any]) -> FloatArray:
        if self.own_outputs is None:
            return np.zeros((0, self.rows.field.shape[1]))
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
        from nonsmooth.kernels.linear.layout import scratch

        n, width = self.rows.field.shape
        of_one = table_bytes(n, self.harmonics, 1) + 8 * (conditions + n + outputs) * 13 * width
        self.capacity = 2 * self.capacity or max(8, min(MOST, (free_memory() or 2**32) // (4 * of_one)))
        room_for(
            float(of_one) * self.capacity, f"the tables of {self.capacity} patterns of {n} states",
            "take fewer elements or a shorter run: it visits more patterns than there is memory for",
        )  # fmt: skip
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
        maps = np.array(self.maps)[None]

        def parts(rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
            cut = rows[..., :n], rows[..., n], rows[..., n + 1 :: 2], rows[..., n + 2 :: 2]
            a, b, c, s = (np.ascontiguousarray(part) for part in cut)
            return a, b, c, s

        def turned(waves: FloatArray) -> FloatArray:
            return np.ascontiguousarray(np.swapaxes(waves, -1, -2))

        a, b, c, s = parts(flow[None, None])
        ra, rb, rc, rs = parts(maps)
        return Form(
            a, b, turned(c), turned(s), self.multiples, self.omega, self.period,
            *parts(conditions[None]), *parts(outputs[None, :, None]), ra, rb, turned(rc), turned(rs),
            np.zeros((0, n), dtype=np.int64),
        )  # fmt: skip

    def _net(self) -> Any:
        """The transition table of the patterns that stand."""
        from nonsmooth.kernels.hybrid.records import Net

        count, n = len(self.leads), self.rows.n
        changed = np.zeros((len(self.maps), n + 1), dtype=np.int64)
        for m, states in enumerate(self.maps):
            moved = np.flatnonzero((states != self.maps[0]).any(axis=1))
            changed[m, 0], changed[m, 1 : len(moved) + 1] = len(moved), moved
        whole = np.int64
        return Net(
            self.transitions, np.concatenate([self.conditions, SECTION]), np.cumsum([0, *self.lengths], dtype=whole),
            np.array(self.starts, dtype=whole), np.arange(count, dtype=whole), np.full(count, -1.0), changed,
        )  # fmt: skip
