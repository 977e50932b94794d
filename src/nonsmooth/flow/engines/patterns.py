"""The engine of systems whose modes are made when they are first visited (:mod:`nonsmooth.system.derived.patterns`).

It is that of the exact flow; only the tables grow (:mod:`nonsmooth.flow.engines.pattern_tables`). A run that is about
to enter a pattern without tables pauses, they are put behind those that stand, and it goes on. What leaves the engine
has the numbers of patterns that all points share.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import Changes, FloatArray, KernelMarch, Points, State, TrajectoryLog
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.pattern_tables import PatternTables
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Kept, Section

if TYPE_CHECKING:
    from nonsmooth.system.derived.patterns import Patterns
    from nonsmooth.system.symbolic.traced import Traced


@dataclass
class PatternEngine(Engine):
    """``Engine`` over ``kernels.linear`` for a system whose patterns are made when they are visited."""

    traced: Traced
    patterns: Patterns
    scale: FloatArray  # (n,)
    name: str = "exact"

    def prepare(self, points: FloatArray) -> Points:
        form = self.patterns.form.evaluate(points)
        return Points(np.asarray(points, dtype=float), form.period, form)

    def module(self) -> ModuleType:
        from nonsmooth.kernels.compile.assembly import linear_module

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

    def placed(self, here: PatternTables, plan: Section) -> Section:
        return plan if plan.mode < 0 else plan._replace(mode=here.place(self.patterns.visited[plan.mode]))

    def touches_of_a_leg(self) -> int:
        """None: an extremum of each condition of each element, in a hundred states, would fill the memory."""
        return 0

    def go_on(self, tables: Any, march: KernelMarch, system: Any) -> bool:
        tables.complete()
        return True

    def chain(
        self,
        tables: Points,
        first: int,
        last: int,
        state: State,
        starts: FloatArray | None,
        plan: Section,
        transient: int,
        keep: int,
        out: Kept,
    ) -> None:
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

    def record(
        self,
        tables: Points,
        state: State,
        until: float,
        samples: FloatArray,
        room: Any = None,
        changes: Changes | None = None,
        most: float = np.inf,
    ) -> TrajectoryLog:
        here, _ = self.enter(tables, 0, state)
        log = super().record(here, state, until, samples, changes=changes, most=most)
        here.leave(state)
        numbers = np.array(here.numbers, dtype=np.int64)
        log.sample_mode = np.where(log.sample_mode < 0, -1, numbers[log.sample_mode])
        log.crossing_transition = here.transitions_of(log.crossing_transition)
        return log

    def _at(self, tables: Points, i: int) -> PatternTables:
        """The present thread's tables of point i; those of another point give way."""
        if getattr(tables.local, "i", None) != i:
            tables.local.tables = None
            tables.local.tables, tables.local.i = PatternTables(self.patterns, tables, i), i
        found: PatternTables = tables.local.tables
        return found
