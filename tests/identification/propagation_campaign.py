"""Distributions of a flip, a fold and a jump by draws, to first order, and by fits of drawn records.

    python tests/identification/propagation_campaign.py [DRAWS] [RECORDS]

For each system a record is simulated and fitted; its covariance goes through a branch (or a response) by draws and to
first order. Then further records are drawn from the same truth, each is fitted, and the special point of each fit is
computed. Printed: standard deviations, with that of a standard deviation from so many fits, and quantiles about the
median. ``make`` does not run it: it takes minutes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import nonsmooth as ns

UPPER = {"q": 1.5, "v_q": 0.0}  # leads to the motion that meets the stop
QUANTILES = (0.025, 0.25, 0.5, 0.75, 0.975)


class Case(NamedTuple):
    """The truth, its record, what is fitted, and the special point of a system."""

    system: ns.System
    duration: float
    samples: int
    noise: float
    start: dict[str, float]
    unknowns: list[str]
    measured: str
    point: Callable[[ns.System], float]
    verb: tuple[Any, ...]
    kind: str


def branch_point(
    parameter: str, ends: tuple[float, float], kind: str, step: float, start: dict[str, float] | None = None
) -> Callable[[ns.System], float]:
    def found(system: ns.System) -> float:
        branch = ns.continue_orbit(ns.find_orbit(system, start=start, progress=False), parameter, ends, step=step)
        values = branch["special_value"].values[branch["special_kind"].values == kind]
        return float(values[0]) if len(values) else np.nan

    return found


def cases() -> dict[str, Case]:
    support = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045, rho=0.42)
    stop = ns.elements.ElasticStop(at="q", position=1.0, stiffness="k_s", damping=0.0)
    bench = ns.mechanical(
        1.0,
        "c",
        "k",
        parameters={"c": 0.1, "k": 1.0, "k_s": 6.0, "omega": 1.3},
        coordinates=["q"],
        elements={"s": stop},
        forcing={"q": lambda t, p: 0.5 * np.cos(p.omega * t)},
    )
    flip = (ns.continue_orbit, "rho", (0.36, 0.45))
    fold = (ns.continue_orbit, "omega", (1.25, 1.4))
    omega = np.concatenate([np.arange(1.2, 1.33, 0.01), np.arange(1.335, 1.36, 1e-4)])  # fine about the jump
    jump = (ns.frequency_response, omega)

    def jumped(system: ns.System) -> float:
        response = ns.frequency_response(
            system, omega, direction="up", transient=150, keep=10, progress=False, start={"q": 0.0, "v_q": 0.0}
        )
        values = response["jump_value"].values[response["jump_variable"].values == "q"]
        return float(values[0]) if len(values) else np.nan

    return {
        "flip": Case(
            support,
            15.0,
            400,
            1e-4,
            {"x": 0.01},
            ["k", "c"],
            "x",
            branch_point("rho", (0.36, 0.45), "flip", 0.5),
            flip,
            "flip",
        ),
        "fold": Case(
            bench,
            60.0,
            400,
            0.02,
            {"q": 0.5},
            ["k", "c", "k_s"],
            "q",
            branch_point("omega", (1.25, 1.4), "fold", 0.2, UPPER),
            fold,
            "fold",
        ),
        "jump": Case(bench, 60.0, 400, 0.02, {"q": 0.5}, ["k", "c", "k_s"], "q", jumped, jump, "jump"),
    }


def record(case: Case, rng: np.random.Generator) -> dict[str, Any]:
    t = np.linspace(0.0, case.duration, case.samples)
    run = ns.simulate(case.system, duration=case.duration, samples=t, start=case.start)
    x = run["u"].sel(state=case.measured).groupby("time").last().sel(time=t, method="nearest").values
    return {case.measured: (t, x + case.noise * rng.standard_normal(t.size))}


def main(draws: int, records: int) -> None:
    """Print the distributions."""
    for name, case in cases().items():
        rng, begin = np.random.default_rng(11), time.process_time()
        options = {"measured": {case.measured: ns.Sensor(noise=case.noise)}, "progress": False, "tries": 2}
        fits = [ns.fit(case.system, record(case, rng), case.unknowns, **options) for _ in range(records)]
        refitted = np.array([case.point(case.system.with_parameters(found)) for found in fits])
        spent, begin = time.process_time() - begin, time.process_time()
        found = fits[0]
        base = case.system.with_parameters(found)
        if name == "jump":
            verb, omega = case.verb
            band = ns.propagate(
                found,
                verb,
                base,
                omega,
                direction="up",
                transient=150,
                keep=10,
                draws=draws // 4,
                start={"q": 0.0, "v_q": 0.0},
                progress=False,
            )
            mine = band["jump_variable"].values == "q"
            drawn, linear = band["jump_value_draws"].values[:, mine][:, 0], np.nan
        else:
            verb, parameter, ends = case.verb
            orbit = ns.find_orbit(base, start=UPPER if name == "fold" else None, progress=False)
            step = 0.5 if name == "flip" else 0.2
            band = ns.propagate(
                found, verb, orbit, parameter, ends, draws=draws, first_order=True, step=step, progress=False
            )
            at = int(np.flatnonzero(band["special_kind"].values == case.kind)[0])
            drawn, linear = band["special_value_draws"].values[:, at], float(band["special_first_order"][at])
        drawn, refitted = drawn[np.isfinite(drawn)], refitted[np.isfinite(refitted)]
        error = 1 / np.sqrt(2 * len(refitted))
        print(
            f"{name}: standard deviation by {len(drawn)} draws {np.std(drawn):.3e}, to first order {linear:.3e}, "
            f"by {len(refitted)} fits {np.std(refitted):.3e} (+-{error:.0%})"
        )
        for by, values in (("draws", drawn), ("fits", refitted)):
            about = " ".join(f"{q:.2e}" for q in np.quantile(values, QUANTILES) - np.median(values))
            print(f"  quantiles about the median, {by}: {about}")
        print(f"  processor time: fits {spent:.0f} s, draws {time.process_time() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main(*[int(given) for given in sys.argv[1:]] or [2000, 200])
