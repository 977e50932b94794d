"""Records in which an engine is asked for runs and answers; a thread's calls of its march, and whether it is wanted.

Ctrl-C reaches the main thread only, and a kernel that runs in another one hears nothing of it.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.kernels.hybrid.codes import GROW, LOGGED, NO_CONVERGENCE, PAUSED, RETURNS_OF_SECTION, WAITS
from nonsmooth.kernels.hybrid.kept import Kept, Section

IntArray = NDArray[np.int64]


@dataclass
class State:
    """Place of a trajectory: everything needed to go on. Kernels read and write it in place.

    ``clock[0]`` is the time since the start of the current forcing period (autonomous: the time), ``clock[1]``
    the number of whole periods before it, so that no digits are lost in long runs: t = clock[1] * T + clock[0].
    ``clock[2]`` is the period T in which clock[0] was measured (0: none yet), so that a carried state keeps its
    phase when the forcing frequency changes. ``counters``: [mode, and three places that an engine may use].
    """

    u: FloatArray  # (n,)
    memory: FloatArray  # (n_memory,)
    clock: FloatArray = field(default_factory=lambda: np.zeros(3))
    counters: IntArray = field(default_factory=lambda: np.array([0, -1, 0, 0], dtype=np.int64))
    settled: bool = False  # False: the start rules (transitions that already hold) are still to be applied

    def keep_phase(self, period: float, phase: float) -> None:
        """Go on under a forcing of another period at equal phase of it.

        ``phase`` is that of the section (negative: none): a state left there stays exactly there, else rounding could
        count the same point as a return once more."""
        if not period < np.inf:
            self.clock[2] = 0.0
            return
        if self.clock[2] > 0.0:
            self.clock[0] *= period / self.clock[2]
        if phase >= 0.0 and abs(self.clock[0] - phase * period) <= 1e-12 * period:
            self.clock[0] = phase * period
        self.clock[2] = period

    def motion(self) -> Any:
        """The same arrays as the kernels take them (``kernels.records.Motion``)."""
        from nonsmooth.kernels.hybrid.records import Motion

        return Motion(self.u, self.memory, self.clock, self.counters)

    @property
    def place(self) -> FloatArray:
        """The states, then the memory."""
        return np.concatenate([self.u, self.memory])

    def copy(self) -> State:
        return State(self.u.copy(), self.memory.copy(), self.clock.copy(), self.counters.copy(), self.settled)


@dataclass
class Points:
    """Parameter points as an engine prepares them, shared by threads: what stands for the system there, its sizes, and
    what each thread keeps beside them."""

    points: FloatArray  # (P, n_parameters)
    period: FloatArray  # (P,), inf where autonomous
    form: Any = None  # ``kernels.records.Form``
    sizes: tuple[int, ...] = ()  # modes, indicators, outputs, rows of conditions
    local: threading.local = field(default_factory=threading.local)


class Changes(NamedTuple):
    """Instants (K,) at which states that stand for inputs change, their values (K, m) from then on, and the number of
    the first of these states."""

    times: FloatArray
    values: FloatArray
    first: int


NO_CHANGES = Changes(np.zeros(0), np.zeros((0, 0)), 0)


@dataclass
class TrajectoryLog:
    """Everything that ``record`` collected, already trimmed: samples at the times asked for, crossings and touches."""

    sample_u: FloatArray  # (n_samples, n)
    sample_memory: FloatArray  # (n_samples, n_memory)
    sample_mode: IntArray  # (n_samples,)
    sample_segment: IntArray  # (n_samples,) number of crossings before the sample
    crossing_time: FloatArray  # (n_crossings,)
    crossing_transition: IntArray
    u_before: FloatArray  # (n_crossings, n)
    u_after: FloatArray
    memory_after: FloatArray  # (n_crossings, n_memory)
    touch_time: FloatArray  # (n_touches,) non-crossing maxima of an armed indicator row
    touch_indicator: IntArray
    touch_u: FloatArray  # (n_touches, n)
    touch_clearance: FloatArray  # (n_touches,) = -(sign * indicator) > 0 at the extremum
    status: int


PATIENCE = 50_000  # steps of a run between two looks whether somebody wants to stop it: seconds of the slowest
_NO_STARTS = np.zeros((0, 0))


class KernelMarch:
    """The blocks of one thread, over the kernels of one stepper (``linear_module`` or ``series_module``)."""

    def __init__(self, module: ModuleType, limit: FloatArray) -> None:
        from nonsmooth.kernels.compile.pointers import Block
        from nonsmooth.kernels.hybrid import records

        self.module, self.limit = module, limit
        self.system = Block(module.SYSTEM, module.put_system)
        self.call, self.kept = Block(records.CALL, records.put_call), Block(records.KEPT, records.put_kept)
        self.log, self.growth = Block(records.LOG, records.put_log), Block(records.GROWTH, records.put_growth)
        self.kept.put(Kept.room(1, 0, 0, 0))  # a run that keeps nothing looks at its row as well
        self.orders, self.reals = np.zeros(records.N_ORDERS, dtype=np.int64), np.zeros(records.N_REALS)
        self.left = np.inf  # steps after which a run is given up

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

    def logged(self, state: State, until: float, limit: FloatArray, most: float = np.inf) -> None:
        """Ask for the log of point 0 to a time, of states within a limit, in so many steps (in whole ``PATIENCE``)."""
        self._anywhere(0, LOGGED, 0)
        self.reals[:] = until, 0.0, -1.0, 0.0
        self._ask(state, _NO_STARTS, most, limit)

    def grown(self, i: int, state: State, count: int, unit: float, growth: Any) -> None:
        """Ask for ``count`` units of time of point i with its frame (``records.Growth``)."""
        self._anywhere(i, GROW, count)
        self.reals[:] = 0.0, unit, -1.0, 0.0
        self.growth.put(growth)
        self._ask(state, _NO_STARTS)

    def run(self, system: tuple[Any, Any, Any, Any]) -> int:
        """March what is asked for (model, transition table, tables, work). Returns a code of ``kernels.hybrid``."""
        blocks = self.call, self.kept, self.log, self.growth
        code = int(self.module.run(self.system.put(system), *(block.address for block in blocks)))
        if code == PAUSED and system[3].tally[WAITS] == 0:  # for no answer
            self.left -= PATIENCE
        return code if self.left >= 0 else NO_CONVERGENCE

    def _anywhere(self, i: int, kind: int, keep: int) -> None:
        """A run that knows no section."""
        self.orders[:] = i, i + 1, kind, 0, keep, PATIENCE, -1, 0, -1, 0, 1, 0, 0, -1

    def _ask(self, state: State, starts: FloatArray, most: float = np.inf, limit: FloatArray | None = None) -> None:
        from nonsmooth.kernels.hybrid.records import Call

        self.left = most
        self.call.put(Call(self.orders, self.reals, self.limit if limit is None else limit, starts, state.motion()))


_of_thread = threading.local()


def obey(array: Any) -> None:
    """From here on kernels of this thread end soon after ``array[0]`` has become 1."""
    _of_thread.flag = array


def flag() -> Any:
    """The flag of this thread, an array of one integer: 1 where its work is not wanted any more."""
    if not hasattr(_of_thread, "flag"):
        _of_thread.flag = np.zeros(1, dtype=np.int64)
    return _of_thread.flag


def end_if_not_wanted() -> None:
    """Raise KeyboardInterrupt where the work of this thread is not wanted any more."""
    if flag()[0]:
        raise KeyboardInterrupt
