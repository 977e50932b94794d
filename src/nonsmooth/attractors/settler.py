"""Many starts brought to their attractors and judged: the work behind charts and basins.

A *job* is a start at one parameter point. Linear systems with the exact flow and a stroboscopic section run their jobs
in one compiled call (``compiled``); all others go through ``attractors.settle`` one by one. What is done is
decided in one place (``kernels.settle``): a period number is granted with a certificate only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.compiled import exponents_compiled, load, run_compiled
from nonsmooth.attractors.exponents import rates, separate_one_by_one, separation_sizes
from nonsmooth.attractors.settle import ATTEMPTS, Attractors, rules_of, tolerance_of
from nonsmooth.attractors.settle_cuda import separate_on_gpu, settle_on_gpu
from nonsmooth.attractors.settled import Settled, least_sizes, usable
from nonsmooth.attractors.trace import Trace, mode_at, period_of, place_of, state_at, trace
from nonsmooth.flow.engines.engine import Chain, Engine, FloatArray, IntArray, SectionPlan, State
from nonsmooth.flow.engines.linear import LinearEngine
from nonsmooth.flow.engines.loop import LoopEngine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.results.memory import room_for
from nonsmooth.system.phases import varying_phases

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Rules
    from nonsmooth.system.system import System

__all__ = ["FIRST_LOOK", "Settler"]

FIRST_LOOK = 40  # returns after which a point is judged for the first time, where it may stop early


@dataclass(frozen=True)
class Settler:
    """The way jobs are run: an engine, a section, and how long to wait.

    Parameters
    ----------
    stop_early : bool
        A job ends as soon as its period number is certain, not at the end of the transient.
    extremes : bool
        Whether extremes are wanted; they cost time where the motion is not periodic.
    device : str
        ``"cpu"`` or ``"cuda"``: see :mod:`nonsmooth.flow.engines.devices`.
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
    device: str = "cpu"
    tolerance: float = field(init=False)
    width: int = field(init=False)  # numbers that say where a run stands on the section (``trace``)

    def __post_init__(self) -> None:
        room_for(16.0 * self.keep * len(self.system.states), f"keep = {self.keep:.6g} section points", "keep fewer")
        object.__setattr__(self, "tolerance", tolerance_of(self.engine, self.rtol))
        u, m, forced = self.system.traced.u, self.system.traced.m, self.system.traced.period is not None
        object.__setattr__(self, "width", len(u) + len(m) + int(forced and self.plan.indicator >= 0))

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process as the system's text: what is compiled there comes from that machine's own cache."""
        given = {item.name: getattr(self, item.name) for item in fields(self) if item.init}
        options = {name: given.pop(name) for name in ("system", "engine")}
        text, values = options["system"].to_text(), dict(options["system"].values)
        return _remade, (text, values, options["engine"].name, given)

    @property
    def compiled(self) -> LoopEngine | None:
        """The engine whose jobs run in one compiled call; None where they run one by one: modes that are made on the
        way, what elements decide together, phases that depend on the parameters, sections on a surface."""
        engine = self.engine
        if not isinstance(engine, LinearEngine | SeriesEngine) or engine.traced.decider is not None:
            return None
        return engine if engine.phases is None and self.plan.indicator < 0 else None

    def load(self) -> None:
        """Compile or load the kernel now, before threads ask for it."""
        if self.compiled is not None and self.device == "cpu":
            load(self.compiled)

    def run(
        self,
        points: FloatArray,
        rows: Any,
        starts: FloatArray,
        *,
        carried: bool = False,
        modes: Any = None,
        begin: float = 0.0,
        attempts: int = ATTEMPTS,
    ) -> Settled:
        """Run J jobs one after the other.

        Parameters
        ----------
        points : array (P, n_parameters)
        rows : array (J,) of int
            The parameter point of each job.
        starts : array (J, n) or (J, width)
            States, or places at which other runs ended (``last``).
        carried : bool
            Job j goes on from where job j - 1 ended (from its own start where that failed).
        modes : array (J,) of int, optional
            Mode at the start; that of the phase (:func:`.mode_at`) where not given.
        begin : float
            Phase of the forcing at the starts, in periods, where they do not say it themselves.
        attempts : int
            Further transients (of 1, 2, 4 times the first) for a point that is still settling.
        """
        rows = np.ascontiguousarray(rows, dtype=np.int64)
        starts = np.ascontiguousarray(starts, dtype=float)
        points = np.ascontiguousarray(points, dtype=float)
        if modes is None:
            one = varying_phases(self.system.traced) is None
            modes = np.array([mode_at(self.system, begin, values) for values in points[: 1 if one else None]])
            modes = np.full(len(rows), modes[0]) if one else modes[rows]
        modes = np.array(modes, dtype=np.int64)
        if self.device == "cuda":
            assert not carried  # refused at the door
            return settle_on_gpu(self, points, rows, starts, modes, begin, attempts)
        if self.compiled is None:
            return self._run_one_by_one(points, rows, starts, carried, modes, begin, attempts)
        return run_compiled(
            self.compiled, points, rows, starts, self.system.memory_vector(), modes, begin, self.plan.phase, carried,
            self.extremes, self.rules(attempts, beyond=1),
        )  # fmt: skip

    def rules(self, attempts: int = ATTEMPTS, beyond: int = 0) -> Rules:
        """The rules of judgement; ``beyond`` as in :class:`nonsmooth.kernels.judging.settle.Rules`."""
        return rules_of(
            self.engine.name, self.transient, self.keep, self.max_period, self.tolerance, self.system.scale_vector(),
            FIRST_LOOK if self.stop_early else 0, attempts, beyond,
        )  # fmt: skip

    @property
    def least(self) -> FloatArray:
        """The least size of a motion in each state: what is smaller has stopped."""
        return least_sizes(self.engine.name, self.system.scale_vector())[0]

    def least_at(self, maximum: FloatArray, minimum: FloatArray) -> FloatArray:
        """The least size of a motion with these extremes (..., n)."""
        least, rounded = least_sizes(self.engine.name, self.system.scale_vector())
        return np.maximum(least, rounded * np.maximum(np.abs(maximum), np.abs(minimum)))

    @property
    def section_phase(self) -> float:
        """Phase of the forcing at which the section stands; 0 where it is no phase."""
        return self.plan.phase if self.plan.indicator < 0 else 0.0

    def trace(self, point: FloatArray, place: FloatArray, mode: int, transient: int, keep: int) -> Trace:
        """Section points of one run at one parameter point (1, n_parameters), from a place on the section."""
        return trace(self.system, self.engine, self.plan, point, place, mode, transient, keep, self.width)

    def exponents(
        self, points: FloatArray, rows: Any, starts: FloatArray, modes: Any, n_returns: int, maximum: FloatArray,
        minimum: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """Largest Lyapunov exponents (per unit time) of J jobs that begin on the section, and their errors.

        Two neighbours over ``n_returns`` returns, put back to a small distance after each, in units of the motion's
        size by its extremes (J, n); NaN where one failed.
        """
        points = np.ascontiguousarray(points, dtype=float)
        rows = np.ascontiguousarray(rows, dtype=np.int64)
        starts = np.ascontiguousarray(starts, dtype=float)
        modes = np.array(modes, dtype=np.int64)
        sizes = separation_sizes(maximum, minimum, self.system.scale_vector())
        largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
        for size in np.unique(sizes, axis=0):
            jobs = np.flatnonzero((sizes == size).all(axis=1))
            largest[jobs], error[jobs] = self._parted(points, rows[jobs], starts[jobs], modes[jobs], n_returns, size)
        return largest, error

    def _parted(
        self, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int, size: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Exponents of jobs whose motions are of one size."""
        from nonsmooth.kernels.judging.exponent import BATCHES, DISTANCE, RATE_SUMS

        batch = n_returns // BATCHES
        offsets, sums = np.tile(DISTANCE * size, (len(rows), 1)), np.zeros((len(rows), RATE_SUMS))
        jobs = points, rows, starts, modes, batch // 4 + BATCHES * batch, batch
        if self.device == "cuda" and self.width == len(self.system.traced.u) + len(self.system.traced.m):
            status = separate_on_gpu(self, *jobs, size, offsets, sums)
        elif self.compiled is not None:
            status = exponents_compiled(
                self.compiled, *jobs[:3], self.system.memory_vector(), *jobs[3:], self.plan.phase, size, offsets, sums
            )
        else:
            status = separate_one_by_one(self.system, self.engine, self.plan, *jobs, size, offsets, sums)
        return rates(sums, status)

    def _run_one_by_one(
        self, points: FloatArray, rows: IntArray, starts: FloatArray, carried: bool, modes: IntArray, begin: float,
        attempts: int,
    ) -> Settled:  # fmt: skip
        system, traced = self.system, self.system.traced
        tables = self.engine.prepare(points)
        attractors = Attractors(
            self.engine, tables, self.plan, self.transient, self.keep, self.max_period, self.tolerance,
            system.scale_vector(), FIRST_LOOK if self.stop_early else 0, attempts,
        )  # fmt: skip
        out = Chain.empty(len(points), self.keep, len(traced.u), len(traced.indicators), len(traced.outputs))
        found = Settled.empty(len(rows), len(traced.u), self.width)
        state: State | None = None
        for j, i in enumerate(rows):

            def fresh(j: int = j, i: int = i) -> State:
                period = period_of(tables, i)
                return state_at(system, starts[j], int(modes[j]), begin * period, period)

            if state is None or not carried:
                state = fresh()
            verdict = attractors.settle(int(i), state, out, fresh)
            for name in ("period_number", "status", "residual", "multiplier", "returns"):
                getattr(found, name)[j] = getattr(verdict, name)
            if not usable(verdict.status):
                state = None
                continue
            # counts and extremes over one whole cycle: the kept window may begin before it was reached
            p, cycle = verdict.period_number, out
            if p:
                cycle = Chain.empty(int(i) + 1, p, len(traced.u), len(traced.indicators), len(traced.outputs))
                self.engine.chain(tables, int(i), int(i) + 1, state.copy(), None, self.plan, 0, p, cycle)
            n = p or self.keep
            found.crossings[j], found.contacts[j] = cycle.crossings[i] / n, cycle.contacts[i] / n
            found.maximum[j], found.minimum[j] = cycle.maximum[i], cycle.minimum[i]
            found.last[j], found.mode[j] = place_of(state, self.width), state.counters[0]
        return found


@lru_cache(maxsize=8)
def _system_from(text: str) -> System:
    """The same object for the same text: tracing takes longer than a chunk."""
    from nonsmooth.system.system import System

    return System.from_text(text)


def _remade(text: str, values: Mapping[str, float], method: str, given: Mapping[str, Any]) -> Settler:
    system = _system_from(text).with_parameters(values)
    # "auto" takes tolerances that the exact flow has no use for
    engine = engine_for(
        system, "auto" if method == "exact" else method, given["rtol"], given["atol"], **given["expert"]
    )
    return Settler(system, engine, **given)
