"""The motion of a window of a record at its samples, with derivatives in its start, in parameters and in its phase."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.inputs import Driven
from nonsmooth.flow.sampled import SampledRun, sampled
from nonsmooth.flow.sensitivity import Variation
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.system import System

KEPT = 100_000  # samples of the motions that a marcher keeps
STEPS = 1000  # between two readings: a motion that takes more is none that they tell of
RTOL = 1e-11  # where the flow is not exact: below any noise, and below what a step of a fit changes


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

        def marched() -> SampledRun | None:
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

        key = values.tobytes(), begin, times.tobytes(), z.tobytes(), mode, drive
        return self.once(key, len(times), marched)

    def differentiated(self, values: FloatArray, motion: SampledRun) -> SampledRun | None:
        """The motion with its derivatives; None where they are not known: of a start at which several contacts are
        hit."""

        def derived() -> SampledRun | None:
            try:
                run = Variation(self.flow, values, motion)
            except ValueError:
                return None
            return replace(motion, rate=run.rate, D=run.D, of_time=run.of_time)

        moved = np.asarray(motion.moved).tobytes()  # what is derived of a log keeps it, and its id, alive
        return self.once((id(motion.log), moved), len(motion.time), derived)

    def once(self, key: Any, size: int, compute: Callable[[], Any]) -> Any:
        """Return what is computed under a key; the last are kept, as many as there is room for of this size."""
        self._kept[key] = found = self._kept.pop(key) if key in self._kept else compute()
        while len(self._kept) * size > KEPT:
            del self._kept[next(iter(self._kept))]
        return found
