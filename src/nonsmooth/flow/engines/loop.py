"""Flow methods as the analyses see them; engines differ in what they give the hybrid loop, not in how it is run.

An engine is bound to one system (its parameters' values apart), one method and one tolerance. It never raises for
numerical trouble; it writes a status code (``kernels.hybrid.codes``).
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property, lru_cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.engines.engine import NO_CHANGES, Changes, KernelMarch, State, TrajectoryLog, end_if_not_wanted
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.codes import (
    BEGUN,
    CONCERNS,
    CROSSINGS,
    DEAD_END,
    MODE,
    RESET,
    STARTS,
    TIME,
    TOUCHES,
    WAITS,
)
from nonsmooth.kernels.hybrid.kept import Kept, Section
from nonsmooth.results.memory import room_for
from nonsmooth.system.derived.deciding import begun, decide
from nonsmooth.system.symbolic.traced import ALONE, ASKED, ASKS_BEHIND, OWN, TOGETHER
from nonsmooth.system.transition import phases, varying_phases

if TYPE_CHECKING:
    from nonsmooth.system.derived.assembly import Pattern
    from nonsmooth.system.derived.instants import Numbers
    from nonsmooth.system.symbolic.traced import Traced, TracedTransition

DIVERGENCE = 1e9  # in units of a state's scale
# Place 4 of ``Net.transitions``
KINDS = {ALONE: codes.ALONE, OWN: codes.OWN, ASKS_BEHIND: codes.ASKS_BEHIND}
#: Called by the thread of a run whenever it pauses.
at_pause: list[Callable[[], None]] = []


class Engine(ABC):
    """``chain`` and ``record`` of an engine over the kernels of ``kernels.hybrid``.

    An engine says which compiled module marches (:meth:`module`), and what stands for the system there: model, tables
    and work (:meth:`given`).
    """

    name: str  # "exact", "taylor" or "rkf45"
    traced: Traced
    scale: FloatArray
    net: Any  # ``kernels.records.Net``

    @abstractmethod
    def prepare(self, points: FloatArray) -> Any:
        """Tables for the parameter points ``points`` (P, n_parameters), to be passed to the calls below."""

    @abstractmethod
    def module(self) -> ModuleType:
        """The kernels of this engine's stepper."""

    @abstractmethod
    def given(self, tables: Any) -> tuple[Any, Any, Any]:
        """Model, tables and work of the kernels."""

    @abstractmethod
    def touches_of_a_leg(self) -> int:
        """Number of touches that one segment may add to a log, at most."""

    def march(self) -> KernelMarch:
        """The present thread's way into the kernels."""
        local = self._threads
        if not hasattr(local, "march"):
            local.march = KernelMarch(self.module(), self.limit)
        found: KernelMarch = local.march
        return found

    @cached_property
    def _threads(self) -> threading.local:
        return threading.local()

    def kept(self, points: int, keep: int) -> Kept:
        """Room for ``keep`` section points of each of so many runs."""
        n = len(self.scale)
        room_for(8.0 * points * keep * (n + 2), f"{points:.6g} x {keep:.6g} section points", "ask for fewer of them")
        return Kept.room(points, keep, n, n + len(self.traced.indicators) + len(self.traced.outputs))

    @property
    def own_systems(self) -> bool:
        """Return whether each point has a transition table, or all tables, of its own."""
        return self.phases is not None

    def enter(self, tables: Any, i: int, state: State) -> tuple[Any, int]:
        """Tables and row under which point i is run; the state's mode gets the number that it has there."""
        return tables, i

    def leave(self, here: Any, state: State) -> None:  # noqa: B027  most engines number modes as the system does
        """The reverse of :meth:`enter`, for a state."""

    def placed(self, here: Any, plan: Section) -> Section:
        """The section with its mode as these tables number it."""
        return plan

    def go_on(self, tables: Any, march: KernelMarch, system: Any) -> bool:
        """Give a run that has paused what it waits for; True where that exchanged model, tables or work.

        What elements decide together is asked here (:mod:`nonsmooth.system.derived.deciding`)."""
        waits = int(system[3].tally[WAITS]) - 1
        if waits < 0 or self.traced.decider is None or system[1].transitions[waits, 0] >= 0:
            return False  # nothing is asked, or it has been answered and the run has paused for another reason
        taken = self._answer(waits, tables, march, system)
        if taken >= len(self.net.transitions):
            self.traced = self.traced.decider.known()
            self.net = pack_net(self.traced)
            self.renew()
        return taken >= len(system[1].transitions)

    def _answer(self, waits: int, tables: Any, march: KernelMarch, system: Any) -> int:
        """Say where a transition that is asked leads, and which one is taken; -1 at a start."""
        decider, i, local, work = self.traced.decider, int(march.orders[0]), self._threads, system[3]
        assert decider is not None
        if getattr(local, "asked", None) != (id(tables), i):
            local.asked, local.point = (id(tables), i), decider.at_point(tables.points[i])
        starts, mode, n = bool(work.tally[STARTS]), int(work.tally[MODE]), len(self.scale)
        base, pattern = decider.modes[mode]
        memory, step = self.memory_in(work), 0.0 if starts else self.step_in(mode, system)
        numbers = local.point(mode, float(work.memo[TIME]), work.w[:n], memory, step)
        fired = int(work.tally[CONCERNS])
        met = [] if fired < 0 else decider.met(self.traced.indicator_names[fired], self.traced.indicators[fired])
        concerned = decider.concerned(waits, mode, met)
        found = begun(numbers, pattern) if starts else decide(numbers, pattern, met, concerned)
        there, taken = decider.number(base, found.pattern), -1
        self.note_zeros(there, numbers, found.pattern, work)
        if starts:
            work.tally[MODE] = there
        else:
            taken = decider.found(waits, there, found.struck, concerned)
        if taken < 0 or not found.struck:
            work.w[:n] = found.states
        work.tally[WAITS] = taken + 1
        return taken

    def renew(self) -> None:  # noqa: B027  most engines hold nothing of this kind
        """Let go of what depends on the transitions, of which there are more now."""

    def memory_in(self, work: Any) -> FloatArray:
        """The memory of the motion in the kernels' work: behind the states, or where an engine has it."""
        return np.asarray(work.w[len(self.scale) :][: len(self.traced.m)])

    def note_zeros(self, mode: int, numbers: Numbers, pattern: Pattern, work: Any) -> None:  # noqa: B027  an exact flow judges alike
        """Let a march take for zero in the mode behind an answer what is zero by the numbers asked, nothing else."""

    def step_in(self, mode: int, system: Any) -> float:
        """A time in which states change as much as they do from one step to the next."""
        return 0.0

    @cached_property
    def phases(self) -> Callable[[Any], FloatArray] | None:
        """``Net.at`` as a function of the parameters; None where no phase depends on them."""
        return varying_phases(self.traced)

    def net_of(self, tables: Any, i: int) -> Any:
        """The transition table with its phases at point i."""
        return self.net if self.phases is None else self.net._replace(at=self.phases(tables.points[i]))

    @cached_property
    def lacking(self) -> Any:
        """(modes, n) 1 where a mode has not that state."""
        return np.array(self.traced.lacking, dtype=np.int64).reshape(len(self.traced.mode_names), -1)

    def hide(self, u: FloatArray, modes: Any) -> None:
        """Make NaN of the states that their modes lack, as results show them."""
        if self.lacking.any():
            u[self.lacking[modes] == 1] = np.nan

    @cached_property
    def _none(self) -> Any:
        """No samples, no crossings, no touches: of most runs from one sample of a controller to the next."""
        n_u, n_m = len(self.scale), len(self.traced.m)
        return _samples(np.empty(0), n_u, n_m), _crossings(0, n_u, n_m), _touches(0, n_u)

    @cached_property
    def limit(self) -> FloatArray:
        return DIVERGENCE * np.asarray(self.scale, dtype=float)

    def system(self, tables: Any, i: int, indicator: int = -1) -> tuple[Any, Any, Any, Any]:
        """Model, transition table with a section's indicator, tables and work: what a march is given."""
        model, own, work = self.given(tables)
        net, local = self.net_of(tables, i), self._threads
        if indicator >= 0:
            known = getattr(local, "section", None)
            if known is None or known[0] is not net or known[1] != indicator:
                rows = net.rows.copy()
                rows[-2:, 0] = indicator  # the last two are the section's (rising, falling)
                local.section = net, indicator, net._replace(rows=rows)
            net = local.section[2]
        return model, net, own, work

    def chain(
        self,
        tables: Any,
        first: int,
        last: int,
        state: State,
        starts: FloatArray | None,
        plan: Section,
        transient: int,
        keep: int,
        out: Kept,
    ) -> None:
        """Points ``first <= i < last``: run ``transient`` section returns, then ``keep`` more into ``out``.

        With ``starts`` None each point goes on from ``state`` (carried along, left at the end of the last point); else
        point i begins afresh at ``starts[i]`` in the first mode, at t = 0. Releases the GIL. A point that fails gets
        its status; the next carried one then starts from the last finite state of the previous good point."""
        if self.phases is not None and last - first > 1:  # each point has a net of its own
            for i in range(first, last):
                self.chain(tables, i, i + 1, state, starts, plan, transient, keep, out)
            return
        carry, clock = starts is None, state.clock.copy()
        if carry:
            state.keep_phase(float(tables.period[first]), plan.phase if plan.indicator < 0 else -1.0)
            state.clock[2] = 0.0  # for the kernel: done, take the time as it stands
        if starts is not None:  # every start begins with the memory that is given
            starts = np.ascontiguousarray(np.hstack([starts, np.tile(state.memory, (len(starts), 1))]), dtype=float)
        state.counters[1] = int(carry and state.settled)
        march = self.march()
        march.returns(first, last, state, starts, self.placed(tables, plan), transient, keep, out)
        self._run(march, tables, plan.indicator)
        if carry:
            state.settled = True
            if state.clock[2] == 0.0 and tables.period[last - 1] < np.inf:
                state.clock[:] = clock  # failed at the first point: nothing was written

    def _run(self, march: KernelMarch, tables: Any, indicator: int = -1) -> tuple[int, Any]:
        """March until the goal is reached or a log is full; Ctrl-C comes in between. Returns the code, and the work."""
        system = self.system(tables, int(march.orders[0]), indicator)
        system[3].tally[BEGUN] = system[3].tally[STARTS] = system[3].tally[WAITS] = 0
        return self._go_on(march, tables, indicator, system)

    def _go_on(self, march: KernelMarch, tables: Any, indicator: int, system: Any) -> tuple[int, Any]:
        code = codes.PAUSED
        while code == codes.PAUSED:
            code = march.run(system)
            if self.go_on(tables, march, system):
                system = self.system(tables, int(march.orders[0]), indicator)
            end_if_not_wanted()
            for look in at_pause:
                look()
        return code, system

    def room(self, tables: Any) -> Any:
        """Memory of :meth:`record` for many short runs with the same tables, which it would else make each time."""
        n_u, n_m = len(self.scale), len(self.traced.m)
        return [_crossings(1024, n_u, n_m), _touches(1024, n_u)]

    def record(
        self,
        tables: Any,
        state: State,
        until: float,
        samples: FloatArray,
        room: Any = None,
        changes: Changes | None = None,
        most: float = np.inf,
    ) -> TrajectoryLog:
        """Point 0: march ``state`` to the time ``until``, with dense samples at the increasing absolute times
        ``samples`` (a sample exactly at a crossing is the limit after it). A state that a mode lacks is NaN.

        States that stand for inputs are given new values at the times of ``changes``. A run of more than ``most`` steps
        is given up (``codes.NO_CONVERGENCE``)."""
        from nonsmooth.kernels.hybrid import records

        n, n_u, n_m = len(samples), len(self.scale), len(self.traced.m)
        sampled = _samples(samples, n_u, n_m) if n else self._none[0]
        crossings, touches = Engine.room(self, tables) if room is None else room
        spare, march = self.touches_of_a_leg(), self.march()
        given, limit = NO_CHANGES if changes is None else changes, self.limit
        if changes is not None:  # inputs are as large as they were given
            limit = np.where(np.arange(n_u) < changes.first, limit, np.inf)
        state.counters[1] = int(state.settled)
        march.logged(state, float(until), limit, most)
        march.log.put(records.Log(*(*sampled, *crossings, *touches, spare, *given)))
        code, system = self._run(march, tables)
        while code == codes.LOG_FULL:
            crossings = _longer(crossings, _crossings(2 * len(crossings[0]), n_u, n_m))
            touches = _longer(touches, _touches(2 * len(touches[0]) + spare, n_u))
            march.log.put(records.Log(*(*sampled, *crossings, *touches, spare, *given)))
            code, system = self._go_on(march, tables, -1, system)
        state.settled = True
        tally = system[3].tally
        n_c, n_t = tally[CROSSINGS], tally[TOUCHES]
        taken = [part[:n_c].copy() for part in crossings] if n_c else self._none[1]
        touched = self._none[2]
        if n_t:
            by_time = np.argsort(touches[0][:n_t], kind="stable")  # those of a segment come by condition
            touched = [part[by_time] for part in touches]
        log = TrajectoryLog(*(*sampled[1:], *taken, *touched, int(code)))
        if self.lacking.any():
            self.hide(log.sample_u, log.sample_mode)
            jumps = [self.traced.transitions[k] for k in log.crossing_transition]
            self.hide(log.u_before, [jump.source for jump in jumps])
            self.hide(log.u_after, [jump.target for jump in jumps])
        return log


def _samples(instants: FloatArray, n: int, n_memory: int) -> list[Any]:
    """Instants, and room for states, memory, mode and number of crossings there."""
    size = len(instants)
    return [
        np.ascontiguousarray(instants, dtype=float),
        np.full((size, n), np.nan),
        np.full((size, n_memory), np.nan),
        np.full(size, -1, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
    ]


def _crossings(size: int, n: int, n_memory: int) -> list[Any]:
    """Room for crossings: time, transition, states before and after, memory after."""
    return [
        np.zeros(size),
        np.zeros(size, dtype=np.int64),
        np.zeros((size, n)),
        np.zeros((size, n)),
        np.zeros((size, n_memory)),
    ]


def _touches(size: int, n: int) -> list[Any]:
    """Room for touches: time, indicator, states, clearance."""
    return [np.zeros(size), np.zeros(size, dtype=np.int64), np.zeros((size, n)), np.zeros(size)]


def _longer(old: list[Any], new: list[Any]) -> list[Any]:
    for one, other in zip(old, new, strict=True):
        other[: len(one)] = one
    return new


def _change(traced: Traced, jump: TracedTransition) -> int:
    """Place 1 of ``Net.transitions``: RESET, or 2 for one that also happens where it holds at a start already.

    It writes memory, or begins states that its source lacks."""
    if not traced.keeps(jump):
        return RESET
    return 0 if jump.reset is None and not jump.writes else 2


@lru_cache(maxsize=32)
def pack_net(traced: Traced) -> Any:
    """The transition table (``kernels.records.Net``), with two more rows for a section.

    Phases that depend on the parameters are zero here; see :meth:`Engine.net_of`."""
    from nonsmooth.kernels.hybrid.records import Net

    integer, jumps, modes = np.int64, traced.transitions, range(len(traced.mode_names))
    plain, maps = traced.without_answers()
    transitions = np.array(
        [
            (
                -1 if t.kind in (ASKED, TOGETHER) else t.target,
                _change(traced, t),
                DEAD_END if traced.ends(t) else t.contact,
                j,
                KINDS.get(t.kind, 0),
            )
            for j, t in zip(maps, jumps, strict=True)
        ],
        dtype=integer,
    ).reshape(-1, 5)
    rows = [(r.indicator, r.sign, r.strict) for t in jumps for r in t.rows if t.fires]
    row_start = np.cumsum([0] + [len(t.rows) if t.fires else 0 for t in jumps], dtype=integer)
    leaving = [[j for j, t in enumerate(jumps) if t.source == m and t.fires] for m in modes]
    mode_start = np.cumsum([0] + [len(one) for one in leaving], dtype=integer)
    mode_list = np.array([j for one in leaving for j in one], dtype=integer)
    both = np.array([*rows, (0, 1, 1), (0, -1, 1)], dtype=integer).reshape(-1, 3)
    changed = np.zeros((len(plain.transitions), len(traced.u) + len(traced.m) + 1), dtype=integer)
    for j, t in enumerate(plain.transitions):
        moved = [i for i, e in enumerate(t.reset or ()) if e != traced.u[i]]
        moved += [len(traced.u) + i for i, _ in t.writes]
        changed[j, : len(moved) + 1] = [len(moved), *moved]
    asked = {t.source: j for j, t in enumerate(jumps) if t.kind == TOGETHER}
    meets = [[row.indicator for row in jumps[asked[m]].rows] if m in asked else [] for m in modes]
    return Net(
        transitions,
        both,
        row_start,
        mode_start,
        mode_list,
        phases(traced),
        changed,
        np.array([f for one in meets for f in one], dtype=integer),
        np.cumsum([0] + [len(one) for one in meets], dtype=integer),
        np.array([asked.get(m, -1) for m in modes], dtype=integer),
    )
