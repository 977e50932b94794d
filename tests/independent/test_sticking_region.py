"""An impact oscillator that chatters and sticks (Budd and Dux 1994) for a long time from many states at its stop.

x'' + x = cos(w t) for x < sigma, v -> -r v at x = sigma: with sigma < 1 the force presses the mass against the stop
where cos(w t) > sigma. There these runs begin, so slowly that their impacts accumulate before it lets go.
"""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

BEYOND = 1e-12
COMBINATIONS = [
    (sigma, w, r) for sigma in (-0.5, 0.0, 0.4, 0.8, 0.95) for w, r in ((0.4, 0.6), (0.7, 0.8), (1.3, 0.5), (2.1, 0.9))
]
PERIODS = 1000


def at_the_stop(sigma: float, w: float, r: float) -> ns.System:
    return ns.System(
        states=["x", "v"],
        parameters={"w": w, "sigma": sigma, "r": r},
        modes={"free": lambda t, u, p: (u.v, np.cos(p.w * t) - u.x)},
        elements={"stop": ns.elements.Stop(gap=lambda t, u, p: p.sigma - u.x, on={"v": -1.0}, restitution="r")},
    )


def campaign(combinations: list[tuple[float, float, float]], count: int, periods: int) -> dict[str, float]:
    """Runs, impacts, the largest excess over the stop and gain of energy, and the share of runs that rested."""
    told = {"runs": 0, "impacts": 0, "excess": -np.inf, "gain": -np.inf, "rested": 0}
    for number, (sigma, w, r) in enumerate(combinations):
        system = at_the_stop(sigma, w, r)
        random = np.random.default_rng(number)
        until = np.arccos(sigma) / w  # presses; impacts of speed v accumulate in 2 r v / ((1 - sigma) (1 - r))
        v = random.uniform(0, 0.1, count) * until * (1 - sigma) * (1 - r) / r
        starts = np.stack([sigma - random.uniform(0, 0.1, count) * until * v, v], axis=1)
        found = ns.sweep(
            system, "w", [w], start=starts, direction=None, transient=0, keep=periods, max_period=8, progress=False
        )
        good = {"ok", "slow", "not_periodic"}
        names = found.status.attrs["flag_meanings"].split()
        assert {names[code] for code in found.status.values.ravel()} <= good
        told["excess"] = max(told["excess"], float(found.maximum.sel(state="x").max()) - sigma)
        for start in starts:
            run = ns.simulate(system, periods=periods, start=start, samples=2)
            before, after = run.u_before.values, run.u_after.values
            told["gain"] = max(told["gain"], float(((after**2 - before**2).sum(axis=1) / 2).max()))
            targets = np.array([jump.target for jump in system.transitions])[run.crossing_transition.values]
            told["rested"] += "stop_rest" in {system.modes[i] for i in set(targets.tolist())}
            told["runs"], told["impacts"] = told["runs"] + 1, told["impacts"] + len(targets)
        print(f"sigma {sigma}, w {w}, r {r}: until here {told}", flush=True)
    return told


def test_a_few_runs_from_the_sticking_region() -> None:
    told = campaign([(0.4, 0.7, 0.8)], 3, 100)
    assert told["excess"] <= BEYOND and told["gain"] <= BEYOND and told["rested"] == 3


@pytest.mark.slow
def test_ten_thousand_runs_from_the_sticking_region() -> None:
    """1000 periods each: none hangs, none passes the stop, no impact adds energy."""
    told = campaign(COMBINATIONS, 500, PERIODS)
    assert told["runs"] == 10_000
    assert told["excess"] <= BEYOND and told["gain"] <= BEYOND
    assert told["rested"] > 0.95 * told["runs"]  # with r = 0.9 the force turns before some accumulations end
