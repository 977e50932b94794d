"""Jobs on a stroboscopic section in one compiled call, with the march of an engine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settled import Settled
from nonsmooth.flow.engines.engine import Chain, FloatArray, IntArray, SectionPlan, State
from nonsmooth.flow.engines.loop import LoopEngine
from nonsmooth.kernels.hybrid.stopping import flag

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Rules

__all__ = ["exponents_compiled", "load", "run_compiled"]


def load(engine: LoopEngine) -> None:
    """Compile or load what the jobs of an engine need."""
    from nonsmooth.kernels.compile.cache import compiled
    from nonsmooth.kernels.judging import driver

    for kernel in (engine.module().run, driver.settle_many, driver.separate_many):
        compiled(kernel)


def run_compiled(
    engine: LoopEngine, points: FloatArray, rows: IntArray, starts: FloatArray, memory: FloatArray, modes: IntArray,
    begin: float, phase: float, carried: bool, extremes: bool, rules: Rules,
) -> Settled:  # fmt: skip
    """Jobs settled and judged, as :meth:`nonsmooth.attractors.settler.Settler.run` describes."""
    from nonsmooth.kernels.judging.driver import settle_many
    from nonsmooth.kernels.judging.settle import new_jobs

    n = len(engine.scale)
    runs = _Runs(engine, points, phase, memory, rules.keep, rules.max_period)
    jobs, found = new_jobs(len(rows), n, rules.max_period), Settled.empty(len(rows), n, n + len(memory))
    settle_many(
        (rows, starts, np.full(len(rows), begin), modes), phase, int(carried), int(extremes), rules, jobs, runs.record,
        (np.zeros((n + 1, n)), np.zeros((2, n, n))),
        (found.crossings, found.contacts, found.maximum, found.minimum, found.last, found.mode),
    )  # fmt: skip
    return found.judged(jobs)


def exponents_compiled(
    engine: LoopEngine, points: FloatArray, rows: IntArray, starts: FloatArray, memory: FloatArray, modes: IntArray,
    returns: int, batch: int, phase: float, size: FloatArray, offsets: FloatArray, sums: FloatArray,
) -> IntArray:  # fmt: skip
    """Growth of neighbours of jobs, taken into their sums (``kernels.judging.exponent``); their statuses."""
    from nonsmooth.kernels.judging.driver import separate_many

    status = np.zeros(len(rows), dtype=np.int64)
    runs = _Runs(engine, points, phase, memory, 1, 1)
    separate_many(
        (rows, starts, np.full(len(rows), phase), modes), returns, batch, size, runs.record, offsets, sums, status
    )
    return status


class _Runs:
    """The record of an engine's march for the compiled loops (``kernels.judging.driver.Runs``), and what it reads."""

    def __init__(
        self, engine: LoopEngine, points: FloatArray, phase: float, memory: FloatArray, keep: int, cycle: int
    ) -> None:
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.compile.pointers import addresses
        from nonsmooth.kernels.hybrid.blocks import call_block, kept_block
        from nonsmooth.kernels.judging.driver import Runs

        n, traced, self.tables = len(engine.scale), engine.traced, engine.prepare(points)
        plan, self.march = SectionPlan(phase=phase, extremes=False), engine.march()
        system = engine.system(self.tables, 0)
        chains = [
            Chain.empty(len(points), size, n, len(traced.indicators), engine.outputs_of(self.tables))
            for size in (keep, cycle)
        ]
        states = [State(np.zeros(n), memory.copy()) for _ in range(2)]
        self.blocks = call_block(), kept_block()
        self.march.returns(0, 0, states[0], None, plan, 0, 0, chains[0])
        first = self.march.call.record
        other = first._replace(motion=states[1].motion())
        addresses_ = [
            self.march.system.put(system), self.march.call.address, self.blocks[0].put(other),
            self.march.kept.address, self.blocks[1].put(chains[1].record()), self.march.log.address,
            self.march.growth.address,
        ]  # fmt: skip
        system[3].tally[0] = 0
        self.record = Runs(
            addresses(compiled(engine.module().run)), _together(addresses_), self.march.orders, system[3].tally,
            self.tables.period, memory, flag(), first.motion, other.motion, chains[0].record(), chains[1].record(),
        )  # fmt: skip


def _together(addresses: list[Any]) -> Any:
    """Addresses as an array; where nothing is compiled they are the blocks themselves."""
    return np.array(addresses, dtype=np.int64) if isinstance(addresses[0], int) else addresses
