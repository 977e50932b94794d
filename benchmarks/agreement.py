"""Random systems of one to six states, run by one checkout and compared with what another one kept.

`PYTHONPATH=OLD/src python benchmarks/agreement.py old.npz` in one environment, then `PYTHONPATH=src python
benchmarks/agreement.py new.npz old.npz`: the same crossings, at times and with states that differ by no more than
rounding times the growth of a neighbour 1e-14 away.
"""

from __future__ import annotations

import sys
import warnings

import numpy as np

import nonsmooth as ns

SYSTEMS, NEAR = 300, 1e-14


Drawn = tuple[ns.System, float, str]  # a system, its period, and an indicator for a section


def drawn(seed: int) -> Drawn:
    """Every third system has a reset of one state, or memory; all others are masses with elements."""
    rng = np.random.default_rng(seed)
    return masses(rng) if seed % 3 else yielding(rng) if seed % 2 else filling(rng)


def filling(rng: np.random.Generator) -> Drawn:
    """One state that relaxes under a drive and is set back from a threshold; a valve opens at half of it."""
    a, b, F, w, top, low = rng.uniform((0.1, 0.5, 0.2, 0.5, 0.8, -0.5), (0.6, 2.0, 1.0, 2.0, 1.5, 0.2))
    system = ns.System(
        states=["x"],
        parameters={"w": w, "top": top, "low": low},
        modes={
            "shut": lambda t, u, p: (b - a * u.x + F * np.cos(p.w * t),),
            "open": lambda t, u, p: (b - 2 * a * u.x + F * np.cos(p.w * t),),
        },
        indicators={
            "full": lambda t, u, p: u.x - p.top,
            "half": lambda t, u, p: u.x - 0.5 * p.top,
            "third": lambda t, u, p: u.x - 0.3 * p.top,
        },
        transitions=[
            ns.Transition("open", "shut", when="full > 0", reset=lambda t, u, p: (p.low,)),
            ns.Transition("shut", "open", when="half > 0"),
            ns.Transition("open", "shut", when="third < 0"),
        ],
    )
    return system, 2.0 * np.pi / w, "half"


def yielding(rng: np.random.Generator) -> Drawn:
    """A wall that remembers: it gives way by a part of each impact's speed, and recovers once a swing."""
    least, most = (0.5, 0.05, 0.5, 0.6, 0.5, 0.02, 0.3, -0.8), (2.0, 0.4, 2.0, 1.8, 0.9, 0.1, 0.9, -0.4)
    k, c, F, w, e, d, r, low = rng.uniform(least, most)

    def motion(t, u, p):
        return u.v, F * np.cos(p.w * t) - k * u.x - c * u.v + 0.2 * p.wall

    system = ns.System(
        states=["x", "v"],
        parameters={"w": w, "e": e},
        memory={"wall": 0.3},
        modes={"near": motion, "far": motion},
        indicators={"reach": lambda t, u, p: u.x - p.wall, "back": lambda t, u, p: u.x - low},
        transitions=[
            ns.Transition(
                "near",
                "near",
                when="reach > 0",
                reset=lambda t, u, p: (u.x, -p.e * u.v),
                write={"wall": lambda t, u, p: p.wall + d * u.v},
            ),
            ns.Transition("near", "far", when="back < 0", write={"wall": lambda t, u, p: r * p.wall}),
            ns.Transition("far", "near", when="back > 0"),
        ],
    )
    return system, 2.0 * np.pi / w, "back"


def masses(rng: np.random.Generator) -> Drawn:
    """One to three masses with a stop, an elastic stop, friction, or two of them."""
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
        M.tolist(),
        (0.05 * K + 0.02 * np.eye(n)).tolist(),
        K.tolist(),
        parameters={},
        coordinates=names,
        forcing={names[0]: lambda t, p: F * np.cos(w * t)},
        elements=elements,
    )
    return system, 2.0 * np.pi / w, next(iter(system.indicators))


def main() -> int:
    warnings.simplefilter("ignore")
    found = {}
    for seed in range(SYSTEMS):
        system, period, surface = drawn(seed)
        first = next(iter(system.states))
        run, other = (ns.simulate(system, duration=6 * period, samples=7, start={first: x}) for x in (0.0, NEAR))
        try:
            points = ns.poincare(system, n=6, section=ns.Poincare(surface, rising=None, t_max=6 * period))
            found[f"section_{seed}"] = points["section"].values
        except ns.SolveError:  # no six returns
            found[f"section_{seed}"] = np.empty(0)
        found[f"crossings_{seed}"], found[f"u_{seed}"] = run["crossing_time"].values, run["u"].values
        same = other["u"].shape == run["u"].shape
        apart = float(np.abs(other["u"].values - run["u"].values).max()) if same else np.inf
        found[f"growth_{seed}"] = np.array(max(apart / NEAR, 1.0))
    np.savez(sys.argv[1], **found)
    if len(sys.argv) > 2:
        kept, different, worst = np.load(sys.argv[2]), [], 0.0
        for seed in range(SYSTEMS):
            names = [f"{name}_{seed}" for name in ("crossings", "u", "section")]
            if any(found[name].shape != kept[name].shape for name in names):
                different.append(seed)
                continue
            apart = max(np.abs(found[name] - kept[name]).max(initial=0.0) for name in names)
            worst = max(worst, float(apart / kept[f"growth_{seed}"]))
        print(f"{SYSTEMS - len(different)} of {SYSTEMS} with the same crossings; others: {different}")
        print(f"largest difference of crossings, states and section points over a neighbour's growth: {worst:.2g}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
