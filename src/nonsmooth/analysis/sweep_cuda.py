"""The points of a sweep that stand alone, on a GPU: one trajectory per thread, judged in rounds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nonsmooth.analysis.attractors_cuda import Judging, fail
from nonsmooth.analysis.settle import LONGER
from nonsmooth.analysis.settled import LEAST, Settled, usable
from nonsmooth.flow.devices import batch_size
from nonsmooth.flow.engine import Chain, FloatArray
from nonsmooth.flow.linear import PlanarEngine
from nonsmooth.flow.planar_cuda import PlanarOnGpu
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels import codes

__all__ = ["sweep_on_gpu"]

SAVED = ("section", "maximum", "minimum", "indicator_max", "indicator_min", "output_max", "output_min", "crossings",
         "contacts")  # fmt: skip


def sweep_on_gpu(
    engine: PlanarEngine, points: FloatArray, start: FloatArray, phase: float, transient: int, keep: int,
    max_period: int, tolerance: float, scale: FloatArray, chain: Chain, advance: Callable[[int], Any],
) -> Settled:  # fmt: skip
    """Every parameter point from one start: the rules of ``analysis.settle``, whose buffers ``chain`` is filled."""
    parts, size = [], batch_size()
    for first in range(0, len(points), size):
        some = slice(first, first + size)
        gpu = PlanarOnGpu(engine, points[some], phase)
        parts.append(_batch(gpu, start, transient, keep, max_period, tolerance, scale, chain, some))
        advance(len(parts[-1].status))
    return Settled.joined(parts)


def _batch(
    gpu: PlanarOnGpu, start: FloatArray, transient: int, keep: int, max_period: int, tolerance: float,
    scale: FloatArray, chain: Chain, some: slice,
) -> Settled:  # fmt: skip
    n = len(gpu.period)
    rows = np.arange(n)
    judging = Judging(gpu, n, keep, max_period, tolerance, LEAST * scale, rows)
    states = gpu.states(rows, np.tile(start, (n, 1)), np.zeros(n, dtype=np.int64), 0.0)
    found, under_way = Settled.empty(n, 2), rows
    todo = transient
    for factor in (*LONGER, 0):
        ran = gpu.run(under_way, states, todo, keep, judging.kept, extremes=True)
        fail(found, under_way, ran, judging.kept)
        judging.judge(ran, found, judging.kept)
        under_way = ran[found.status[ran] == codes.SLOW]
        if not len(under_way) or not factor:
            break
        judging.push(states, under_way, found.multiplier)
        todo = factor * max(transient, 1)
    for name in SAVED:
        room = getattr(chain, name)
        if room.shape[1:] != (0,):
            room[some] = getattr(judging.kept, name).copy_to_host()
    failed = ~usable(found.status)
    found.period_number[failed], found.residual[failed] = 0, np.nan
    found.status[failed] = [result_status(code) for code in found.status[failed]]
    return found
