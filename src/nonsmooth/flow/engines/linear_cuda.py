"""Trajectories of the planar exact flow on a GPU: copies of the tables there, and launches that stay short."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nonsmooth.flow.engines.devices import OnGpu, StatesOnGpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.loop import DIVERGENCE
from nonsmooth.kernels.hybrid import codes
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
        of_point = sum(part.size for part in scratch(self.n, harmonics, n_modes, *self.sizes, n_rows)[0])
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
