"""One thread's calls of an engine's compiled march: the blocks of memory that it reads and writes."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.kernels.hybrid.places import GROW, LOGGED, RETURNS_OF_SECTION

PATIENCE = 50_000  # steps of a run between two looks whether somebody wants to stop it: seconds of the slowest
_NO_STARTS = np.zeros((0, 0))


class KernelMarch:
    """The blocks of one thread, over the kernels of one stepper (``linear_module`` or ``series_module``)."""

    def __init__(self, module: ModuleType, limit: FloatArray) -> None:
        from nonsmooth.kernels.compile.pointers import Block
        from nonsmooth.kernels.hybrid import blocks, records

        self.module, self.limit = module, limit
        self.system = Block(module.SYSTEM, module.put_system)
        self.call, self.kept = Block(records.CALL, blocks.put_call), Block(records.KEPT, blocks.put_kept)
        self.log, self.growth = Block(records.LOG, blocks.put_log), Block(records.GROWTH, blocks.put_growth)
        self.orders, self.reals = np.zeros(records.N_ORDERS, dtype=np.int64), np.zeros(records.N_REALS)

    def returns(
        self,
        first: int,
        last: int,
        state: State,
        starts: FloatArray | None,
        plan: Section,
        transient: int,
        keep: int,
        out: Kept,
    ) -> None:
        """Ask for section returns of some points; see :class:`nonsmooth.flow.engines.loop.Engine`."""
        self.orders[:] = (
            first,
            last,
            RETURNS_OF_SECTION,
            transient,
            keep,
            PATIENCE,
            plan.indicator,
            plan.rising,
            plan.mode,
            plan.after,
            plan.every,
            plan.extremes,
            plan.repeats and plan.indicator < 0,
            -1,
        )
        phase = plan.phase if plan.indicator < 0 else -1.0
        self.reals[:] = 0.0, 0.0, phase, min(plan.t_max, 1e300)
        self.kept.put(out)
        self._ask(state, _NO_STARTS if starts is None else starts)

    def logged(self, state: State, until: float) -> None:
        """Ask for the log of point 0 to a time."""
        self._anywhere(0, LOGGED, 0)
        self.reals[:] = until, 0.0, -1.0, 0.0
        self._ask(state, _NO_STARTS)

    def grown(self, i: int, state: State, count: int, unit: float, growth: Any) -> None:
        """Ask for ``count`` units of time of point i with its frame (``records.Growth``)."""
        self._anywhere(i, GROW, count)
        self.reals[:] = 0.0, unit, -1.0, 0.0
        self.growth.put(growth)
        self._ask(state, _NO_STARTS)

    def run(self, system: tuple[Any, Any, Any, Any]) -> int:
        """March what is asked for (model, transition table, tables, work). Returns a code of ``kernels.hybrid``."""
        blocks = self.call, self.kept, self.log, self.growth
        return int(self.module.run(self.system.put(system), *(block.address for block in blocks)))

    def _anywhere(self, i: int, kind: int, keep: int) -> None:
        """A run that knows no section."""
        self.orders[:] = i, i + 1, kind, 0, keep, PATIENCE, -1, 0, -1, 0, 1, 0, 0, -1

    def _ask(self, state: State, starts: FloatArray) -> None:
        from nonsmooth.kernels.hybrid.records import Call

        self.call.put(Call(self.orders, self.reals, self.limit, starts, state.motion()))
