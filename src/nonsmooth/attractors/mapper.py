"""The compiled driver of transients, judgements and perturbations, over the parameter points of an engine."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settled import Settled
from nonsmooth.flow.engines.engine import FloatArray, IntArray, KernelMarch, State, end_if_not_wanted, flag
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.codes import BEGUN, STARTS, WAITS
from nonsmooth.kernels.hybrid.kept import Kept

if TYPE_CHECKING:
    from nonsmooth.attractors.settler import Settler
    from nonsmooth.kernels.judging.settle import Rules


class Mapper:
    """Jobs of one thread, run one after the other: each from its place (see ``trace``) at its parameter point.

    Parameters
    ----------
    rows, places, modes, begin
        Parameter point, place and mode of each job; the phase of the forcing at which they begin.
    kept, into
        Room for the kept returns, and the row of each job there; one row for all where not given.
    """

    def __init__(
        self,
        settler: Settler,
        tables: Any,
        rows: IntArray,
        places: FloatArray,
        modes: IntArray | None = None,
        begin: float = 0.0,
        kept: Kept | None = None,
        into: IntArray | None = None,
    ) -> None:
        from nonsmooth.kernels.judging.judge import ROUNDS

        engine, plan, memory = settler.engine, settler.plan, settler.system.memory_vector()
        passes = max(settler.max_period * plan.every, 1)
        self.engine, self.tables, self.settler, self.memory, self.rows = engine, tables, settler, memory, rows
        self.kept = engine.kept(1, settler.keep) if kept is None else kept
        none = np.zeros(len(rows), dtype=np.int64)
        modes = none.copy() if modes is None else modes.copy()
        self.starts = rows.copy(), places, np.full(len(rows), begin), modes, none if into is None else into
        self.rooms = engine.kept(1, passes), engine.kept(1, 1 if plan.indicator < 0 else ROUNDS * passes + 2)
        self.states = [State(np.zeros(len(engine.scale)), memory.copy()) for _ in range(2)]
        self.at = np.zeros(5, dtype=np.int64)
        self.runs: Any = None
        self.system: Any = None
        self.found: Settled | None = None
        self.march = KernelMarch(engine.module(), engine.limit)

    def settle(self, rules: Rules, carried: int, extremes: bool) -> Callable[[int], None]:
        """Return a function that settles the jobs before a number; see ``kernels.judging.driver.settle_many``."""
        from nonsmooth.kernels.judging.driver import settle_many
        from nonsmooth.kernels.judging.settle import new_jobs

        n, plan = len(self.engine.scale), self.settler.plan
        self.jobs = new_jobs(len(self.rows), n, rules.max_period)
        found = Settled.empty(len(self.rows), n, self.settler.width)
        phase, self.found = -1.0 if plan.indicator >= 0 else plan.phase, found
        work = np.zeros((n + 1, n)), np.zeros((2, n, n))
        results = found.crossings, found.contacts, found.maximum, found.minimum, found.last, found.mode

        def call(runs: Any) -> int:
            options = phase, carried, int(extremes), rules, self.jobs
            return int(settle_many(self.starts, *options, runs, self.at, work, results))

        return partial(self._run, call)

    def settled(self) -> Settled:
        """Return the results of the jobs."""
        assert self.found is not None
        return self.found.judged(self.jobs)

    def separate(self, returns: int, batch: int, sizes: FloatArray, offsets: FloatArray, sums: FloatArray) -> IntArray:
        """Take the growth of neighbours of the jobs into their sums (``kernels.judging.judge``); their statuses."""
        from nonsmooth.kernels.judging.driver import separate_many

        status = np.zeros(len(self.rows), dtype=np.int64)
        self._run(
            lambda runs: separate_many(self.starts, returns, batch, sizes, runs, self.at, offsets, sums, status),
            len(status),
        )
        return status

    def _run(self, call: Callable[[Any], int], stop: int) -> None:
        """Run the jobs before ``stop``: where each point has a system of its own, one by one."""
        engine, state, (rows, _, _, modes, _) = self.engine, self.states[0], self.starts
        while self.at[0] < stop:
            j = int(self.at[0])
            self.at[1], here, row = stop, self.tables, int(self.rows[j])
            if engine.own_systems:
                begin, self.at[1] = State(state.u, state.memory), j + 1
                begin.counters[0] = modes[j]
                engine.enter(here, row, begin)
                here, rows[j] = engine.enter(here, row, state)
                modes[j], row = begin.counters[0], int(rows[j])
            if engine.own_systems or self.runs is None:
                self.runs = self._bound(here, row)
            self.runs.tally[BEGUN] = self.runs.tally[STARTS] = self.runs.tally[WAITS] = 0
            while call(self.runs) == codes.PAUSED:
                if engine.go_on(here, self.march, self.system):
                    self.runs = self.runs._replace(tally=self._system(here, row)[3].tally)
                end_if_not_wanted()
            if engine.own_systems:
                engine.leave(here, state)
                if self.found is not None and int(self.at[0]) > j:  # modes have the numbers that all points share
                    begin.counters[0] = self.found.mode[j]
                    engine.leave(here, begin)
                    self.found.mode[j] = begin.counters[0]

    def _system(self, tables: Any, row: int) -> Any:
        self.system = self.engine.system(tables, row, self.settler.plan.indicator)
        self.march.system.put(self.system)
        return self.system

    def _bound(self, tables: Any, row: int) -> Any:
        """The record of the engine's march for the compiled loops (``kernels.judging.driver.Runs``)."""
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.compile.pointers import Block, addresses
        from nonsmooth.kernels.hybrid import records
        from nonsmooth.kernels.judging.driver import Runs

        march, plan, (one, other) = self.march, self.engine.placed(tables, self.settler.plan), self.states
        march.returns(0, 0, one, None, plan, 0, 0, self.kept)
        first, work = march.call.record, self._system(tables, row)[3]
        second = first._replace(motion=other.motion())
        kept = [Block(records.KEPT, records.put_kept) for _ in self.rooms]
        self.blocks = Block(records.CALL, records.put_call), *kept
        found = [
            march.system.address,
            march.log.address,
            march.growth.address,
            march.kept.address,
            march.call.address,
            *(block.put(record) for block, record in zip(self.blocks, (second, *self.rooms), strict=True)),
        ]
        return Runs(
            addresses(compiled(self.engine.module().run)),
            np.array(found, dtype=np.int64) if isinstance(found[0], int) else found,  # else nothing is compiled
            march.orders,
            march.reals,
            plan.every,
            int(plan.extremes),
            work.tally,
            tables.period,
            self.memory,
            flag(),
            first.motion,
            second.motion,
            self.kept,
            *self.rooms,
        )
