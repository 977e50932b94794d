"""Jobs of systems of two states with the exact flow and a stroboscopic section, on a GPU.

The looks of ``kernels.planar_settle`` come at the same returns for every job, so they are rounds here: all jobs that
are still under way are marched together, judged together, and those that are done are left out of the next round.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from nonsmooth.analysis.settled import Settled, usable
from nonsmooth.flow.devices import batch_size
from nonsmooth.flow.engine import FloatArray, IntArray
from nonsmooth.flow.launches import batches
from nonsmooth.flow.linear import PlanarEngine
from nonsmooth.flow.planar_cuda import SLICE, Buffers, PlanarOnGpu, States
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels import codes

__all__ = ["Judging", "exponents_on_gpu", "fail", "run_on_gpu"]


def run_on_gpu(
    engine: PlanarEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float,
    phase: float, choice: tuple[Any, ...], tolerance: float, least: FloatArray,
) -> Settled:  # fmt: skip
    """Jobs settled and judged; arguments and result as in :func:`.attractors_compiled.run_compiled`."""
    found = Settled.empty(len(rows), 2)
    for some, own, own_rows in batches(points, rows, batch_size()):
        part = _settle(
            PlanarOnGpu(engine, own, phase), own_rows, starts[some], modes[some], begin, choice, tolerance, least
        )
        for item in fields(found):
            getattr(found, item.name)[some] = getattr(part, item.name)
    return found


def _settle(
    gpu: PlanarOnGpu, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float, choice: tuple[Any, ...],
    tolerance: float, least: FloatArray,
) -> Settled:  # fmt: skip
    """One batch of jobs."""
    transient, keep, max_period, look, attempts, _, extremes = choice
    judging = Judging(gpu, len(rows), keep, max_period, tolerance, least, rows)
    states = gpu.states(rows, starts, modes, begin)
    found = Settled.empty(len(rows), 2)
    found.multiplier[:] = -1.0
    under_way = np.arange(len(rows))
    used, extra = 0, 0
    todo = look if 0 < look < transient else transient
    early = todo < transient
    while len(under_way):
        found.returns[under_way] = used
        ran = gpu.run(under_way, states, todo, keep, judging.kept, one_more=judging.single)
        fail(found, under_way, ran, judging.single)
        fail(found, under_way, ran, judging.kept)
        used += todo + keep + 1
        found.returns[ran] = used
        judging.judge(ran, found, judging.single)
        verdict = found.status[ran]
        if early:
            under_way = ran[verdict != codes.OK]
            todo = used if 2 * used + keep < transient else max(transient - used, 0)
            early = used + todo < transient
            continue
        if extra >= attempts:
            break
        under_way = ran[verdict == codes.SLOW]
        judging.push(states, under_way, found.multiplier)
        todo = (1 << extra) * max(transient, 1)
        extra += 1
    found.last[:], found.mode[:] = states.u.copy_to_host(), states.counters.copy_to_host()[:, 0]
    _window(gpu, states, judging.kept, found, keep, bool(extremes))
    failed = ~usable(found.status)
    found.period_number[failed] = 0
    found.status[failed] = [result_status(code) for code in found.status[failed]]
    found.residual[failed] = np.nan
    found.multiplier[found.multiplier < 0.0] = np.nan
    return found


def fail(found: Settled, before: IntArray, after: IntArray, out: Buffers) -> None:
    """Codes of the jobs that did not come to the end of a run."""
    lost = np.setdiff1d(before, after, assume_unique=True)
    codes_of = out.status.copy_to_host()[lost]
    found.status[lost] = np.where(codes_of != codes.OK, codes_of, found.status[lost])


def _window(gpu: PlanarOnGpu, states: States, out: Buffers, found: Settled, keep: int, extremes: bool) -> None:
    """Extremes and counts: over one whole cycle where there is one; else counts of the judged window, extremes of as
    many returns behind it."""
    good = np.flatnonzero(usable(found.status))
    cyclic = found.period_number > 0
    n = np.where(cyclic, found.period_number, keep)
    crossings, contacts = out.crossings.copy_to_host(), out.contacts.copy_to_host()
    wanted = good if extremes else good[cyclic[good]]
    ran = gpu.run(wanted, states, 0, n, out, extremes=extremes)
    fail(found, wanted, ran, out)
    cycles = ran[cyclic[ran]]
    crossings[cycles], contacts[cycles] = out.crossings.copy_to_host()[cycles], out.contacts.copy_to_host()[cycles]
    good = np.flatnonzero(usable(found.status))
    found.crossings[good], found.contacts[good] = crossings[good] / n[good], contacts[good] / n[good]
    if extremes:
        found.maximum[ran], found.minimum[ran] = out.maximum.copy_to_host()[ran], out.minimum.copy_to_host()[ran]


class Judging:
    """Arrays on the GPU for the judgement of J jobs."""

    def __init__(
        self, gpu: PlanarOnGpu, n: int, keep: int, max_period: int, tolerance: float, least: FloatArray, rows: IntArray
    ) -> None:
        array = gpu.cuda.device_array
        self.gpu, self.keep, self.max_period, self.tolerance = gpu, keep, max_period, tolerance
        rules = gpu.module
        self.nudge, self.kick, self.unstable = max(rules.NUDGE, 1e2 * tolerance), rules.KICK, 1.0 + rules.MARGIN
        self.least = gpu.cuda.to_device(least)
        self.kept, self.single = gpu.buffers(n, keep), gpu.buffers(n, 1)
        self.sizes, self.returns = array((n, 2)), array((n, max_period))
        self.period, self.status = (gpu.cuda.to_device(np.zeros(n, dtype=np.int64)) for _ in range(2))
        self.residual, self.multiplier = (gpu.cuda.to_device(np.zeros(n)) for _ in range(2))
        twice = np.tile(rows, 2)
        self.neighbours = gpu.states(twice, np.zeros((2 * n, 2)), np.zeros(2 * n, dtype=np.int64), 0.0)
        self.arrived = gpu.buffers(2 * n, 1)

    def judge(self, jobs: IntArray, found: Settled, extremes: Buffers) -> None:
        """Period number, status, residual and multiplier of jobs whose section points stand in ``kept``."""
        if not len(jobs):
            return
        gpu, module, other = self.gpu, self.gpu.module, self.neighbours
        gpu.launch(
            module.judge, jobs, self.keep, self.max_period, self.tolerance, self.least, self.kept.section,
            extremes.maximum, extremes.minimum, self.sizes, self.period, self.status, self.residual, self.returns,
        )  # fmt: skip
        period = self.period.copy_to_host()
        cycles = jobs[period[jobs] > 0]
        if len(cycles):
            gpu.launch(
                module.beside, cycles, self.keep, self.nudge, gpu.phase, gpu.periods, other.rows, self.kept.section,
                self.kept.section_mode, self.sizes, self.period, other.u, other.clock, other.counters,
            )  # fmt: skip
            gpu.run_pairs(cycles, other, np.maximum(period - 1, 0), self.arrived)
            gpu.launch(
                module.decide, cycles, self.keep, self.nudge, self.kept.section, self.sizes, other.u,
                self.arrived.status, self.period, self.status, self.residual, self.multiplier, self.returns,
            )  # fmt: skip
            found.multiplier[cycles] = self.multiplier.copy_to_host()[cycles]
        found.multiplier[np.setdiff1d(jobs, cycles, assume_unique=True)] = -1.0
        found.period_number[jobs] = self.period.copy_to_host()[jobs]
        found.status[jobs] = self.status.copy_to_host()[jobs]
        found.residual[jobs] = self.residual.copy_to_host()[jobs]

    def push(self, states: States, jobs: IntArray, multiplier: FloatArray) -> None:
        """Push jobs that sit on an unstable orbit off it."""
        pushed = jobs[multiplier[jobs] > self.unstable]
        if len(pushed):
            u = states.u.copy_to_host()
            u[pushed] += self.kick * self.sizes.copy_to_host()[pushed]
            states.u.copy_to_device(u)


def exponents_on_gpu(
    engine: PlanarEngine, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int,
    phase: float, scale: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Largest exponents of jobs and their standard errors, as :func:`.attractors_compiled.exponents_compiled`."""
    largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    for some, own, own_rows in batches(points, rows, batch_size()):
        gpu = PlanarOnGpu(engine, own, phase)
        largest[some], error[some] = _exponents(gpu, own_rows, starts[some], modes[some], n_returns, scale)
    return largest, error


def _exponents(
    gpu: PlanarOnGpu, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int, scale: FloatArray
) -> tuple[FloatArray, FloatArray]:
    n, batch, module, to_device = len(rows), n_returns // 10, gpu.module, gpu.cuda.to_device
    states = gpu.states(rows, starts, modes, gpu.phase)
    apart, sums = to_device(np.tile(scale * module.NUDGE, (n, 1))), to_device(np.zeros((n, 3)))
    status, size = to_device(np.zeros(n, dtype=np.int64)), to_device(scale)
    jobs, end = np.arange(n), batch // 4 + 10 * batch
    for begin in range(0, end, SLICE // 2):
        gpu.launch(
            module.neighbours, jobs, states.rows, *gpu.tables, gpu.net, states.u, states.clock, states.counters,
            begin, min(begin + SLICE // 2, end), batch, size, apart, sums, gpu.plans[0], gpu.phase, gpu.limit, status,
        )  # fmt: skip
        jobs = jobs[status.copy_to_host()[jobs] == codes.OK]
        if not len(jobs):
            break
    largest, error = np.full(n, np.nan), np.full(n, np.nan)
    _, total, square = sums.copy_to_host()[jobs].T
    largest[jobs] = total / 10.0
    error[jobs] = np.sqrt(np.maximum(square / 10.0 - (total / 10.0) ** 2, 0.0) / 9.0)
    return largest, error
