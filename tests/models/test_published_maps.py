"""The ready maps against closed forms and published scenarios."""

from __future__ import annotations

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth import models

pytestmark = pytest.mark.physics

# ----------------------------------------------------------------------------------------------------------------
# Nordmark's square-root map: the period-m orbit with one impact


def flip_at(lam: float, m: int) -> float:
    """mu at which the multiplier lam^m - lam^(m-1) / (2 s) is -1."""
    s = lam ** (m - 1) / (2 * (1 + lam**m))
    return (1 - lam) / (1 - lam**m) * ((1 - lam**m) * s**2 + lam ** (m - 1) * s)


def collision_at(lam: float, m: int) -> float:
    """mu at which the last point before the impact lies on the border; infinite for m = 1, where there is none."""
    return np.inf if m == 1 else (lam ** (m - 2) * (1 - lam) / (1 - lam**m)) ** 2


def stable_periods(lam: float, mu: float) -> set[int]:
    return {m for m in range(1, 30) if flip_at(lam, m) < mu < collision_at(lam, m)}


def test_period_adding_below_a_quarter():
    """Chin, Ott, Nusse, Grebogi 1994: for lambda < 1/4 period m + 1 follows on m as mu falls; both exist between."""
    lam = 0.2
    mu = np.geomspace(0.3, 1e-4, 60)
    found = ns.sweep(models.square_root_map(lam=lam), "mu", mu, direction="both", transient=2000, keep=24)
    expected = [stable_periods(lam, value) for value in mu]
    assert {2, 3, 4} <= set.union(*expected)
    assert any(len(one) == 2 for one in expected)
    for direction in ("up", "down"):
        numbers = found.period_number.sel(direction=direction).values
        assert all(number in one for number, one in zip(numbers, expected, strict=True)), direction
    up, down = (found.period_number.sel(direction=direction).values for direction in ("up", "down"))
    assert any(a != b for a, b in zip(up, down, strict=True))  # hysteresis


def test_between_a_quarter_and_two_thirds_chaos_fills_the_gaps():
    lam = 0.4
    inside = [np.sqrt(flip_at(lam, m) * collision_at(lam, m)) for m in (3, 4, 5)]
    gaps = [collision_at(lam, m + 1) + 0.3 * (flip_at(lam, m) - collision_at(lam, m + 1)) for m in (3, 4)]
    found = ns.sweep(models.square_root_map(lam=lam), "mu", inside, direction=None, transient=5000, keep=24)
    assert found.period_number.values.tolist() == [3, 4, 5]
    chaos = ns.lyapunov(models.square_root_map(lam=lam), parameter="mu", values=gaps, periods=20000)
    assert (chaos.exponents.values[:, 0] > 0.05).all()


def test_chaos_at_once_beyond_two_thirds():
    chaos = ns.lyapunov(models.square_root_map(lam=0.8), parameter="mu", values=[1e-2, 1e-3, 1e-4], periods=20000)
    assert not any(stable_periods(0.8, mu) for mu in (1e-2, 1e-3, 1e-4))
    assert (chaos.exponents.values[:, 0] > 0.05).all()


def test_a_branch_ends_its_stability_at_the_flip_and_meets_the_border():
    lam, m = 0.2, 3
    mu = np.sqrt(flip_at(lam, m) * collision_at(lam, m))
    orbit = ns.find_orbit(models.square_root_map(lam=lam, mu=mu))
    a, b = 1 - lam**m, lam ** (m - 1)
    s = (-b + np.sqrt(b**2 + 4 * a * mu * a / (1 - lam))) / (2 * a)
    assert orbit.period_number == m
    assert orbit.floquet_multipliers.real == pytest.approx([lam**m - b / (2 * s)], abs=1e-11)
    branch = ns.continue_orbit(orbit, "mu", (0.5 * flip_at(lam, m), 2 * collision_at(lam, m)))
    table = ns.special_points(branch)
    at = {str(kind): float(value) for kind, value in zip(table.kind.values, table.mu.values, strict=True)}
    assert at["flip"] == pytest.approx(flip_at(lam, m), rel=1e-9)
    assert at["corner"] == pytest.approx(collision_at(lam, m), rel=1e-9)


# ----------------------------------------------------------------------------------------------------------------
# Border collisions


def normal_form(a: float, b: float, mu: float = 0.1) -> ns.Map:
    """That with one slope either side: y stays 0."""
    return models.border_collision(tau_l=a, tau_r=b, delta_l=0.0, delta_r=0.0, mu=mu)


@pytest.mark.parametrize("side", ["l", "r"])
def test_fixed_points_of_the_normal_form(side: str):
    tau, delta = {"l": (0.5, 0.2), "r": (-0.6, 0.3)}[side]
    mu = -0.1 if side == "l" else 0.1
    system = models.border_collision(tau_l=0.5, delta_l=0.2, tau_r=-0.6, delta_r=0.3, mu=mu)
    orbit = ns.find_orbit(system)
    x = mu / (1 - tau + delta)
    assert orbit.u == pytest.approx([x, -delta * x], abs=1e-13)
    assert np.sort(orbit.floquet_multipliers) == pytest.approx(np.sort(np.roots([1, -tau, delta])), abs=1e-12)
    branch = ns.continue_orbit(orbit, "mu", (-0.2, 0.2))
    table = ns.special_points(branch)
    assert table.kind.values.tolist() == ["corner"]
    assert table.mu.values == pytest.approx([0.0], abs=1e-14)
    ends = branch.section.values[[0, -1], 0]
    assert np.sort(ends) == pytest.approx([-0.2 / (1 - 0.5 + 0.2), 0.2 / (1 + 0.6 + 0.3)], abs=1e-12)


def test_two_fixed_points_annihilate():
    """tau_r > 1 + delta_r: both fixed points exist for mu < 0 and none for mu > 0, a non-smooth fold."""
    orbit = ns.find_orbit(normal_form(0.5, 1.5, mu=-0.1), start={"x": -0.2})
    branch = ns.continue_orbit(orbit, "mu", (-0.5, 0.5))
    assert branch.mu.values[[0, -1]] == pytest.approx([-0.5, -0.5])
    assert np.sort(branch.section.values[[0, -1], 0]) == pytest.approx([-0.5 / (1 - 0.5), -0.5 / (1 - 1.5)])
    assert float(branch.mu.max()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("a", "b", "period"), [(0.5, -0.8, 1), (0.5, -1.5, 2), (0.3, -6.0, 3), (0.5, -2.5, 0)])
def test_from_period_1_to(a: float, b: float, period: int):
    """Nusse and Yorke 1992: what attracts behind the collision follows from the two slopes alone."""
    found = ns.sweep(normal_form(a, b), "mu", [-0.1, 0.1], direction=None)
    assert found.period_number.values.tolist() == [1, period]


def test_charts_and_basins_of_the_normal_form():
    """a = 0.5: behind the collision period 1 for b = -0.8, 2 for -1.5, 3 for none of these; every start gets there."""
    chart = ns.chart(normal_form(0.5, -0.8), {"mu": [-0.1, 0.1], "tau_r": [-1.5, -0.8]})
    assert chart.period_number.values.tolist() == [[1, 1], [2, 1]]
    grid = {"x": np.linspace(-1.0, 1.0, 5), "y": np.linspace(-1.0, 1.0, 4)}
    basins = ns.basins(normal_form(0.5, -1.5), grid)
    assert (basins.label.values == 0).all()
    assert basins.period_number.values.tolist() == [2]


def test_the_exponent_of_chaos_behind_a_collision():
    """b = -2.5 and a = b / (1 - b^2): the third image of the border is the fixed point, three intervals are mapped
    onto one another, and the density is uniform on each."""
    b = -2.5
    a = b / (1 - b**2)
    left, middle = -(1 + b), 1 / (1 - b)
    share = left / (left + middle)  # of the images of the right interval, those to the left of the border
    expected = 0.5 * (np.log(-b) + share * np.log(a) + (1 - share) * np.log(-b))
    found = ns.lyapunov(normal_form(a, b, mu=1.0), periods=200_000, start={"x": 0.31})
    exponent, error = float(found.exponents[0]), float(found.standard_error[0])
    assert exponent == pytest.approx(expected, abs=max(5 * error, 1e-3))


# ----------------------------------------------------------------------------------------------------------------
# The bouncing ball


@pytest.mark.parametrize(("alpha", "fold", "flip"), [(0.5, 3.141593, 4.344), (0.8, 1.256637, 3.813)])
def test_the_bouncing_ball_has_the_published_fold_and_flip(alpha: float, fold: float, flip: float):
    start = {"theta": 4.2, "v": 2 * np.pi}
    orbit = ns.find_orbit(models.bouncing_ball_map(alpha=alpha, gamma=0.5 * (fold + flip)), start=start)
    assert orbit.u[1] == pytest.approx(2 * np.pi, abs=1e-11)
    assert np.prod(orbit.floquet_multipliers) == pytest.approx(alpha, abs=1e-11)
    table = ns.special_points(ns.continue_orbit(orbit, "gamma", (1.0, 5.0)))
    at = {str(kind): float(value) for kind, value in zip(table.kind.values, table.gamma.values, strict=True)}
    assert at["fold"] == pytest.approx(2 * np.pi * (1 - alpha), abs=1e-9)
    assert at["fold"] == pytest.approx(fold, abs=1e-6)
    assert at["flip"] == pytest.approx(2 * np.hypot(np.pi * (1 - alpha), 1 + alpha), abs=1e-9)
    assert at["flip"] == pytest.approx(flip, abs=1e-3)
