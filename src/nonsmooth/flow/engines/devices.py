"""Places where work runs, ``device="cpu"`` or ``device="cuda"``; what a GPU takes, and how work for one is cut up."""

from __future__ import annotations

import importlib.util
import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.errors import not_installed
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.engines.linear import LinearEngine, PlanarEngine
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.engines.patterns import PatternEngine
from nonsmooth.flow.engines.series import SeriesEngine
from nonsmooth.kernels.hybrid.kept import Kept, Section

BATCH = 65536  # trajectories of one chunk of work on a GPU
SERIES = ("taylor",)  # methods of the series kernels that a GPU runs
PER_MULTIPROCESSOR = 512  # of one launch: twice what its registers hold, so that a small GPU is not busy for long


def batch_size() -> int:
    """Trajectories of one launch on the present GPU; results do not depend on it."""
    from numba import cuda

    if _simulated():
        return BATCH
    return min(BATCH, PER_MULTIPROCESSOR * int(cuda.get_current_device().MULTIPROCESSOR_COUNT))


def gpu_name() -> str:
    """Name of the present GPU."""
    from numba import cuda

    if _simulated():
        return "Numba's CUDA simulator"
    name = cuda.get_current_device().name
    return name.decode() if isinstance(name, bytes) else str(name)


def _simulated() -> bool:
    return os.environ.get("NUMBA_ENABLE_CUDASIM", "0") not in ("", "0")


def engine_on_gpu(engine: Engine, plan: Section | None) -> Engine:
    """The engine that runs a system on a GPU.

    The planar kernels of a GPU know two states and stroboscopic sections only: else the same flow goes there by the
    series kernels."""
    decides = engine.traced.decider is not None
    if decides or isinstance(engine, PatternEngine):
        raise ValueError(
            "what contacts and frictions decide together, and modes that are made when they are visited, are found by "
            'the processor: leave out device="cuda"'
        )
    planar = isinstance(engine, PlanarEngine) and (plan is None or plan.indicator < 0)
    if planar or not isinstance(engine, LinearEngine):
        return engine
    from nonsmooth.flow.engines.methods import SHARPEST

    return SeriesEngine(engine.traced, engine.scale, "taylor", SHARPEST)


def on_gpu(device: Any, verb: str, engine: Engine, plan: Section | None, *, carried: bool = False) -> bool:
    """Return whether a verb's work goes to the GPU; every reason why it cannot is raised before anything is compiled.

    Parameters
    ----------
    engine : Engine
        The method resolved for the system.
    plan : Section, optional
        The section, where the verb has one.
    carried : bool
        Whether a state is to be carried from one parameter value to the next.

    Raises
    ------
    ValueError
        A device that does not exist; a system, method or section without a path to a GPU; passed-over returns; a
        carried state.
    ImportError
        The package numba-cuda is not installed.
    RuntimeError
        No NVIDIA driver, or no GPU.
    """
    if device == "cpu":
        return False
    if engine.phases is not None:
        raise ValueError(
            f'{verb} with device="cuda" takes transitions at fixed phases; here `at` depends on the parameters: use '
            'device="cpu"'
        )
    planar = isinstance(engine, PlanarEngine)
    if not planar and verb == "lyapunov":
        raise ValueError(
            'lyapunov with device="cuda" takes systems of two states whose modes are linear with harmonic forcing, '
            f'whose indicators and resets are affine, by their exact flow; this one runs by method="{engine.name}": '
            'use device="cpu", or chart with lyapunov'
        )
    if not planar and not (isinstance(engine, SeriesEngine) and engine.name in SERIES and engine.locate):
        raise ValueError(
            f'{verb} with device="cuda" runs by method="exact" or method="taylor" with crossings located; this call '
            f'asks for method="{engine.name}"{"" if engine.name not in SERIES else ", locate=False"}: choose one of '
            'them, or use device="cpu"'
        )
    if plan is not None and plan.every > 1:
        raise ValueError(
            f'{verb} with device="cuda" takes every return of a section, this one passes over some (every = '
            f'{plan.every}): leave `every` out, or use device="cpu"'
        )
    if carried and not (planar and verb == "chart"):
        raise ValueError(
            f'{verb} with device="cuda" runs all points at once, so none can go on from the state of another: begin '
            'each at start (chart: leave carry out; sweep, lyapunov: direction=None), or use device="cpu"'
        )
    if importlib.util.find_spec("numba_cuda") is None:
        raise ImportError(f'device="cuda" needs {not_installed("numba-cuda", "cuda")}, or use device="cpu"')
    if not _simulated():
        _find_gpu()
    return True


def _find_gpu() -> None:
    from numba import cuda

    try:
        if len(cuda.gpus):
            return
        reason = "the driver reports no GPU"
    except Exception as error:  # the driver's loader raises whatever its own layers do
        lines = [line.strip(" .:") for line in str(error).splitlines() if line.strip(" .:")]
        reason = ": ".join(lines[:2]) or type(error).__name__
    raise RuntimeError(
        f'device="cuda" found no GPU on this machine ({reason}). It needs an NVIDIA GPU and its driver (nvidia-smi '
        'shows both); without one use device="cpu"'
    )


@dataclass
class StatesOnGpu:
    """Places of N trajectories, on the GPU: states, memory, clocks, modes, and the parameter row of each."""

    u: Any  # (N, n)
    memory: Any  # (N, n_memory), at least one column
    clock: Any  # (N, 3)
    counters: Any  # (N, 4)
    rows: Any  # (N,)

    @classmethod
    def of(
        cls, cuda: Any, rows: IntArray, u: FloatArray, memory: FloatArray, modes: Any, clock: FloatArray
    ) -> StatesOnGpu:
        """Those of N trajectories with their clocks (:class:`.engine.State`), which have no transition behind them."""
        counters, room = np.zeros((len(rows), 4), dtype=np.int64), np.zeros((len(rows), max(memory.shape[1], 1)))
        counters[:, 0], counters[:, 1], room[:, : memory.shape[1]] = modes, -1, memory
        parts = (np.array(u, dtype=float), room, np.array(clock, dtype=float), counters, np.asarray(rows))
        return cls(*map(cuda.to_device, parts))

    def room(self, cuda: Any, times: int) -> StatesOnGpu:
        """Room for so many states at the parameter rows of each of these."""
        shapes = [(times * len(part), *part.shape[1:]) for part in self.all()]
        rows = np.tile(self.rows.copy_to_host(), times)
        arrays = (cuda.device_array(shape, part.dtype) for shape, part in zip(shapes, self.all(), strict=True))
        return StatesOnGpu(*[*arrays, cuda.to_device(rows)])

    def all(self) -> tuple[Any, ...]:
        return self.u, self.memory, self.clock, self.counters

    def place(self) -> tuple[Any, ...]:
        """Without memory, as the linear kernels take it."""
        return self.u, self.clock, self.counters


def batches(points: FloatArray, rows: IntArray, size: int) -> Iterator[tuple[slice, FloatArray, IntArray]]:
    """Jobs in batches: which, the parameter points that they need, and their rows among these."""
    for first in range(0, len(rows), size):
        some = slice(first, first + size)
        needed, own = np.unique(rows[some], return_inverse=True)
        yield some, points[needed], own.astype(np.int64)


class OnGpu:
    """Launches, and room for what they leave, of an engine on a GPU; ``n`` states, ``rows`` whose extremes are kept."""

    cuda: Any
    threads: int
    n: int
    rows: int

    def launch(self, entry: Any, jobs: IntArray, *arguments: Any) -> None:
        """One thread for each job, in blocks of ``threads``; waits for nothing."""
        with warnings.catch_warnings():  # a few threads on a large GPU: Numba warns of it, in a class of its own
            warnings.filterwarnings("ignore", message=".*low occupancy")
            configured = entry[-(-len(jobs) // self.threads), self.threads]
        configured(self.cuda.to_device(jobs), *arguments)

    def buffers(self, n: int, keep: int) -> Kept:
        """Room for ``keep`` section points of each of n trajectories."""
        array, whole, keep = self.cuda.device_array, np.int64, max(keep, 1)
        return Kept(
            array((n, keep, self.n)),
            array((n, self.rows)),
            array((n, self.rows)),
            array(n, whole),
            array(n, whole),
            array(n),
            array((n, keep)),
            array((n, keep), whole),
            array(n, whole),
        )
