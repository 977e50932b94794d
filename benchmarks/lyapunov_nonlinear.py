"""Lyapunov spectra of nonlinear systems: Lorenz's, and the relief valve's with impacts, against heyoka."""

from __future__ import annotations

from functools import partial
from statistics import median

import numpy as np

import lyapunov_heyoka
import nonsmooth as ns
from timing import interleaved, ratio
from work import LORENZ, VALVE_INFLOWS

Verdict = tuple[str, str, str, bool]
TOLERANCE, RTOL = 1e-10, 1e-12  # heyoka's, and ours, with which our errors are no larger
TRANSIENT, DURATION = 100.0, 2000.0
SHORT = 8.0  # time over which both are held against a reference: longer runs of chaos have nothing in common
UNITS = {"Lorenz": 0.5, "valve": 0.25}  # of time between heyoka's QRs: with longer ones it loses the third exponent


def lorenz() -> ns.System:
    return ns.System(
        states=["x", "y", "z"],
        parameters=LORENZ,
        modes={"all": lambda t, u, p: (p.s * (u.y - u.x), u.x * (p.r - u.z) - u.y, u.x * u.y - p.b * u.z)},
    )


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    duration = effort * DURATION
    cases = {"Lorenz": (lorenz(), (1.0, 1.0, 20.0), "Lorenz", lyapunov_heyoka.lorenz)}
    for q in VALVE_INFLOWS:
        system = ns.models.relief_valve().with_parameters(q=q)
        cases[f"valve, q = {q}"] = system, (1.0, 0.0, 11.0), "valve", partial(lyapunov_heyoka.valve, q)
    lines = [
        f"## Lyapunov spectra of nonlinear systems: {duration:g} units of time after {TRANSIENT:g}, through `lyapunov`",
        "",
        f"heyoka: variational equations at {TOLERANCE:g}, NumPy's QR every {UNITS['Lorenz']} units of time (Lorenz) and"
        f" {UNITS['valve']} (valve), the valve's",
        f"saltation by hand; ours: `rtol` {RTOL:g}. Errors: the largest of the three exponents over {SHORT:g} units",
        "from the same start and frame, against heyoka at 1e-16 with a QR every 1/32.",
        "",
        "| case | exponents | standard error | trace defect | seconds | heyoka, seconds | heyoka / ours | error"
        " | heyoka's error |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    ratios, errors = {}, []
    for name, (system, start, kind, made) in cases.items():
        options = {"start": list(start), "rtol": RTOL, "progress": False}
        ours = partial(ns.lyapunov, system, duration=duration, transient=TRANSIENT, **options)
        peer, reference = made(TOLERANCE), made(1e-16)
        theirs = partial(peer.run, start, TRANSIENT, duration, UNITS[kind])
        times = interleaved({"ours": ours, "heyoka": theirs})
        found = ours()
        scale = system.scale_vector()
        wanted = reference.short(start, SHORT, 1 / 32, scale)
        short = ns.lyapunov(system, duration=SHORT, transient=0, **options).exponents.values
        error = float(np.abs(short - wanted).max())
        other = float(np.abs(peer.short(start, SHORT, UNITS[kind], scale) - wanted).max())
        errors.append(error / other)
        ratios[name] = ratio(times, "heyoka", "ours")
        exponents = ", ".join(f"{value:.4f}" for value in found.exponents.values)
        lines.append(
            f"| {name} | {exponents} | {float(found.standard_error.max()):.0e} | {abs(float(found.trace_defect)):.0e} "
            f"| {median(times['ours']):.4f} | {median(times['heyoka']):.4f} | {ratios[name]:.2f} | {error:.0e} "
            f"| {other:.0e} |"
        )
    worst = min(ratios, key=lambda name: ratios[name])
    lines.append("")
    return lines, [
        (
            "Lyapunov spectra of Lorenz and the valve: heyoka / ours, least",
            "at least 1",
            f"{ratios[worst]:.2f} ({worst})",
            ratios[worst] >= 1,
        ),
        ("their errors over a short run, ours / heyoka's, worst", "at most 1", f"{max(errors):.1g}", max(errors) <= 1),
    ]
