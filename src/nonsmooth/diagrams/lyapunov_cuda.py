"""Lyapunov spectra of many parameter points on a GPU, one trajectory per thread, in batches of time."""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.flow.engines.devices import StatesOnGpu
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.engines.gpu import PlanarOnGpu
from nonsmooth.flow.engines.linear import PlanarEngine
from nonsmooth.kernels.hybrid.kept import Section


def growth_on_gpu(
    engine: PlanarEngine,
    points: FloatArray,
    start: FloatArray,
    mode: int,
    scale: FloatArray,
    align: int,
    wait: int,
    edges: IntArray,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Growth of the frames of P trajectories that begin at one start, at the phase 0 of the forcing.

    Parameters
    ----------
    wait, align : int
        Forcing periods passed over; in the last ``align`` of them the frame turns into the directions of growth.
    edges : array (B + 1,)
        Ends of the batches of time, in periods, beginning with 0.

    Returns
    -------
    growth : array (P, B, 2)
        Logarithms of the lengths divided out, by batch.
    sums : array (P, 6)
        As :class:`nonsmooth.kernels.hybrid.records.Growth` says.
    status : array (P,)
    """
    n = len(points)
    gpu = PlanarOnGpu(engine, points, Section())
    module, to_device = gpu.growth(), gpu.cuda.to_device
    states = StatesOnGpu.of(gpu.cuda, np.arange(n), np.tile(start, (n, 1)), np.zeros((n, 0)), mode, np.zeros((n, 3)))
    status = np.zeros(n, dtype=np.int64)
    jobs = np.arange(n)
    if wait > align:
        out = gpu.buffers(n, 1)
        jobs = gpu.run(jobs, states, wait - align - 1, 1, out)
        status[:] = out.status.copy_to_host()
    frame, sums = to_device(np.tile(np.eye(2), (n, 1, 1))), to_device(np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], (n, 1)))
    on_device, lengths = to_device(status), to_device(scale)

    def grow(jobs: IntArray, count: int, sums: Any) -> tuple[IntArray, FloatArray]:
        growth = to_device(np.zeros((n, 2)))
        while count > 0 and len(jobs):
            some = min(count, module.UNITS)
            gpu.launch(
                module.frames,
                jobs,
                states.rows,
                gpu.tables,
                gpu.net,
                states.place(),
                some,
                gpu.periods,
                gpu.limit,
                lengths,
                (frame, growth, sums, on_device),
            )
            status[:] = on_device.copy_to_host()
            jobs = jobs[status[jobs] == 0]
            count -= some
        return jobs, growth.copy_to_host()

    jobs, _ = grow(jobs, align, to_device(np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], (n, 1))))
    found = np.zeros((n, len(edges) - 1, 2))
    for batch, count in enumerate(np.diff(edges)):
        jobs, found[:, batch] = grow(jobs, int(count), sums)
    return found, sums.copy_to_host(), status
