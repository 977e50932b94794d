"""Compare `nonsmooth`'s exact flow of the paper's oscillator with heyoka over 40 parameter sets and 50 periods.

`compare_all()` returns one `Agreement` per set; `python heyoka_agreement.py` prints the table and the summary.
"""

from __future__ import annotations

from dataclasses import dataclass

import heyoka_support as hs
import numpy as np
import xarray as xr
from numpy.typing import NDArray

import nonsmooth as ns

N_SETS, N_PERIODS, SEED = 40, 50, 2007
SCALE = np.array([1e-3, 1e-2])  # metres, metres per second: the norm of the per-period comparison

#: Figure, rho, g, omega: the centres of the +-20 % boxes, taken in turn.
FIGURES = (
    (9, 0.14, 0.02, 5.29),
    (10, 0.16, 0.0145, 5.0),
    (11, 0.29, -0.0045, 3.69),
    (12, 0.39, -0.0045, 3.69),
    (13, 0.33, -0.0012, 11.15),
    (14, 0.33, 0.0018, 11.15),
    (17, 0.23, 0.0036, 9.55),
)


@dataclass
class Agreement:
    """Return the distance of the two runs of one parameter set."""

    figure: int
    parameters: dict[str, float]
    n_contacts: int
    growth: float  # largest growth factor of a neighbour within the stretch
    difference: float  # largest |difference| of a state over the 50 periods, SI units
    excess: float  # the same over its allowance max(1e-10, 1e-13 growth at that period); must be <= 1
    per_period: float  # largest scaled difference after one period from the same state; must be <= 1e-12
    nearest_graze: float  # metres
    same_modes: bool  # up to the first touch or crossing nearer to grazing than 1e-9 m
    crossing_time: float  # largest difference of a crossing's time while growth < 1e3, seconds
    n_touches: int  # touches of the gap both codes saw, or -1 where the numbers differ
    clearance: float  # largest difference of a touch's clearance, metres
    allowance: float  # the largest allowance on the stretch


def parameter_sets() -> list[tuple[int, dict[str, float]]]:
    rng = np.random.default_rng(SEED)
    sets = []
    for i in range(N_SETS):
        figure, rho, g, omega = FIGURES[i % len(FIGURES)]
        centre = dict(hs.TABLE_1, rho=rho, g=g, omega=omega)
        factors = rng.uniform(0.8, 1.2, len(hs.NAMES))
        sets.append((figure, {name: centre[name] * f for name, f in zip(hs.NAMES, factors, strict=True)}))
    return sets


def scaled(difference: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.linalg.norm(difference / SCALE, axis=-1)


def compare(figure: int, p: dict[str, float], model: ns.System) -> Agreement:
    """Run both codes with parameters `p` from rest; then ours again from each of heyoka's section points."""
    system = model.with_parameters(p)
    theirs = hs.run(p, N_PERIODS)
    allowance = np.maximum(1e-10, 1e-13 * hs.growth(p, theirs, scale=SCALE))
    section = ns.poincare(system, n=N_PERIODS, start={"x": 0.0, "v": 0.0}, section=ns.Stroboscopic(0.0))
    ours = section["section"].transpose("iterate", "state").values
    difference = np.max(np.abs(ours - theirs.states[1:]), axis=1)

    worst = 0.0
    for before, after in zip(theirs.states, theirs.states[1:], strict=False):
        one = ns.simulate(system, periods=1, start={"x": before[0], "v": before[1]}, samples=2, method="exact")
        worst = max(worst, float(scaled(one["u"].transpose("time", "state").values[-1] - after)))

    run = ns.simulate(system, periods=N_PERIODS, method="exact")
    until = theirs.first_near_grazing()
    kinds = entries_and_releases(run, until)
    expected = [(c.time, c.kind == "release") for c in theirs.crossings if c.time < until]
    same = [release for _, release in kinds] == [release for _, release in expected]
    calm = (
        allowance[np.minimum((np.array([t for t, _ in expected]) / run_period(p)).astype(int) + 1, N_PERIODS)] < 1.1e-10
    )
    times = [abs(a - b) for (a, _), (b, _), ok in zip(kinds, expected, calm, strict=False) if ok]
    return Agreement(
        figure,
        p,
        theirs.n_contacts,
        float(hs.growth(p, theirs, scale=SCALE).max()),
        float(difference.max()),
        float(np.max(difference / allowance[1:])),
        worst,
        theirs.nearest_graze(),
        same,
        max(times, default=0.0),
        *touches(run, theirs, until),
        float(allowance.max()),
    )


def run_period(p: dict[str, float]) -> float:
    return 2 * np.pi / p["omega"]


def entries_and_releases(run: xr.Dataset, until: float) -> list[tuple[float, bool]]:
    """(time, is release) of every crossing of our run before `until`.

    ``crossing_transition`` counts the transitions as declared: contact first, then its loss.
    """
    times, transitions = run["crossing_time"].values, run["crossing_transition"].values
    return [(float(t), int(k) == 1) for t, k in zip(times, transitions, strict=True) if t < until]


def touches(run: xr.Dataset, theirs: hs.Run, until: float) -> tuple[int, float]:
    """Touches of the gap (maxima of x below it while free) both saw, -1 where the counts differ; and the largest
    difference of a clearance (metres)."""
    gap = run["touch_indicator"].values == 0  # penetration, the first indicator declared
    times, clearances = run["touch_time"].values[gap], run["touch_clearance"].values[gap]
    ours = clearances[times < until]
    expected = [
        -e.value
        for e in theirs.extrema
        if e.time < until and e.mode == 0 and e.value <= 0 and e.indicator == "penetration"
    ]
    if len(ours) != len(expected):
        return -1, np.inf
    return len(ours), float(np.max(np.abs(ours - expected), initial=0.0))


def compare_all(n: int = N_SETS) -> list[Agreement]:
    model = ns.models.discontinuous_support()
    return [compare(figure, p, model) for figure, p in parameter_sets()[:n]]


def report(results: list[Agreement]) -> str:
    lines = ["figure contacts   growth  difference  /allowed  per period  nearest graze  modes"]
    lines += [
        f"{r.figure:6d} {r.n_contacts:8d} {r.growth:8.1e} {r.difference:11.1e} {r.excess:9.1e} {r.per_period:11.1e}"
        f" {r.nearest_graze:14.1e}  {'same' if r.same_modes else 'DIFFER'}"
        for r in results
    ]
    lines += [
        f"{sum(r.n_contacts >= 20 for r in results)} of {len(results)} sets have 20 contacts or more",
        f"{sum(r.nearest_graze >= 1e-9 for r in results)} have no touch or crossing nearer to grazing than 1e-9 m",
        f"worst difference over its allowance: {max(r.excess for r in results):.1e}",
        f"worst difference after one period from the same state (scaled): {max(r.per_period for r in results):.1e}",
        f"touches of the gap seen by both: {sum(r.n_touches for r in results)}, worst clearance over its allowance:"
        f" {max(r.clearance / r.allowance for r in results):.1e}",
        f"worst crossing time while neighbours stay together: {max(r.crossing_time for r in results):.1e} s",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    print(report(compare_all()))
