"""Crossings of the exact flow close to a graze, against closed forms: no wrong instant, no missed transition.

x = sin(theta), v = cos(theta) with theta = t + phi in both modes. ``a`` is left where x > c and v < k, ``b`` where
x < c. With alpha = arcsin c and beta = arccos k the first holds on (alpha, pi - alpha) and (beta, 2 pi - beta), so the
crossings of each turn stand at max(alpha, beta) and pi - alpha, or there are none.
"""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics

TURNS = 2
UNDECIDED = 1e-7  # rad: where the two intervals end together rounding decides


@pytest.fixture(scope="module")
def gate() -> ns.System:
    def field(t, u, p):
        return u.v, -u.x

    return ns.System(
        states=["x", "v"],
        parameters={"c": 0.9, "k": 0.0},
        modes={"a": field, "b": field},
        indicators={"over": lambda t, u, p: u.x - p.c, "slow": lambda t, u, p: p.k - u.v},
        transitions=[
            ns.Transition("a", "b", when="over > 0 and slow > 0"),
            ns.Transition("b", "a", when="over < 0"),
        ],
        name="gate near a graze",
    )


def expected(phi: float, c: float, k: float, duration: float) -> np.ndarray | None:
    alpha, beta = np.arcsin(c), np.arccos(min(k, 1.0))
    begin, end = max(alpha, beta), np.pi - alpha
    if abs(begin - end) < UNDECIDED:
        return None
    if begin > end:
        return np.empty(0)
    turns = 2 * np.pi * np.arange(TURNS + 2)
    times = np.sort(np.concatenate([begin + turns, end + turns])) - phi
    return times[(times > 0.0) & (times < duration)]


def wrong_of(gate: ns.System, count: int, seed: int) -> tuple[list[str], int, int]:
    """Runs whose crossings are not those of the closed form to 1e-10 of the period, how many were judged, and how many
    ended with a status that says so."""
    rng = np.random.default_rng(seed)
    wrong, judged, said = [], 0, 0
    for _ in range(count):
        depth = 10.0 ** rng.uniform(-6.0, -1.0)
        c = 1.0 - depth
        # half of the starts see the velocity's condition decide within the same short piece
        k = np.cos(np.pi / 2 + rng.uniform(-1.5, 1.5) * np.sqrt(2 * depth)) if rng.random() < 0.5 else 0.999
        phi = rng.uniform(np.pi, 2 * np.pi)  # below the gate
        phi_0 = phi - 2 * np.pi
        duration = 2 * np.pi * TURNS - 0.3
        truth = expected(phi_0, c, float(k), duration)
        if truth is None:
            continue
        judged += 1
        run = ns.simulate(
            gate.with_parameters(c=c, k=float(k)),
            duration=duration,
            samples=2,
            method="exact",
            start={"x": float(np.sin(phi_0)), "v": float(np.cos(phi_0))},
        )
        if int(run.status) != 0:
            said += 1
            continue
        got = run.crossing_time.values
        if len(got) != len(truth) or (len(got) and np.abs(got - truth).max() > 1e-10 * 2 * np.pi):
            wrong.append(f"c = {c!r}, k = {k!r}, phi = {phi_0!r}: {got - truth if len(got) == len(truth) else got}")
    return wrong, judged, said


def test_crossings_near_grazes_are_those_of_the_closed_form(gate: ns.System) -> None:
    wrong, judged, said = wrong_of(gate, 600, 11)
    assert judged > 590
    assert said == 0
    assert not wrong, wrong[:5]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("rising", [True, False])
def test_returns_beside_an_extremum_one_way(side: int, rising: bool) -> None:
    """x = -side cos(t + phi) passes side (1 - depth) at t + phi = pi -+ arccos(1 - depth) in each turn. From a return
    on steps are quarters of a turn, so that one of them ends on the section."""

    def swing(t, u, p):
        return u.v, -u.x

    for depth in (1e-9, 1e-6, 1e-3, 0.01, 0.1):
        level = {"level": lambda t, u, p, depth=depth: u.x - side * (1.0 - depth)}
        system = ns.System(states=["x", "v"], parameters={}, modes={"only": swing}, indicators=level)
        section, before = ns.Poincare("level", rising=rising, t_max=20.0), rising == (side > 0)
        for phi in np.linspace(0.0, 2.5, 6):
            start = {"x": -side * np.cos(phi), "v": side * np.sin(phi)}
            found = ns.poincare(system, n=3, start=start, section=section)["time"].values
            first = np.pi + (-1 if before else 1) * np.arccos(1.0 - depth) - phi
            np.testing.assert_allclose(found, first + 2 * np.pi * np.arange(3), rtol=0, atol=1e-7)


def test_a_root_finder_that_has_not_converged_has_found_nothing(gate: ns.System) -> None:
    """The first guess stands on the indicator's maximum: ten steps of Halley's method do not converge from there."""
    phi, c = 4.824163895694583, 0.999425333961005
    run = ns.simulate(
        gate.with_parameters(c=c, k=0.9999999),
        duration=9.0,
        samples=2,
        method="exact",
        start={"x": np.sin(phi), "v": np.cos(phi)},
    )
    up = np.arcsin(c)
    np.testing.assert_allclose(run.crossing_time.values, [up - phi + 2 * np.pi, 3 * np.pi - up - phi], rtol=1e-11)


def test_conditions_that_become_true_together(gate: ns.System) -> None:
    """A gap and the force of a spring without a damper are the same function, but for rounding where k is not 1."""
    both = ns.System(
        states=["x", "v"],
        parameters={"c": 0.9, "k": 1210.0},
        modes=dict.fromkeys("ab", lambda t, u, p: (u.v, -u.x)),
        indicators={"over": lambda t, u, p: u.x - p.c, "push": lambda t, u, p: p.k * (u.x - p.c)},
        transitions=[
            ns.Transition("a", "b", when="over > 0 and push > 0"),
            ns.Transition("b", "a", when="over < 0 and push < 0"),
        ],
    )
    rng = np.random.default_rng(5)
    for k in [1.0] * 120 + [*10.0 ** rng.uniform(-1.0, 3.0, 120)]:
        c = 1.0 - 10.0 ** rng.uniform(-6.0, -3.0)
        phi = rng.uniform(-np.pi, 0.0)
        run = ns.simulate(
            both.with_parameters(c=c, k=k),
            duration=2 * np.pi * TURNS - 0.3,
            samples=2,
            start={"x": float(np.sin(phi)), "v": float(np.cos(phi))},
            method="exact",
        )
        truth = expected(phi, c, 2.0, 2 * np.pi * TURNS - 0.3)
        np.testing.assert_allclose(run.crossing_time.values, truth, rtol=0, atol=1e-10, err_msg=f"{c!r} {phi!r}")


@pytest.mark.slow
def test_a_hundred_thousand_starts_near_grazes(gate: ns.System) -> None:
    wrong, judged, said = wrong_of(gate, 100_000, 2007)
    print(f"{judged} starts judged, {len(wrong)} wrong, {said} ended with a status")
    assert not wrong, wrong[:5]
