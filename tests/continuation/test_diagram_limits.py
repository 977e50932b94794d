"""Limits of a bifurcation diagram, and ends of curves and marches, on maps whose branches are closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = pytest.mark.physics


def logistic() -> ns.Map:
    """x -> r x (1 - x): flips at 3 and 1 + sqrt 6."""
    return ns.Map(states=["x"], parameters={"r": 2.9}, branches=[ns.Branch(lambda u, p: (p.r * u.x * (1 - u.x),))])


def diagram(depth: int, max_period: int, system: Any = None, limits: tuple[float, float] = (2.9, 3.5)) -> Any:
    return ns.bifurcation_diagram(
        system or logistic(), "r", limits, n=31, start={"x": 0.4}, depth=depth, max_period=max_period, progress=False
    )


@pytest.mark.parametrize(("depth", "parents"), [(0, [-1, -1, -1]), (1, [-1, 0, -1]), (2, [-1, 0, 1])])
def test_depth_counts_the_switches_in_a_row(depth: int, parents: list[int]) -> None:
    """Periods 1, 2, 4: what no switch reaches is found in the sweep (-1)."""
    found = diagram(depth, 4)
    assert found["period_number"].values.tolist() == [1, 2, 4]
    assert found["parent"].values.tolist() == parents
    flips = np.unique(ns.special_points(found)["r"].values.round(9))
    assert flips == pytest.approx([3.0, 1 + np.sqrt(6)], abs=1e-8)


@pytest.mark.parametrize(("longest", "periods"), [(1, [1]), (2, [1, 2]), (3, [1, 2])])
def test_no_branch_is_longer_than_the_longest_period(longest: int, periods: list[int]) -> None:
    assert diagram(3, longest)["period_number"].values.tolist() == periods


def test_a_longer_orbit_beside_a_branch_is_another_branch() -> None:
    """x = 100 r is fixed, and beside it, at +-1/2 of a range of 100, lies a cycle of two: neither is the other."""

    def inside(u: Any, p: Any) -> Any:
        return (100 * p.r - (p.r - 0.5) * (u.x - 100 * p.r),)

    def outside(side: int) -> Any:  # side / 2 goes to -side / 2
        return lambda u, p: (100 * p.r - side * 0.5 - 0.3 * (u.x - 100 * p.r - side * 0.5),)

    system = ns.Map(
        states=["x"],
        parameters={"r": 1.0},
        scale={"x": 100.0},
        branches=[
            ns.Branch(outside(-1), when="low < 0 and high < 0"),
            ns.Branch(inside, when="low > 0 and high < 0"),
            ns.Branch(outside(1), when="low > 0 and high > 0"),
        ],
        indicators={"low": lambda u, p: u.x - 100 * p.r + 0.25, "high": lambda u, p: u.x - 100 * p.r - 0.25},
    )
    found = ns.bifurcation_diagram(
        system, "r", (1.0, 2.0), n=21, start={"x": 100.0}, depth=0, max_period=2, progress=False
    )
    assert found["period_number"].values.tolist() == [1, 2]
    assert found["parent"].values.tolist() == [-1, -1]
    second = found.isel(point=np.flatnonzero(found["branch"].values == 1))
    away = np.sort(second["returns"].squeeze().values - 100 * second["r"].values[:, None], axis=1)
    assert away == pytest.approx(np.tile([-0.5, 0.5], (len(away), 1)), abs=1e-9)


@pytest.mark.parametrize(("a", "b"), [(0.995, 2.0), (2.0, 0.995), (0.998, 0.997), (0.997, 0.998)])
def test_a_curve_that_leaves_by_a_corner_ends_at_the_nearer_edge(a: float, b: float) -> None:
    """x -> x + a - b - x^2 has its folds at a = b: the curve ends where the first of both is at its edge."""
    system = ns.Map(
        states=["x"], parameters={"a": 0.5, "b": 0.4}, branches=[ns.Branch(lambda u, p: (u.x + p.a - p.b - u.x**2,))]
    )
    branch = ns.continue_orbit(ns.find_orbit(system, start={"x": 0.3}, progress=False), "a", (0.2, 0.8))
    table = ns.special_points(branch)
    fold = table.isel(special=int(np.flatnonzero(table["kind"].values == "fold")[0]))
    curve = ns.continue_curve(fold, {"a": (0.1, a), "b": (0.1, b)}, step=0.05)
    assert curve["a"].values == pytest.approx(curve["b"].values, abs=1e-10)
    assert float(curve["a"].max()) == pytest.approx(min(a, b), abs=1e-12)
    assert float(curve["a"].min()) == pytest.approx(0.1, abs=1e-12)
