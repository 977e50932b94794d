"""What sweeps, charts and basins ask of the series methods on a GPU: batches of jobs, settled in rounds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.analysis.attractors_parting import BESIDE
from nonsmooth.analysis.settle import LONGER, Attractors
from nonsmooth.analysis.settle_cuda import Settling
from nonsmooth.analysis.settled import Settled, usable
from nonsmooth.flow.devices import batch_size
from nonsmooth.flow.engine import Chain, FloatArray, IntArray
from nonsmooth.flow.launches import batches
from nonsmooth.flow.series import SeriesEngine
from nonsmooth.flow.series_cuda import PART, SeriesOnGpu, States
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.analysis.attractors import Settler

__all__ = ["series_exponents_on_gpu", "settle_series_on_gpu", "sweep_series_on_gpu"]


def sweep_series_on_gpu(
    points: FloatArray, start: FloatArray, memory: FloatArray, rules: Attractors, chain: Chain,
    advance: Callable[[int], Any],
) -> Settled:  # fmt: skip
    """Every parameter point from one start: the rules of ``analysis.settle``, whose buffers ``chain`` is filled."""
    parts = []
    for some, own, rows in batches(points, np.arange(len(points)), int(PART * batch_size())):
        gpu = SeriesOnGpu(engine_of(rules), own, rules.plan)
        jobs = np.arange(len(rows))
        states = states_at(gpu, np.tile(start, (len(rows), 1)), memory, rows, np.zeros(len(rows), dtype=np.int64), 0.0)
        settling = Settling(gpu, states, rules.keep, rules.max_period, rules.tolerance, rules.scale)
        settling.settle(jobs, np.full(len(rows), rules.transient), rules.longer)
        _into(chain, some, settling, gpu)
        parts.append(settling.finished())
        advance(len(rows))
    return Settled.joined(parts)


def _into(chain: Chain, some: slice, settling: Settling, gpu: SeriesOnGpu) -> None:
    kept, n, n_i = settling.kept, gpu.n, chain.indicator_max.shape[1]
    chain.section[some] = kept.sections.copy_to_host()[:, :, :n]
    for found, names in zip(
        gpu.extremes(kept),
        (("maximum", "indicator_max", "output_max"), ("minimum", "indicator_min", "output_min")), strict=True,
    ):  # fmt: skip
        for name, part in zip(names, (slice(0, n), slice(n, n + n_i), slice(n + n_i, None)), strict=True):
            getattr(chain, name)[some] = found[:, part]
    chain.crossings[some], chain.contacts[some] = kept.crossings.copy_to_host(), kept.contacts.copy_to_host()


def states_at(
    gpu: SeriesOnGpu, places: FloatArray, memory: FloatArray, rows: IntArray, modes: IntArray, begin: float
) -> States:
    """States at places (see ``attractors_trace``); what they do not say is as at a fresh start, at the phase ``begin``.
    """
    n, n_memory, period = gpu.n, gpu.n_memory, gpu.period[rows]
    memory, clock = np.tile(memory, (len(rows), 1)), np.zeros((len(rows), 3))
    if places.shape[1] >= n + n_memory:
        memory = places[:, n : n + n_memory]
    forced = period < np.inf
    clock[forced, 0] = places[forced, -1] if places.shape[1] > n + n_memory else begin * period[forced]
    clock[forced, 2] = period[forced]
    return gpu.states(rows, places[:, :n], memory, modes, clock)


def settle_series_on_gpu(
    settler: Settler, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float,
    attempts: int, first_look: int,
) -> Settled:  # fmt: skip
    """Jobs settled and judged, as ``Settler`` does one by one."""
    found = Settled.empty(len(rows), len(settler.system.traced.u), settler.width)
    for some, own, own_rows in batches(points, rows, int(PART * batch_size())):
        part = _settle(settler, own, own_rows, starts[some], modes[some], begin, LONGER[:attempts], first_look)
        for item in fields(found):
            getattr(found, item.name)[some] = getattr(part, item.name)
    return found


def _settle(
    settler: Settler, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, begin: float,
    longer: tuple[int, ...], first_look: int,
) -> Settled:  # fmt: skip
    """One batch: looks before the transient ends, then what remains of it and further transients."""
    keep, transient, n = settler.keep, settler.transient, len(rows)
    gpu = SeriesOnGpu(engine_of(settler), points, settler.plan)
    states = states_at(gpu, starts, settler.system.memory_vector(), rows, modes, begin)
    settling = Settling(gpu, states, keep, settler.max_period, settler.tolerance, settler.system.scale_vector())
    found, under_way, used, todo = settling.found, np.arange(n), 0, first_look
    rest, spent = np.full(n, transient), np.zeros(n, dtype=np.int64)
    while settler.stop_early and used + todo < transient and len(under_way):
        settling.look(under_way, np.full(n, todo))
        ended = usable(found.status[under_way])
        rest[under_way[~ended]], spent[under_way[~ended]] = transient - used, used
        used += todo + keep
        under_way = under_way[ended]
        spent[under_way] = used
        under_way = under_way[found.status[under_way] != codes.OK]
        rest[under_way] = max(transient - used, 0)
        todo = used if 2 * used + keep < transient else max(transient - used, 0)
    left = np.flatnonzero(found.period_number == 0)
    if len(left):
        settling.settle(left, rest, longer)
        spent[left] += rest[left] + keep
    return _closed(settling, gpu, spent, settler.width)


def _closed(settling: Settling, gpu: SeriesOnGpu, spent: IntArray, width: int) -> Settled:
    """What was found with counts and extremes, over one whole cycle where there is one: the kept window may begin
    before it was reached."""
    kept, states = settling.kept, settling.states
    cycle, found = settling.cycles(), settling.finished()
    n = np.maximum(np.where(found.period_number > 0, found.period_number, settling.keep), 1)
    cyclic, good = found.period_number > 0, usable(found.status)

    def of_both(read: Callable[[Any], Any]) -> Any:
        one, other = read(cycle), read(kept)
        return np.where(cyclic.reshape((-1,) + (1,) * (other.ndim - 1)), one, other)

    crossings = of_both(lambda out: out.crossings.copy_to_host()) / n
    contacts = of_both(lambda out: out.contacts.copy_to_host()) / n
    high = of_both(lambda out: gpu.extremes(out)[0, :, : gpu.n])
    low = of_both(lambda out: gpu.extremes(out)[1, :, : gpu.n])
    u, memory, clock, counters = (part.copy_to_host() for part in states.all())
    place = np.concatenate([u, memory[:, : gpu.n_memory], clock[:, :1]], axis=1)[:, :width]
    found.crossings[good], found.contacts[good] = crossings[good], contacts[good]
    found.maximum[good], found.minimum[good] = high[good], low[good]
    last = np.full((len(u), width), np.nan)
    last[good], found.mode[good] = place[good], counters[good, 0]
    return replace(found, last=last, returns=spent)


def engine_of(rules: Settler | Attractors) -> SeriesEngine:
    assert isinstance(rules.engine, SeriesEngine)  # the door has seen to it
    return rules.engine


def series_exponents_on_gpu(
    settler: Settler, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int,
    scale: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Largest exponents of jobs and their standard errors, as ``attractors_parting.exponent_of``."""
    largest, error = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    for some, own, own_rows in batches(points, rows, int(PART * batch_size())):
        largest[some], error[some] = _exponents(settler, own, own_rows, starts[some], modes[some], n_returns, scale)
    return largest, error


def _exponents(
    settler: Settler, points: FloatArray, rows: IntArray, starts: FloatArray, modes: IntArray, n_returns: int,
    scale: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    plan, n = settler.plan, len(rows)
    gpu = SeriesOnGpu(engine_of(settler), points, replace(plan, extremes=False))
    phase = plan.phase if plan.indicator < 0 else 0.0
    states = states_at(gpu, starts, settler.system.memory_vector(), rows, modes, phase)
    offset = np.tile(BESIDE * scale, (n, 1))
    first, batch = float(np.linalg.norm(offset[0] / scale)), n_returns // 10
    logs, times = [], []
    jobs, out = np.arange(n), gpu.buffers(n, 1)
    for k in range(batch // 4 + 10 * batch):
        other = states.taken(gpu.cuda, np.arange(n), offset)
        taken = []
        for one, settled in ((states, k > 0), (other, False)):
            jobs = gpu.run(jobs, one, 0, 1, out, settled)
            elapsed = out.elapsed.copy_to_host()
            taken.append(elapsed)
            short = jobs[elapsed[jobs] < 0.5 * taken[0][jobs]]  # just before the surface: that was no return
            if len(short):
                jobs = np.setdiff1d(jobs, np.setdiff1d(short, gpu.run(short, one, 0, 1, out, True)))
        times.append(taken[0])
        offset = other.u.copy_to_host() - states.u.copy_to_host()
        apart = np.linalg.norm(offset / scale, axis=1)
        fallen = ~(apart > 0.0)
        offset *= np.where(fallen, 1.0, first / np.where(fallen, 1.0, apart))[:, None]
        offset[fallen], apart[fallen] = BESIDE * scale, 1e-16 * first
        logs.append(np.log(apart / first))
    grown = np.array(logs[batch // 4 :]).reshape(10, batch, n).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = grown / np.array(times[batch // 4 :]).reshape(10, batch, n).sum(axis=1)
    lost = np.setdiff1d(np.arange(n), jobs)
    rates[:, lost] = np.nan
    return rates.mean(axis=0), rates.std(axis=0) / 3.0
