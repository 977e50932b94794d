"""The 601-point diagram of Fig. 11: 1000 periods of transient, 200 kept, through the public `sweep`."""

from __future__ import annotations

from functools import partial
from statistics import median
from time import perf_counter

import numpy as np

import nonsmooth as ns
from timing import interleaved

Verdict = tuple[str, str, str, bool]


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    system = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)
    values = np.linspace(0.2, 0.5, 601)
    transient = int(1000 * effort)
    sweep = partial(ns.sweep, system, "rho", values, transient=transient, keep=200, progress=False)
    directions = {"up": "up", "both": "both", "each from rest": None}
    peers = {name: partial(sweep, direction=direction) for name, direction in directions.items()}
    t = {name: median(values) for name, values in interleaved(peers, perf_counter).items()}
    n_periods = values.size * (transient + 200)
    lines = [
        "## Fig. 11: 601 points, 1000 periods of transient, 200 kept (true extremes, period numbers), wall time",
        "",
        "| direction | seconds | microseconds per period asked for |",
        "|---|---|---|",
        *(
            f"| {name} | {seconds:.2f} | {1e6 * seconds / n_periods / (1 + (name == 'both')):.2f} |"
            for name, seconds in t.items()
        ),
        "",
    ]
    return lines, [("601-point diagram of Fig. 11, rho rising", "under 1.5 s", f"{t['up']:.2f} s", t["up"] < 1.5)]
