"""The relief valve on a GPU, scanned as published: against the processor, its speed, and what the compiler makes of it.

The parts that `gpu.py` prints. The scan is that of `valve_scan.py`: 1024 + 32 maxima of the lift from one start at each
inflow, tolerance 1e-10.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

import nonsmooth as ns
from nonsmooth.attractors.settler import Settler
from nonsmooth.flow.engines.devices import batch_size
from nonsmooth.flow.engines.gpu import PART
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.sections import section_plan
from nonsmooth.kernels.hybrid import codes
from own_process import printed
from ptxas import resources_of

HERE = Path(__file__).parent
TRANSIENT, KEEP, TOLERANCE = 1024, 32, 1e-10
START = {"y1": 0.2, "y2": 0.0, "y3": 10.0}
LOWEST, HIGHEST = 0.2, 7.5  # every orbit here has as many maxima as are asked for
TITAN = 4.0e6  # MPGOS on a Titan Black with 30 720 trajectories (published)
WANTED = 5e7
TOP = ns.Poincare("lift_velocity", rising=False)


def counted() -> dict[str, float]:
    """Operations and steps per return."""
    found: dict[str, float] = json.loads(printed(str(HERE / "gpu_flops_valve.py"), NUMBA_DISABLE_JIT="1"))
    return found


def engine_and_points(inflows: np.ndarray) -> tuple[Any, Any]:
    valve = ns.models.relief_valve()
    return engine_for(valve, "taylor", TOLERANCE, None), valve.parameter_points({"q": inflows})


def launched() -> str:
    """Types with which the kernel is launched, by a run of one trajectory under Numba's simulator."""
    code = (
        "import json, numpy as np, gpu_both, gpu_valve\n"
        "from nonsmooth.flow.engines.gpu import SeriesOnGpu\n"
        "types = gpu_both.launches_of(SeriesOnGpu)\n"
        "gpu_valve.march(np.array([5.0]), 2, 1)\n"
        "print(types['advance'])"
    )
    return printed("-c", code, NUMBA_ENABLE_CUDASIM="1").splitlines()[-1]


def ptx(signature: str) -> str:
    """The kernel of the valve as PTX."""
    from nonsmooth.flow.engines.gpu import module_of
    from nonsmooth.kernels.cuda.module import ptx_of_module

    engine, points = engine_and_points(np.array([5.0]))
    return ptx_of_module(module_of(engine, engine.prepare(points)), "advance", signature)


def compiled() -> list[str]:
    began = process_time()
    text = ptx(launched())
    seconds = process_time() - began
    used = resources_of(text)
    found = (
        f"{used['registers']} registers, {used['stack_bytes']} bytes of stack, {used['spill_store_bytes']} and "
        f"{used['spill_load_bytes']} bytes of spills (stores, loads), {used['object_bytes'] / 1000:.0f} kB"
        if used
        else "no ptxas here: pip install nvidia-cuda-nvcc"
    )
    return [
        f"- the valve's kernel (Taylor series of order 16), compute capability 9.0: {found}; "
        f"{seconds:.0f} s of processor time to PTX",
        "",
    ]


def page(flops: dict[str, float]) -> list[str]:
    return [
        f"- the relief valve: {flops['per_return']:.0f} operations and {flops['steps_per_return']:.1f} steps per"
        " section return (mean over 8 inflows)",
        "",
    ]


def scan(inflows: np.ndarray, **options: Any) -> Any:
    return ns.sweep(
        ns.models.relief_valve(),
        "q",
        inflows,
        direction=None,
        start=START,
        section=TOP,
        transient=TRANSIENT,
        keep=KEEP,
        method="taylor",
        rtol=TOLERANCE,
        progress=False,
        **options,
    )


def apart(a: Any, b: Any, which: np.ndarray, least: Any) -> float:
    """The greatest difference of extremes, in units of the motion's size (after chaos two runs may stand at different
    points of one cycle, which has one pair of extremes)."""
    size = np.maximum(0.5 * (a.maximum - a.minimum), least)
    gap = np.maximum(np.abs(a.maximum - b.maximum), np.abs(a.minimum - b.minimum)) / size
    return float(gap[which].max()) if which.any() else np.nan


def compared(n: int = 400) -> list[str]:
    """The scan on both devices: labels, and points of the cycles of which both are sure."""
    inflows = np.linspace(LOWEST, HIGHEST, n)
    engine, points = engine_and_points(inflows)
    valve = ns.models.relief_valve()
    cpu = Settler(valve, engine, section_plan(valve, TOP)[1], TRANSIENT, KEEP, 16, stop_early=False)
    rows, starts = np.arange(n), np.tile(list(START.values()), (n, 1))
    began = perf_counter()
    a = cpu.run(points, rows, starts)
    rate = n * (TRANSIENT + KEEP) / (perf_counter() - began)
    b = replace(cpu, device="cuda").run(points, rows, starts)
    differs = (a.period_number != b.period_number) | (a.status != b.status)
    differs |= (a.period_number > 0) & (np.rint(1e6 * a.contacts) != np.rint(1e6 * b.contacts))
    doubtful = np.isin(a.status, (codes.SLOW, codes.NOT_PERIODIC)) | np.isin(b.status, (codes.SLOW, codes.NOT_PERIODIC))
    good = ~differs & (a.period_number > 0) & (a.multiplier < 0.95)
    worst = apart(a, b, good, cpu.least)
    met = worst <= 1e-9 and differs.mean() < 0.002
    return [
        f"- relief valve, {n} inflows: {differs.mean():.3%} of the labels differ, {int((differs & ~doubtful).sum())}"
        f" of them neither slow nor chaotic; {int(good.sum())} periodic points with |multiplier| < 0.95, extremes at "
        f"most {worst:.1e} of the motion's size apart: {'met' if met else '**not met**'}",
        f"- the processor's scan beside it, one thread: {rate:.3g} returns/s",
        "",
    ]


def march(inflows: np.ndarray, transient: int, keep: int) -> tuple[np.ndarray, np.ndarray]:
    """March the valve at each inflow: codes, and the seconds of each of three runs."""
    from nonsmooth.flow.engines.devices import StatesOnGpu
    from nonsmooth.flow.engines.gpu import SeriesOnGpu

    engine, points = engine_and_points(inflows)
    gpu = SeriesOnGpu(engine, points, section_plan(ns.models.relief_valve(), TOP)[1])
    n = len(inflows)
    jobs, out, seconds = np.arange(n), gpu.buffers(n, keep), []
    for _ in range(3):
        states = StatesOnGpu.of(
            gpu.cuda, jobs, np.tile(list(START.values()), (n, 1)), np.zeros((n, 0)), 0, np.zeros((n, 3))
        )
        gpu.cuda.synchronize()
        began = perf_counter()
        gpu.run(jobs, states, transient, keep, out)
        seconds.append(perf_counter() - began)
    return out.status.copy_to_host(), np.array(seconds)


def timed(flops: dict[str, float], peak: float) -> list[str]:
    """Returns per second of the published scan, and of the same through ``sweep`` with its verdicts."""
    lines = [
        f"| relief valve: trajectories | returns/s, {TRANSIENT} + {KEEP} marched | of the FP64 peak | through sweep | "
        f"published, Titan Black |",
        "|---|---|---|---|---|",
    ]
    best = 0.0
    for n in (30720, int(PART * batch_size()), 65536):
        inflows = np.linspace(LOWEST, HIGHEST, n)
        ended, seconds = march(inflows, TRANSIENT, KEEP)
        rate = np.isin(ended, (codes.OK, codes.NOT_GUARANTEED)).sum() * (TRANSIENT + KEEP) / seconds.min()
        began = perf_counter()
        scan(inflows, device="cuda")
        whole = n * (TRANSIENT + KEEP) / (perf_counter() - began)
        best = max(best, rate)
        lines.append(f"| {n} | {rate:.3g} | {rate * flops['per_return'] / peak:.1%} | {whole:.3g} | {TITAN:.2g} |")
    return [*lines, "", f"Wanted {WANTED:.1g} returns/s: {'met' if best >= WANTED else '**not met**'}.", ""]
