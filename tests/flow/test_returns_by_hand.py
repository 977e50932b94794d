"""Returns to sections, extremes and counts of linear motions, whose every instant is a closed form."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics
C, K, W = 0.3, 2.0, 1.1
T = 2 * np.pi / W
ANSWER = 1.0 / (K - W**2 + 1j * C * W)  # to cos w t


def forced(**elements: ns.elements.Stop) -> ns.System:
    return ns.mechanical(
        1.0,
        C,
        K,
        parameters={"w": W},
        forcing={"q": lambda t, p: np.cos(p.w * t)},
        elements=elements or None,
        coordinates=["q"],
    )


def state(t: np.ndarray) -> np.ndarray:
    """The steady motion."""
    wave = ANSWER * np.exp(1j * W * np.asarray(t))
    return np.stack([wave.real, (1j * W * wave).real], axis=-1)


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.99])
def test_returns_at_a_phase(phase: float) -> None:
    """The k-th point stands at (k + phase) T, with the state of that instant; the transient is passed over."""
    found = ns.poincare(forced(), n=4, start=state(0.0), transient=3, section=ns.Stroboscopic(phase))
    first = 3 if phase else 4
    expected = (first + np.arange(4) + phase) * T
    assert found["time"].values == pytest.approx(expected, rel=1e-12)
    assert found["section"].values == pytest.approx(state(expected), abs=1e-10)


@pytest.mark.parametrize(("level", "every"), [(0.0, 1), (0.2, 1), (0.2, 3)])
def test_returns_at_a_level(level: float, every: int) -> None:
    """q rises through a level once in a period; of these returns every third one."""
    system = ns.System(
        states=["q", "v"],
        parameters={"w": W},
        modes={"m": lambda t, u, p: (u.v, np.cos(p.w * t) - C * u.v - K * u.q)},
        indicators={"over": lambda t, u, p: u.q - level},
    )
    section = ns.Poincare("over", rising=True, every=every)
    found = ns.poincare(system, n=3, start=state(0.0), transient=2, section=section)
    angle = -np.arccos(level / abs(ANSWER)) - np.angle(ANSWER)
    turns = np.round((found["time"].values * W - angle) / (2 * np.pi))
    assert found["time"].values == pytest.approx((angle + 2 * np.pi * turns) / W, abs=1e-9)
    assert np.diff(turns).tolist() == [every, every]
    assert found["section"].values == pytest.approx(state(found["time"].values), abs=1e-9)


def test_extremes_and_counts_of_the_kept_window() -> None:
    """An elastic stop that is touched once in a period: two crossings, one contact; without one the amplitudes."""
    free = ns.sweep(forced(), "w", [W], start=state(0.0), transient=5, keep=4, progress=False).squeeze()
    size = abs(ANSWER)
    assert free["maximum"].values == pytest.approx([size, W * size], rel=1e-9)
    assert free["minimum"].values == pytest.approx([-size, -W * size], rel=1e-9)
    assert (int(free["period_number"]), float(free["crossings_per_period"])) == (1, 0.0)
    stop = ns.elements.ElasticStop(at="q", position=0.8 * size, stiffness=0.5)
    for keep in (4, 7):
        found = ns.sweep(forced(stop=stop), "w", [W], transient=200, keep=keep, progress=False).squeeze()
        assert int(found["period_number"]) == 1
        assert (float(found["crossings_per_period"]), float(found["contacts_per_period"])) == (2.0, 1.0)
        assert 0.8 * size < float(found["maximum"][0]) < size


def test_extremes_of_conditions_that_are_a_state_and_that_are_not() -> None:
    """The room left to q = 2 and to q + v = 2, of which the sum swings by |1 + i w| |answer|."""

    def field(t, u, p):
        return u.v, np.cos(p.w * t) - K * u.q - C * u.v

    conditions = {"place": lambda t, u, p: u.q - 2.0, "sum": lambda t, u, p: u.q + u.v - 2.0}
    system = ns.System(states=["q", "v"], parameters={"w": W}, modes={"only": field}, indicators=conditions)
    found = ns.sweep(system, "w", [W], start=state(0.0), transient=5, keep=4, progress=False).squeeze()
    swings = abs(ANSWER), abs(ANSWER * (1 + 1j * W))
    assert found["clearance"].values == pytest.approx([2.0 - swing for swing in swings], rel=1e-9)
