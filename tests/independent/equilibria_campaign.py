"""Random systems' equilibria: what the package finds beside the enumeration.

``python tests/independent/equilibria_campaign.py FIRST LAST``: seeds FIRST to LAST - 1. For each: the components that
branches from random starts pass at P = 0, their extents along the branch, their ends, their stability, and runs from
neighbours.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from equilibria_enumeration import Component, Draw, components, draw, growth

CLOSE = 1e-6
BESIDE = 1e-4  # of the parameter: before and behind a special point
STARTS = 12  # beside those near each component


def starts(one: Draw, known: list[Component], anywhere: int) -> Any:
    """Random states: some anywhere, some near each component."""
    rng, n = np.random.default_rng(1000 + one.seed), len(one.K)
    yield from rng.uniform(-2.0, 2.0, (anywhere, n))
    for part in known:
        low, high = np.maximum(part.lower, -5.0), np.minimum(part.upper, 5.0)
        yield from rng.uniform(np.minimum(low, high) - 0.02, np.maximum(low, high) + 0.02, (2, n))


def same(part: Component, lower: Any, upper: Any) -> bool:
    return bool(np.allclose(part.lower, lower, atol=CLOSE) and np.allclose(part.upper, upper, atol=CLOSE))


def found_from_starts(one: Draw, system: Any, known: list[Component], anywhere: int) -> tuple[list[str], list[Any]]:
    """Faults, and a branch through each component."""
    import nonsmooth as ns

    n, faults, hit = len(one.K), [], {}
    for q in starts(one, known, anywhere):
        try:
            start = [*map(float, q), *[0.0] * n]
            branch = ns.continue_equilibrium(system, "P", (-1.5, 1.5), start=start, step=0.1, points=2000)
        except ns.SolveError:
            if known:
                faults.append(f"nothing found from {q}")
            continue
        at = int(np.argmin(np.abs(branch["P"].values)))
        lower, upper = (branch[key].values[at, :n] for key in ("u_lower", "u_upper"))
        which = [k for k, part in enumerate(known) if same(part, lower, upper)]
        if which:
            hit.setdefault(which[0], branch)
        else:
            faults.append(f"no component: {lower} to {upper}")
    faults += [f"not found: {known[k].lower} to {known[k].upper}" for k in range(len(known)) if k not in hit]
    return faults, [hit.get(k) for k in range(len(known))]


def along(one: Draw, branch: Any) -> list[str]:
    """Faults of a branch: extents that are not those of a component, ends where it goes on."""
    import nonsmooth as ns

    n, faults, P = len(one.K), [], branch["P"].values
    special = ns.special_points(branch)
    folds = special["P"].values[special["boundary"].values == "non_smooth_fold"]
    for i in np.unique(np.linspace(0, len(P) - 1, 12).astype(int)):
        if np.abs(special["P"].values - P[i]).min(initial=1.0) < 1e-6:
            continue
        lower, upper = (branch[key].values[i, :n] for key in ("u_lower", "u_upper"))
        if not any(same(part, lower, upper) for part in components(one, float(P[i]))):
            faults.append(f"P = {P[i]:.6g}: {lower} to {upper} is no component")
    for end, said in zip((0, -1), branch["ended_because"].values, strict=True):
        if abs(abs(P[end]) - 1.5) < 1e-9 or "boundary" not in str(said):
            if abs(abs(P[end]) - 1.5) > 1e-9:
                faults.append(f"ends at P = {P[end]:.6g}: {said}")
            continue
        faults += _vanishes(one, branch, end, n)
    for value in folds:  # two components before, none behind
        i = int(np.argmin(np.abs(P - value)))
        q, counts = branch["u"].values[i, :n], []
        for side in (-BESIDE, BESIDE):
            near = [c for c in components(one, float(value) + side) if _distance(c, q) < 100 * BESIDE]
            counts.append(len(near))
        if sorted(counts) != [0, 2]:
            faults.append(f"non-smooth fold at P = {value:.6g}: {counts} components beside it")
    return faults


def _distance(part: Component, q: Any) -> float:
    return float(np.maximum(part.lower - q, q - part.upper).max())


def _vanishes(one: Draw, branch: Any, end: int, n: int) -> list[str]:
    P, q = float(branch["P"].values[end]), branch["u"].values[end, :n]
    inside = 1.0 if P < branch["P"].values[end + (1 if end == 0 else -1)] else -1.0
    there = [c for c in components(one, P - inside * BESIDE) if _distance(c, q) < 10 * BESIDE]
    return [f"ends at P = {P:.6g}, but goes on"] if there else []


def beside(one: Draw, system: Any, branch: Any, part: Component) -> list[str]:
    """Faults of stability at P = 0: said against eigenvalues of what moves, and against runs from neighbours."""
    import nonsmooth as ns

    rate, n = growth(one, part), len(one.K)
    if rate is None or abs(rate) < 0.02:
        return []
    at = int(np.argmin(np.abs(branch["P"].values)))
    if bool(branch["stable"].values[at]) != (rate < 0):
        return [f"stable {bool(branch['stable'].values[at])}, growth {rate:.4g}"]
    rng, q = np.random.default_rng(one.seed), branch["u"].values[at]
    if not np.isfinite(branch["u_lower"].values[at]).all() or not np.isfinite(branch["u_upper"].values[at]).all():
        return []
    start = q + 1e-5 * rng.normal(size=2 * n)
    for p in one.parts:  # not beyond a stop
        if p.kind == "stop" and (over := p.side * (p.w @ start[:n] - p.position)) > 0:
            start[:n] -= p.side * over * p.w / (p.w @ p.w)
    run = ns.simulate(system, duration=min((12.0 if rate > 0 else 25.0) / abs(rate), 1200.0), start=start, samples=2000)
    # A component may be a long line of states that friction holds: motion leaves them all within its extent. It moves.
    q, v = run["u"].values[:, :n], run["u"].values[:, n : 2 * n]
    off = np.hstack([part.lower - q, q - part.upper, np.abs(v)]).max(axis=1)
    if rate < 0 and off[-1] > 1e-4:
        return [f"a stable one is left: {off[-1]:.3g}"]
    if rate > 0 and off.max() < 1e-3:
        return [f"an unstable one is not left: {off.max():.3g}"]
    return []


def check(seed: int, anywhere: int = STARTS) -> tuple[int, list[str]]:
    """The number of components of a seed at P = 0, and all faults."""
    one = draw(seed)
    system, known = one.as_nonsmooth(), components(one, 0.0)
    faults, branches = found_from_starts(one, system, known, anywhere)
    for part, branch in zip(known, branches, strict=True):
        if branch is not None:
            faults += along(one, branch) + beside(one, system, branch, part)
    return len(known), faults


def main() -> None:
    first, last = int(sys.argv[1]), int(sys.argv[2])
    bad = parts = 0
    for seed in range(first, last):
        begun = time.process_time()
        try:
            count, faults = check(seed)
        except Exception as error:
            count, faults = 0, [f"{type(error).__name__}: {str(error)[:200]}"]
        parts, bad = parts + count, bad + bool(faults)
        if faults:
            print(seed, f"{time.process_time() - begun:.1f} s", *dict.fromkeys(faults), sep="\n    ", flush=True)
    print(f"{last - first} systems, {parts} components at P = 0, {bad} systems with faults")


if __name__ == "__main__":
    main()
