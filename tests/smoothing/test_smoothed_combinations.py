"""Several elements smoothed together: the sum of what each does over its own band, by SciPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nonsmooth as ns

pytestmark = pytest.mark.physics

E = ns.elements
SHARES = {
    "linear": lambda x: np.clip((1 + x) / 2, 0, 1),
    "tanh": lambda x: (1 + np.tanh(x)) / 2,
    "arctan": lambda x: 0.5 + np.arctan(x) / np.pi,
}


def apart(seed: int, shape: str) -> float:
    """The distance of a motion of 8 time units by Taylor series from that by SciPy, of a random chain of masses."""
    rng = np.random.default_rng(seed)
    n, eta = int(rng.integers(1, 4)), float(rng.choice([0.02, 0.1])) / (20 if shape == "tanh" else 1)
    names = [f"q{i + 1}" for i in range(n)] if n > 1 else ["q"]
    k, loads, masses, w = rng.uniform(0.5, 3, n + 1), rng.uniform(-1, 1, n), rng.uniform(0.5, 2, n), 1.3
    K = np.diag(k[:-1] + k[1:]) - np.diag(k[1:-1], 1) - np.diag(k[1:-1], -1)
    (f, g), (a, b, c) = rng.uniform(0.1, 0.6, 2).tolist(), rng.uniform(5, 20, 3).tolist()
    first, last = names[0], names[-1]

    def share(gap: Any) -> Any:
        return SHARES[shape](gap / eta)

    def pushed(gap: Any) -> Any:
        return gap * share(gap)

    known: dict[str, tuple[Any, int, Any]] = {
        "belt": (E.Coulomb(at=last, friction=f, belt=0.3), -1, lambda q, v: f * (1 - 2 * share(v - 0.3))),
        "rail": (E.Coulomb(at=first, friction=g), 0, lambda q, v: g * (1 - 2 * share(v))),
        "soft": (E.ElasticStop(at=first, side=-1, position=-0.4, stiffness=a), 0, lambda q, v: a * pushed(-0.4 - q)),
        "wall": (E.ElasticStop(at=last, side=1, position=0.4, stiffness=b), -1, lambda q, v: -b * pushed(q - 0.4)),
        "preload": (E.PreloadedSpring(at=first, preload=0.3, stiffness=1.0), 0, lambda q, v: 0.3 - q - 0.6 * share(q)),
    }
    if shape != "arctan":  # of three regions side by side its weights are divided by their sum
        play = E.Backlash(at=last, half_width=0.35, stiffness=c)
        known["play"] = play, -1, lambda q, v: c * (pushed(-q - 0.35) - pushed(q - 0.35))
    chosen = rng.choice(list(known), size=int(rng.integers(2, 4)), replace=False)
    forcing = {q: lambda t, p, load=load: load * np.cos(p.w * t) for q, load in zip(names, loads, strict=True)}
    system = ns.mechanical(
        np.diag(masses),
        0.1 * K,
        K,
        forcing=forcing,
        parameters={"w": w},
        elements={name: known[name][0] for name in chosen},
    )
    speeds = rng.uniform(-0.5, 0.5, n).tolist()
    start = dict.fromkeys(names, 0.2) | {f"v_{name}": v for name, v in zip(names, speeds, strict=True)}

    def field(t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:n], y[n:]
        force = loads * np.cos(w * t) - K @ q - 0.1 * K @ v
        for _, at, law in (known[name] for name in chosen):
            force[at] += law(q[at], v[at])
        return np.concatenate([v, force / masses])

    y0 = np.array([0.2] * n + speeds)
    expected = solve_ivp(field, (0, 8.0), y0, method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.01).y[:, -1]
    run = ns.simulate(system.smoothed(eta, shape), duration=8.0, start=start, method="taylor")
    return float(np.abs(run.u.values[-1] - expected).max())


@pytest.mark.parametrize(("seed", "shape"), [(3, "linear"), (5, "tanh"), (10, "arctan")])
def test_random_combinations(seed: int, shape: str) -> None:
    assert apart(seed, shape) < 1e-8


@pytest.mark.slow
def test_forty_of_each() -> None:
    assert not [(seed, shape) for seed in range(40) for shape in SHARES if not apart(seed, shape) < 1e-7]


def test_two_dry_frictions_on_one_mass_hold_as_their_sum() -> None:
    """In the corner of both bands the force is linear in the speed: a creep that decays at (f + g) / eta."""
    both = {"a": E.Coulomb(at="q", friction=0.2), "b": E.Coulomb(at="q", friction=0.3)}
    smooth = ns.mechanical(1.0, 0.0, 0.0, elements=both).smoothed(0.1)
    run = ns.simulate(smooth, duration=0.7, start={"q": 0.0, "v_q": 0.05})
    assert run.u.values[-1, 1] == pytest.approx(0.05 * np.exp(-0.5 / 0.1 * 0.7), rel=1e-12)
