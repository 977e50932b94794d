"""Two checkouts in turns: `python benchmarks/pairs.py OTHER [--pairs 30] [--only chain chart]`.

A pair is a process of the other checkout and one of this one. In it each scenario is called once and then timed, by the
least of a few calls, in seconds of a processor. Printed is the median over all pairs of the other's time over this
one's (above 1: this one is faster) with its 95 % interval. Both checkouts need what they compile ahead. Run it on a
quiet machine.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from scipy.stats import binom

HERE = Path(__file__).parent
PLANES = {
    "Fig. 9": ({"g": 0.02}, {"omega": (3.0, 7.0), "rho": (0.1, 0.3)}),
    "Fig. 13": ({"omega": 11.15}, {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)}),
}
CASES = ((0.29, -0.0045, 3.69), (0.42, -0.0045, 3.69), (0.33, 0.0009, 11.15))  # rho, g, omega of two states


def scenarios(side: int) -> Iterator[tuple[str, Callable[[], Any], int]]:
    """Names, calls that both checkouts know, and how often each is timed."""
    import chain
    import friction
    import lyapunov_nonlinear
    import nonsmooth as ns
    import patterns

    def settle(system: ns.System, name: str, values: Any, periods: int, **options: Any) -> Callable[[], Any]:
        return partial(ns.sweep, system, name, values, transient=periods, keep=20, progress=False, **options)

    support = ns.models.discontinuous_support(omega=3.69, g=-0.0045)
    for rho, g, omega in CASES:
        case = support.with_parameters(g=g, omega=omega)
        yield f"two states, rho {rho}, g {g}", settle(case, "rho", [rho], 20_000), 3
    chain.GAPS[50] = 0.5
    for masses, periods in ((2, 4000), (3, 2000), (5, 1000), (10, 500), (50, 60)):
        yield f"chain of {masses} masses", settle(chain.system(masses), "g", [chain.GAPS[masses]], periods), 3
    rubs, rests = friction.rubbing(), friction.resting()
    yield "friction, simulate", partial(ns.simulate, rubs, periods=2000, samples=2), 3
    yield "friction, sweep", settle(rubs, "mu", np.linspace(0.2, 0.6, 40), 200), 2
    axes = {"mu": np.linspace(0.1, 0.9, 12), "w": np.linspace(0.3, 1.5, 12)}
    yield "friction, chart", partial(ns.chart, rubs, axes, threads=1, progress=False), 1
    yield "rest, simulate", partial(ns.simulate, rests, periods=1000, samples=2), 3
    yield "rest, sweep", settle(rests, "d", np.linspace(0.2, 0.4, 20), 100), 2
    yield "50 masses, 25 elements", partial(ns.simulate, patterns.system(), periods=5, samples=2), 1
    valve = ns.models.relief_valve()
    yield "valve, simulate", partial(ns.simulate, valve, duration=6000, start={"y1": 0.2, "y3": 10.0}, samples=2), 3
    start = {"x": 1.0, "y": 1.0, "z": 20.0}
    lorenz = lyapunov_nonlinear.lorenz()
    yield "Lorenz, spectrum", partial(ns.lyapunov, lorenz, duration=100.0, start=start, progress=False), 2
    for name, (fixed, ranges) in PLANES.items():
        axes = {key: np.linspace(*ends, side) for key, ends in ranges.items()}
        plane = ns.models.discontinuous_support(**fixed)
        yield f"chart, {name}", partial(ns.chart, plane, axes, threads=1, progress=False), 1
    yield "601 points upwards", settle(support, "rho", np.linspace(0.2, 0.5, 601), 100, direction="up"), 1
    orbit = ns.find_orbit(support.with_parameters(rho=0.45), progress=False)
    yield "branch", partial(ns.continue_orbit, orbit, "rho", (0.3, 0.6)), 3


def timed(side: int, only: list[str]) -> dict[str, float]:
    found = {}
    for name, call, repeats in scenarios(side):
        if only and not any(word in name for word in only):
            continue
        call()
        found[name] = np.inf
        for _ in range(repeats):
            begin = process_time()
            call()
            found[name] = min(found[name], process_time() - begin)
    return found


def of_a_process(checkout: Path, arguments: list[str]) -> dict[str, float]:
    """The times that a process of its own finds, with the package of a checkout and the scenarios of this one."""
    paths = os.pathsep.join([str(checkout / "src"), str(HERE)])
    done = subprocess.run(
        [sys.executable, str(Path(__file__)), "--child", *arguments],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONPATH": paths, "OPENBLAS_NUM_THREADS": "1"},
    )
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def interval(ratios: list[float]) -> tuple[float, float]:
    """Order statistics that hold the median with at least 95 %, the least and the greatest where there are few."""
    n, ordered = len(ratios), sorted(ratios)
    k = max(int(binom.ppf(0.025, n, 0.5)), 1)
    return ordered[k - 1], ordered[n - k]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", nargs="?", type=Path, help="a checkout of another commit")
    parser.add_argument("--pairs", type=int, default=30)
    parser.add_argument("--side", type=int, default=200, help="points on each side of a chart")
    parser.add_argument("--only", nargs="*", default=[], help="words, one of which a scenario's name must have")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.child:
        print(json.dumps(timed(options.side, options.only)))
        return 0
    if options.other is None:
        parser.error("name the other checkout")
    arguments = ["--side", str(options.side), "--only", *options.only]
    ours: list[dict[str, float]] = []
    theirs: list[dict[str, float]] = []
    for pair in range(options.pairs):
        theirs.append(of_a_process(options.other, arguments))
        ours.append(of_a_process(HERE.parent, arguments))
        print(f"pair {pair + 1} of {options.pairs}", file=sys.stderr)
    print(f"{'':28}{'other, s':>10}{'this, s':>10}{'ratio':>8}  95 % interval")
    for name in ours[0]:
        ratios = [a[name] / b[name] for a, b in zip(theirs, ours, strict=True)]
        low, high = interval(ratios)
        there, here = (median(one[name] for one in each) for each in (theirs, ours))
        print(f"{name:28}{there:10.4f}{here:10.4f}{median(ratios):8.3f}  [{low:.3f}, {high:.3f}]")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
