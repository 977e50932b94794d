"""Trajectories of the series methods on a GPU: copies of the tables there, and launches that stay short."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.flow.engine import FloatArray, IntArray, SectionPlan
from nonsmooth.flow.launches import launch
from nonsmooth.flow.series import SeriesEngine
from nonsmooth.flow.series_tables import Tables
from nonsmooth.kernels import codes

__all__ = ["PART", "STEPS", "Buffers", "SeriesOnGpu", "States", "module_of"]

STEPS = 1024  # of one launch, at most: below a second also on a small GPU
PART = 0.75  # of ``devices.batch_size`` in one launch: what the registers hold by the compiler's choice (168 of each)


@dataclass
class States:
    """Where N trajectories are, on the GPU: states, memory, clocks, modes, and the parameter row of each."""

    u: Any  # (N, n)
    memory: Any  # (N, n_memory), at least one column
    clock: Any  # (N, 3)
    counters: Any  # (N, 4)
    rows: Any  # (N,)

    def all(self) -> tuple[Any, ...]:
        return self.u, self.memory, self.clock, self.counters

    def taken(self, cuda: Any, which: IntArray, moved: FloatArray) -> States:
        """New states beside some of these: ``moved`` is added to their u."""
        parts = [part.copy_to_host()[which] for part in (*self.all(), self.rows)]
        parts[0] = parts[0] + moved
        return States(*map(cuda.to_device, parts))

    def copy(self, cuda: Any) -> States:
        return self.taken(cuda, np.arange(len(self.rows)), np.zeros((1, 1)))

    def push(self, which: IntArray, moved: FloatArray) -> None:
        """Add ``moved`` to some of the states."""
        if len(which):
            u = self.u.copy_to_host()
            u[which] += moved
            self.u.copy_to_device(u)

    def restore(self, other: States, which: IntArray) -> None:
        """Put some of them where they are in ``other``."""
        for mine, its in zip(self.all(), other.all(), strict=True):
            found = mine.copy_to_host()
            found[which] = its.copy_to_host()[which]
            mine.copy_to_device(found)


@dataclass
class Buffers:
    """What a run leaves behind for N trajectories, on the GPU, and what it needs to go on after a launch."""

    whole: Any  # (numbers, N)
    real: Any
    sections: Any  # (N, keep, n + 2): section points with time and mode
    extremes: Any  # (N, 2, rows): maxima and minima of states, indicators, outputs
    crossings: Any  # (N,)
    contacts: Any
    elapsed: Any
    status: Any

    def all(self) -> tuple[Any, ...]:
        return tuple(vars(self).values())


def module_of(engine: SeriesEngine, tables: Tables) -> Any:
    """The kernels for an engine's system, method and order."""
    from nonsmooth.kernels.cuda_series_module import cuda_series_module, cuda_series_source
    from nonsmooth.system.generate import model_source

    net, form = engine.net, engine.generated(tables)
    sizes = {
        "METHOD": form.method, "ORDER": form.order, "CHECKED": form.checked, "CORNERS": form.corners,
        "NONLINEAR_ROWS": form.nonlinear_rows, "N_GUARDS": form.guards, "N_PARAMETERS": len(engine.traced.p),
        "N_INDICATORS": form.indicators, "N_OUTPUTS": form.outputs, "N_MEMORY": len(engine.traced.m),
        "N_SCRATCH_ROWS": engine.model.n_scratch,
    }  # fmt: skip
    arrays = {
        "TRANSITIONS": _filled(net.transitions, (1, 3)), "ROWS": net.rows, "ROW_START": net.row_start,
        "MODE_START": net.mode_start, "MODE_LIST": _filled(net.mode_list, (1,)),
        "AT": net.at if len(net.at) else np.full(1, -1.0), "LACKING": engine.lacking, "KINDS": engine.kinds,
    }  # fmt: skip
    return cuda_series_module(cuda_series_source(model_source(engine.layers.model), sizes, arrays))


def _filled(array: Any, shape: tuple[int, ...]) -> Any:
    return array if array.size else np.zeros(shape, dtype=array.dtype)


class SeriesOnGpu:
    """An engine's parameter points on the GPU, and the runs from there to a section.

    Parameters
    ----------
    engine : SeriesEngine
        ``"taylor"`` with crossings located.
    points : array (P, n_parameters)
    plan : SectionPlan
    """

    def __init__(self, engine: SeriesEngine, points: FloatArray, plan: SectionPlan) -> None:
        from nonsmooth.kernels.cuda_target import THREADS, cuda

        tables = engine.prepare(points)
        traced = engine.traced
        self.n, self.n_memory = len(traced.u), len(traced.m)
        self.rows = self.n + len(traced.indicators) + len(traced.outputs)
        self.module, self.cuda, self.threads, self.plan = module_of(engine, tables), cuda, THREADS, plan
        self.period: FloatArray = tables.period
        self.repeats = engine.repeats
        columns = points.T if points.shape[1] else np.zeros((1, len(points)))
        phase = plan.phase if plan.indicator < 0 else 0.0
        step = 0.0 if engine.step is None else engine.step
        self.tables = (
            *map(cuda.to_device, (np.ascontiguousarray(columns), tables.period, tables.steps)),
            tuple(map(cuda.to_device, engine.norms)),
            cuda.to_device(np.array([plan.indicator, plan.rising, plan.mode, plan.after, plan.every], dtype=np.int64)),
            cuda.to_device(np.array([engine.rtol, step, phase, min(plan.t_max, 1e300)])),
        )

    def launch(self, entry: Any, jobs: IntArray, *arguments: Any) -> None:
        """One thread for each job; waits for nothing."""
        launch(entry, self.threads, self.cuda.to_device(jobs), *arguments)

    def states(self, rows: IntArray, u: FloatArray, memory: FloatArray, modes: IntArray, clock: FloatArray) -> States:
        """States of N trajectories with their clocks (see :class:`engine.State`)."""
        counters, room = np.zeros((len(rows), 4), dtype=np.int64), np.zeros((len(rows), max(self.n_memory, 1)))
        counters[:, 0], counters[:, 1], room[:, : self.n_memory] = modes, -1, memory
        parts = (np.array(u, dtype=float), room, np.array(clock, dtype=float), counters, np.asarray(rows))
        return States(*map(self.cuda.to_device, parts))

    def buffers(self, n: int, keep: int) -> Buffers:
        """Room for ``keep`` section points of each of n trajectories."""
        array, whole, module = self.cuda.device_array, np.int64, self.module
        return Buffers(
            array((module.N_WHOLE, n), whole), array((module.N_REAL, n)), array((n, max(keep, 1), self.n + 2)),
            array((n, 2, self.rows)), array(n, whole), array(n, whole), array(n), array(n, whole),
        )  # fmt: skip

    def extremes(self, out: Buffers) -> FloatArray:
        """Maxima and minima (2, N, rows) of states, indicators and outputs over the kept window."""
        found: FloatArray = out.extremes.copy_to_host()
        for row, original in self.repeats.items():
            found[:, :, row] = found[:, :, original]
        return found.transpose(1, 0, 2)

    def run(
        self, jobs: IntArray, states: States, transient: Any, keep: Any, out: Buffers, settled: Any = False
    ) -> IntArray:
        """March jobs by ``transient`` returns, then ``keep`` more into ``out`` (numbers, or one for each trajectory).

        Parameters
        ----------
        settled : bool, or array of bool
            Whether transitions that hold at the beginning have been taken already.

        Returns
        -------
        array
            The jobs that came to their end; the others have their code in ``out.status``.
        """
        to_device, n = self.cuda.to_device, len(states.rows)
        counts = [to_device(np.atleast_1d(np.asarray(one, dtype=np.int64))) for one in (transient, keep)]
        begun = to_device(np.broadcast_to(np.asarray(settled, dtype=np.int64), (n,)).copy())
        under_way, fresh = jobs, 1
        while len(under_way):
            self.launch(
                self.module.advance, under_way, states.rows, *self.tables, *states.all(), begun, *counts, fresh, STEPS,
                *out.all(),
            )  # fmt: skip
            under_way, fresh = under_way[out.status.copy_to_host()[under_way] == codes.PAUSED], 0
        return jobs[np.isin(out.status.copy_to_host()[jobs], (codes.OK, codes.NOT_GUARANTEED))]
