"""Trajectories on a GPU, by the planar exact flow and the series: copies of the tables, launches that stay short."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nonsmooth.flow.engines.devices import OnGpu, StatesOnGpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray, Points
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.loop import DIVERGENCE
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.codes import METHODS
from nonsmooth.kernels.hybrid.kept import Kept, Section

SLICE = 256  # section returns of one launch, at most: below a second also on a small GPU


class PlanarOnGpu(OnGpu):
    """A planar engine's parameter points on the GPU, and the runs from there.

    Parameters
    ----------
    engine : PlanarEngine
    points : array (P, n_parameters)
    plan : Section
        A stroboscopic section.
    """

    n, n_memory = 2, 0

    def __init__(self, engine: PlanarEngine, points: FloatArray, plan: Section) -> None:
        from nonsmooth.flow.engines.linear import scratch
        from nonsmooth.kernels.cuda.module import cuda_linear_module
        from nonsmooth.kernels.cuda.target import THREADS, cuda

        tables = engine.prepare(points)
        n_modes, n_indicators, n_outputs, n_rows = tables.sizes
        self.sizes = max(n_indicators, 1), max(n_outputs, 1)
        self.rows = 2 + sum(self.sizes)
        self.void = [] if n_indicators else [self.n]  # a row of no indicator: no array is empty there
        harmonics = len(tables.form.multiples)
        shape = harmonics, n_modes, *self.sizes, max(len(engine.net.transitions), 1), n_rows
        self.module = cuda_linear_module(*shape)
        self.growth = partial(cuda_linear_module, *shape, "growth")
        self.cuda, self.threads, self.plan, self.phase = cuda, THREADS, plan, float(plan.phase)
        self.period: FloatArray = tables.period
        given = cuda.to_device(_packed(tables.form)), cuda.to_device(tables.form.multiples)
        room = scratch(self.n, harmonics, n_modes, *self.sizes, n_rows, planar=harmonics == 1)[0]
        of_point = sum(part.size for part in room)
        self.tables = *given, cuda.device_array((of_point, len(points)))
        self.launch(self.module.tabulate, np.arange(len(points)), self.tables)
        self.net = tuple(cuda.to_device(_not_empty(part)) for part in engine.net)
        self.limit = cuda.to_device(DIVERGENCE * engine.scale)
        self.plans = [cuda.to_device(np.array([-1, 1, -1, 1, 1, extremes], dtype=np.int64)) for extremes in (0, 1)]
        self.periods = cuda.to_device(self.period)

    def extremes(self, found: FloatArray) -> FloatArray:
        """Extremes (N, rows) of states, indicators and outputs, from what stands in :class:`Kept`."""
        return np.delete(found, self.void, axis=1)

    def run(
        self,
        jobs: IntArray,
        states: StatesOnGpu,
        transient: int,
        keep: Any,
        out: Kept,
        settled: Any = False,
        *,
        extremes: bool = False,
        one_more: Kept | None = None,
    ) -> IntArray:
        """March jobs by ``transient`` returns, then ``keep`` more into ``out`` (a number, or one for each trajectory).

        Parameters
        ----------
        settled
            Of no concern here: what holds where a run begins is always taken.
        one_more : Kept, optional
            One return more, with extremes, goes in here.

        Returns
        -------
        array
            The jobs that came to their end; the others have their code in ``out.status`` (or ``one_more.status``).
        """
        while transient > SLICE and len(jobs):
            jobs = self._advance(jobs, states, SLICE - 1, 1, out)
            transient -= SLICE
        if not len(jobs):
            return jobs
        if one_more is None:
            return self._advance(jobs, states, transient, keep, out, extremes)
        done = self._advance(jobs, states, transient, keep, out, extremes, one_more, True)
        return done[one_more.status.copy_to_host()[done] == codes.OK]

    def run_beside(
        self, jobs: IntArray, others: StatesOnGpu, period: IntArray, whole: Kept, arrived: Kept, extremes: bool
    ) -> None:
        """March jobs j by period[j] returns into ``whole``, and their neighbours, which stand behind them in
        ``others``; of these the last return goes into ``arrived``."""
        self._advance(jobs, others, 0, period, whole, extremes, arrived, False, 3, len(period))

    def _advance(
        self,
        jobs: IntArray,
        states: StatesOnGpu,
        transient: int,
        keep: Any,
        out: Kept,
        extremes: bool = False,
        other: Kept | None = None,
        after: bool = False,
        legs: int = 2,
        apart: int = 0,
    ) -> IntArray:
        counts = tuple(self.cuda.to_device(np.atleast_1d(np.asarray(n, dtype=np.int64))) for n in (transient, keep))
        self.launch(
            self.module.advance,
            jobs,
            states.rows,
            self.tables,
            self.net,
            states.place(),
            counts,
            (self.plans[extremes], self.plans[after]),
            (1 if other is None else legs, apart),
            self.phase,
            self.limit,
            tuple(out),
            tuple(out if other is None else other),
        )
        return jobs[out.status.copy_to_host()[jobs] == codes.OK]


def _not_empty(array: Any) -> Any:
    """A kernel's array of constant shape has no dimension of length zero; what fills it is never read."""
    found = np.ascontiguousarray(array)
    return found if found.size else np.zeros([max(n, 1) for n in found.shape], dtype=found.dtype)


def _packed(form: Any) -> FloatArray:
    """All numbers of a parameter point as one column, in the order in which a thread unpacks them."""
    n_points = len(form.A)
    parts = [form.omega, form.period, *form[:4], *form[7:-1]]
    columns = []
    for part in parts:
        shape = [n_points, *(max(n, 1) for n in part.shape[1:])]
        full = part if part.shape == tuple(shape) else np.zeros(shape)
        columns.append(full.reshape(n_points, -1))
    return np.ascontiguousarray(np.concatenate(columns, axis=1).T)


STEPS = 1024  # of one launch, at most: below a second also on a small GPU
PART = 0.75  # of ``devices.batch_size`` in one launch: what the registers hold by the compiler's choice (168 of each)


def module_of(engine: SeriesEngine, tables: Points) -> Any:
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
        "TRANSITIONS": _not_empty(net.transitions),
        "ROWS": net.rows,
        "ROW_START": net.row_start,
        "MODE_START": net.mode_start,
        "MODE_LIST": _not_empty(net.mode_list),
        "AT": net.at if len(net.at) else np.full(1, -1.0),
        "LACKING": engine.lacking,
        "KINDS": engine.kinds,
    }
    return cuda_series_module(cuda_series_source(model_source(engine.layers.model), sizes, arrays))


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
