"""Branches of random systems of ten kinds, each entered at five of its points: the same branch from each?

``python tests/continuation/entries_campaign.py [--kinds relay rest] [--systems 10] [--rows FILE]`` prints a line for
each branch and a table. A branch and its entries must have the same special points (kinds, and the parameter to 1e-8 of
the range) and the same ends; each special point must satisfy its own equation to 1e-8: its multipliers do, or a
simulated period of its orbit.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
import xarray as xr

sys.path.insert(0, str(Path(__file__).parent))

import random_templates as templates
from test_random_branches import drawn, endings

import nonsmooth as ns

ENTRIES, SAME = 5, 1e-8
APART = 1e-6  # of the range: entries from special points
POINTS, SAMPLES = 2500, 20_000


def special(branch: xr.Dataset, name: str, width: float) -> list[tuple[str, float]]:
    """Kinds and scaled parameters of the special points, by their parameters."""
    kinds = [
        "/".join(filter(None, (str(kind), str(sliding))))
        for kind, sliding in zip(branch["special_kind"].values, branch["special_sliding"].values, strict=True)
    ]
    return sorted(zip(kinds, (branch["special_value"].values / width).tolist(), strict=True), key=lambda one: one[1])


def ends(branch: xr.Dataset, name: str, width: float) -> list[tuple[str, float]]:
    """Endings with their scaled parameters."""
    if "closed" in endings(branch):
        return [("closed", 0.0)]
    return sorted(zip(endings(branch), (branch[name].values[[0, -1]] / width).tolist(), strict=True))


def differ(one: list[tuple[str, float]], other: list[tuple[str, float]]) -> tuple[str, float]:
    """Return what only one of two lists has, and the largest difference of those that both have."""
    left, missing, worst = list(other), [], 0.0
    for kind, value in one:
        near = [x for x in left if x[0] == kind and abs(x[1] - value) < SAME]
        if near:
            best = min(near, key=lambda x: abs(x[1] - value))
            left.remove(best)
            worst = max(worst, abs(best[1] - value))
        else:
            missing.append(f"-{kind} {value:.12g}")
    return ", ".join([*missing, *(f"+{kind} {value:.12g}" for kind, value in left)]), worst


def residual(system: ns.System, branch: xr.Dataset, name: str, k: int) -> float:
    """Return the distance of special point k from satisfying the equation that defines it.

    A multiplier at 1, at -1, on the unit circle; at a boundary an indicator that vanishes at a touch, or two at once.
    """
    point = branch.isel(point=int(branch["special_point"][k]))
    kind, mu = str(branch["special_kind"].values[k]), point["floquet_multipliers"].values
    if kind in ("fold", "pitchfork", "transcritical", "branch_point"):
        return float(np.abs(mu - 1.0).min())
    if kind == "flip":
        return float(np.abs(mu + 1.0).min()) if "branching" not in endings(branch) else float(np.abs(mu - 1.0).min())
    if kind == "neimark_sacker":
        return float(np.abs(np.abs(mu[np.abs(mu.imag) > 0]) - 1.0).min(initial=np.inf))
    return at_boundary(system.with_parameters({name: float(point[name])}), point)


def at_boundary(system: ns.System, point: xr.Dataset) -> float:
    """Return the least zero over one simulated period.

    Of an extremum of an indicator, by a parabola through the sample next to it; of the height by which one is overshot
    at a transition; of a second indicator at the same instant."""
    period, traced = float(point["period"]), system.traced
    run = ns.simulate(
        system, duration=period, start=point["section"].values, mode=system.modes[int(point["mode"])], samples=SAMPLES
    )
    p, m = system.parameter_vector(), np.zeros(len(traced.m))
    times, states, modes = run["time"].values, np.nan_to_num(run["u"].values), run["mode"].values
    found = [np.inf]
    for mode in range(len(traced.mode_names)):
        here = np.flatnonzero(modes == mode)
        if not len(here):
            continue
        h, rate, bend = (
            np.array([np.broadcast_to(x, len(here)) for x in part], dtype=float)
            for part in indicators(traced, mode)(times[here], states[here].T, p, m)
        )
        near = np.abs(rate) < np.abs(bend) * period / SAMPLES * 1.5
        found.append(np.abs(h - rate**2 / np.where(near, 2 * bend, 1.0))[near].min(initial=np.inf))
    for i in range(run.sizes["crossing"]):
        jump = traced.transitions[int(run["crossing_transition"][i])]
        for mode, u in ((jump.source, run["u_before"].values[i]), (jump.target, run["u_after"].values[i])):
            at = float(run["crossing_time"][i]), np.nan_to_num(u), p, m
            h, rate, bend = np.abs(np.array(indicators(traced, mode)(*at), float))
            near = np.flatnonzero(h < 1e-6)
            found += [*sorted(h)[1:2], *(rate[near] ** 2 / np.maximum(2 * bend[near], 1e-300))]
    return float(min(found))


@cache
def indicators(traced: Any, mode: int) -> Any:
    """All indicators and their first two derivatives along the flow of a mode."""
    flow = list(zip(traced.u, traced.fields[mode], strict=True))

    def along(e: sp.Expr) -> sp.Expr:
        return e.diff(traced.t) + sp.Add(*(e.diff(u) * f for u, f in flow))

    rates = [along(h) for h in traced.indicators]
    return sp.lambdify([traced.t, traced.u, traced.p, traced.m], [traced.indicators, rates, list(map(along, rates))])


def entries(branch: xr.Dataset, name: str, width: float) -> list[int]:
    """Five points of a branch, apart from its special ones."""
    apart = np.abs(branch[name].values[:, None] - branch["special_value"].values).min(axis=1, initial=np.inf)
    plain = np.flatnonzero((apart > APART * width) & ~branch["virtual"].values)
    return plain[np.linspace(0, len(plain) - 1, ENTRIES + 2).astype(int)[1:-1]].tolist()


def one(template: str, seed: int, drawn_one: templates.Drawn, orbit: ns.Orbit) -> dict[str, Any]:
    system, name, limits, _ = drawn_one
    width = limits[1] - limits[0]
    begun = time.process_time()
    branch = ns.continue_orbit(orbit, name, limits, points=POINTS)
    row: dict[str, Any] = {
        "template": template,
        "seed": seed,
        "points": branch.sizes["point"],
        "special": branch.sizes["special"],
        "ends": endings(branch),
        "s": round(time.process_time() - begun, 2),
        "differs": [],
        "worst": 0.0,
        "lost": 0,
    }
    size = np.maximum(np.ptp(branch["section"].values, axis=0), 1e-3 * system.scale_vector())
    for i in entries(branch, name, width):
        point = branch.isel(point=i)
        here = system.with_parameters({name: float(point[name])})
        try:
            again = ns.find_orbit(
                here,
                start=point["section"].values,
                transient=0,
                progress=False,
                period_number=int(branch["period_number"]),
            )
        except ns.SolveError:
            row["lost"] += 1
            continue
        # whatever period it begins in
        moved = [getattr(again, one) - point[one].values for one in ("maximum", "minimum")]
        if np.abs(np.array(moved) / size).max() > 1e-6:
            row["lost"] += 1
            continue
        other = ns.continue_orbit(again, name, limits, points=POINTS)
        for part in (special, ends):
            words, worst = differ(part(branch, name, width), part(other, name, width))
            row["worst"] = max(row["worst"], worst)
            if words:
                row["differs"].append(f"{part.__name__} from {float(point[name])!r}: {words}")
    row["residuals"] = [
        (str(branch["special_kind"].values[k]), float(branch["special_value"][k]), r)
        for k in range(branch.sizes["special"])
        if not (r := residual(system, branch, name, k)) < SAME
    ]
    return row


def table(rows: list[dict[str, Any]]) -> str:
    """Return the summary of all rows."""
    lines = ["kind            branches  equal  special points  not to 1e-8  entries lost  largest difference"]
    for kind in [*dict.fromkeys(row["template"] for row in rows), "all"]:
        own = [row for row in rows if kind in ("all", row["template"])]
        lines.append(
            f"{kind:15} {len(own):8d} {sum(not row['differs'] for row in own):6d} {sum(r['special'] for r in own):15d} "
            f"{sum(len(r['residuals']) for r in own):12d} {sum(r['lost'] for r in own):13d} "
            f"{max(r['worst'] for r in own):19.1e}"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="*", default=list(templates.TEMPLATES))
    parser.add_argument("--systems", type=int, default=10, help="of each kind")
    parser.add_argument("--rows", type=Path, help="file of one JSON object per branch")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    rows = []
    for kind in arguments.kinds:
        for seed, system, orbit in islice(drawn(kind), arguments.systems):
            rows.append(one(kind, seed, system, orbit))
            print(json.dumps(rows[-1]), flush=True)
            if arguments.rows:
                arguments.rows.parent.mkdir(parents=True, exist_ok=True)
                with arguments.rows.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))
