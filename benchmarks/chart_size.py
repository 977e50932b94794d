"""Growth of a chart with its number of points: time over three decades, two threads over one, memory.

    python benchmarks/chart_size.py                    times and threads, as in `make bench`
    python benchmarks/chart_size.py --picture FILE     the picture of time against points alone
    python benchmarks/chart_size.py --memory 4000      one chart of labels only, its peak memory (ten minutes)

The chart is that of the paper's Fig. 9 plane. Time is processor time on one thread; memory is the peak resident size of
a process of its own that imports the package and computes the chart, with the fewest periods (two kept, no transient):
what is stored does not depend on them.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

Verdict = tuple[str, str, str, bool]
SIDES = (10, 18, 32, 56, 100, 178, 316)
GIB = 2**30


def plane(side: int, **options: Any) -> Any:
    import nonsmooth as ns

    system = ns.models.discontinuous_support(g=0.02)
    grid = {"omega": np.linspace(3.0, 7.0, side), "rho": np.linspace(0.1, 0.3, side)}
    return ns.chart(system, grid, progress=False, extremes=False, **options)


def times(effort: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and seconds of processor time: the least of three turns, one of the largest chart, eight of small ones."""
    plane(4, threads=1)
    sides = [side for side in SIDES if side <= max(316 * effort, 60)]
    seconds = []
    for side in sides:
        turns = []
        for _ in range(1 if side > 200 else 3 if side > 60 else 8):
            begin = process_time()
            plane(side, threads=1)
            turns.append(process_time() - begin)
        seconds.append(min(turns))
    return np.array(sides) ** 2, np.array(seconds)


def scaling(effort: float, turns: int = 6) -> tuple[float, list[str]]:
    """Wall time of one thread over that of two, least against least, and every turn with the machine's load."""
    side = max(int(160 * effort**0.5), 60)
    wall: dict[int, list[float]] = {1: [], 2: []}
    words = []
    for _ in range(turns):
        for threads in (1, 2):
            begin = perf_counter()
            plane(side, threads=threads, stop_early=False)
            wall[threads].append(perf_counter() - begin)
        load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
        words.append(f"{wall[1][-1]:.2f} s / {wall[2][-1]:.2f} s{load}")
    return min(wall[1]) / min(wall[2]), words


def picture(points: np.ndarray, seconds: np.ndarray, path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    from nonsmooth import plot

    with plot.journal():
        import matplotlib.pyplot as plt

        _, ax = plt.subplots()
        ax.loglog(points, seconds, "o", color=plot.COLORS["first"], label="measured")
        per_point = seconds[-1] / points[-1]
        text = f"{1e6 * per_point:.0f} µs per point"
        ax.loglog(points, per_point * points, "-", color=plot.COLORS["muted"], label=text)
        ax.set(xlabel="points of the chart", ylabel="processor time (s)")
        ax.legend()
        ax.figure.set_size_inches(5.2, 3.7)  # 1400 pixels wide, as the other pictures of the documentation
        ax.figure.savefig(path, dpi=270, metadata={"Software": None} if path.suffix == ".png" else None)


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    points, seconds = times(effort)
    slope = float(np.polyfit(np.log(points[2:]), np.log(seconds[2:]), 1)[0])
    gain, words = scaling(effort)
    lines = [
        "## A chart's cost against its size (plane of Fig. 9, one thread, processor time)",
        "",
        "| points | seconds | microseconds per point |",
        "|---|---|---|",
        *(f"| {n} | {t:.3g} | {1e6 * t / n:.1f} |" for n, t in zip(points, seconds, strict=True)),
        "",
        f"Time grows like points^{slope:.3f}. One thread / two threads, wall time of each turn: {'; '.join(words)}.",
        "",
    ]
    return lines, [
        ("chart: time against points over three decades, exponent", "1 +- 0.1", f"{slope:.3f}", abs(slope - 1) < 0.1),
        ("chart: 2 threads over 1, wall time, least of 6", "at least 1.8", f"{gain:.2f}", gain >= 1.8),
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--memory", type=int)
    parser.add_argument("--scaling", action="store_true", help="only one thread against two")
    options = parser.parse_args()
    if options.memory:
        chart = plane(options.memory, transient=0, keep=2, max_period=1, stop_early=False)
        stored = sum(chart[name].nbytes for name in chart.data_vars)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        side = options.memory
        print(f"{side} x {side}: {stored} bytes of results; peak resident memory {peak / GIB:.3f} GiB")
    elif options.picture:
        picture(*times(1.0), options.picture)
    elif options.scaling:
        gain, words = scaling(1.0)
        print(*words, f"least / least: {gain:.2f}", sep="\n")
    else:
        print("\n".join(run(1.0)[0]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
