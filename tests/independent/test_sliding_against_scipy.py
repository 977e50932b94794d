"""Random friction and relay systems against SciPy on each field and on Filippov's."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

sys.path.insert(0, str(Path(__file__).parent))
from filippov_reference import ABOVE, BELOW, SLIDING, Contacts, Filippov, integrate, rub

pytestmark = pytest.mark.physics


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
        states=[f"x{i}" for i in range(n)],
        parameters={"w": w},
        modes={BELOW: side(1), ABOVE: side(-1)},
        indicators={"h": lambda t, u, p: k @ u - b * (1 + m * np.cos(w * t))},
        transitions=[ns.Surface("h", below=BELOW, above=ABOVE, mode=SLIDING, static=static)],
    )
    reference = Filippov(
        lambda t, u: A @ u + c * np.cos(w * t) + g,
        lambda t, u: A @ u + c * np.cos(w * t) - g,
        lambda t, u: k @ u - b * (1 + m * np.cos(w * t)),
        lambda t, u: k,
        lambda t, u: b * m * w * np.sin(w * t),
        static,
    )
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


@pytest.mark.parametrize("seed", range(4))
def test_two_contacts_that_stick_in_turn_and_together(seed: int) -> None:
    random = np.random.default_rng([seed, 77])
    w, K = random.uniform(0.5, 1.3), np.array([[2.0, -0.8], [-0.8, 1.5]])
    c, F, belt = random.uniform(0.4, 1.0, 2), random.uniform(0.5, 1.0, 2), random.uniform(-0.3, 0.3, 2)
    start = np.array([*random.uniform(-1, 1, 2), *(belt + 0.5)])
    names = {1: "p", -1: "m"}

    def side(signs: tuple[int, int]) -> Any:
        return lambda t, u, p: (u[2], u[3], *(c * np.cos(w * t) - K @ u[:2] - 0.05 * u[2:] - F * np.array(signs)))

    system = ns.System(
        states=["x0", "x1", "v0", "v1"],
        parameters={"w": w},
        modes={names[a] + names[b]: side((a, b)) for a in (1, -1) for b in (1, -1)},
        indicators={f"rub{i}": (lambda t, u, p, i=i: u[2 + i] - belt[i]) for i in (0, 1)},
        transitions=[
            ns.Surface("rub0", below="mm", above="pm"),
            ns.Surface("rub0", below="mp", above="pp"),
            ns.Surface("rub1", below="mm", above="mp"),
            ns.Surface("rub1", below="pm", above="pp"),
        ],
    )
    contacts = Contacts(lambda t, x, v: c * np.cos(w * t) - K @ x - 0.05 * v, F, belt)
    changes, last = rub(contacts, start, 25.0)
    run = ns.simulate(system, duration=25.0, start=start, samples=2501)
    assert run.attrs["nonsmooth"].count('"exact"')

    def signs(mode: str) -> tuple[int, ...]:
        """Of the relative velocities, 0 where the mode slides."""
        if mode == "rub0_rub1_sliding":
            return 0, 0
        values = {"p": 1, "m": -1}
        if mode.startswith("rub"):  # rub0_sliding_mp_pp: what both modes share
            one, two = mode.split("_")[-2:]
            return tuple(values[a] if a == b else 0 for a, b in zip(one, two, strict=True))
        return tuple(values[a] for a in mode)

    log = [signs(system.modes[system.transitions[i].target]) for i in run.crossing_transition.values]
    assert log == [signs for _, signs in changes]
    assert run.crossing_time.values == pytest.approx([time for time, _ in changes], abs=1e-9)
    assert run.u.values[-1] == pytest.approx(last, abs=1e-9)
    stuck = np.array([signs(mode) for mode in np.array(system.modes)[run.mode.values]]) == 0
    assert (stuck.all(axis=1)).any()
    assert np.abs((run.u.values[:, 2:] - belt)[stuck]).max() <= 1e-12
