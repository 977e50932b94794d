r"""Growth of small changes along a trajectory: frames carried through segments and transitions, kept orthonormal.

The sums of the logarithms of what is divided out, over the elapsed time, are finite-time Lyapunov exponents. Their sum
is :math:`\frac1t \log|\det\Phi(t)|`, which must equal
:math:`\frac1t(\int \operatorname{div} f\,dt + \sum \log|\det S|)`. Linear systems with an exact flow are marched with
their frame in one kernel, and so is a motion of Taylor series without transitions. Every other trajectory is recorded
by its engine piece by piece, and the frame follows it.

References
----------
G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30; P.C. Mueller, Chaos, Solitons &
Fractals 5 (1995) 1671-1681.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, Log, State
from nonsmooth.flow.engines.linear import LinearEngine
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.series import SeriesEngine, order_for
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced
    from nonsmooth.system.system import System

__all__ = ["Growth", "frame_for"]

CHUNK = 250  # units of time recorded at once
APART = 1e3  # times the engine's tolerance: what a piece may end away from the record
DENSEST = 4096  # samples per unit of time
FINER = 0.1  # of the engine's tolerance: a step of the frame
FINEST = 1e-11  # and no coarser than this


@dataclass
class Growth:
    """Growth of a frame over K units of time."""

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


def _record(scale: FloatArray, Q: FloatArray, count: int) -> Any:
    """Room for the growth of a frame over some units of time (``kernels.records.Growth``)."""
    from nonsmooth.kernels.hybrid.records import Growth as Record

    (n, columns), square = Q.shape, np.zeros((len(scale), len(scale)))
    return Record(
        scale, Q, np.zeros((count, columns)), np.ones(columns), np.array([0.0, 0.0, 0.0, 1.0, 0.0]), square,
        square.copy(), square.copy(), np.zeros((3, n)), np.zeros(n), np.zeros(n),
    )  # fmt: skip


class _LinearFrame:
    """One kernel of the exact flow for the trajectory and its frame."""

    def __init__(self, engine: LinearEngine, tables: Any, i: int, scale: FloatArray) -> None:
        self.engine, self.tables, self.i, self.scale, self.Q = engine, tables, i, scale, np.eye(len(scale))
        self.active = np.ones(len(scale), dtype=bool)

    def advance(self, state: State, count: int, unit: float) -> Growth:
        """March ``count`` units of time. ``state`` is left at the end; its clock may be set back by whole periods."""
        record = _record(self.scale, self.Q, count)
        status = self.engine.grow(self.tables, self.i, state, count, unit, record)
        divergence, determinants, _, nearest, _ = record.sums.tolist()
        return Growth(record.growth, divergence, determinants, nearest, status)


class _SeriesFrame:
    """Taylor series for the frame, along pieces of a trajectory that the engine records.

    Where nothing can happen to the motion nothing is recorded: state and frame are marched as one."""

    def __init__(
        self, engine: Engine, tables: Any, flow: VariationalFlow, values: FloatArray, period: float | None, timed: bool
    ) -> None:
        from nonsmooth.kernels.tangent.spectrum import Pace

        self.engine, self.tables, self.flow, self.values = engine, tables, flow, values
        self.period, self.timed = period, timed
        self.density = 1
        n, n_u = flow.n, flow.n_u
        self.active = np.zeros(n, dtype=bool)
        self.Q = np.zeros((n, 0))
        self._lacking = np.array(flow.traced.lacking, dtype=bool).reshape(len(flow.traced.mode_names), -1)
        self.rtol = float(getattr(engine, "rtol", 1e-9))
        self.smooth = _smooth(engine, flow.traced)
        weight, limit = flow.scale[:n_u], np.full(n_u, np.inf)
        if isinstance(engine, SeriesEngine):
            weight, _, limit = engine.norms
        tolerance = max(min(FINER * self.rtol, FINEST), 1e-16)
        self.pace = Pace(order_for(tolerance), float(np.log(tolerance)), weight, np.zeros(0), limit)

    def advance(self, state: State, count: int, unit: float) -> Growth:
        total = Growth(np.zeros((count, self.flow.n)), 0.0, 0.0, 1.0, codes.OK)
        done = 0
        while done < count and total.status in (codes.OK, codes.NOT_GUARANTEED):
            some = min(CHUNK, count - done)
            self._chunk(state, some, unit, total, done)
            done += some
        return total

    def _chunk(self, state: State, count: int, unit: float, total: Growth, done: int) -> None:
        """Follow ``count`` units, into the rows of ``total`` from ``done`` on.

        A piece is marched from its recorded beginning, so in chaos it parts from the record; the frame would then go on
        along another motion. Where a piece ends too far away the piece is done again with more samples."""
        # Times count from here, by whole periods, so that no digits are lost in long runs.
        state.clock[1] = 0.0
        if self.period is None and not self.timed:
            state.clock[0] = 0.0
        at_start, Q, active = state.copy(), self.Q.copy(), self.active
        while True:
            status, growth, sums = (self._march if self.smooth else self._follow)(state, count, unit)
            if growth is None or sums[4] <= APART * self.rtol or self.density >= DENSEST:
                break
            self.density *= 4
            state.u[:], state.memory[:], state.clock[:] = at_start.u, at_start.memory, at_start.clock
            state.counters[:], state.settled = at_start.counters, at_start.settled
            self.Q, self.active = Q.copy(), active
        if status != codes.OK:
            total.status = status
        if growth is not None:
            total.logarithms[done : done + count, : growth.shape[1]] += growth
            total.divergence += float(sums[0])
            total.determinants += float(sums[1])
            total.nearest = min(total.nearest, float(sums[3]))

    def _march(self, state: State, count: int, unit: float) -> tuple[int, FloatArray, FloatArray]:
        """The motion itself with its frame, by the tolerance of the frame."""
        from nonsmooth.kernels.tangent.spectrum import Pieces

        mode, begun = int(state.counters[0]), float(state.clock[0])
        self._widen({mode}, set())
        pieces = Pieces(
            np.full(count, mode), begun + unit * np.arange(count), np.full(count, unit),
            np.concatenate([state.u, state.memory])[None, :], np.arange(count), np.zeros(count + 1, dtype=np.int64),
            np.zeros(0, dtype=np.int64), np.zeros((0, self.flow.n)),
        )  # fmt: skip
        found = self._grow(pieces, count)
        state.u[:], state.settled = self.flow.scratch().u, True
        state.clock[0] += 0.0 if unit == self.period else count * unit
        if self.period is not None and unit == self.period:
            state.clock[1] += count
        elif self.period is not None:
            state.clock[1], state.clock[0] = divmod(state.clock[0], self.period)
        return found

    def _follow(self, state: State, count: int, unit: float) -> tuple[int, FloatArray | None, FloatArray]:
        """Record, and follow the record: (status, logarithms, sums of ``kernels.records.Growth``)."""
        density, traced = self.density, self.flow.traced
        steps = np.arange(count * density + 1, dtype=np.float64)
        instants: FloatArray = float(state.clock[0]) + unit * (steps / density)
        log = self.engine.record(self.tables, state, float(instants[-1]), instants[:-1])
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            return log.status, None, np.zeros(5)
        visited = {*log.sample_mode.tolist(), *(traced.transitions[k].target for k in log.crossing_transition)}
        written = {i for k in set(log.crossing_transition.tolist()) for i, _ in traced.transitions[k].writes}
        self._widen(visited, written)
        status, growth, sums = self._grow(_pieces(traced, log, instants, density), count)
        return status if status != codes.OK else log.status, growth, sums

    def _grow(self, pieces: Any, count: int) -> tuple[int, FloatArray, FloatArray]:
        """Carry the frame along the pieces."""
        from nonsmooth.kernels.tangent.spectrum import grow

        flow, record = self.flow, _record(self.flow.scale, self.Q, count)
        sizes = np.concatenate([np.zeros(len(flow.model.entries)), np.repeat(flow.scale[: flow.n_u], self.Q.shape[1])])
        status = grow(
            flow.equations, pieces, self.pace._replace(sizes=sizes), self.values, record, np.zeros(flow.n_out),
            flow.scratch(),
        )  # fmt: skip
        return int(status), record.growth, record.sums

    def _widen(self, visited: set[int], written: set[int]) -> None:
        """Directions for the states of the modes now visited, and for the memory now written."""
        now = self.active.copy()
        now[: self.flow.n_u] |= ~self._lacking[sorted(visited)].all(axis=0)
        now[[self.flow.n_u + i for i in written]] = True
        new = np.flatnonzero(now & ~self.active)
        if len(new):
            both = np.hstack([self.Q, np.eye(self.flow.n)[:, new]])
            self.Q = np.ascontiguousarray(np.linalg.qr(both)[0])
            self.active = now


def _pieces(traced: Traced, log: Log, instants: FloatArray, density: int) -> Any:
    """Smooth pieces between samples and crossings (``kernels.spectrum.Pieces``).

    A sample at the instant of a crossing is left out; transitions at one instant (a chain) form a group."""
    from nonsmooth.kernels.tangent.spectrum import Pieces

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
    return Pieces(
        np.concatenate([log.sample_mode[kept], target[ends - 1]])[order].astype(np.int64), t0,
        np.diff(np.append(t0, instants[-1])), np.nan_to_num(np.vstack([sampled, after[ends - 1]])[order]),
        (unit // density).astype(np.int64), np.concatenate([[0], np.cumsum(count)]).astype(np.int64),
        log.crossing_transition.astype(np.int64), np.nan_to_num(at_end),
    )  # fmt: skip


def _smooth(engine: Engine, traced: Traced) -> bool:
    """Return whether motion is one Taylor series after the other, of steps that need not be checked."""
    if not isinstance(engine, SeriesEngine) or engine.name != "taylor" or traced.transitions:
        return False
    return engine.step is None and engine.order is None and not engine.layers.checked


def frame_for(system: System, engine: Engine, tables: Any, i: int) -> _LinearFrame | _SeriesFrame:
    """A frame for row ``i`` of an engine's tables."""
    if isinstance(engine, LinearEngine) and engine.is_plain:
        return _LinearFrame(engine, tables, i, system.scale_vector())
    flow = VariationalFlow.of(system)
    points = tables.points[i : i + 1]
    period = system.period_at(points[0])
    return _SeriesFrame(engine, engine.prepare(points), flow, np.ascontiguousarray(points[0]), period,
                        system.depends_on_time)  # fmt: skip
