"""A 200 x 200 chart of the paper's oscillator against heyoka and SciPy, time per forcing period and core.

Ours computes the whole chart, with period numbers, contacts and statuses; the peers march a sample of its points over
500 periods each and label nothing. Once every point gets its 500 periods (and more where it has not settled), and once
each stops as soon as its period number is certain, which is what `chart` does unless told otherwise. The ratios are
those of the time per point, so that what ours runs beyond the 500 periods counts against it; the mean number of periods
run stands beside (probes of the multipliers and the returns for extremes are not among them).

heyoka is timed in scalar mode and in batch mode, each point from rest; both reach the same states.
"""

from __future__ import annotations

from functools import partial
from statistics import median

import numpy as np

import nonsmooth as ns
import oscillator_heyoka
import oscillator_heyoka_batch
import oscillator_scipy
from nonsmooth.diagrams.chart import chart, plan_chart
from timing import interleaved, ratio
from work import TABLE_1

Verdict = tuple[str, str, str, bool]

PERIODS = 500
PLANES = {
    "Fig. 9: omega 3-7, rho 0.1-0.3, g 0.02": ({"g": 0.02}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}),
    "Fig. 13: g -0.0015-0.002, rho 0.2-0.5, omega 11.15": (
        {"omega": 11.15},
        {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)},
    ),
}


def periods_run(system: ns.System, ranges: dict[str, tuple[float, float]]) -> float:
    """Mean number of periods of a point with every period run, longer transients among them, on a coarser grid."""
    grid = {key: np.linspace(*ends, 40) for key, ends in ranges.items()}
    settler = plan_chart(system, grid, transient=PERIODS - 60, keep=60, extremes=False, stop_early=False).work.settler
    a, b = (values.ravel() for values in np.meshgrid(*grid.values(), indexing="ij"))
    points = system.parameter_points(dict(zip(grid, (a, b), strict=True)))
    return float(settler.run(points, np.arange(len(points)), np.zeros((len(points), 2))).returns.mean())


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    side = max(int(200 * effort**0.5), 20)
    lines = [
        f"## A {side} x {side} chart, {PERIODS} periods at each point: microseconds per point, one core",
        "",
        "| plane | every period run | its periods | stopping early | heyoka | heyoka, batch | SciPy | heyoka / every |"
        " heyoka / early | batch / every | SciPy / every |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
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
        peer, lanes = oscillator_heyoka.oscillator("complete"), oscillator_heyoka_batch.batch()

        def heyoka(peer: oscillator_heyoka.Oscillator = peer, sample: list[dict[str, float]] = sample) -> None:
            for p in sample:
                peer.start(p)
                peer.march(PERIODS)

        def scipy(sample: list[dict[str, float]] = sample) -> None:
            for p in sample[:4]:
                oscillator_scipy.march(p, np.zeros(2), 10)

        batch = partial(lanes.march, sample, PERIODS)
        times = interleaved(
            {
                "every": partial(ours, threads=1, stop_early=False),
                "early": partial(ours, threads=1),
                "heyoka": heyoka,
                "batch": batch,
                "scipy": scipy,
            },
            repeats=3,
        )
        points = side * side
        scale = {"every": points, "early": points, "heyoka": len(sample), "batch": len(sample)}
        scale["scipy"] = 4 * 10 / PERIODS
        per_point = {key: [1e6 * t / scale[key] for t in values] for key, values in times.items()}
        every, early, wide = (
            ratio(per_point, a, b) for a, b in (("heyoka", "every"), ("heyoka", "early"), ("batch", "every"))
        )
        slow = ratio(per_point, "scipy", "every")
        cell = {key: f"{median(values):.4g}" for key, values in per_point.items()}
        cells = [cell["every"], f"{periods_run(system, ranges):.0f}", cell["early"], cell["heyoka"], cell["batch"]]
        cells += [cell["scipy"], f"{every:.1f}", f"{early:.1f}", f"{wide:.1f}", f"{slow:.0f}"]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
        place = name.split(":")[0]
        verdicts += [
            (f"chart of {place}: heyoka / ours, the same picture", "at least 15", f"{early:.1f}", early >= 15),
            (f"chart of {place}: heyoka / ours, every period run", "at least 15", f"{every:.1f}", every >= 15),
            (f"chart of {place}: SciPy / ours, every period run", "at least 3000", f"{slow:.0f}", slow >= 3000),
        ]
    lines += ["", f"heyoka's batch mode: {oscillator_heyoka_batch.batch().lanes} lanes, one trajectory in each.", ""]
    return lines, verdicts
