r"""Growth of small changes along a trajectory: frames carried through segments and transitions, kept orthonormal.

The sums of the logarithms of what is divided out, over the elapsed time, are finite-time Lyapunov exponents. Their sum
is :math:`\frac1t \log|\det\Phi(t)|`, which must equal
:math:`\frac1t(\int \operatorname{div} f\,dt + \sum \log|\det S|)`. The frame is marched with the trajectory by the
engine's own kernel: with the tables of an exact flow, or by Taylor series of its own.

References
----------
G. Benettin, L. Galgani, A. Giorgilli, J.-M. Strelcyn, Meccanica 15 (1980) 9-30; P.C. Mueller, Chaos, Solitons &
Fractals 5 (1995) 1671-1681.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.series import SeriesEngine, order_for
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.places import UNBROKEN

if TYPE_CHECKING:
    from nonsmooth.system.system import System

FINER = 0.1  # of the engine's tolerance: a step of the frame
FINEST = 1e-11  # and no coarser than this


@dataclass
class FrameGrowth:
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


class Frame:
    """Directions that follow the trajectory of row ``i`` of an engine's tables, in columns.

    There is one for each state that some visited mode has, and for memory that has been written: ``active``."""

    def __init__(self, system: System, engine: Engine, tables: Any, i: int) -> None:
        self.system, self.engine, self.tables, self.i = system, engine, tables, i
        self.is_smooth = isinstance(engine, SeriesEngine) and engine.is_smooth
        self.behind: Any = None  # what carries the frame of a series
        self.own, memory = len(engine.scale), len(engine.traced.m)
        self.scale = np.concatenate([system.scale_vector(), np.ones(memory)])
        self.lacking = engine.lacking.astype(bool)
        self.active = np.full(len(self.scale), not (memory or self.lacking.any()))
        self.Q = np.ascontiguousarray(np.eye(len(self.scale))[:, self.active])

    def advance(self, state: State, count: int, unit: float) -> FrameGrowth:
        """March ``count`` units of time. ``state`` is left at the end; its clock may be set back by whole periods."""
        if not np.isfinite(self.tables.period[self.i]) and not self.system.depends_on_time:
            state.clock[0] = 0.0  # no digits are lost in long runs
        total = FrameGrowth(np.zeros((count, len(self.scale))), 0.0, 0.0, 1.0, codes.OK)
        done = 0
        while done < count and total.status in (codes.OK, codes.NOT_GUARANTEED):
            # Where a direction is new the part is done again: the first parts are short.
            some = count - done if self.active.all() else min(count - done, max(1, done))
            before, Q = state.copy(), self.Q.copy()
            status, record = self._march(state, some, unit)
            if self._widen(Q, record.taken, int(state.counters[0])):
                state.u[:], state.memory[:], state.clock[:] = before.u, before.memory, before.clock
                state.counters[:], state.settled = before.counters, before.settled
                continue
            divergence, determinants, _, nearest, _ = record.sums.tolist()
            total.logarithms[done : done + some, : record.growth.shape[1]] = record.growth
            total.divergence += divergence
            total.determinants += determinants
            total.nearest = min(total.nearest, nearest)
            if status != codes.OK:
                total.status = status
            done += some
        return total

    def _march(self, state: State, count: int, unit: float) -> tuple[int, Any]:
        """Status, and record of the growth (``kernels.records.Growth``)."""
        from nonsmooth.kernels.hybrid.records import TRANSIENT, Growth

        engine, (n, columns), series = self.engine, self.Q.shape, isinstance(self.engine, SeriesEngine)
        noted = len(engine.traced.transitions) if series or not self.active.all() else 0
        none, square = np.zeros(0), np.zeros((n, n))
        record = Growth(
            self.scale,
            self.Q,
            np.zeros((count, columns)),
            np.ones(columns),
            np.array([0.0, 0.0, 0.0, 1.0, 0.0]),
            square,
            square.copy(),
            square.copy(),
            np.zeros((4, n)),
            np.zeros(n),
            np.zeros(n),
            np.zeros(noted, dtype=np.int64),
            np.zeros(0, dtype=np.int64),
            0,
            none,
            none,
        )
        if series:
            record = self._followed(record)
        here, row = engine.enter(self.tables, self.i, state)
        state.counters[1] = int(state.settled)
        march = engine.march()
        march.grown(row, state, count, unit, record)
        if self.is_smooth:
            march.orders[TRANSIENT] = UNBROKEN
        status, _ = engine._run(march, here)
        engine.leave(here, state)
        state.settled = True
        return int(status), record

    def _followed(self, record: Any) -> Any:
        """The record, with the series that carry the frame (``kernels.tangent.following``)."""
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.compile.pointers import Block, addresses
        from nonsmooth.kernels.tangent.following import FOLLOWER, frame_across, frame_along, put_follower

        if self.behind is None:
            assert isinstance(self.engine, SeriesEngine)
            flow = VariationalFlow.of(self.system, rows=False)
            tolerance = max(min(FINER * self.engine.rtol, FINEST), 1e-16)
            flow.catch_up()
            self.behind = (
                Block(FOLLOWER, put_follower),
                addresses(compiled(frame_along), compiled(frame_across)),
                flow,
                flow.steps(order_for(tolerance), tolerance),
                np.zeros(flow.n_out),
            )
        block, functions, flow, steps, out = self.behind
        record = record._replace(functions=functions, follower=block.address, u=steps.u, q=steps.q)
        block.put((flow.equations, record, steps, out))
        return record

    def _widen(self, Q: FloatArray, taken: Any, mode: int) -> bool:
        """Add directions for the states of the modes now visited and for the memory now written, to the frame Q with
        which the part just marched began; return whether it is to be done again: with them, or with new transitions."""
        jumps = self.engine.traced.transitions
        if self.active.all() and not isinstance(self.engine, SeriesEngine):
            return False
        if len(jumps) > len(taken):
            self.Q, self.behind = Q, None
            return True
        fired = [jumps[k] for k in np.flatnonzero(taken)]
        visited = {mode, *(jump.source for jump in fired), *(jump.target for jump in fired)}
        now = self.active.copy()
        now[: self.own] |= ~self.lacking[sorted(visited)].all(axis=0)
        now[[self.own + i for jump in fired for i, _ in jump.writes]] = True
        new = np.flatnonzero(now & ~self.active)
        if len(new):
            both = np.hstack([Q, np.eye(len(now))[:, new]])
            self.Q, self.active = np.ascontiguousarray(np.linalg.qr(both)[0]), now
        return bool(len(new))
