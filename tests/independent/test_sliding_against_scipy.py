"""Random friction and relay systems against SciPy on each field and on Filippov's."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

sys.path.insert(0, str(Path(__file__).parent))
from filippov_reference import ABOVE, BELOW, SLIDING, Filippov, integrate


def linear(seed: int, n: int, kind: str) -> tuple[ns.System, Filippov, np.ndarray]:
    """u' = A u + c cos(w t) -+ g (above, below), on the surface k u = b (1 + m cos(w t))."""
    random = np.random.default_rng([seed, n])
    w, b = random.uniform(0.6, 1.6), random.uniform(-0.3, 0.3)
    A, c, g, k = np.zeros((n, n)), np.zeros(n), np.zeros(n), np.zeros(n)
    m = random.uniform(-0.8, 0.8) if seed % 2 else 0.0
    if kind == "friction":  # masses on springs; the first rubs on a belt
        d = n // 2
        B = random.uniform(-0.4, 0.4, (d, d))
        K, C = np.eye(d) * random.uniform(0.8, 2.0) + B @ B.T, 0.05 * np.eye(d)
        A[:d, d:], A[d:, :d], A[d:, d:] = np.eye(d), -K, -C
        c[d:], g[d], k[d] = random.uniform(0.4, 1.0, d), random.uniform(0.6, 1.2), 1.0
    else:  # a stable linear plant under a relay
        A = random.normal(size=(n, n))
        A -= (np.linalg.eigvals(A).real.max() + 0.2) * np.eye(n)
        c, g, k = random.normal(size=n), random.normal(size=n), random.normal(size=n)
        g *= np.sign(k @ g) * 0.8
    static = random.uniform(1.05, 1.6) if seed % 3 == 0 else 1.0

    def side(sign: int) -> Any:
        return lambda t, u, p: A @ u + c * np.cos(w * t) + sign * g

    system = ns.System(
        states=[f"x{i}" for i in range(n)], parameters={"w": w},
        modes={BELOW: side(1), ABOVE: side(-1)},
        indicators={"h": lambda t, u, p: k @ u - b * (1 + m * np.cos(w * t))},
        transitions=[ns.Surface("h", below=BELOW, above=ABOVE, mode=SLIDING, static=static)],
    )  # fmt: skip
    reference = Filippov(
        lambda t, u: A @ u + c * np.cos(w * t) + g, lambda t, u: A @ u + c * np.cos(w * t) - g,
        lambda t, u: k @ u - b * (1 + m * np.cos(w * t)), lambda t, u: k, lambda t, u: b * m * w * np.sin(w * t), static,
    )  # fmt: skip
    return system, reference, random.uniform(-1, 1, n)


@pytest.mark.parametrize(("n", "kind"), [(2, "friction"), (4, "friction"), (3, "relay")])
@pytest.mark.parametrize("seed", range(4))
def test_states_modes_and_surface(n: int, kind: str, seed: int) -> None:
    system, reference, start = linear(seed, n, kind)
    first = BELOW if reference.h(0.0, start) < 0 else ABOVE
    changes, last = integrate(reference, start, 20.0, first)
    run = ns.simulate(system, duration=20.0, start=start, samples=2001)
    assert run.attrs["nonsmooth"].count('"exact"')
    log = [
        (time, system.modes[system.transitions[i].target])
        for time, i in zip(run.crossing_time.values, run.crossing_transition.values, strict=True)
    ]
    if log and log[0][0] == 0.0:
        log = log[1:]  # the start rule
    assert [mode for _, mode in log] == [mode for _, mode in changes]
    assert [time for time, _ in log] == pytest.approx([time for time, _ in changes], abs=1e-9)
    assert run.u.values[-1] == pytest.approx(last, abs=1e-9)
    slid = run.mode.values == system.modes.index(SLIDING)
    assert any(mode == SLIDING for _, mode in changes)
    off = [reference.h(t, u) for t, u in zip(run.time.values[slid], run.u.values[slid], strict=True)]
    assert np.abs(off).max() <= 1e-12
