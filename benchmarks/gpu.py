"""`make gpu`: a GPU against the processor on the paper's chart and the valve's scan, and how fast it is; `make
gpu-compiler` without a GPU.

With a GPU: every label of a 200 x 200 chart and every periodic point against the processor's, then forcing periods
per second of one launch and of whole charts, with the part of the FP64 peak that a counted number of operations per
period makes of it. With `--compiler` only what needs no GPU: registers, stack, spills and size of every kernel
(ptxas), and the operations per period. Prints a page; `--out` keeps it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import gpu_valve
import machine
import nonsmooth as ns
from gpu_flops import PLANES
from nonsmooth.diagrams.chart import plan_chart
from nonsmooth.diagrams.chart_refine import labels_of_points
from nonsmooth.flow.engines.devices import gpu_name
from nonsmooth.kernels.hybrid import codes
from own_process import SCRIPTS, printed
from ptxas import resources_of

HERE = Path(__file__).parent
# FP64 units of a multiprocessor, by compute capability; each makes a multiplication and an addition per clock.
UNITS = {(6, 0): 32, (7, 0): 32, (8, 0): 32, (9, 0): 64, (10, 0): 64}
SHAPE = (1, 2, 2, 1, 2, 5)  # of the paper's oscillator: see nonsmooth.kernels.cuda.module
PERIODS = 500


def page(flops: dict[str, Any]) -> list[str]:
    """Operations of the exact flow."""
    lines = [
        "## Floating-point operations, counted",
        "",
        "| plane | per forcing period | tables of a point |",
        "|---|---|---|",
    ]
    return [*lines, *(f"| {name} | {one['per_period']:.0f} | {one['tables']:.0f} |" for name, one in flops.items()), ""]


def counted() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(printed(str(HERE / "gpu_flops.py"), NUMBA_DISABLE_JIT="1"))
    return found


def compiled() -> list[str]:
    """Return what the compiler makes of every kernel, for the argument types of a simulated run."""
    simulated = printed(str(SCRIPTS / "gpu_script.py"), NUMBA_ENABLE_CUDASIM="1")
    launched = json.loads(simulated.splitlines()[-1])["launched"]
    lines = [
        "## Kernels for compute capability 9.0, shape of the paper's oscillator",
        "",
        "| kernel | registers | stack, bytes | spills (store, load), bytes | object, kB | seconds to PTX |",
        "|---|---|---|---|---|---|",
    ]
    code = "import json, sys; from nonsmooth.kernels.cuda.module import ptx_of; print(ptx_of(*json.load(sys.stdin)))"
    for name, signature in launched.items():
        began = perf_counter()
        ptx = printed("-c", code, given=json.dumps([name, signature, SHAPE]))
        seconds = perf_counter() - began
        used = resources_of(ptx)
        if not used:
            lines.append(f"| {name} | no ptxas here: pip install nvidia-cuda-nvcc | | | | {seconds:.0f} |")
            continue
        lines.append(
            f"| {name} | {used['registers']} | {used['stack_bytes']} | {used['spill_store_bytes']}, "
            f"{used['spill_load_bytes']} | {used['object_bytes'] / 1000:.0f} | {seconds:.0f} |"
        )
    return [*lines, ""]


def peak() -> tuple[str, float]:
    """The GPU's name and its FP64 peak in operations per second; NaN where its number of units is not known here."""
    from numba import cuda

    gpu = cuda.get_current_device()
    units = UNITS.get(tuple(gpu.compute_capability), np.nan)
    return gpu_name(), 2.0 * units * gpu.MULTIPROCESSOR_COUNT * gpu.CLOCK_RATE * 1e3


def settlers(side: int, plane: str, **options: Any) -> tuple[Any, Any, Any, Any]:
    """The processor's and the GPU's attractor mapper of a chart, its points, and its starts."""
    parameters, ranges = PLANES[plane]
    system = ns.models.discontinuous_support(**parameters)
    grid = {name: np.linspace(*ends, side) for name, ends in ranges.items()}
    settler = plan_chart(system, grid, **options).work.settler
    (a, x), (b, y) = grid.items()
    points = system.parameter_points({a: np.repeat(x, side), b: np.tile(y, side)})
    return settler, replace(settler, device="cuda"), points, np.zeros((side * side, 2))


def compared(plane: str, side: int) -> list[str]:
    """Labels and periodic points of a chart on both devices."""
    cpu, gpu, points, starts = settlers(side, plane, stop_early=False)
    rows = np.arange(len(points))
    a, b = cpu.run(points, rows, starts), gpu.run(points, rows, starts)
    names = {"crossings_per_period": "crossings", "period_number": "period_number", "status": "status"}
    one, other = (
        labels_of_points({name: getattr(found, key) for name, key in names.items()}).reshape(side, side)
        for found in (a, b)
    )
    differs = one != other
    padded = np.pad(one, 1, mode="edge")
    beside = np.zeros_like(differs)
    for dx in range(3):
        for dy in range(3):
            beside |= padded[dx : dx + side, dy : dy + side] != one
    doubtful = np.isin(a.status, (codes.SLOW, codes.NOT_PERIODIC)) | np.isin(b.status, (codes.SLOW, codes.NOT_PERIODIC))
    lost = differs & ~beside & ~doubtful.reshape(side, side)
    good = ~differs.ravel() & (a.period_number > 0) & (a.multiplier < 0.95)
    worst = gpu_valve.apart(a, b, good, cpu.least)
    met = worst <= 1e-9 and differs.mean() < 0.002 and not lost.any()
    return [
        f"- {plane}, {side} x {side}: {differs.mean():.3%} of the labels differ ({int(differs.sum())} points), "
        f"{int(lost.sum())} of them neither beside a boundary nor slow nor chaotic; {int(good.sum())} periodic points "
        f"with |multiplier| < 0.95, extremes at most {worst:.1e} of the motion's size apart: "
        f"{'met' if met else '**not met**'}"
    ]


def one_launch(plane: str, side: int, returns: int = 256) -> float:
    """Forcing periods per second while all trajectories of a chart are marched, tables included."""
    from nonsmooth.flow.engines.devices import StatesOnGpu
    from nonsmooth.flow.engines.gpu import PlanarOnGpu

    _, settler, points, starts = settlers(side, plane)
    gpu = PlanarOnGpu(settler.engine, points, settler.plan)
    jobs = np.arange(len(points))
    states = StatesOnGpu.of(gpu.cuda, jobs, starts, np.zeros((len(jobs), 0)), 0, np.zeros((len(jobs), 3)))
    out = gpu.buffers(len(jobs), 1)
    best = np.inf
    for _ in range(4):
        gpu.cuda.synchronize()
        began = perf_counter()
        gpu.run(jobs, states, returns - 1, 1, out)
        best = min(best, perf_counter() - began)
    return len(jobs) * returns / best


def timed(flops: dict[str, Any]) -> list[str]:
    name, most = peak()
    lines = [
        f"On {name}, FP64 peak {most / 1e12:.1f} TFLOP/s by its clock and units:",
        "",
        "| plane | points | periods/s of one launch | of the peak | chart of every period: s, periods/s |"
        " chart stopping early: s, points/s |",
        "|---|---|---|---|---|---|",
    ]
    for plane, (parameters, ranges) in PLANES.items():
        for side in (200, 256, 1000):
            rate = one_launch(plane, min(side, 256))
            system = ns.models.discontinuous_support(**parameters)
            grid = {key: np.linspace(*ends, side) for key, ends in ranges.items()}
            options = {"transient": PERIODS - 60, "keep": 60, "extremes": False, "progress": False, "device": "cuda"}
            seconds = {}
            for early in (False, True):
                best = np.inf
                for _ in range(2 if side > 500 else 3):
                    began = perf_counter()
                    ns.chart(system, grid, stop_early=early, **options)
                    best = min(best, perf_counter() - began)
                seconds[early] = best
            part = rate * flops[plane]["per_period"] / most
            lines.append(
                f"| {plane} | {side} x {side} | {rate:.3g} | {part:.1%} | {seconds[False]:.3g}, "
                f"{side * side * PERIODS / seconds[False]:.3g} | {seconds[True]:.3g}, "
                f"{side * side / seconds[True]:.3g} |"
            )
    return [*lines, ""]


def parts(options: argparse.Namespace) -> Iterator[list[str]]:
    """The page, part by part."""
    flops, valve = counted(), gpu_valve.counted()
    yield ["# The GPU", "", *(f"- {fact}" for fact in machine.facts() if fact), ""]
    yield [*page(flops), *gpu_valve.page(valve)]
    if options.compiler:
        yield compiled()
        yield gpu_valve.compiled()
        return
    yield ["## Against the processor", ""]
    for plane in PLANES:
        yield compared(plane, options.side)
    yield gpu_valve.compared()
    yield ["## Speed", "", *gpu_valve.timed(valve, peak()[1])]
    yield timed(flops)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compiler", action="store_true", help="only what needs no GPU")
    parser.add_argument("--side", type=int, default=200, help="points along each side of the compared charts")
    parser.add_argument("--out", type=Path, help="a file for the page that is printed")
    options = parser.parse_args()
    with contextlib.ExitStack() as files:
        out = None if options.out is None else files.enter_context(options.out.open("w", encoding="utf-8"))
        for lines in parts(options):  # what is measured stands, whatever comes behind it
            print("\n".join(lines), flush=True)
            if out is not None:
                print("\n".join(lines), file=out, flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
