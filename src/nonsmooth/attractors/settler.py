"""Many starts brought to their attractors, judged, to a tolerance, with exponents: the work of charts and basins.

A *job* is a start at one parameter point. All jobs of a call run in one compiled loop (``mapper``), on a GPU in rounds.
What is done is decided in one place (``kernels.judging.settle``): a period number is granted with a certificate only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.mapper import Mapper
from nonsmooth.attractors.settle_cuda import separate_on_gpu, settle_on_gpu
from nonsmooth.attractors.settled import ROUNDED, SectionTrace, Settled, least_sizes, mode_at, usable
from nonsmooth.flow.engines.devices import engine_on_gpu, on_gpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray, State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import RTOL, engine_for
from nonsmooth.flow.failure import LEAST, beyond_stops
from nonsmooth.flow.loads import meter_of
from nonsmooth.flow.options import Settling, Solver, longest_period, solver_of
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Section
from nonsmooth.results.memory import room_for
from nonsmooth.system.transition import varying_phases

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Rules
    from nonsmooth.system.system import System


TOLERANCE = 1e-9  # of a return, in units of the motion's size
ATTEMPTS = 3  # further transients for a point that is still settling: of 1, 2 and 4 times the first
DIFFERENCE = 1e-6  # finite differences of the return map, in units of the motion's size
MEASURED = 200  # returns over which loads of a motion without a period are measured, at most
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
    plan: Section
    transient: int
    keep: int
    max_period: int
    stop_early: bool = True
    extremes: bool = True
    solver: Solver = field(default_factory=lambda: Solver())
    device: str = "cpu"
    tolerance: float = field(init=False)
    width: int = field(init=False)  # numbers that say where a run stands on the section (``trace``)

    def __post_init__(self) -> None:
        room_for(16.0 * self.keep * len(self.system.states), f"keep = {self.keep:.6g} section points", "keep fewer")
        tolerance = TOLERANCE  # no less than what the engine's own shows
        if self.engine.name != "exact":
            tolerance = max(TOLERANCE, 10.0 * getattr(self.engine, "rtol", RTOL))
        object.__setattr__(self, "tolerance", tolerance)
        u, m, forced = self.system.traced.u, self.system.traced.m, self.system.traced.period is not None
        object.__setattr__(self, "width", len(u) + len(m) + int(forced and self.plan.indicator >= 0))

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process as the system's text: what is compiled there comes from that machine's own cache."""
        given = {item.name: getattr(self, item.name) for item in fields(self) if item.init}
        options = {name: given.pop(name) for name in ("system", "engine")}
        text, values = options["system"].to_text(), dict(options["system"].values)
        return _remade, (text, values, options["engine"].name, given, self.told([self.plan.mode]))

    def told(self, modes: Any) -> Any:
        """Modes as data for another process: those made when they are first visited have numbers of this one."""
        patterns = self.system.traced.patterns
        return modes if patterns is None else np.array(patterns.visited)[modes]

    def retold(self, data: Any) -> Any:
        """The numbers of modes that were told."""
        patterns = self.system.traced.patterns
        if patterns is None:
            return data
        every, which = np.unique(np.atleast_2d(data), axis=0, return_inverse=True)
        numbers = np.array([patterns.retold_mode(one) for one in every], dtype=np.int64)
        return numbers[which.ravel()]

    def load(self) -> None:
        """Compile or load the kernels now, before threads ask for them."""
        from nonsmooth.kernels.compile.cache import compiled
        from nonsmooth.kernels.judging import driver

        if self.device == "cpu":
            for kernel in (self.engine.module().run, driver.settle_many, driver.separate_many):
                compiled(kernel)

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
            States, or places at which other runs ended (``last``). One beyond a rigid stop is not run:
            ``no_convergence``.
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
        n = len(self.system.states)
        if starts.shape[1] <= n + len(self.system.memory):  # it has no time of its own
            which = self.admissible(points[rows], starts, begin, carried)
            if len(which) < len(rows):
                found = Settled.empty(len(rows), n, self.width)
                found.status[:] = codes.NO_CONVERGENCE
                if len(which):
                    own = None if modes is None else np.asarray(modes)[which]
                    begun = points, rows[which], starts[which]
                    some = self.run(*begun, carried=carried, modes=own, begin=begin, attempts=attempts)
                    found.put(which, some)
                return found
        if modes is None:
            one = varying_phases(self.system.traced) is None
            modes = np.array([mode_at(self.system, begin, values) for values in points[: 1 if one else None]])
            modes = np.full(len(rows), modes[0]) if one else modes[rows]
        modes = np.array(modes, dtype=np.int64)
        if self.device == "cuda":
            assert not carried  # refused at the door
            return settle_on_gpu(self, points, rows, starts, modes, begin, attempts)
        # true extremes are dear: where returns are one period each, one more gives the motion's size
        beyond = int(self.plan.indicator < 0 and not self.engine.own_systems)
        plan = self.plan._replace(extremes=not beyond)
        mapper = Mapper(replace(self, plan=plan), self.engine.prepare(points), rows, starts, modes, begin)
        mapper.settle(self.rules(attempts, beyond), int(carried), self.extremes or not beyond)(len(rows))
        return mapper.settled()

    def admissible(self, points: FloatArray, starts: FloatArray, begin: float = 0.0, carried: bool = False) -> IntArray:
        """The starts, one for each point, that lie beyond no stop; where states are carried, all from the first on."""
        time: Any = 0.0
        if begin and self.system.period() is not None:
            time = begin * np.array([self.system.period_at(point) for point in points])
        good = ~beyond_stops(self.system, points, starts[:, : len(self.system.states)], time)
        return np.flatnonzero(np.logical_or.accumulate(good) if carried else good)

    def rules(self, attempts: int = ATTEMPTS, beyond: int = 0) -> Rules:
        """The rules of judgement; ``beyond`` as in :class:`nonsmooth.kernels.judging.settle.Rules`."""
        from nonsmooth.kernels.judging.settle import Rules

        # at rest a Runge-Kutta pair errs by atol: a difference must stand well above that
        clear = min(1e3 * self.tolerance, 1e-4) if self.engine.name == "rkf45" else DIFFERENCE
        scale = self.system.scale_vector()
        least, rounded = least_sizes(self.engine.name, scale)
        return Rules(
            self.transient,
            self.keep,
            self.max_period,
            FIRST_LOOK if self.stop_early else 0,
            attempts,
            beyond,
            self.tolerance,
            max(DIFFERENCE, 1e2 * self.tolerance, clear),
            least,
            rounded,
            LEAST * scale,
            ROUNDED,
        )

    @property
    def least(self) -> FloatArray:
        """The least size of a motion in each state: what is smaller has stopped."""
        return least_sizes(self.engine.name, self.system.scale_vector())[0]

    def least_at(self, maximum: FloatArray, minimum: FloatArray) -> FloatArray:
        """The least size of a motion with these extremes (..., n)."""
        least, rounded = least_sizes(self.engine.name, self.system.scale_vector())
        return np.asarray(np.fmax(least, rounded * np.maximum(np.abs(maximum), np.abs(minimum))))

    @property
    def section_phase(self) -> float:
        """Phase of the forcing at which the section stands; 0 where it is no phase."""
        return self.plan.phase if self.plan.indicator < 0 else 0.0

    def trace(self, point: FloatArray, place: FloatArray, mode: int, transient: int, keep: int) -> SectionTrace:
        """Section points of one run at one parameter point (1, n_parameters), from a place on the section."""
        tables, n = self.engine.prepare(point), len(self.system.states)
        state = self._state(place, mode, float(tables.period[0]))
        begin, out = state.clock[0], self.engine.kept(1, keep)
        self.engine.chain(tables, 0, 1, state, None, self.plan._replace(extremes=False), transient, keep, out)
        if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
            none = np.zeros(0)
            return SectionTrace(np.zeros((0, n)), np.zeros(0, dtype=np.int64), none, place, mode)
        end = np.append(state.place, state.clock[0])[: self.width]
        return SectionTrace(
            out.section[0], out.section_mode[0], out.section_time[0] - begin, end, int(state.counters[0])
        )

    def _state(self, place: FloatArray, mode: int, period: float) -> State:
        """The state of a run that goes on from a place."""
        n, strobed = len(self.system.states), self.plan.indicator < 0
        whole = n + len(self.system.traced.m)
        memory = place[n:whole].copy() if len(place) >= whole else self.system.memory_vector()
        state = State(place[:n].copy(), memory)
        state.counters[0] = mode
        if period < np.inf:
            state.clock[2] = period
            state.clock[0] = place[-1] if len(place) > whole else self.plan.phase * period if strobed else 0.0
        return state

    def loads(self, points: FloatArray, rows: Any, found: Settled) -> dict[str, FloatArray]:
        """Loads of elements (``flow.loads``) of J jobs that have settled, per return of their section, over the returns
        of a cycle, or as many as are kept (at most ``MEASURED``) where there is none; NaN where a run failed."""
        meter = meter_of(self.system)
        assert meter is not None  # refused at the door
        columns = {name: np.full(len(found.status), np.nan) for name in meter.per_period}
        for j in np.flatnonzero(usable(found.status)):
            point, returns = points[rows[j]], int(found.period_number[j]) or min(self.keep, MEASURED)
            period = self.system.period_at(point) or np.inf
            place, mode = found.last[j], int(found.mode[j])
            if self.plan.indicator < 0:
                duration = returns * period
            else:
                times = self.trace(point[None, :], place, mode, 0, returns).times
                if not len(times):
                    continue
                duration = float(times[-1])
            one = meter.over(self.engine, point, self._state(place, mode, period), duration, returns)
            for name, value in (one or {}).items():
                columns[name][j] = value
        return columns

    def exponents(
        self,
        points: FloatArray,
        rows: Any,
        starts: FloatArray,
        modes: Any,
        n_returns: int,
        maximum: FloatArray,
        minimum: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Largest Lyapunov exponents (per unit time) of J jobs that begin on the section, and their errors.

        Two neighbours over ``n_returns`` returns, put back to a small distance after each, in units of the motion's
        size by its extremes (J, n); NaN where one failed.
        """
        from nonsmooth.kernels.judging.judge import BATCHES, DISTANCE, RATE_SUMS

        points = np.ascontiguousarray(points, dtype=float)
        rows = np.ascontiguousarray(rows, dtype=np.int64)
        starts = np.ascontiguousarray(starts, dtype=float)
        modes = np.array(modes, dtype=np.int64)
        sizes = separation_sizes(maximum, minimum, self.system.scale_vector())
        batch = n_returns // BATCHES
        offsets, sums = DISTANCE * sizes, np.zeros((len(rows), RATE_SUMS))
        jobs = points, rows, starts, modes, batch // 4 + BATCHES * batch, batch
        if self.device == "cuda" and self.width == len(self.system.traced.u) + len(self.system.traced.m):
            status = separate_on_gpu(self, *jobs, sizes, offsets, sums)
        else:
            plan = self.plan._replace(extremes=False, every=1)
            if plan.indicator >= 0 and self.system.traced.period is not None:
                plan = Section(extremes=False)  # once per period, at the phase that a place has
            quiet = replace(self, plan=plan, keep=1, max_period=1)
            mapper = Mapper(quiet, self.engine.prepare(points), rows, starts, modes, self.section_phase)
            status = mapper.separate(*jobs[4:], sizes, offsets, sums)
        return rates(sums, status)


def settler_for(system: System, verb: str, options: Settling, *, carried: bool = False, **changes: Any) -> Settler:
    """The attractor mapper that a verb's options describe; what cannot be done on the device asked for is refused.

    Parameters
    ----------
    carried : bool
        Whether a state is carried from one parameter point to the next.
    **changes
        Fields of the mapper beyond its options.
    """
    plan = section_plan(system, options["section"])[1]
    longest = longest_period(options["keep"], options["max_period"])
    solver, device = solver_of(options), options["device"]
    engine = engine_for(system, **solver)
    if device == "cuda":
        engine = engine_on_gpu(engine, plan)
        on_gpu(device, verb, engine, plan, carried=carried)
    given = {"solver": solver, "device": device} | changes
    return Settler(system, engine, plan, options["transient"], options["keep"], longest, **given)


@lru_cache(maxsize=8)
def _system_from(text: str) -> System:
    """The same object for the same text: tracing takes longer than a chunk."""
    from nonsmooth.system.system import System

    return System.from_text(text)


def _remade(text: str, values: Mapping[str, float], method: str, given: Mapping[str, Any], mode: Any) -> Settler:
    system = _system_from(text).with_parameters(values)
    # "auto" takes tolerances that the exact flow has no use for
    engine = engine_for(system, **given["solver"] | {"method": "auto" if method == "exact" else method})
    found = Settler(system, engine, **given)
    plan = found.plan
    return found if plan.mode < 0 else replace(found, plan=plan._replace(mode=int(found.retold(mode)[0])))


USUAL = 1.5  # powers of ten: a motion this near to its scale is taken to have that size
SLENDER = 1e-6  # a state whose motion is smaller than this, beside the largest of the others, is at rest
RESTING = 1e-9  # in units of the scales: a motion that has come to rest in all states
AT_REST = 1e-3


def separation_sizes(maximum: FloatArray, minimum: FloatArray, scale: FloatArray) -> FloatArray:
    """Sizes (J, n) by which neighbours of J motions are told apart: those of the motions, in powers of ten.

    The states' ``scale`` will not do: neighbours of a motion in micrometres would be as far apart as it is wide, and
    those of a motion in pascals equal within rounding. Extremes that are not known (NaN) give the scale.
    """
    half = np.nan_to_num(0.5 * (maximum - minimum)) / scale
    value = np.nan_to_num(np.maximum(np.abs(maximum), np.abs(minimum))) / scale
    widest = half.max(axis=1, keepdims=True, initial=0.0)
    size = np.maximum(half, SLENDER * widest)
    size = np.maximum(np.where(widest < RESTING, AT_REST, size), ROUNDED * value)
    power = np.log10(size)
    power = np.where((np.abs(power) < USUAL) | np.isnan(maximum).all(axis=1, keepdims=True), 0.0, np.rint(power))
    return np.asarray(scale * 10.0**power)


def rates(sums: FloatArray, status: IntArray) -> tuple[FloatArray, FloatArray]:
    """Exponents per unit time and their standard errors (J,) from the sums of J jobs; NaN where a run failed."""
    from nonsmooth.kernels.judging.judge import BATCHES, MEAN_RATE, SQUARED_RATES

    good = np.isin(status, (codes.OK, codes.NOT_GUARANTEED))
    error = np.sqrt(sums[:, SQUARED_RATES] / (BATCHES * (BATCHES - 1)))
    return np.where(good, sums[:, MEAN_RATE], np.nan), np.where(good, error, np.nan)
