"""The engine of the exact flow: linear modes with harmonic forcing, affine indicators and resets, any number of states.

It only packs a system into the arrays of ``kernels.linear_module`` and unpacks what comes back. Memory travels there as
states behind the others, that nothing but transitions changes.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engine import Chain, FloatArray, Log, SectionPlan, State
from nonsmooth.kernels import codes
from nonsmooth.kernels.run_places import BEGUN, CROSSINGS, PATIENCE, TOUCHES

if TYPE_CHECKING:
    from nonsmooth.system.linear import LinearForm
    from nonsmooth.system.traced import Traced

__all__ = ["LinearEngine", "PlanarEngine", "is_linear"]

DIVERGENCE = 1e9  # in units of a state's scale
LARGEST = 64e6  # bytes of the tables of all modes


def is_linear(traced: Traced, form: LinearForm | None) -> bool:
    """Whether the fast kernel covers the system: fields, indicators, resets and what is written to memory all affine.

    It notes the modes of a start rule as bits of one integer: 62 modes at most."""
    return (
        form is not None
        and len(traced.mode_names) <= 62
        and table_bytes(len(traced.u) + len(traced.m), len(form.multiples), len(traced.mode_names)) <= LARGEST
        and form.affine_indicators
        and form.affine_resets
    )


def table_bytes(states: int, harmonics: int, modes: int) -> int:
    """Memory of the propagators, which are most of the tables."""
    return 8 * modes * 33 * states * (states + 1 + 2 * harmonics)


@dataclass
class Tables:
    """Arrays of the kernel for P parameter points, and scratch memory for each thread that asks for it."""

    points: FloatArray
    form: Any  # ``kernels.records.Form``
    period: FloatArray
    sizes: tuple[int, int, int, int]
    harmonics: int

    local: threading.local = field(default_factory=threading.local)

    def module(self, observer: str = "sections") -> ModuleType:
        """The kernels that observe a run in that way."""
        from nonsmooth.kernels.linear_module import linear_module

        return linear_module(self.form.A.shape[-1], self.harmonics, observer)

    def scratch(self, observer: str = "sections") -> tuple[Any, Any]:
        """The present thread's tables and work arrays; the kernel keeps the tables of the last point in them."""
        if not hasattr(self.local, "work"):
            self.local.work = self.module(observer).scratch(*self.sizes)
        work: tuple[Any, Any] = self.local.work
        return work


@dataclass
class LinearEngine:
    """``Engine`` over ``kernels.linear_module`` for one system's traced form."""

    traced: Traced
    form: LinearForm
    scale: FloatArray  # (n,)
    name: str = "exact"
    net: Any = field(init=False)  # ``kernels.records.Net``
    limit: FloatArray = field(init=False)  # (n + memory,) sizes beyond which a run has diverged

    def __post_init__(self) -> None:
        self.net = pack_net(self.traced)
        self.limit = np.append(DIVERGENCE * self.scale, np.full(len(self.traced.m), np.inf))

    @property
    def is_plain(self) -> bool:
        """Whether there is no memory and every mode has every state."""
        return not self.net.lacking.any()

    def prepare(self, points: FloatArray) -> Tables:
        t = self.form.evaluate(points)
        n_points, n_modes = t.b.shape[:2]
        n_i, n_h = t.ia.shape[1], len(self.form.multiples)
        if self.form.affine_outputs:
            outputs = (t.oa, t.ob, t.oc, t.os)
        else:
            shape = (n_points, 0, n_modes)
            waves = np.zeros((*shape, n_h))
            outputs = (np.zeros((*shape, len(self.limit))), np.zeros(shape), waves, waves)
        multiples = np.array(self.form.multiples, dtype=np.int64)
        with np.errstate(divide="ignore"):
            period = np.where(t.omega > 0.0, 2.0 * np.pi / t.omega, np.inf)
        from nonsmooth.kernels.cache import compiled
        from nonsmooth.kernels.linear_module import linear_module
        from nonsmooth.kernels.records import Form

        form = Form(
            t.A, t.b, t.c, t.s, multiples, t.omega, period,
            t.ia, t.ib, t.ic, t.is_, *outputs, t.ra, t.rb, t.rc, t.rs,
        )  # fmt: skip
        if n_points > 1:  # threads may share them
            compiled(linear_module(len(self.limit), n_h).chain)
        return Tables(points, form, period, (n_modes, n_i, outputs[0].shape[1], len(self.net[1])), n_h)

    def chain(
        self, tables: Tables, first: int, last: int, state: State, starts: FloatArray | None,
        plan: SectionPlan, transient: int, keep: int, out: Chain,
    ) -> None:  # fmt: skip
        from nonsmooth.kernels.records import Goal, Motion, Section

        carry = starts is None
        clock = state.clock.copy()
        if carry:
            state.keep_phase(float(tables.period[first]), plan.phase if plan.indicator < 0 else -1.0)
            state.clock[2] = 0.0  # for the kernel: done, take the time as it stands
        kernel = tables.module().chain
        section = Section(
            plan.indicator, plan.rising, plan.mode, int(plan.after), plan.every, int(plan.extremes),
            float(plan.phase), float(plan.t_max),
        )  # fmt: skip
        n = len(self.scale)
        u = np.append(state.u, state.memory)
        begun = np.zeros((0, len(u)))
        if starts is not None:
            begun = np.hstack([starts, np.tile(state.memory, (len(starts), 1))])
        wide = out if len(u) == n else out.widened(len(u))
        arguments = (
            begun, tables.form, self._net(plan.indicator), section,
            Goal(transient, keep, 0.0, 0.0, self.limit, PATIENCE), Motion(u, state.clock, state.counters),
            wide.record(), *tables.scratch(),
        )  # fmt: skip
        tables.scratch()[1].tally[BEGUN] = 0
        at = first
        while at < last:  # Ctrl-C comes in between
            at = kernel(at, last, *arguments)
        state.u[:], state.memory[:] = u[:n], u[n:]
        if wide is not out:
            out.section[first:last], out.maximum[first:last], out.minimum[first:last] = (
                part[first:last, ..., :n] for part in (wide.section, wide.maximum, wide.minimum)
            )
        if carry:
            state.settled = True
            if state.clock[2] == 0.0 and tables.period[first] < np.inf:
                state.clock[:] = clock  # failed at the first point: nothing was written

    def record(self, tables: Tables, state: State, until: float, samples: FloatArray) -> Log:
        from nonsmooth.kernels import records

        n, u = len(samples), np.append(state.u, state.memory)
        sampled = (
            samples, np.full((n, len(u)), np.nan), np.full(n, -1, dtype=np.int64), np.zeros(n, dtype=np.int64),
        )  # fmt: skip
        size = 1024
        logs = self._logs(size)
        kernel = tables.module("record").record
        form, nowhere, work = tables.form, records.Section(-1, 0, -1, 0, 1, 0, 0.0, 0.0), tables.scratch("record")
        goal = records.Goal(0, 0, float(until), 0.0, self.limit, PATIENCE)
        motion = records.Motion(u, state.clock, state.counters)
        state.counters[1] = int(state.settled)
        work[1].tally[:] = 0
        while True:
            code = kernel(form, self._net(-1), nowhere, goal, motion, records.Log(*sampled, *logs), *work)
            if code == codes.LOG_FULL:
                size *= 2
                grown = self._logs(size)
                for old, new in zip(logs, grown, strict=True):
                    new[: len(old)] = old
                logs = grown
            elif code != codes.PAUSED:
                break
        state.settled = True
        state.u[:], state.memory[:] = u[: len(state.u)], u[len(state.u) :]
        n_c, n_t = work[1].tally[[CROSSINGS, TOUCHES]]
        return self._log(sampled, [log[:n_c] for log in logs[:4]], [log[:n_t] for log in logs[4:]], int(code))

    def _log(
        self, sampled: tuple[np.ndarray, ...], crossings: list[np.ndarray], touches: list[np.ndarray], code: int
    ) -> Log:
        """The kernel's logs, states and memory apart; a state that a mode lacks is NaN."""
        _, sample, mode, segment = sampled
        times, transition, before, after = crossings
        touch_times, indicators, touch_u, clearances = touches
        n, lacking = len(self.scale), np.array(self.traced.lacking, dtype=bool)
        memory, memory_after = sample[:, n:].copy(), after[:, n:].copy()
        u, before, after, touch_u = (np.ascontiguousarray(part[:, :n]) for part in (sample, before, after, touch_u))
        if lacking.any():
            jumps = self.traced.transitions
            u[lacking[mode] & (mode >= 0)[:, None]] = np.nan
            before[lacking[[t.source for t in jumps]][transition]] = np.nan
            after[lacking[[t.target for t in jumps]][transition]] = np.nan
        return Log(
            u, memory, mode, segment, times, transition, before, after, memory_after,
            touch_times, indicators, touch_u, clearances, code,
        )  # fmt: skip

    def grow(self, tables: Tables, i: int, state: State, count: int, unit: float, growth: Any) -> int:
        """Point i: march ``count`` units of time with a frame (``kernels.records.Growth``). Returns a status.

        The periods in the state's clock count from here."""
        from nonsmooth.kernels.records import Goal, Motion, Section

        kernel, work = tables.module("growth").grow, tables.scratch("growth")
        goal = Goal(0, count, 0.0, float(unit), self.limit, PATIENCE)
        state.counters[1] = 0
        work[1].tally[BEGUN] = 0
        code = codes.PAUSED
        while code == codes.PAUSED:
            code = kernel(
                i, tables.form, self._net(-1), Section(-1, 0, -1, 0, 1, 0, 0.0, 0.0), goal,
                Motion(state.u, state.clock, state.counters), growth, *work,
            )  # fmt: skip
        state.settled = True
        return int(code)

    def _logs(self, size: int) -> list[np.ndarray]:
        """Room for crossings (time, transition, states before, after), and touches (time, indicator, states, gap)."""
        n = len(self.limit)
        crossings = [np.zeros(size), np.zeros(size, dtype=np.int64), np.zeros((size, n)), np.zeros((size, n))]
        return [*crossings, np.zeros(size), np.zeros(size, dtype=np.int64), np.zeros((size, n)), np.zeros(size)]

    def _net(self, indicator: int) -> Any:
        """The net, its last two rows being the section's (rising, falling)."""
        rows: np.ndarray = self.net.rows.copy()
        rows[-2:, 0] = max(indicator, 0)
        return self.net._replace(rows=rows)


class PlanarEngine(LinearEngine):
    """That of two states: its spectrum, its judging of many jobs and its GPU kernels are compiled as well."""


def pack_net(traced: Traced) -> Any:
    """The net of transitions, with two more rows for a section."""
    from nonsmooth.kernels.records import Net

    integer = np.int64
    transitions = np.array(
        [(t.target, 1 if t.reset is not None else 2 * bool(t.writes), t.contact) for t in traced.transitions],
        dtype=integer,
    ).reshape(-1, 3)
    rows = [(r.indicator, r.sign, r.strict) for t in traced.transitions for r in t.rows]
    row_start = np.cumsum([0] + [len(t.rows) for t in traced.transitions], dtype=integer)
    leaving = [
        [j for j, t in enumerate(traced.transitions) if t.source == mode] for mode in range(len(traced.mode_names))
    ]
    mode_start = np.cumsum([0] + [len(one) for one in leaving], dtype=integer)
    mode_list = np.array([j for one in leaving for j in one], dtype=integer)
    at = np.array([-1.0 if t.at is None else t.at for t in traced.transitions], dtype=float)
    both = np.array([*rows, (0, 1, 1), (0, -1, 1)], dtype=integer).reshape(-1, 3)
    lacking = np.array([[*own, *(True for _ in traced.m)] for own in traced.lacking], dtype=integer)
    lacking = lacking.reshape(len(traced.mode_names), -1)
    changed = np.zeros((len(transitions), lacking.shape[1] + 1), dtype=integer)
    for j, t in enumerate(traced.transitions):
        moved = [i for i, e in enumerate(t.reset or ()) if e != traced.u[i]]
        moved += [len(traced.u) + i for i, _ in t.writes]
        changed[j, : len(moved) + 1] = [len(moved), *moved]
    return Net(transitions, both, row_start, mode_start, mode_list, at, changed, lacking)
