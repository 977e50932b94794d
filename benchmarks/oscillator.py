"""The paper's oscillator: exact flow and smoothed RKF45 against heyoka and SciPy, time per forcing period."""

from __future__ import annotations

from functools import partial
from statistics import median

import numpy as np

import nonsmooth as ns
import oscillator_heyoka
import oscillator_scipy
from timing import Times, geometric_mean, interleaved, per_unit, ratio
from work import CASES, Case, march, section

Verdict = tuple[str, str, str, bool]


def measure(case: Case, effort: float) -> Times:
    """Microseconds per forcing period of every peer, from the same settled state."""
    complete, minimal = oscillator_heyoka.oscillator("complete"), oscillator_heyoka.oscillator("minimal")
    p = case.parameters
    complete.start(p)
    u = complete.march(500)
    system = ns.models.discontinuous_support().with_parameters(p)
    smooth = system.smoothed(eta=1e-5)
    n, n_heyoka, n_smooth, n_scipy = (max(2, int(effort * k)) for k in (100_000, 10_000, 10_000, 40))

    def heyoka_march(peer: oscillator_heyoka.Oscillator) -> None:
        peer.start(p, u)
        peer.march(n_heyoka)

    def heyoka_section() -> None:
        complete.start(p, u)
        complete.section(n_heyoka)

    peers = {
        "exact": (partial(march, system, u, n, method="exact"), n),
        "heyoka": (partial(heyoka_march, complete), n_heyoka),
        "heyoka, h_a only": (partial(heyoka_march, minimal), n_heyoka),
        "exact, section points": (partial(section, system, u, n, method="exact"), n),
        "heyoka, section points": (heyoka_section, n_heyoka),
        "smoothed RKF45": (partial(march, smooth, u, n_smooth, method="rkf45", rtol=1e-6), n_smooth),
        "SciPy": (partial(oscillator_scipy.march, p, u, n_scipy), n_scipy),
    }
    times = interleaved({name: call for name, (call, _) in peers.items()})
    return per_unit(times, {name: count for name, (_, count) in peers.items()})


def same_answers(case: Case) -> float:
    """Largest difference between exact and heyoka after 5 periods from a settled state (in 1 mm, 1 cm/s).

    Five periods: neighbours have not parted yet in the chaotic cases.
    """
    p, n = case.parameters, 5
    peer = oscillator_heyoka.oscillator()
    peer.start(p)
    u = peer.march(500)
    peer.start(p, u)
    theirs = peer.march(n)
    ours = march(ns.models.discontinuous_support().with_parameters(p), u, n, method="exact")
    scipy = oscillator_scipy.march(p, u, n)
    scale = np.array([1e-3, 1e-2])
    if np.max(np.abs(scipy - theirs) / scale) > 1e-4:
        raise RuntimeError(f"{case.name}: SciPy and heyoka do not solve the same problem: {scipy}, {theirs}")
    return float(np.max(np.abs(ours - theirs) / scale))


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    rows = [(case, measure(case, effort), same_answers(case)) for case in CASES]
    columns = list(rows[0][1])
    lines = [
        "## The paper's oscillator: microseconds per forcing period",
        "",
        "heyoka: scalar mode, tolerance 1e-14, both ways into contact watched (`h_a` only: blind to one of them).",
        "SciPy: `solve_ivp`, DOP853, rtol 1e-8, terminal events. Smoothed: eta 1e-5, rtol 1e-6, band borders located.",
        "",
        "| case | "
        + " | ".join(columns)
        + " | heyoka / exact | with sections | SciPy / exact | smoothed / heyoka | difference |",
        "|---|" + "---|" * (len(columns) + 5),
    ]
    pairs = {
        "heyoka": ("heyoka", "exact"),
        "section": ("heyoka, section points", "exact, section points"),
        "SciPy": ("SciPy", "exact"),
        "smoothed": ("smoothed RKF45", "heyoka"),
        "h_a only": ("heyoka, h_a only", "exact"),
    }
    ratios = {key: [ratio(times, a, b) for _, times, _ in rows] for key, (a, b) in pairs.items()}
    for i, (case, times, difference) in enumerate(rows):
        cells = [f"{median(times[name]):.3g}" for name in columns]
        cells += [f"{ratios[key][i]:.{digits}f}" for key, digits in zip(list(pairs)[:4], (1, 1, 0, 2), strict=True)]
        lines.append(f"| {case.name} | " + " | ".join(cells) + f" | {difference:.1e} |")
    peer = oscillator_heyoka.oscillator()
    peer.start(CASES[0].parameters)
    before = peer.n_callbacks
    peer.march(1000)
    calls = (peer.n_callbacks - before) / 1000
    mean = {key: geometric_mean(values) for key, values in ratios.items()}
    lines += [
        "",
        f"Python within heyoka's time: {calls:.1f} callbacks per period at {1e6 * peer.callback_cost():.2f} us"
        f" ({CASES[0].name}). Geometric means: heyoka / exact {mean['heyoka']:.1f}, with section points"
        f" {mean['section']:.1f}, h_a only {mean['h_a only']:.1f}; SciPy / exact {mean['SciPy']:.0f};"
        f" smoothed / heyoka {mean['smoothed']:.2f}.",
        "",
    ]
    return lines, [
        ("heyoka / exact, geometric mean", "at least 15", f"{mean['heyoka']:.1f}", mean["heyoka"] >= 15),
        ("heyoka / exact, least", "at least 12", f"{min(ratios['heyoka']):.1f}", min(ratios["heyoka"]) >= 12),
        ("SciPy / exact, geometric mean", "at least 3000", f"{mean['SciPy']:.0f}", mean["SciPy"] >= 3000),
        (
            "smoothed RKF45 / heyoka, worst",
            "at most 1.5",
            f"{max(ratios['smoothed']):.2f}",
            max(ratios["smoothed"]) <= 1.5,
        ),
    ]
