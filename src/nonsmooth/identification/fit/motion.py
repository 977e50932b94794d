"""The motion of a window of a record at its samples, with derivatives in its start, in parameters and in its phase."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.inputs import Driven
from nonsmooth.flow.sensitivity import SampledRun, Variation, held, sampled
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.system import System

KEPT = 100_000  # samples of the motions that a marcher keeps
STEPS = 1000  # between two readings: a motion that takes more is none that they tell of
RTOL = 1e-11  # where the flow is not exact: below any noise, and below what a step of a fit changes


class OtherSide(NamedTuple):
    """Samples (K,) on the other side of a transition: which, by how many segments moved, the transition's time, and
    the modes and states there."""

    at: IntArray
    moved: IntArray
    time: FloatArray
    mode: IntArray
    z: FloatArray


Sides = tuple[tuple[FloatArray, IntArray], tuple[FloatArray, IntArray]]  # states and modes before and after transitions


class Marcher:
    """Marches windows of one system, and differentiates in its ``active`` parameters.

    Motions asked for last are kept: a fit asks for the same again, with derivatives where it goes on, and with other
    noise."""

    def __init__(self, system: System, active: tuple[str, ...]) -> None:
        self.system, self.traced = system, system.traced
        self.flow = VariationalFlow.of(system, active)
        engine = engine_for(system)
        self.engine: Engine = engine if engine.name == "exact" else engine_for(system, rtol=RTOL)
        self._tables: tuple[bytes | None, Any] = None, None
        self._kept: dict[Any, Any] = {}

    def run(
        self,
        values: FloatArray,
        begin: float,
        times: FloatArray,
        z: FloatArray,
        mode: int,
        drive: Driven | None = None,
    ) -> SampledRun | None:
        """March from (begin, z, mode) to the samples; None where the run does not come to its end."""
        key = values.tobytes(), begin, times.tobytes(), z.tobytes(), mode, drive
        return self.once(key, len(times), lambda: self._marched(values, begin, times, z, mode, drive))

    def differentiated(self, values: FloatArray, motion: SampledRun) -> SampledRun | None:
        """The motion with its derivatives; None where they are not known: of a start at which several contacts are
        hit."""

        def derived() -> SampledRun | None:
            try:
                run = Variation(self.flow, values, motion)
            except ValueError:
                return None
            return replace(motion, rate=run.rate, D=run.D, of_time=run.of_time)

        return self.once((id(motion.log), np.asarray(motion.moved).tobytes()), len(motion.time), derived)

    def beside(
        self, values: FloatArray, motion: SampledRun, reach: float, jumps: Callable[[FloatArray, Sides], BoolArray]
    ) -> OtherSide | None:
        """The samples no farther than ``reach`` from a transition, as they are where it is taken later, or has been
        taken before; of those transitions only that ``jumps`` tells of their times and sides. None where there are
        none."""
        self.flow.catch_up()
        log, t, known = motion.log, motion.time, self.flow.traced.transitions
        first = np.flatnonzero(np.diff(log.crossing_time, prepend=-np.inf) > 0)  # of those at one instant
        last, every = np.append(first[1:], len(log.crossing_time)) - 1, log.crossing_time[first]
        memories = np.vstack([motion.start[1][None, len(self.traced.u) :], log.memory_after])
        before = np.array([known[k].source for k in log.crossing_transition[first].tolist()])
        after = np.array([known[k].target for k in log.crossing_transition[last].tolist()])
        sides = (
            (np.hstack([held(log.u_before)[first], memories[first]]), before),
            (np.hstack([held(log.u_after)[last], memories[last + 1]]), after),
        )
        which = np.flatnonzero(jumps(every, sides))
        if not len(which):
            return None
        low, high = np.searchsorted(t, every[which] - reach), np.searchsorted(t, every[which] + reach, "right")
        of = np.repeat(which, high - low)
        at = np.arange(len(of)) - np.repeat(np.cumsum(high - low) - high, high - low)
        behind, changes = t[at] >= every[of], motion.changes[0]
        bounds, ends = np.union1d(every, changes), np.sort([t[at], every[of]], axis=0)
        here = np.isin(t[at], changes) & (t[at] != every[of])  # inputs change at the sample, not on the way to it
        between = np.searchsorted(bounds, ends[1], "right") - np.searchsorted(bounds, ends[0]) - here
        at, of, behind, here = (column[between == 1] for column in (at, of, behind, here))
        time, moved = every[of], np.where(behind, -1 - here, 1)
        (z, mode), (z_after, mode_after) = ((states[of], modes[of]) for states, modes in sides)
        z, mode = np.where(behind[:, None], z, z_after), np.where(behind, mode, mode_after)
        legs = self.flow.segments(values, mode, time, t[at] - time, z)
        told = (legs.status == codes.OK) & np.isfinite(legs.z).all(axis=1)
        return OtherSide(*(column[told] for column in (at, moved, time, mode, legs.z)))

    def once(self, key: Any, size: int, compute: Callable[[], Any]) -> Any:
        """Return what is computed under a key; the last are kept, as many as there is room for of this size."""
        self._kept[key] = found = self._kept.pop(key) if key in self._kept else compute()
        while len(self._kept) * size > KEPT:
            del self._kept[next(iter(self._kept))]
        return found

    def _marched(
        self, values: FloatArray, begin: float, times: FloatArray, z: FloatArray, mode: int, drive: Driven | None
    ) -> SampledRun | None:
        period = self.system.period_at(values)
        n_u = len(self.traced.u)
        whole = 0.0 if period is None else float(np.floor(begin / period))
        state = State(z[:n_u].copy(), z[n_u:].copy())
        state.clock[:2] = (begin, 0.0) if period is None else (begin - whole * period, whole)
        state.counters[0] = mode
        if self._tables[0] != values.tobytes():  # many windows at the same parameters
            self._tables = values.tobytes(), self.engine.prepare(values[None, :])
        course = None
        if drive is not None:
            course = drive.at(dict(zip(self.traced.parameter_names, values.tolist(), strict=True)))
        run = sampled(self.engine, self._tables[1], state, begin, times, course, STEPS)
        good = run.log.status in (codes.OK, codes.NOT_GUARANTEED) and np.isfinite(run.z).all()
        return run if good else None
