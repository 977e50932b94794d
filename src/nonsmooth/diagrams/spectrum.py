r"""Lyapunov exponents of one trajectory: growth of a frame in batches of time, their errors, the dimension they give.

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

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engines.engine import FloatArray, State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.series import SeriesEngine, order_for
from nonsmooth.flow.equilibria import Equilibrium, equilibrium_at
from nonsmooth.flow.loads import meter_of
from nonsmooth.flow.sensitivity import order_matters
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.codes import UNBROKEN
from nonsmooth.kernels.hybrid.kept import Section

if TYPE_CHECKING:
    from nonsmooth.system.system import System


FINER = 0.1  # of the engine's tolerance: a step of the frame
FINEST = 1e-11  # and no coarser than this


@dataclass
class FrameGrowth:
    """Growth of a frame over K units, or batches, of time."""

    logarithms: FloatArray  # (K, n); minus infinity where a direction was lost
    divergence: float  # integral of div f
    determinants: float  # sum of log|det S|
    nearest: float  # least |h'| / (|h_z| |f|) of all crossings
    status: int
    beside: float = 0.0  # crossings, each at an instant of its own, that came with another

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
            divergence, determinants, _, nearest, _, beside = record.sums.tolist()
            total.logarithms[done : done + some, : record.growth.shape[1]] = record.growth
            total.divergence += divergence
            total.determinants += determinants
            total.nearest = min(total.nearest, nearest)
            total.beside += beside
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
            np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
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


BATCHES = 32
ALIGN = 100  # units of the transient in which the frame turns into the directions of growth
INDEPENDENT = 1e-7  # of the largest singular value of constraints
GOOD = (codes.OK, codes.NOT_GUARANTEED)


@dataclass(frozen=True)
class Spectrum:
    """The exponents of one trajectory."""

    exponents: FloatArray  # (n,)
    error: FloatArray  # (n,)
    running: FloatArray  # (BATCHES, n)
    defect: float
    dimension: float
    nearest: float
    elapsed: float
    status: int
    rest: Equilibrium | None = None  # where the trajectory stays, or began
    of_one_order: bool = False  # of transitions at one instant, where the other one's derivatives differ


def spectrum_along(
    system: System,
    engine: Engine,
    tables: Any,
    i: int,
    values: FloatArray,
    state: State,
    period: float | None,
    unit: float,
    count: int,
    wait: int,
) -> Spectrum:
    """Run row i (parameters ``values``) from ``state`` on: the transient, its end with the frame, ``count`` units."""
    if period is not None:
        state.keep_phase(period, 0.0)
    state.settled = False
    status = codes.OK
    align = min(ALIGN, wait)
    if wait > align:
        status = _run_on(system, engine, tables, i, state, period, unit, wait - align)
    frame = Frame(system, engine, tables, i)
    if status in GOOD and align:
        status = frame.advance(state, align, unit).status
    begun = state.copy()
    lost = _hold(system, frame, values, begun) if status in GOOD else 0
    if status in GOOD:
        growth = frame.advance(state, count, unit)
        status = growth.status
    n = len(frame.active)
    if status not in GOOD:
        return failed_spectrum(n, count * unit, status)
    if period is not None:
        state.clock[2] = period
    used = int(frame.active.sum())
    growth.logarithms = growth.logarithms[:, :used]
    if lost:
        growth.logarithms[:, used - lost :], growth.determinants = -np.inf, -np.inf
    found = evaluated(n, growth, count, unit, period is not None)
    if growth.beside and order_matters(system, engine, values, state, unit * np.ceil(2 * count / growth.beside)):
        found = replace(found, of_one_order=True)
    return at_rest(found, system, values, begun, state)


def _hold(system: System, frame: Any, values: FloatArray, state: State) -> int:
    """Turn the frame so that what elements hold in the present mode stands in its last columns; their number.

    A held contact or friction takes each neighbour to its constraint in a finite time, so these directions are lost; at
    which rate the equations bring rounding errors back to it means nothing. The others stay within it."""
    meter = meter_of(system)
    if meter is None:
        return 0
    mode = system.modes[int(state.counters[0])]
    rows = meter.constraints(mode, values, float(state.clock[0]), state.u, state.memory) * system.scale_vector()
    active = frame.active[: rows.shape[1]]
    _, sizes, turned = np.linalg.svd(rows[:, active])
    lost = int((sizes > INDEPENDENT * sizes.max(initial=0.0)).sum())
    if lost:
        own, place = np.zeros((frame.Q.shape[0], len(turned))), np.flatnonzero(active)
        own[place] = turned.T
        within = own[:, lost:]
        rest = np.eye(frame.Q.shape[0])[:, len(active) :][:, frame.active[len(active) :]]  # memory
        within = np.hstack([within, rest])
        aligned = np.linalg.qr(within.T @ frame.Q)[0]
        frame.Q[:] = np.hstack([within @ aligned, own[:, :lost]])
    return lost


def at_rest(found: Spectrum, system: System, values: FloatArray, begun: State, ended: State) -> Spectrum:
    """The exponents with the equilibrium at which the run stayed, or began, and the errors they then have.

    Beside a stable equilibrium the true exponents are known, the real parts of its eigenvalues. Batches that are all
    alike say nothing of an exponent's error, and an equilibrium that no motion approaches has no dimension.
    """
    at = [
        equilibrium_at(system, one.u, int(one.counters[0]), values=values, memory=one.memory) for one in (ended, begun)
    ]
    if at[0] is not None and at[0].kind == "unstable" and at[1] is None:
        return found  # passes by
    rest = at[0] if at[0] is not None else at[1]
    if rest is not None and rest.kind == "undecided" and found.exponents[0] > 3.0 / found.elapsed:
        rest = replace(rest, kind="unstable")
    if rest is None or (at[0] is None and rest.kind != "unstable"):
        return found
    if rest.kind == "unstable":
        return replace(found, rest=rest, error=np.full_like(found.error, np.nan), dimension=np.nan)
    error, known = found.error, rest.eigenvalues.real
    if rest.kind == "stable" and len(known) == len(error):
        apart = np.abs(found.exponents - known) + np.finfo(float).eps * np.abs(known)
        error = np.maximum(error, np.where(np.isfinite(found.exponents), apart, 0.0))
    return replace(found, rest=rest, error=error)


def batch_ends(count: int) -> NDArray[np.int64]:
    """Ends of the batches of a run of ``count`` units."""
    return np.linspace(0, count, BATCHES + 1).astype(np.int64)


def failed_spectrum(n: int, elapsed: float, status: int) -> Spectrum:
    nan = np.full(n, np.nan)
    return Spectrum(nan, nan, np.full((BATCHES, n), np.nan), np.nan, np.nan, np.nan, elapsed, status)


def evaluated(n: int, growth: FrameGrowth, count: int, unit: float, forced: bool) -> Spectrum:
    """Exponents from the mean growth per unit time of ``count`` units, their errors from that of the batches."""
    logs, elapsed = growth.logarithms, count * unit
    used, mean = logs.shape[1], logs.sum(axis=0) / elapsed
    exponents, error, running = np.full(n, np.nan), np.full(n, np.nan), np.full((BATCHES, n), np.nan)
    order = np.argsort(-mean, kind="stable")
    exponents[:used] = mean[order]
    if count >= BATCHES:
        edges = batch_ends(count)
        with np.errstate(invalid="ignore"):
            sums = (logs if len(logs) == BATCHES else np.add.reduceat(logs, edges[:-1]))[:, order]
            means = sums / (np.diff(edges)[:, None] * unit)
            error[:used] = means.std(axis=0, ddof=1) / np.sqrt(BATCHES)
            running[:, :used] = np.cumsum(sums, axis=0) / (edges[1:, None] * unit)
        error[:used][np.isinf(exponents[:used])] = 0.0
    # In an autonomous system one exponent is zero, and its estimate of the order of 1/t.
    zero = 0.0 if forced else float(np.nanmax([0.0, *(3 * error[:used])]) + 3.0 / elapsed)
    dimension = kaplan_yorke(exponents[:used], zero)
    return Spectrum(
        exponents, error, running, growth.defect / elapsed, dimension, growth.nearest, elapsed, growth.status
    )


def _run_on(
    system: System, engine: Engine, tables: Any, i: int, state: State, period: float | None, unit: float, count: int
) -> int:
    """Pass over ``count`` units of time."""
    if period is not None and unit == period:
        out = engine.kept(i + 1, 1)
        phase = state.clock[0] / period
        plan = Section(phase=float(phase % 1.0), extremes=False)
        engine.chain(tables, i, i + 1, state, None, plan, count - 1, 1, out)
        return int(out.status[i])
    return Frame(system, engine, tables, i).advance(state, count, unit).status


def kaplan_yorke(exponents: FloatArray, zero: float = 0.0) -> float:
    r"""The Kaplan-Yorke dimension :math:`j + (\lambda_1 + \dots + \lambda_j) / |\lambda_{j+1}|` of a spectrum.

    j is the largest number of exponents, taken in descending order, whose sum is not negative. Where the sum of all is
    not negative it is their number; where the first is negative, 0 (a point of the section).

    Parameters
    ----------
    exponents : array (n,)
        Descending; minus infinity allowed.
    zero : float
        Exponents of at most this size count as zero.

    References
    ----------
    J.L. Kaplan, J.A. Yorke, Lecture Notes in Mathematics 730 (1979) 204-227; P. Frederickson et al., J. Differential
    Equations 49 (1983) 185-207.
    """
    rounded = np.where(np.abs(exponents) <= zero, 0.0, exponents)
    sums = np.cumsum(rounded)
    j = int(np.count_nonzero(sums >= 0.0)) if len(sums) else 0
    if j == len(sums):
        return float(j)
    above = float(sums[j - 1]) if j else 0.0
    return float(j + above / abs(rounded[j]))
