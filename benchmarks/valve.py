"""The relief valve, nonlinear with impacts: our Taylor method against heyoka, both at tolerance 1e-10."""

from __future__ import annotations

from functools import partial
from statistics import median

import numpy as np

import valve_heyoka
from timing import geometric_mean, interleaved, per_unit, ratio
from work import VALVE_INFLOWS, valve_section

Verdict = tuple[str, str, str, bool]
TOLERANCE = 1e-10


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    peer = valve_heyoka.valve(TOLERANCE)
    lines = [
        "## Relief valve: microseconds per section return (maxima of the lift), impacts and maxima located",
        "",
        "| inflow q | taylor | heyoka | heyoka / taylor | taylor, returns/s | impacts per return | difference |",
        "|---|---|---|---|---|---|---|",
    ]
    ratios = []
    for q in VALVE_INFLOWS:
        peer.start(q, (1.0, 0.0, 11.0))
        settled = peer.march(600.0)[-1]
        settled[1] = 0.0
        peer.start(q, tuple(settled))
        duration = effort * 20_000.0
        returns = peer.march(duration)
        impacts = peer.impact.n_calls / len(returns)
        n = len(returns)

        def heyoka(q: float = q, settled: np.ndarray = settled, duration: float = duration) -> None:
            peer.start(q, tuple(settled))
            peer.march(duration)

        ours = partial(valve_section, q, settled, n, TOLERANCE)
        times = per_unit(interleaved({"taylor": ours, "heyoka": heyoka}), {"taylor": n, "heyoka": n})
        ratios.append(ratio(times, "heyoka", "taylor"))
        t = {name: median(values) for name, values in times.items()}
        # The start is a maximum itself; whether a code counts it is its own affair.
        theirs = returns[:5, 0]
        difference = min(np.max(np.abs(ours()[k : k + 3, 0] - theirs[j : j + 3])) for k in (0, 1) for j in (0, 1))
        lines.append(
            f"| {q} | {t['taylor']:.2f} | {t['heyoka']:.2f} | {ratios[-1]:.2f} |"
            f" {1e6 / t['taylor']:.3g} | {impacts:.2f} | {difference:.1e} |"
        )
    mean = geometric_mean(ratios)
    lines += ["", f"Geometric mean of heyoka / taylor: {mean:.2f}.", ""]
    return lines, [
        ("taylor no slower than heyoka on the valve, worst", "at least 1", f"{min(ratios):.2f}", min(ratios) >= 1)
    ]
