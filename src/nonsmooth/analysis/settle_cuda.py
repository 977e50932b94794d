"""Jobs of the series methods brought to their attractors on a GPU, in rounds.

The rules are those of ``analysis.settle``, one job after the other; here every round is one run of all jobs that are
still under way. The GPU marches, the processor judges the section points of a round in arrays (``classify_many``).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.analysis.classify import MARGIN
from nonsmooth.analysis.classify_many import candidates, certain
from nonsmooth.analysis.settle import KICK, NUDGE, ROUNDS
from nonsmooth.analysis.settled import LEAST, Settled, size_of, usable
from nonsmooth.flow.engine import FloatArray, IntArray
from nonsmooth.flow.poincare import result_status
from nonsmooth.flow.series_cuda import Buffers, SeriesOnGpu, States
from nonsmooth.kernels import codes

__all__ = ["Settling"]


class Settling:
    """J jobs on the GPU and what is known of them.

    Parameters
    ----------
    gpu : SeriesOnGpu
    states : States
        Where the jobs begin.
    keep, max_period, tolerance
        As in :class:`nonsmooth.analysis.settle.Attractors`.
    scale : array (n,)

    Attributes
    ----------
    found : Settled
        ``period_number``, ``status``, ``residual`` and ``multiplier`` of the judged jobs; statuses are kernel codes.
    kept : Buffers
        The last ``keep`` section points of each job.
    """

    def __init__(
        self, gpu: SeriesOnGpu, states: States, keep: int, max_period: int, tolerance: float, scale: FloatArray
    ) -> None:
        n = len(states.rows)
        self.gpu, self.states, self.keep, self.max_period, self.tolerance = gpu, states, keep, max_period, tolerance
        self.least = LEAST * scale
        self.begin = states.copy(gpu.cuda)
        self.rows = states.rows.copy_to_host()
        self.kept, self.found = gpu.buffers(n, keep), Settled.empty(n, gpu.n)
        self.unstable, self.doubtful = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        self.size = np.zeros((n, gpu.n))

    def settle(self, jobs: IntArray, transient: IntArray, longer: tuple[int, ...]) -> None:
        """Run jobs through ``transient`` (J,) returns and judge them; those still settling are run on."""
        status = self.look(jobs, transient)
        overtaken = jobs[status == codes.BEYOND_STOP]
        if len(overtaken):
            self.states.restore(self.begin, overtaken)
            self.look(overtaken, transient)
        for factor in longer:
            slow = jobs[self.found.status[jobs] == codes.SLOW]
            if not len(slow):
                break
            pushed = slow[self.unstable[slow]]
            self.states.push(pushed, KICK * self.size[pushed])
            settled = np.ones(len(self.rows), dtype=bool)
            settled[pushed] = False
            self._run(slow, factor * np.maximum(transient, 1), settled)
        doubtful = jobs[self.doubtful[jobs] & (self.found.status[jobs] == codes.OK)]
        self.found.status[doubtful] = codes.NOT_GUARANTEED

    def look(self, jobs: IntArray, transient: IntArray) -> IntArray:
        """Judge jobs after ``transient`` (J,) returns more; their codes."""
        return self._run(jobs, transient, False)

    def _run(self, jobs: IntArray, transient: IntArray, settled: Any) -> IntArray:
        found = self.found
        ran = self.gpu.run(jobs, self.states, transient, self.keep, self.kept, settled)
        code = self.kept.status.copy_to_host()
        found.period_number[jobs], found.residual[jobs], found.multiplier[jobs] = 0, np.nan, np.nan
        found.status[jobs], self.unstable[jobs] = code[jobs], False
        self.doubtful[jobs] = code[jobs] == codes.NOT_GUARANTEED
        if len(ran):
            self._judge(ran)
        status: IntArray = code[jobs]
        return status

    def _judge(self, jobs: IntArray) -> None:
        gpu, found = self.gpu, self.found
        points = self.kept.sections.copy_to_host()[jobs][:, :, : gpu.n]
        high, low = gpu.extremes(self.kept)
        size = size_of(high[jobs, : gpu.n], low[jobs, : gpu.n], self.least)
        period, status, residual, returns = candidates(points, size, self.max_period, self.tolerance)
        self.size[jobs] = size
        found.residual[jobs], found.status[jobs] = residual, status
        there = np.flatnonzero(period > 0)
        if not len(there):
            return
        measure = self._multipliers if gpu.plan.indicator < 0 else self._contractions
        mu = measure(jobs[there], period[there], size[there], points[there])
        stands = certain(period[there], mu, residual[there], returns[there])
        cyclic = jobs[there]
        found.multiplier[cyclic] = mu
        found.period_number[cyclic] = np.where(stands, period[there], 0)
        found.status[cyclic] = np.where(stands, codes.OK, codes.SLOW)
        self.unstable[cyclic] = ~stands & (mu > 1.0 + MARGIN)

    @property
    def _nudge(self) -> float:
        return max(NUDGE, 1e2 * self.tolerance)

    def _probe(
        self, jobs: IntArray, moved: FloatArray, transient: Any, keep: Any, settled: bool
    ) -> tuple[Buffers, IntArray]:
        """Runs of states beside those of the jobs: what they leave behind, and which came to their end."""
        states = self.states.taken(self.gpu.cuda, jobs, moved)
        out = self.gpu.buffers(len(jobs), int(np.max(keep)))
        return out, self.gpu.run(np.arange(len(jobs)), states, transient, keep, out, settled)

    def _multipliers(self, jobs: IntArray, period: IntArray, size: FloatArray, points: FloatArray) -> FloatArray:
        """As ``Attractors._multiplier``: the images of the state and of its neighbours, by differences."""
        n, nudge = size.shape[1], self._nudge * size
        images, failed = [], np.zeros(len(jobs), dtype=bool)
        for j in range(-1, n):
            moved = np.zeros_like(size)
            if j >= 0:
                moved[:, j] = nudge[:, j]
            out, ran = self._probe(jobs, moved, period - 1, 1, j < 0)
            failed |= ~np.isin(np.arange(len(jobs)), ran)
            images.append(out.sections.copy_to_host()[:, 0, :n])
        matrix = np.stack([(images[j + 1] - images[0]) / nudge[:, j, None] for j in range(n)], axis=2)
        scaled = matrix * size[:, None, :] / size[:, :, None]
        failed |= ~np.isfinite(scaled).all(axis=(1, 2))
        mu = np.full(len(jobs), np.nan)
        mu[~failed] = np.abs(np.linalg.eigvals(scaled[~failed])).max(axis=1)
        return mu

    def _contractions(self, jobs: IntArray, period: IntArray, size: FloatArray, points: FloatArray) -> FloatArray:
        """As ``Attractors._contraction``: the factor by which a nudged state nears the cycle per ``period`` returns."""
        mu = np.full(len(jobs), np.nan)
        for p in np.unique(period):
            some = np.flatnonzero(period == p)
            keep = ROUNDS * int(p) + 2
            out, ran = self._probe(jobs[some], self._nudge * size[some], 0, keep, False)
            if not len(ran):
                continue
            here = some[ran]
            run = out.sections.copy_to_host()[ran][:, :, : self.gpu.n] / size[here, None, :]
            cycle = points[here, -p:] / size[here, None, :]
            gap = np.full(run.shape[:2], np.inf)
            for k in range(int(p)):
                np.minimum(gap, np.abs(run - cycle[:, k, None, :]).max(axis=2), out=gap)
            first, last = gap[:, 1 : p + 1].max(axis=1), gap[:, -p:].max(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                measured = (last / first) ** (1.0 / (ROUNDS - 1))
            mu[here] = np.where(last <= self.tolerance, 0.5, measured)
        return mu

    def cycles(self) -> Buffers:
        """One run more over each whole cycle: its extremes and counts."""
        out = self.gpu.buffers(len(self.rows), self.max_period)
        jobs = np.flatnonzero(self.found.period_number > 0)
        if len(jobs):
            states = self.states.copy(self.gpu.cuda)
            self.gpu.run(jobs, states, 0, np.maximum(self.found.period_number, 1), out, True)
        return out

    def finished(self) -> Settled:
        """What was found, with statuses of results in place of the kernel's codes."""
        found = self.found
        failed = ~usable(found.status)
        found.period_number[failed], found.residual[failed] = 0, np.nan
        found.multiplier[failed] = np.nan
        found.status[failed] = [result_status(code) for code in found.status[failed]]
        return found
