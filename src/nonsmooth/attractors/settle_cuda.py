"""Jobs brought to their attractors on a GPU, in rounds: each is one run of all jobs that want it.

What is wanted of a job next is decided there by the text of the processor (``kernels.settle``); looks come at the same
returns for every job, so that all of them do the same thing at the same time, and those that are done are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.attractors.settled import Settled, usable
from nonsmooth.flow.engines.devices import StatesOnGpu, batch_size, batches
from nonsmooth.flow.engines.engine import FloatArray, IntArray, State
from nonsmooth.flow.engines.gpu import PART, SLICE, PlanarOnGpu, SeriesOnGpu
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Kept, Section

if TYPE_CHECKING:
    from nonsmooth.attractors.settler import Settler
    from nonsmooth.kernels.judging.settle import Rules


class JobsOnGpu:
    """J jobs on a GPU, as they are settled under some rules.

    Parameters
    ----------
    gpu : PlanarOnGpu or SeriesOnGpu
    states : StatesOnGpu
        Where the jobs begin, and are left.
    extremes : bool
        Whether those over a whole cycle are wanted.

    Attributes
    ----------
    jobs : Jobs
        What is known, on the GPU.
    kept, single, cycle
        The last ``keep`` section points of each job, one return behind them (where the rules say so), its cycle.
    """

    def __init__(self, gpu: Any, states: StatesOnGpu, rules: Rules, extremes: bool = True) -> None:
        from nonsmooth.kernels.judging.settle import begin_job, new_jobs

        n, to_device = len(states.rows), gpu.cuda.to_device
        self.gpu, self.states, self.rules, self.extremes = gpu, states, rules, extremes
        self.given = tuple(to_device(part) if isinstance(part, np.ndarray) else part for part in rules)
        first = new_jobs(1, gpu.n, rules.max_period)
        begin_job(first, 0, rules, 0)
        self.jobs = type(first)(*(to_device(np.repeat(part, n, axis=0)) for part in first))
        self.kept, self.cycle = gpu.buffers(n, rules.keep), gpu.buffers(n, rules.max_period)
        self.single = gpu.buffers(n, 1) if rules.beyond else None
        self.others, self.arrived = states.room(gpu.cuda, gpu.n + 1), gpu.buffers((gpu.n + 1) * n, 1)
        self.mu = gpu.cuda.device_array(n)

    def run(self) -> None:
        """Settle all jobs."""
        from nonsmooth.kernels.judging.settle import END, PROBE

        while True:
            wanted = self.jobs.wanted.copy_to_host()
            under_way = np.flatnonzero(wanted != END)
            if not len(under_way):
                return
            self._run(under_way[wanted[under_way] != PROBE])
            self._probe(under_way[wanted[under_way] == PROBE])
            last = self.single or self.kept
            self.gpu.launch(
                self.gpu.module.decide,
                under_way,
                self.given,
                tuple(self.jobs),
                self.kept.status,
                last.status,
                self.kept.section,
                last.high,
                last.low,
                self.mu,
                self.states.u,
            )

    def _run(self, jobs: IntArray) -> None:
        transient, settled = self.jobs.transient.copy_to_host(), self.jobs.settled.copy_to_host()
        for returns in np.unique(transient[jobs]):
            self.gpu.run(
                jobs[transient[jobs] == returns],
                self.states,
                int(returns),
                self.rules.keep,
                self.kept,
                settled,
                extremes=self.single is None,
                one_more=self.single,
            )

    def _probe(self, jobs: IntArray) -> None:
        """The cycle of each job from where it stands, and neighbours that show its multipliers."""
        gpu, sizes = self.gpu, self.jobs.size
        if not len(jobs):
            return
        period = self.jobs.period_number.copy_to_host()
        self._beside(jobs, 0, -1, 0.0)
        if gpu.plan.indicator >= 0:
            gpu.run(jobs, self.others, 0, period, self.cycle, True)
            self._contractions(jobs, period)
            return
        for state in range(gpu.n):
            self._beside(jobs, state + 1, state, self.rules.difference)
        gpu.run_beside(jobs, self.others, period, self.cycle, self.arrived, self.extremes)
        gpu.launch(
            gpu.module.measure,
            jobs,
            len(period),
            self.rules.difference,
            sizes,
            self.states.u,
            self.others.u,
            self.cycle.status,
            self.arrived.status,
            self.mu,
        )

    def _beside(self, jobs: IntArray, leg: int, state: int, factor: float) -> None:
        self.gpu.launch(
            self.gpu.module.beside,
            jobs,
            leg * len(self.states.rows),
            state,
            factor,
            self.jobs.size,
            self.states.all(),
            self.others.all(),
        )

    def _contractions(self, jobs: IntArray, period: IntArray) -> None:
        from nonsmooth.kernels.judging.judge import ROUNDS

        gpu = self.gpu
        self._beside(jobs, 0, -1, self.rules.difference)
        for p in np.unique(period[jobs]):
            some, run = jobs[period[jobs] == p], gpu.buffers(len(period), ROUNDS * int(p) + 2)
            gpu.run(some, self.others, 0, ROUNDS * int(p) + 2, run, False)
            gpu.launch(
                gpu.module.contract,
                some,
                int(p),
                self.rules.tolerance,
                self.jobs.size,
                self.kept.section,
                run.section,
                run.status,
                self.mu,
            )

    def found(self, width: int) -> Settled:
        """Results; counts and extremes over one whole cycle where there is one, else over the kept window, or as
        many returns behind it."""
        gpu, n, jobs = self.gpu, len(self.states.rows), type(self.jobs)(*(part.copy_to_host() for part in self.jobs))
        found = Settled.empty(n, gpu.n, width)
        cyclic, good = jobs.period_number > 0, usable(jobs.status)
        returns = np.where(cyclic, jobs.period_number, self.rules.keep)
        for name, to in (("crossings", found.crossings), ("contacts", found.contacts)):
            one, other = (getattr(out, name).copy_to_host() for out in (self.cycle, self.kept))
            to[good] = (np.where(cyclic, one, other) / returns)[good]
        u, memory, clock, counters = (part.copy_to_host() for part in self.states.all())
        place = np.concatenate([u, memory[:, : gpu.n_memory], clock[:, :1]], axis=1)[:, :width]
        found.last[good], found.mode[good] = place[good], counters[good, 0]
        if self.extremes:
            other = good & ~cyclic
            if self.single is not None:
                gpu.run(np.flatnonzero(other), self.states, 0, self.rules.keep, self.kept, extremes=True)
                code = self.kept.status.copy_to_host()
                jobs.status[other] = np.where(code[other] == codes.OK, jobs.status[other], code[other])
                other &= code == codes.OK
            for out, which in ((self.cycle, good & cyclic), (self.kept, other)):
                for name, to in (("high", found.maximum), ("low", found.minimum)):
                    to[which] = getattr(out, name).copy_to_host()[which, : gpu.n]
        return found.judged(jobs)


def _on_gpu(engine: Engine, points: FloatArray, plan: Section) -> Any:
    """Parameter points of an engine on the GPU."""
    if isinstance(engine, PlanarEngine):
        return PlanarOnGpu(engine, points, plan)
    assert isinstance(engine, SeriesEngine)  # the door has seen to it
    return SeriesOnGpu(engine, points, plan)


def _batch(engine: Engine) -> int:
    return batch_size() if isinstance(engine, PlanarEngine) else int(PART * batch_size())


def _states_at(
    gpu: Any, places: FloatArray, memory: FloatArray, rows: IntArray, modes: Any, begin: float
) -> StatesOnGpu:
    """States at places (see ``trace``); what they do not say is as at a fresh start, at the phase ``begin``."""
    n, n_memory, period = gpu.n, gpu.n_memory, gpu.period[rows]
    memory, clock = np.tile(memory, (len(rows), 1)), np.zeros((len(rows), 3))
    if places.shape[1] >= n + n_memory:
        memory = places[:, n : n + n_memory]
    forced = period < np.inf
    clock[forced, 0] = places[forced, -1] if places.shape[1] > n + n_memory else begin * period[forced]
    clock[forced, 2] = period[forced]
    return StatesOnGpu.of(gpu.cuda, rows, places[:, :n], memory, modes, clock)


def settle_on_gpu(
    settler: Settler,
    points: FloatArray,
    rows: IntArray,
    starts: FloatArray,
    modes: IntArray,
    begin: float,
    attempts: int,
) -> Settled:
    """Jobs settled and judged, as ``Settler.run`` describes."""
    system, planar = settler.system, isinstance(settler.engine, PlanarEngine)
    found = Settled.empty(len(rows), len(system.states), settler.width)
    for some, own, own_rows in batches(points, rows, _batch(settler.engine)):
        gpu = _on_gpu(settler.engine, own, settler.plan)
        states = _states_at(gpu, starts[some], system.memory_vector(), own_rows, modes[some], begin)
        rounds = JobsOnGpu(gpu, states, settler.rules(attempts, int(planar)), settler.extremes or not planar)
        rounds.run()
        part = rounds.found(settler.width)
        for item in fields(found):
            getattr(found, item.name)[some] = getattr(part, item.name)
    return found


def sweep_on_gpu(
    settler: Settler,
    points: FloatArray,
    start: State,
    chain: Kept,
    advance: Callable[[int], Any],
) -> Settled:
    """Settle every parameter point from one start; the kept returns go into ``chain``."""
    parts = []
    for some, own, rows in batches(points, np.arange(len(points)), _batch(settler.engine)):
        gpu = _on_gpu(settler.engine, own, settler.plan)
        states = _states_at(gpu, np.tile(start.place, (len(rows), 1)), start.memory, rows, int(start.counters[0]), 0.0)
        rounds = JobsOnGpu(gpu, states, settler.rules(), extremes=False)
        rounds.run()
        _into(chain, some, rounds.kept, gpu)
        parts.append(rounds.found(settler.width))
        advance(len(rows))
    return Settled.joined(parts)


def _into(chain: Kept, some: slice, kept: Kept, gpu: Any) -> None:
    """The kept windows of a batch."""
    for name in ("section", "crossings", "contacts"):
        getattr(chain, name)[some] = getattr(kept, name).copy_to_host()
    for to, part in ((chain.high, kept.high), (chain.low, kept.low)):
        found = gpu.extremes(part.copy_to_host())
        to[some, : found.shape[1]] = found[:, : to.shape[1]]


def separate_on_gpu(
    settler: Settler,
    points: FloatArray,
    rows: IntArray,
    starts: FloatArray,
    modes: IntArray,
    returns: int,
    batch: int,
    sizes: FloatArray,
    offsets: FloatArray,
    sums: FloatArray,
) -> IntArray:
    """Growth of neighbours of jobs, taken into their sums (``kernels.judging.judge``); their statuses."""
    plan, status = settler.plan, np.zeros(len(rows), dtype=np.int64)
    separate = _separate_in_threads if isinstance(settler.engine, PlanarEngine) else _separate_in_rounds
    for some, own, own_rows in batches(points, rows, _batch(settler.engine)):
        gpu = _on_gpu(settler.engine, own, plan)
        states = _states_at(
            gpu,
            starts[some],
            settler.system.memory_vector(),
            own_rows,
            modes[some],
            plan.phase if plan.indicator < 0 else 0.0,
        )
        on_gpu = [gpu.cuda.to_device(np.ascontiguousarray(part[some])) for part in (sizes, offsets, sums, status)]
        separate(gpu, states, returns, batch, *on_gpu)
        sums[some], status[some] = (part.copy_to_host() for part in on_gpu[2:])
    return status


def _separate_in_threads(
    gpu: PlanarOnGpu, states: StatesOnGpu, returns: int, batch: int, sizes: Any, offsets: Any, sums: Any, status: Any
) -> None:
    """Each thread follows its job and the neighbour over some returns."""
    jobs = np.arange(len(states.rows))
    for begin in range(0, returns, SLICE // 2):
        gpu.launch(
            gpu.module.neighbours,
            jobs,
            states.rows,
            gpu.tables,
            gpu.net,
            states.place(),
            (begin, min(begin + SLICE // 2, returns), batch),
            sizes,
            (offsets, sums),
            gpu.plans[0],
            gpu.phase,
            gpu.limit,
            status,
        )
        jobs = jobs[status.copy_to_host()[jobs] == codes.OK]
        if not len(jobs):
            return


def _separate_in_rounds(
    gpu: SeriesOnGpu, states: StatesOnGpu, returns: int, batch: int, sizes: Any, offsets: Any, sums: Any, status: Any
) -> None:
    """Both are run to their next return, one after the other."""
    jobs = every = np.arange(len(states.rows))
    others, out = states.room(gpu.cuda, 1), gpu.buffers(len(jobs), 1)
    for n in range(returns):
        gpu.launch(gpu.module.beside, jobs, 0, -1, 1.0, offsets, states.all(), others.all())
        first = None
        for one, settled in ((states, n > 0), (others, False)):
            jobs = gpu.run(jobs, one, 0, 1, out, settled)
            elapsed = out.elapsed.copy_to_host()
            first = elapsed if first is None else first
            short = jobs[elapsed[jobs] < 0.5 * first[jobs]]  # just before the surface: that was no return
            if len(short):
                jobs = np.setdiff1d(jobs, np.setdiff1d(short, gpu.run(short, one, 0, 1, out, True)))
        if not len(jobs):
            break
        gpu.launch(
            gpu.module.separated, jobs, n, batch, gpu.cuda.to_device(first), states.u, others.u, sizes, offsets, sums
        )
    status.copy_to_device(np.where(np.isin(every, jobs), codes.OK, out.status.copy_to_host()))
