"""Trajectories of the series methods on a GPU: copies of the tables there, and launches that stay short."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.flow.engines.devices import OnGpu, StatesOnGpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.engines.series import SeriesEngine, SeriesPoints
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.codes import METHODS
from nonsmooth.kernels.hybrid.kept import Kept, Section

STEPS = 1024  # of one launch, at most: below a second also on a small GPU
PART = 0.75  # of ``devices.batch_size`` in one launch: what the registers hold by the compiler's choice (168 of each)


def module_of(engine: SeriesEngine, tables: SeriesPoints) -> Any:
    """The kernels for an engine's system, method and order."""
    from nonsmooth.kernels.cuda.module import cuda_series_module, cuda_series_source
    from nonsmooth.system.codegen.generate import model_source

    net, form = engine.net, engine.generated(tables)
    sizes = {
        "METHOD": METHODS[engine.name],
        "ORDER": form.order,
        "CHECKED": form.checked,
        "CORNERS": form.corners,
        "N_GUARDS": form.guards,
        "N_PARAMETERS": len(engine.traced.p),
        "N_INDICATORS": form.indicators,
        "N_OUTPUTS": form.outputs,
        "N_MEMORY": len(engine.traced.m),
        "N_SCRATCH_ROWS": engine.model.n_scratch,
    }
    arrays = {
        "TRANSITIONS": _filled(net.transitions, (1, 3)),
        "ROWS": net.rows,
        "ROW_START": net.row_start,
        "MODE_START": net.mode_start,
        "MODE_LIST": _filled(net.mode_list, (1,)),
        "AT": net.at if len(net.at) else np.full(1, -1.0),
        "LACKING": engine.lacking,
        "KINDS": engine.kinds,
    }
    return cuda_series_module(cuda_series_source(model_source(engine.layers.model), sizes, arrays))


def _filled(array: Any, shape: tuple[int, ...]) -> Any:
    return array if array.size else np.zeros(shape, dtype=array.dtype)


class SeriesOnGpu(OnGpu):
    """An engine's parameter points on the GPU, and the runs from there to a section.

    Parameters
    ----------
    engine : SeriesEngine
        ``"taylor"`` with crossings located.
    points : array (P, n_parameters)
    plan : Section
    """

    def __init__(self, engine: SeriesEngine, points: FloatArray, plan: Section) -> None:
        from nonsmooth.kernels.cuda.target import THREADS, cuda

        tables = engine.prepare(points)
        traced = engine.traced
        self.n, self.n_memory = len(traced.u), len(traced.m)
        self.rows = self.n + len(traced.indicators) + len(traced.outputs)
        self.module, self.cuda, self.threads, self.plan = module_of(engine, tables), cuda, THREADS, plan
        self.period: FloatArray = tables.period
        self.repeats = engine.repeats
        self._rooms: dict[int, tuple[Any, Any]] = {}
        columns = points.T if points.shape[1] else np.zeros((1, len(points)))
        phase = plan.phase if plan.indicator < 0 else 0.0
        step = 0.0 if engine.step is None else engine.step
        self.tables = (
            tuple(map(cuda.to_device, (np.ascontiguousarray(columns), tables.period))),
            tuple(map(cuda.to_device, engine.norms)),
            cuda.to_device(np.array([plan.indicator, plan.rising, plan.mode, plan.after, plan.every], dtype=np.int64)),
            cuda.to_device(np.array([engine.rtol, step, phase, min(plan.t_max, 1e300)])),
        )

    def extremes(self, found: FloatArray) -> FloatArray:
        """Extremes (N, rows) of states, indicators and outputs, from what stands in :class:`Kept`."""
        for row, original in self.repeats.items():
            found[:, row] = found[:, original]
        return found

    def _between(self, n: int) -> tuple[Any, Any]:
        """Room for what n trajectories need to go on after a launch."""
        if n not in self._rooms:
            array, module = self.cuda.device_array, self.module
            self._rooms[n] = array((module.N_WHOLE, n), np.int64), array((module.N_REAL, n))
        return self._rooms[n]

    def run(
        self,
        jobs: IntArray,
        states: StatesOnGpu,
        transient: Any,
        keep: Any,
        out: Kept,
        settled: Any = False,
        *,
        extremes: bool = True,
        one_more: None = None,
    ) -> IntArray:
        """March jobs by ``transient`` returns, then ``keep`` more into ``out`` (numbers, or one for each trajectory).

        Parameters
        ----------
        settled : bool, or array of bool
            Whether transitions that hold at the beginning have been taken already.
        extremes, one_more
            Of no concern here: extremes are always there.

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
                self.module.advance,
                under_way,
                states.rows,
                *self.tables,
                states.all(),
                (begun, *counts),
                (fresh, STEPS),
                self._between(n),
                tuple(out),
            )
            under_way, fresh = under_way[out.status.copy_to_host()[under_way] == codes.PAUSED], 0
        return jobs[np.isin(out.status.copy_to_host()[jobs], (codes.OK, codes.NOT_GUARANTEED))]

    def run_beside(
        self, jobs: IntArray, others: StatesOnGpu, period: IntArray, whole: Kept, arrived: Kept, extremes: bool
    ) -> None:
        """March jobs j by period[j] returns into ``whole``, and their neighbours, which stand behind them in
        ``others``; of these the last return goes into ``arrived``. (Extremes are always there.)"""
        self.run(jobs, others, 0, period, whole, True)
        times = len(others.rows) // len(period)
        neighbours = np.concatenate([jobs + leg * len(period) for leg in range(1, times)])
        self.run(neighbours, others, np.tile(np.maximum(period, 1) - 1, times), 1, arrived, False)
