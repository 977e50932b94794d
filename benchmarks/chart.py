"""A 200 x 200 chart of the paper's oscillator against heyoka and SciPy, time per forcing period and core.

Ours computes the whole chart, with period numbers, contacts and statuses; the peers march a sample of its points over
500 periods each and label nothing. Once every point gets its 500 periods (and more where it has not settled), and once
each stops as soon as its period number is certain, which is what `chart` does unless told otherwise.
"""

from __future__ import annotations

from functools import partial
from statistics import median
from time import perf_counter

import numpy as np

import nonsmooth as ns
import oscillator_heyoka
import oscillator_scipy
from nonsmooth.analysis.chart import chart
from timing import interleaved, ratio
from work import TABLE_1

Verdict = tuple[str, str, str, bool]

PERIODS = 500
PLANES = {
    "Fig. 9: omega 3-7, rho 0.1-0.3, g 0.02": ({"g": 0.02}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}),
    "Fig. 13: g -0.0015-0.002, rho 0.2-0.5, omega 11.15": (
        {"omega": 11.15}, {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)},
    ),
}  # fmt: skip


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    side = max(int(200 * effort**0.5), 20)
    lines = [
        f"## A {side} x {side} chart, {PERIODS} periods at each point: microseconds per point, one core",
        "",
        "| plane | every period run | stopping early | heyoka | SciPy | heyoka / every | heyoka / early |"
        " SciPy / early | 2 threads |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    verdicts: list[Verdict] = []
    for name, (parameters, ranges) in PLANES.items():
        system = ns.models.discontinuous_support(**parameters)
        grid = {key: np.linspace(*ends, side) for key, ends in ranges.items()}
        ours = partial(chart, system, grid, transient=PERIODS - 60, keep=60, extremes=False, progress=False)
        rng = np.random.default_rng(9)
        sample = [
            {**TABLE_1, **parameters, **{key: float(rng.choice(values)) for key, values in grid.items()}}
            for _ in range(max(int(400 * effort), 20))
        ]
        peer = oscillator_heyoka.oscillator("complete")

        def heyoka(peer: oscillator_heyoka.Oscillator = peer, sample: list[dict[str, float]] = sample) -> None:
            for p in sample:
                peer.start(p)
                peer.march(PERIODS)

        def scipy(sample: list[dict[str, float]] = sample) -> None:
            for p in sample[:4]:
                oscillator_scipy.march(p, np.zeros(2), 10)

        times = interleaved(
            {
                "every": partial(ours, threads=1, stop_early=False), "early": partial(ours, threads=1),
                "heyoka": heyoka, "scipy": scipy,
            },
            repeats=3,
        )  # fmt: skip
        points = side * side
        scale = {"every": points, "early": points, "heyoka": len(sample), "scipy": 4 * 10 / PERIODS}
        per_point = {key: [1e6 * t / scale[key] for t in values] for key, values in times.items()}
        wall = []
        for threads in (1, 2):
            begin = perf_counter()
            ours(threads=threads, stop_early=False)
            wall.append(perf_counter() - begin)
        every, early = ratio(per_point, "heyoka", "every"), ratio(per_point, "heyoka", "early")
        slow = ratio(per_point, "scipy", "early")
        cells = [f"{median(per_point[key]):.4g}" for key in ("every", "early", "heyoka", "scipy")]
        scaling = wall[0] / wall[1]
        cells += [f"{every:.1f}", f"{early:.1f}", f"{slow:.0f}", f"{scaling:.2f}"]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
        place = name.split(":")[0]
        verdicts += [
            (f"chart of {place}: heyoka / ours, the same picture", "at least 15", f"{early:.1f}", early >= 15),
            (f"chart of {place}: heyoka / ours, every period run", "at least 15", f"{every:.1f}", every >= 15),
            (f"chart of {place}: SciPy / ours", "at least 3000", f"{slow:.0f}", slow >= 3000),
            (f"chart of {place}: 2 threads over 1", "at least 1.8", f"{scaling:.2f}", scaling >= 1.8),
        ]
    return [*lines, ""], verdicts
