"""The relief valve scanned as published: 1024 section returns of transient and 32 kept at each inflow, tolerance 1e-10.

Ours is the public `sweep` over the inflow q from 0.2 to 10 with the maxima of the lift as section, every point from the
same start, one thread. It is paid for judging, too (return distances, probes of contraction, longer transients where a
point has not settled); the rate counts the published 1056 returns of each point that came to its end and nothing else.
heyoka marches the same inflows from the same start until it has met as many maxima, and judges nothing. At inflows
beyond the Hopf bifurcation the valve stands still and there are no 1056 maxima: the sweep ends such a point with a
status, and heyoka leaves it out.
"""

from __future__ import annotations

from functools import partial
from statistics import median
from typing import Any

import numpy as np

import nonsmooth as ns
import valve_heyoka
from timing import interleaved

Verdict = tuple[str, str, str, bool]
TRANSIENT, KEEP, TOLERANCE = 1024, 32, 1e-10
START = {"y1": 0.2, "y2": 0.0, "y3": 10.0}
LOWEST, HIGHEST, HOPF = 0.2, 10.0, 8.4911176352
PUBLISHED = 3.7e4  # odeint with SIMD on one i7-4820K core


def scan(values: np.ndarray) -> Any:
    top = ns.Poincare("lift_velocity", rising=False)
    return ns.sweep(
        ns.models.relief_valve(),
        "q",
        values,
        direction=None,
        start=START,
        section=top,
        transient=TRANSIENT,
        keep=KEEP,
        method="taylor",
        rtol=TOLERANCE,
        threads=1,
        progress=False,
    )


def heyoka_scan(peer: valve_heyoka.Valve, values: np.ndarray) -> int:
    """The maxima met: TRANSIENT + KEEP or somewhat more at each inflow below the Hopf point."""
    total = 0
    for q in values[values < HOPF]:
        peer.start(float(q), tuple(START.values()))
        met = 0
        while met < TRANSIENT + KEEP:
            met += len(peer.march(200.0))
        total += met
    return total


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    values = np.linspace(LOWEST, HIGHEST, max(int(200 * effort), 20))
    peer = valve_heyoka.valve(TOLERANCE)
    found: dict[str, Any] = {}

    def ours() -> None:
        found["scan"] = scan(values)

    def theirs() -> None:
        found["returns"] = heyoka_scan(peer, values)

    times = interleaved({"sweep": ours, "heyoka": partial(theirs)}, repeats=3)
    ended = int(np.isin(found["scan"]["status"], (0, 1, 2, 6)).sum())
    n = ended * (TRANSIENT + KEEP)
    rates = [n / t for t in times["sweep"]]
    peers = [found["returns"] / t for t in times["heyoka"]]
    rate = max(rates)
    lines = [
        f"## The relief valve scanned as published: q {LOWEST} to {HIGHEST}, {len(values)} inflows,"
        f" {TRANSIENT} + {KEEP} maxima of the lift, tolerance {TOLERANCE:g}",
        "",
        "| code | returns | seconds | returns/s and core (best) | median |",
        "|---|---|---|---|---|",
        f"| sweep (judged) | {n} | {min(times['sweep']):.3f} | {rate:.3g} | {median(rates):.3g} |",
        f"| heyoka | {found['returns']} | {min(times['heyoka']):.3f} | {max(peers):.3g} | {median(peers):.3g} |",
        f"| odeint, SIMD, i7-4820K (published) | | | {PUBLISHED:.2g} | |",
        "",
        f"{len(values) - ended} of {len(values)} inflows end with a status (an equilibrium, or chatter).",
        "",
    ]
    return lines, [("valve scan, returns/s and core", "at least 8e4", f"{rate:.3g}", rate >= 8e4)]
