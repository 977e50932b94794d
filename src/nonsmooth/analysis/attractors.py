"""Many starts brought to their attractors and judged: the work behind charts and basins.

A *job* is a start at one parameter point. Systems of two states with the exact flow and a stroboscopic section run
their jobs in one compiled call (``attractors_compiled``); all others go through ``analysis.settle`` one by one. The
rules of judgement are the same: a period number is granted with a certificate only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.analysis.attractors_compiled import exponents_compiled, load, run_compiled
from nonsmooth.analysis.attractors_cuda import exponents_on_gpu, run_on_gpu
from nonsmooth.analysis.attractors_parting import exponent_of, parting_sizes
from nonsmooth.analysis.attractors_trace import Trace, mode_at, period_of, place_of, state_at, trace
from nonsmooth.analysis.classify import Verdict
from nonsmooth.analysis.series_cuda import series_exponents_on_gpu, settle_series_on_gpu
from nonsmooth.analysis.settle import LONGER, Attractors, tolerance_of
from nonsmooth.analysis.settled import Settled, least_sizes, usable
from nonsmooth.flow.engine import Chain, Engine, FloatArray, IntArray, SectionPlan, State
from nonsmooth.flow.linear import PlanarEngine
from nonsmooth.flow.methods import engine_for
from nonsmooth.kernels import codes
from nonsmooth.results.memory import room_for

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["FIRST_LOOK", "Settler"]

FIRST_LOOK = 40  # returns after which a point is judged for the first time, where it may stop early


@dataclass(frozen=True)
class Settler:
    """How jobs are run: an engine, a section, and how long to wait.

    Parameters
    ----------
    stop_early : bool
        A job ends as soon as its period number is certain, not at the end of the transient.
    extremes : bool
        Whether extremes are wanted; they cost time where the motion is not periodic.
    device : str
        ``"cpu"`` or ``"cuda"``: see :mod:`nonsmooth.flow.devices`.
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
    width: int = field(init=False)  # numbers that say where a run stands on the section (``attractors_trace``)

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
    def planar(self) -> PlanarEngine | None:
        """The engine whose jobs run in one compiled call; None where they run one by one."""
        return self.engine if isinstance(self.engine, PlanarEngine) and self.plan.indicator < 0 else None

    def load(self) -> None:
        """Compile or load the kernel now, before threads ask for it."""
        if self.planar is not None and self.device == "cpu":
            from nonsmooth.kernels.cache import compiled

            compiled(load(self.planar).settle_many)

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
        if modes is None:
            modes = np.full(len(rows), mode_at(self.system, begin))
        modes = np.array(modes, dtype=np.int64)
        points = np.ascontiguousarray(points, dtype=float)
        if self.planar is None and self.device == "cuda":
            assert not carried  # refused at the door
            return settle_series_on_gpu(self, points, rows, starts, modes, begin, attempts, FIRST_LOOK)
        if self.planar is None:
            return self._run_one_by_one(points, rows, starts, carried, modes, begin, attempts)
        choice = (
            self.transient, self.keep, self.max_period, FIRST_LOOK if self.stop_early else 0, attempts, carried,
            self.extremes,
        )  # fmt: skip
        return (run_on_gpu if self.device == "cuda" else run_compiled)(
            self.planar, points, rows, starts, modes, begin, self.plan.phase, choice, self.tolerance, self.least
        )

    @property
    def least(self) -> FloatArray:
        """The least size of a motion in each state: what is smaller has come to rest."""
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
        sizes = parting_sizes(maximum, minimum, self.system.scale_vector())
        largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
        for size in np.unique(sizes, axis=0):
            jobs = np.flatnonzero((sizes == size).all(axis=1))
            largest[jobs], error[jobs] = self._parted(points, rows[jobs], starts[jobs], modes[jobs], n_returns, size)
        return largest, error

    def _parted(
        self, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int, size: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Exponents of jobs whose motions are of one size."""
        if self.planar is not None and self.device == "cuda":
            return exponents_on_gpu(self.planar, points, rows, starts, modes, n_returns, self.plan.phase, size)
        if self.planar is not None:
            return exponents_compiled(
                self.planar, points, rows, starts, modes, n_returns, self.plan.phase, size, self.max_period
            )
        if self.device == "cuda" and self.width == len(self.system.traced.u) + len(self.system.traced.m):
            return series_exponents_on_gpu(self, points, rows, starts, modes, n_returns, size)
        found = [
            exponent_of(
                self.system, self.engine, self.plan, points[i : i + 1], starts[j], int(modes[j]), n_returns, size
            )
            for j, i in enumerate(rows)
        ]
        largest, error = np.array(found).reshape(-1, 2).T
        return largest, error

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
        found = Settled.empty(len(rows), len(traced.u), self.width)
        state: State | None = None
        for j, i in enumerate(rows):

            def fresh(j: int = j, i: int = i) -> State:
                period = period_of(tables, i)
                return state_at(system, starts[j], int(modes[j]), begin * period, period)

            if state is None or not carried:
                state = fresh()
            verdict, found.returns[j] = self._settle(attractors, int(i), state, out, fresh)
            found.period_number[j], found.status[j] = verdict.period_number, verdict.status
            found.residual[j], found.multiplier[j] = verdict.residual, verdict.multiplier
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
    # "auto" takes tolerances that the exact flow has no use for
    engine = engine_for(
        system, "auto" if method == "exact" else method, given["rtol"], given["atol"], **given["expert"]
    )
    return Settler(system, engine, **given)
