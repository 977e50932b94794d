"""Random linear systems with contacts, run by one checkout and compared with what another one kept.

`PYTHONPATH=OLD/src python benchmarks/agreement.py old.npz` in one environment, then `PYTHONPATH=src python
benchmarks/agreement.py new.npz old.npz`: transitions must be the same, and states differ by no more than rounding times
the growth of a neighbour 1e-14 away.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np

import nonsmooth as ns

SYSTEMS, NEAR = 300, 1e-14


def drawn(seed: int) -> tuple[ns.System, float]:
    """Return a system of one to three masses with a stop, an elastic stop, friction, or two of them, and its period."""
    rng = np.random.default_rng(seed)
    n, uniform = int(rng.integers(1, 4)), rng.uniform
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    M, K = np.diag(uniform(0.5, 2.0, n)), Q @ np.diag(uniform(0.5, 6.0, n)) @ Q.T
    K = 0.5 * (K + K.T)
    names, w, F, kind = [f"q{i + 1}" for i in range(n)], uniform(0.4, 2.0), uniform(0.3, 1.5), rng.integers(0, 4)
    at, E = names[int(rng.integers(0, n))], ns.elements
    elements = {}
    if kind in (0, 3):
        elements["stop"] = E.Stop(at=at, position=uniform(0.1, 0.6), restitution=uniform(0.2, 0.9))
    if kind == 2:
        elements["stop"] = E.ElasticStop(
            at=at, position=uniform(0.1, 0.5), stiffness=uniform(5.0, 40.0), damping=uniform(0.0, 0.5)
        )
    if kind in (1, 3):
        elements["rub"] = E.Coulomb(at=names[-1] if kind == 3 else at, friction=uniform(0.05, 0.4))
    system = ns.mechanical(
        M.tolist(), (0.05 * K + 0.02 * np.eye(n)).tolist(), K.tolist(), parameters={}, coordinates=names,
        forcing={names[0]: lambda t, p: F * np.cos(w * t)}, elements=elements,
    )  # fmt: skip
    return system, 2.0 * np.pi / w


def main() -> int:
    warnings.simplefilter("ignore")
    found = {}
    for seed in range(SYSTEMS):
        system, period = drawn(seed)
        run, other = (ns.simulate(system, duration=6 * period, samples=7, start={"q1": x}) for x in (0.0, NEAR))
        found[f"transitions_{seed}"], found[f"u_{seed}"] = run["crossing_transition"].values, run["u"].values
        same = other["u"].shape == run["u"].shape
        apart = float(np.abs(other["u"].values - run["u"].values).max()) if same else np.inf
        found[f"growth_{seed}"] = np.array(max(apart / NEAR, 1.0))
    np.savez(sys.argv[1], **found)
    if len(sys.argv) > 2:
        kept, different, worst = np.load(sys.argv[2]), [], 0.0
        for seed in range(SYSTEMS):
            if not np.array_equal(found[f"transitions_{seed}"], kept[f"transitions_{seed}"]):
                different.append(seed)
                continue
            apart = np.abs(found[f"u_{seed}"] - kept[f"u_{seed}"]).max()
            worst = max(worst, float(apart / kept[f"growth_{seed}"]))
        print(f"{SYSTEMS - len(different)} of {SYSTEMS} with the same transitions; others: {different}")
        print(f"largest difference of states over a neighbour's growth: {worst:.2g}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
