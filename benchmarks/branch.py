"""The period-1 branch of Fig. 9 with multipliers and all special points, beside the same by a general-purpose route."""

from __future__ import annotations

from functools import partial
from statistics import median

import numpy as np

import nonsmooth as ns
from branch_scipy import follow
from timing import interleaved, per_unit, ratio

Verdict = tuple[str, str, str, bool]
LIMITS = (3.0, 7.0)
SPECIAL = ["grazing", "flip", "flip", "fold", "fold", "grazing"]


def run(effort: float) -> tuple[list[str], list[Verdict]]:
    n_scipy = max(3, int(20 * effort))
    system = ns.models.discontinuous_support().with_parameters(rho=0.14, g=0.02, omega=3.3)
    orbit = ns.find_orbit(system)
    ours = partial(ns.continue_orbit, orbit, "omega", LIMITS)
    branch = ours()
    contact = ns.find_orbit(system.with_parameters(omega=4.5))
    theirs = partial(follow, dict(contact.system.values), contact.u, n_scipy)
    n = branch.sizes["point"]
    raw = interleaved({"ours": ours, "SciPy": theirs})
    seconds = median(raw["ours"])
    per_point = per_unit(raw, {"ours": n, "SciPy": n_scipy})
    found = list(ns.special_points(branch)["kind"].values)
    omega, sections = theirs()
    again = [
        ns.find_orbit(system.with_parameters(omega=float(w)), start=u, period_number=1, transient=0).u
        for w, u in zip(omega, sections, strict=True)
    ]
    difference = float(np.abs(np.array(again) - sections).max())
    at_200 = seconds * 200 / n
    lines = [
        "## A branch of orbits: Fig. 9, period 1, omega 3 to 7 rad/s, through the public `continue_orbit`",
        "",
        "SciPy: shooting on `solve_ivp` with terminal events (DOP853, rtol 1e-8), Jacobian by differences, arclength",
        "steps; no special points. The difference is the largest of its section points against ours.",
        "",
        "| points | special points | seconds | ms per point | SciPy, ms per point | SciPy / ours | difference |",
        "|---|---|---|---|---|---|---|",
        f"| {n} | {', '.join(map(str, found))} | {seconds:.3f} | {median(per_point['ours']) * 1e-3:.2f} "
        f"| {median(per_point['SciPy']) * 1e-3:.0f} | {ratio(per_point, 'SciPy', 'ours'):.0f} | {difference:.0e} |",
        "",
    ]
    return lines, [
        ("a branch of 200 points with multipliers and all detection", "under 0.2 s", f"{at_200:.3f} s", at_200 < 0.2),
        ("special points of this branch", ", ".join(SPECIAL), ", ".join(map(str, found)), found == SPECIAL),
    ]
