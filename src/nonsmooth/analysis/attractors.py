"""Many starts brought to their attractors and judged: the work behind charts and basins.

A *job* is a start at one parameter point. Systems of two states with the exact flow and a stroboscopic section run
their jobs in one compiled call (``kernels.planar_settle``); all others go through ``analysis.settle`` one by one. The
rules of judgement are the same: a period number is granted with a certificate only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.analysis.classify import TOLERANCE, Verdict
from nonsmooth.analysis.settle import LEAST, LONGER, Attractors
from nonsmooth.flow.engine import Chain, Engine, FloatArray, IntArray, SectionPlan, State
from nonsmooth.flow.methods import RTOL, engine_for
from nonsmooth.flow.planar import DIVERGENCE, PlanarEngine
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["FIRST_LOOK", "Settled", "Settler", "usable"]

FIRST_LOOK = 40  # returns after which a point is judged for the first time, where it may stop early
USABLE = (codes.OK, codes.SLOW, codes.NOT_PERIODIC, codes.NOT_GUARANTEED)


def usable(status: Any) -> NDArray[np.bool_]:
    """Where a run came to its end, so that its extremes and last point mean something."""
    return np.isin(status, USABLE)


@dataclass
class Settled:
    """What became of J jobs. Extremes and counts are over whole cycles where there is a period, else the kept window.

    ``multiplier`` is the largest modulus over ``period_number`` returns (NaN: unknown); ``returns`` the section
    returns run.
    """

    period_number: IntArray  # (J,)
    status: IntArray
    residual: FloatArray
    multiplier: FloatArray
    crossings: FloatArray
    contacts: FloatArray
    maximum: FloatArray  # (J, n)
    minimum: FloatArray  # (J, n)
    last: FloatArray  # (J, n): the section point at the end
    mode: IntArray
    returns: IntArray

    @classmethod
    def empty(cls, jobs: int, n: int) -> Settled:
        def whole() -> IntArray:
            return np.zeros(jobs, dtype=np.int64)

        def one() -> FloatArray:
            return np.full(jobs, np.nan)

        def state() -> FloatArray:
            return np.full((jobs, n), np.nan)

        return cls(
            whole(), whole(), one(), one(), one(), one(), state(), state(), state(), whole(), whole()
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Settled]) -> Settled:
        return cls(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(cls)))

    def __getitem__(self, which: Any) -> Settled:
        return Settled(*(getattr(self, item.name)[which] for item in fields(self)))


@dataclass(frozen=True)
class Settler:
    """How jobs are run: an engine, a section, and how long to wait.

    Parameters
    ----------
    stop_early : bool
        A job ends as soon as its period number is certain, not at the end of the transient.
    extremes : bool
        Whether extremes are wanted; they cost time where the motion is not periodic.
    """

    system: System
    engine: Engine
    plan: SectionPlan
    transient: int
    keep: int
    max_period: int
    stop_early: bool = True
    extremes: bool = True
    rtol: float | None = None
    atol: Any = None
    expert: Mapping[str, Any] = field(default_factory=dict)
    tolerance: float = field(init=False)

    def __post_init__(self) -> None:
        noise = TOLERANCE
        if self.engine.name != "exact":
            noise = max(TOLERANCE, 10.0 * (RTOL if self.rtol is None else self.rtol))
        object.__setattr__(self, "tolerance", noise)

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process as the system's text: what is compiled there comes from that machine's own cache."""
        given = {item.name: getattr(self, item.name) for item in fields(self) if item.init}
        options = {name: given.pop(name) for name in ("system", "engine")}
        text, values = options["system"].to_text(), dict(options["system"].values)
        return _remade, (text, values, options["engine"].name, given)

    @property
    def compiled(self) -> bool:
        """Whether jobs run in one compiled call."""
        return isinstance(self.engine, PlanarEngine) and self.plan.indicator < 0

    def load(self) -> None:
        """Compile or load the kernel now, before threads ask for it."""
        if self.compiled:
            from nonsmooth.kernels.planar_module import settle_module

            settle_module(len(self.engine.form.multiples))  # type: ignore[attr-defined]

    def run(
        self,
        points: FloatArray,
        rows: Any,
        starts: FloatArray,
        *,
        carried: bool = False,
        modes: Any = None,
        begin: float = 0.0,
        attempts: int = len(LONGER),
    ) -> Settled:
        """Run J jobs one after the other.

        Parameters
        ----------
        points : array (P, n_parameters)
        rows : array (J,) of int
            The parameter point of each job.
        starts : array (J, n)
        carried : bool
            Job j goes on from where job j - 1 ended (from its own start where that failed).
        modes : array (J,) of int, optional
            Mode at the start; the first where not given.
        begin : float
            Phase of the forcing at the starts, in periods.
        attempts : int
            Further transients (of 1, 2, 4 times the first) for a point that is still settling.
        """
        rows = np.ascontiguousarray(rows, dtype=np.int64)
        starts = np.ascontiguousarray(starts, dtype=float)
        modes = np.zeros(len(rows), dtype=np.int64) if modes is None else np.array(modes, dtype=np.int64)
        run = self._run_compiled if self.compiled else self._run_one_by_one
        return run(np.ascontiguousarray(points, dtype=float), rows, starts, carried, modes, begin, attempts)

    def _run_compiled(
        self, points: FloatArray, rows: IntArray, starts: FloatArray, carried: bool, modes: IntArray, begin: float,
        attempts: int,
    ) -> Settled:  # fmt: skip
        from nonsmooth.kernels.planar_module import settle_module

        engine: Any = self.engine
        tables, traced = engine.prepare(points), self.system.traced
        sizes = len(traced.u), len(traced.indicators), tables.sizes[2]
        out, probe = (_buffers(Chain.empty(len(points), k, *sizes)) for k in (self.keep, self.max_period))
        look = FIRST_LOOK if self.stop_early else 0
        choice = np.array(
            [self.transient, self.keep, self.max_period, look, attempts, carried, self.extremes], dtype=np.int64
        )
        norms = np.concatenate([[self.tolerance], self.least, np.zeros(2)])
        plan, quiet = (np.array([-1, 1, -1, 1, 1, extremes], dtype=np.int64) for extremes in (1, 0))
        work = _work(self.max_period)
        found = Settled.empty(len(rows), 2)
        settle_module(len(engine.form.multiples)).settle_many(
            rows, starts, np.full(len(rows), begin), modes, choice, norms, tables.linear, engine.net, plan, quiet,
            self.plan.phase, np.inf, DIVERGENCE * engine.scale, out, probe, tables.scratch(), work,
            tuple(getattr(found, item.name) for item in fields(found)),
        )  # fmt: skip
        failed = ~usable(found.status)
        found.status[failed] = [result_status(code) for code in found.status[failed]]
        found.residual[failed] = np.nan
        found.multiplier[found.multiplier < 0.0] = np.nan
        return found

    @property
    def least(self) -> FloatArray:
        """The least size of a motion in each state: what is smaller has come to rest."""
        return LEAST * self.system.scale_vector()

    @property
    def section_phase(self) -> float:
        """Phase of the forcing at which the section stands; 0 where it is no phase."""
        return self.plan.phase if self.plan.indicator < 0 else 0.0

    def period(self, point: FloatArray) -> float:
        """Period of the forcing at one parameter point (1, n_parameters); 1 where there is none."""
        tables = self.engine.prepare(point)
        found = float((tables.period if hasattr(tables, "period") else tables.periods)[0])
        return found if found < np.inf else 1.0

    def trace(
        self, point: FloatArray, start: FloatArray, mode: int, transient: int, keep: int
    ) -> tuple[FloatArray, FloatArray, int, float]:
        """Section points of one run that begins on the section: points (keep, n), the last one, its mode, their time.

        No points where the run failed."""
        traced = self.system.traced
        state, tables = State(start.copy(), self.system.memory_vector()), self.engine.prepare(point)
        state.counters[0] = mode
        period = float((tables.period if hasattr(tables, "period") else tables.periods)[0])
        if self.plan.indicator < 0:
            state.clock[0], state.clock[2] = self.plan.phase * period, period
        out = Chain.empty(1, keep, len(traced.u), len(traced.indicators), len(traced.outputs))
        self.engine.chain(tables, 0, 1, state, None, replace(self.plan, extremes=False), transient, keep, out)
        if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
            return np.zeros((0, len(start))), start, mode, 0.0
        return out.section[0], state.u, int(state.counters[0]), float(out.elapsed[0])

    def exponents(
        self, points: FloatArray, rows: Any, starts: FloatArray, modes: Any, n_returns: int
    ) -> tuple[FloatArray, FloatArray]:
        """Largest Lyapunov exponents (per unit time) of J jobs that begin on the section, and their standard errors.

        Two neighbours over ``n_returns`` returns, put back to a small distance after each; NaN where one failed.
        """
        from nonsmooth.kernels.planar_module import settle_module

        rows = np.ascontiguousarray(rows, dtype=np.int64)
        starts = np.ascontiguousarray(starts, dtype=float)
        largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
        if not self.compiled:
            for j, i in enumerate(rows):
                largest[j], error[j] = self._exponent(points[i : i + 1], starts[j], int(modes[j]), n_returns)
            return largest, error
        engine: Any = self.engine
        tables = engine.prepare(np.ascontiguousarray(points, dtype=float))
        out = _buffers(Chain.empty(len(points), 1, 2, len(self.system.traced.indicators), tables.sizes[2]))
        quiet = np.array([-1, 1, -1, 1, 1, 0], dtype=np.int64)
        settle_module(len(engine.form.multiples)).exponents_of(
            rows, starts, np.array(modes, dtype=np.int64), n_returns, self.system.scale_vector(), tables.linear,
            engine.net, quiet, self.plan.phase, np.inf, DIVERGENCE * engine.scale, out, tables.scratch(),
            _work(self.max_period), largest, error,
        )  # fmt: skip
        return largest, error

    def _exponent(self, point: FloatArray, start: FloatArray, mode: int, n_returns: int) -> tuple[float, float]:
        """The same through the engine's own calls, for one job."""
        tables, traced, scale = self.engine.prepare(point), self.system.traced, self.system.scale_vector()
        period = float((tables.period if hasattr(tables, "period") else tables.periods)[0])
        plan = replace(self.plan, extremes=False)
        out = Chain.empty(1, 1, len(traced.u), len(traced.indicators), len(traced.outputs))
        state = State(start.copy(), self.system.memory_vector())
        state.counters[0] = mode
        if self.plan.indicator < 0:
            state.clock[0], state.clock[2] = self.plan.phase * period, period
        offset = np.full(len(start), 1e-6) * scale
        first = float(np.linalg.norm(offset / scale))
        batch = n_returns // 10
        logs, times = [], []
        for _ in range(batch // 4 + 10 * batch):
            other = state.copy()
            other.u += offset
            other.settled = False
            for one in (state, other):
                self.engine.chain(tables, 0, 1, one, None, plan, 0, 1, out)
                if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
                    return np.nan, np.nan
                if one is state:
                    times.append(float(out.elapsed[0]))
            offset = other.u - state.u
            apart = float(np.linalg.norm(offset / scale))
            if apart > 0.0:
                offset *= first / apart
            else:
                apart, offset = 1e-16 * first, np.full(len(start), 1e-6) * scale
            logs.append(np.log(apart / first))
        grown = np.array(logs[batch // 4 :]).reshape(10, batch).sum(axis=1)
        rates = grown / np.array(times[batch // 4 :]).reshape(10, batch).sum(axis=1)
        return float(rates.mean()), float(rates.std() / 3.0)

    def _run_one_by_one(
        self, points: FloatArray, rows: IntArray, starts: FloatArray, carried: bool, modes: IntArray, begin: float,
        attempts: int,
    ) -> Settled:  # fmt: skip
        system, traced = self.system, self.system.traced
        tables = self.engine.prepare(points)
        attractors = Attractors(
            self.engine, tables, self.plan, self.transient, self.keep, self.max_period, self.tolerance,
            system.scale_vector(), LONGER[:attempts],
        )  # fmt: skip
        out = Chain.empty(len(points), self.keep, len(traced.u), len(traced.indicators), len(traced.outputs))
        found = Settled.empty(len(rows), len(traced.u))
        memory = system.memory_vector()
        period = tables.period if hasattr(tables, "period") else tables.periods
        state: State | None = None
        for j, i in enumerate(rows):

            def fresh(j: int = j, i: int = i) -> State:
                new = State(starts[j].copy(), memory.copy())
                new.counters[0] = modes[j]
                if period[i] < np.inf:
                    new.clock[0], new.clock[2] = begin * period[i], period[i]
                return new

            if state is None or not carried:
                state = fresh()
            verdict, found.returns[j] = self._settle(attractors, int(i), state, out, fresh)
            found.period_number[j], found.status[j] = verdict.period_number, verdict.status
            found.residual[j], found.multiplier[j] = verdict.residual, verdict.multiplier
            if not usable(verdict.status):
                state = None
                continue
            p = verdict.period_number
            n = p if p and self.keep % p else self.keep
            if n != self.keep:  # counts over whole cycles
                cycle = Chain.empty(int(i) + 1, n, len(traced.u), len(traced.indicators), len(traced.outputs))
                self.engine.chain(tables, int(i), int(i) + 1, state.copy(), None, self.plan, 0, n, cycle)
            else:
                cycle = out
            found.crossings[j], found.contacts[j] = cycle.crossings[i] / n, cycle.contacts[i] / n
            found.maximum[j], found.minimum[j] = out.maximum[i], out.minimum[i]
            found.last[j], found.mode[j] = state.u, state.counters[0]
        return found

    def _settle(
        self, attractors: Attractors, i: int, state: State, out: Chain, fresh: Callable[[], State]
    ) -> tuple[Verdict, int]:
        """Settle one job with looks before its transient ends: the verdict, and the returns run (without attempts)."""
        used, todo = 0, FIRST_LOOK
        while self.stop_early and used + todo < self.transient:
            verdict = attractors.look(i, state, todo, out)
            if verdict is None:
                break
            used += todo + self.keep
            if verdict.status == codes.OK:
                return verdict, used
            todo = used if 2 * used + self.keep < self.transient else max(self.transient - used, 0)
        rest = max(self.transient - used, 0)
        verdict = replace(attractors, transient=rest).settle(i, state, out, fresh)
        return verdict, used + rest + self.keep


@lru_cache(maxsize=8)
def _system_from(text: str) -> System:
    """The same object for the same text: tracing takes longer than a chunk."""
    from nonsmooth.system.system import System

    return System.from_text(text)


def _remade(text: str, values: Mapping[str, float], method: str, given: Mapping[str, Any]) -> Settler:
    system = _system_from(text).with_parameters(values)
    exact = method == "exact"
    engine = engine_for(
        system, "auto" if exact else method, None if exact else given["rtol"], None if exact else given["atol"],
        **given["expert"],
    )  # fmt: skip
    return Settler(system, engine, **given)


def _work(max_period: int) -> tuple[Any, ...]:
    """Two states in pieces (u, clock, counters), images of the return map, returns."""
    one, other = ((np.zeros(2), np.zeros(3), np.zeros(4, dtype=np.int64)) for _ in range(2))
    return *one, *other, np.zeros((3, 2)), np.zeros(max_period)


def _buffers(chain: Chain) -> tuple[Any, ...]:
    """A chain's arrays in the order in which the planar kernel takes them."""
    return (
        chain.section, chain.maximum, chain.minimum, chain.indicator_max, chain.indicator_min, chain.output_max,
        chain.output_min, chain.crossings, chain.contacts, chain.elapsed, chain.section_time, chain.section_mode,
        chain.status,
    )  # fmt: skip
