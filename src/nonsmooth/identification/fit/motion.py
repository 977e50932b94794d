"""The motion of a window of a record at its samples, with derivatives in its start, in parameters and in its phase."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.flow.engines.engine import State, TrajectoryLog
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.inputs import DelayedInputs, Driven
from nonsmooth.flow.sensitivity import Variation, held
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.system import System

KEPT = 100_000  # samples of the motions that a marcher keeps
STEPS = 1000  # between two readings: a motion that takes more is none that they tell of
RTOL = 1e-11  # where the flow is not exact: below any noise, and below what a step of a fit changes


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """States at the samples; with derivatives where they were asked for.

    Attributes
    ----------
    time : array (N,)
        The system's time: that of the record, and what the phase adds.
    z : array (N, n)
        States and memory.
    mode, segment : array (N,) of int
        The mode, and how many transitions came before.
    log : TrajectoryLog
    start : array (n,)
        States and memory at the beginning.
    course, changes
        The inputs of the run, the instants at which they change, and the log's samples there.
    rate : array (N, n), D : array (N, n, n + n_active), of_time : array (N, n)
        dz/dt; derivatives in the start z and in the active parameters; in the time of the whole window.
    """

    time: FloatArray
    z: FloatArray
    mode: IntArray
    segment: IntArray
    log: TrajectoryLog
    start: FloatArray
    course: DelayedInputs | None
    changes: tuple[FloatArray, IntArray]
    rate: FloatArray | None = None
    D: FloatArray | None = None
    of_time: FloatArray | None = None


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
        derivatives: bool = False,
        drive: Driven | None = None,
    ) -> SampledMotion | None:
        """March from (begin, z, mode) to the samples; None where the run does not come to its end."""
        key, size = (values.tobytes(), begin, times.tobytes(), z.tobytes(), mode, drive), len(times)
        plain = self.once(key, size, lambda: self._marched(values, begin, times, z, mode, drive))
        if plain is None or not derivatives:
            return plain

        def derived() -> SampledMotion | None:
            """None where derivatives are not known: of a start at which several contacts are hit."""
            start, places = (mode, plain.start), (plain.time, plain.z)
            try:
                run = Variation(self.flow, values, plain.log, start, begin, *places, plain.course, plain.changes)
            except ValueError:
                return None
            return replace(plain, rate=run.rate, D=run.D, of_time=run.of_time)

        return self.once((*key, True), size, derived)

    def once(self, key: Any, size: int, compute: Callable[[], Any]) -> Any:
        """Return what is computed under a key; the last are kept, as many as there is room for of this size."""
        self._kept[key] = found = self._kept.pop(key) if key in self._kept else compute()
        while len(self._kept) * size > KEPT:
            del self._kept[next(iter(self._kept))]
        return found

    def _marched(
        self, values: FloatArray, begin: float, times: FloatArray, z: FloatArray, mode: int, drive: Driven | None
    ) -> SampledMotion | None:
        period = self.system.period_at(values)
        n_u = len(self.traced.u)
        whole = 0.0 if period is None else float(np.floor(begin / period))
        state = State(z[:n_u].copy(), z[n_u:].copy())
        state.clock[:2] = (begin, 0.0) if period is None else (begin - whole * period, whole)
        state.counters[0] = mode
        # the start itself is a sample too: there the transitions that hold already have been taken
        if self._tables[0] != values.tobytes():  # many windows at the same parameters
            self._tables = values.tobytes(), self.engine.prepare(values[None, :])
        course, changes, instants = None, None, times
        if drive is not None:
            course = drive.at(dict(zip(self.traced.parameter_names, values.tolist(), strict=True)))
            state.u[course.first :] = course.at(begin)
            z, changes = np.concatenate([state.u, state.memory]), course.changes(begin, times[-1])
            instants = np.union1d(times, changes.times)
        samples, most = np.append(begin, instants), STEPS * len(instants)
        log = self.engine.record(self._tables[1], state, times[-1], samples, changes=changes, most=most)
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            return None
        u = np.hstack([held(log.sample_u), log.sample_memory])
        if not np.isfinite(u).all():
            return None
        at = slice(1, None) if changes is None else 1 + np.searchsorted(instants, times)
        cuts = np.zeros(0) if changes is None else changes.times
        where = cuts, 1 + np.searchsorted(instants, cuts)
        return SampledMotion(times, u[at], log.sample_mode[at], log.sample_segment[at], log, z.copy(), course, where)
