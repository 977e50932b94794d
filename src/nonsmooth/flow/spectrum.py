r"""How small changes grow along a trajectory: frames carried through legs and transitions, kept orthonormal.

The sums of the logarithms of what is divided out, over the elapsed time, are finite-time Lyapunov exponents. Their sum
is :math:`\frac1t \log|\det\Phi(t)|`, which must equal
:math:`\frac1t(\int \operatorname{div} f\,dt + \sum \log|\det S|)`. Two ways lead there: linear systems with an exact
flow are marched with their frame in one kernel; every other trajectory is recorded by its engine piece by piece, and
the frame follows it with Taylor legs.

References
----------
G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30; P.C. Mueller, Chaos, Solitons &
Fractals 5 (1995) 1671-1681.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engine import Engine, FloatArray, Log, State
from nonsmooth.flow.linear import LinearEngine
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System
    from nonsmooth.system.traced import Traced

__all__ = ["Frame", "Growth", "frame_for"]

CHUNK = 250  # units of time recorded at once
APART = 1e3  # times the engine's tolerance: what a piece may end away from the record
DENSEST = 4096  # samples per unit of time


@dataclass
class Growth:
    """What happened to a frame over K units of time."""

    logarithms: FloatArray  # (K, n) by unit of time; minus infinity where a direction was lost
    divergence: float  # integral of div f
    determinants: float  # sum of log|det S|
    nearest: float  # least |h'| / (|h_z| |f|) of all crossings
    status: int

    @property
    def defect(self) -> float:
        """log|det Phi| less what it must be; 0 where both are minus infinity."""
        found, wanted = float(self.logarithms.sum()), self.divergence + self.determinants
        return 0.0 if found == wanted else found - wanted


class Frame(Protocol):
    """Orthonormal directions that follow a trajectory; :meth:`advance` carries both on."""

    active: NDArray[np.bool_]  # (n,) components of z = (u, memory) that have directions of their own

    def advance(self, state: State, count: int, unit: float) -> Growth:
        """March ``count`` units of time. ``state`` is left at the end; its clock may be set back by whole periods."""


class _LinearFrame:
    """One kernel of the exact flow for the trajectory and its frame."""

    def __init__(self, engine: LinearEngine, tables: Any, i: int, scale: FloatArray) -> None:
        from nonsmooth.kernels.records import Growth as Record

        self.engine, self.tables, self.i = engine, tables, i
        n = len(scale)
        square, vector = (n, n), np.zeros(n)
        self.record = Record(
            scale, np.eye(n), np.zeros((0, n)), np.ones(n), np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(square),
            np.zeros(square), np.zeros(square), np.zeros((3, n)), vector, vector.copy(),
        )  # fmt: skip
        self.active = np.ones(n, dtype=bool)

    def advance(self, state: State, count: int, unit: float) -> Growth:
        sums = np.array([0.0, 0.0, 0.0, 1.0])
        record = self.record._replace(growth=np.zeros((count, len(self.active))), sums=sums)
        status = self.engine.grow(self.tables, self.i, state, count, unit, record)
        return Growth(record.growth, float(sums[0]), float(sums[1]), float(sums[3]), status)


class _RecordedFrame:
    """The engine records a stretch of the trajectory; the frame follows piece by piece."""

    def __init__(
        self, engine: Engine, tables: Any, flow: VariationalFlow, values: FloatArray, period: float | None, timed: bool
    ) -> None:
        self.engine, self.tables, self.flow, self.values = engine, tables, flow, values
        self.period, self.timed = period, timed
        self.density = 1
        self.active = np.zeros(flow.n, dtype=bool)
        self.Q = np.zeros((flow.n, 0))
        traced = flow.traced
        self._transitions = np.array(
            [(t.source, t.target, len(t.rows)) for t in traced.transitions], dtype=np.int64
        ).reshape(-1, 3)
        self._lacking = np.array(traced.lacking, dtype=bool).reshape(len(traced.mode_names), -1)

    def advance(self, state: State, count: int, unit: float) -> Growth:
        total = Growth(np.zeros((count, self.flow.n)), 0.0, 0.0, 1.0, codes.OK)
        done = 0
        while done < count and total.status in (codes.OK, codes.NOT_GUARANTEED):
            some = min(CHUNK, count - done)
            self._chunk(state, some, unit, total, done)
            done += some
        return total

    def _chunk(self, state: State, count: int, unit: float, total: Growth, done: int) -> None:
        """Record and follow ``count`` units, into the rows of ``total`` from ``done`` on.

        A piece is marched from its recorded beginning, so in chaos it parts from the record; the frame would then go on
        along another motion. Where a piece ends too far away the stretch is done again with more samples."""
        # Times count from here, by whole periods, so that no digits are lost in long runs.
        state.clock[1] = 0.0
        if self.period is None and not self.timed:
            state.clock[0] = 0.0
        at_start, Q, active = state.copy(), self.Q.copy(), self.active
        limit = APART * float(getattr(self.engine, "rtol", 1e-9))
        while True:
            log, apart, growth, sums, status = self._follow(state, count, unit)
            if log.status not in (codes.OK, codes.NOT_GUARANTEED) or apart <= limit or self.density >= DENSEST:
                break
            self.density *= 4
            state.u[:], state.memory[:], state.clock[:] = at_start.u, at_start.memory, at_start.clock
            state.counters[:], state.settled = at_start.counters, at_start.settled
            self.Q, self.active = Q.copy(), active
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            total.status = log.status
            return
        total.logarithms[done : done + count, : growth.shape[1]] += growth
        total.divergence += sums[0]
        total.determinants += sums[1]
        total.nearest = min(total.nearest, sums[2])
        if status != codes.OK or log.status != codes.OK:
            total.status = status if status != codes.OK else log.status

    def _follow(
        self, state: State, count: int, unit: float
    ) -> tuple[Log, float, FloatArray, tuple[float, float, float], int]:
        """One attempt: (record, distance from it, logarithms, (divergence, determinants, nearest), status)."""
        from nonsmooth.kernels.spectrum import grow

        density, n, flow = self.density, self.flow.n, self.flow
        steps = np.arange(count * density + 1, dtype=np.float64)
        instants: FloatArray = float(state.clock[0]) + unit * (steps / density)
        log = self.engine.record(self.tables, state, float(instants[-1]), instants[:-1])
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            return log, 0.0, np.zeros((count, 0)), (0.0, 0.0, 1.0), codes.OK
        self._widen(log)
        columns = self.Q.shape[1]
        growth, rates = np.zeros((count, columns)), np.ones(2 + 3 * n)
        divergence, determinant = np.zeros(count), np.zeros(count)
        rates[1] = 0.0
        status = grow(
            flow.functions, flow.model.entries, flow.model.kinds, self._transitions,
            *_pieces(flow.traced, log, instants, density), self.values, flow.scale, self.Q, np.zeros((n, columns)),
            np.zeros((n, n)), np.zeros((n, n)), growth, divergence, determinant, np.zeros(flow.n_out), rates,
            flow.scratch(),
        )  # fmt: skip
        sums = float(divergence.sum()), float(determinant.sum()), float(rates[0])
        return log, float(rates[1]), growth, sums, int(status)

    def _widen(self, log: Log) -> None:
        """Directions for the states of the modes now visited, and for the memory now written."""
        traced, n_u = self.flow.traced, self.flow.n_u
        visited = {*log.sample_mode.tolist(), *(traced.transitions[k].target for k in log.crossing_transition)}
        now = self.active.copy()
        now[:n_u] |= ~self._lacking[sorted(visited)].all(axis=0)
        for k in set(log.crossing_transition.tolist()):
            for i, _ in traced.transitions[k].writes:
                now[n_u + i] = True
        new = np.flatnonzero(now & ~self.active)
        if len(new):
            both = np.hstack([self.Q, np.eye(self.flow.n)[:, new]])
            self.Q = np.ascontiguousarray(np.linalg.qr(both)[0])
            self.active = now


def _pieces(traced: Traced, log: Log, instants: FloatArray, density: int) -> tuple[Any, ...]:
    """Smooth pieces between samples and crossings: modes, t0, tau, z0, unit, first_jump, jumps, before.

    A sample at the instant of a crossing is left out; transitions at one instant (a chain) form a group."""
    times, first = np.unique(log.crossing_time, return_index=True)
    ends = np.append(first, len(log.crossing_time))[1:]
    kept = ~np.isin(instants[:-1], times)
    kept[0] = True
    sampled = np.hstack([log.sample_u, log.sample_memory])[kept]
    memory = np.vstack([log.sample_memory[:1], log.memory_after])
    after, before = np.hstack([log.u_after, memory[1:]]), np.hstack([log.u_before, memory[:-1]])
    target = np.array([jump.target for jump in traced.transitions], dtype=np.int64)[log.crossing_transition]
    start = np.concatenate([instants[:-1][kept], times])
    order = np.argsort(start, kind="stable")
    group = np.concatenate([np.full(int(kept.sum()), -1), np.arange(len(times))])[order]  # that begins each piece
    following = np.append(group[1:], -1)
    t0 = start[order]
    at_end = np.zeros((len(t0), after.shape[1]))
    at_end[following >= 0] = before[first]
    count = np.zeros(len(t0), dtype=np.int64)
    count[following >= 0] = ends - first
    unit = np.clip(np.searchsorted(instants, t0, side="right") - 1, 0, len(instants) - 2)
    return (
        np.concatenate([log.sample_mode[kept], target[ends - 1]])[order].astype(np.int64), t0,
        np.diff(np.append(t0, instants[-1])), np.nan_to_num(np.vstack([sampled, after[ends - 1]])[order]),
        (unit // density).astype(np.int64), np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        log.crossing_transition.astype(np.int64), np.nan_to_num(at_end),
    )  # fmt: skip


def frame_for(system: System, engine: Engine, tables: Any, i: int) -> Frame:
    """A frame for row ``i`` of an engine's tables."""
    if isinstance(engine, LinearEngine) and engine.is_plain:
        return _LinearFrame(engine, tables, i, system.scale_vector())
    flow = VariationalFlow.of(system)
    points = tables.points[i : i + 1]
    period = system.period_at(points[0])
    return _RecordedFrame(engine, engine.prepare(points), flow, np.ascontiguousarray(points[0]), period,
                          system.depends_on_time)  # fmt: skip
