"""Motions far from their states' scale: a change of units changes no number, or it is said that it may."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import nonsmooth as ns

QUIET = {"progress": False}


def cubic(unit: float, **more: object) -> ns.System:
    """x -> a x - x^3 / unit^2 once per period: x / unit follows one map, whatever the unit."""
    return ns.System(
        states=["x"],
        parameters={"a": 2.1, "unit": unit},
        modes={"rest": lambda t, u, p: 0 * u.x},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.a * u.x - u.x**3 / p.unit**2)],
        period=1.0,
        **more,
    )


@pytest.mark.parametrize("unit", [1e-6, 1e-3, 1.0, 1e8])
@pytest.mark.filterwarnings("ignore:.*where a motion counts as rest")
def test_exponents_do_not_depend_on_the_units(unit: float) -> None:
    """a = 1.7: the fixed point x^2 = a - 1 has the multiplier 3 - 2 a; a = 2.1: the cycle of y = x^2, with y1 + y2 = a
    and y1 y2 = 1, has the product of a - 3 y over its two points."""
    a = np.array([1.7, 2.1])
    y = np.roots([1.0, -2.1, 1.0])
    expected = np.log(np.abs([3 - 2 * 1.7, np.sqrt(np.abs(np.prod(2.1 - 3 * y)))]))
    plane = ns.chart(cubic(unit), {"a": a, "unit": [unit]}, start={"x": 0.3 * unit}, lyapunov=200, **QUIET)
    assert plane["period_number"].values.ravel().tolist() == [1, 2]
    np.testing.assert_allclose(plane["lyapunov"].values.ravel(), expected, rtol=1e-3)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_an_unstable_fixed_point_is_left_for_the_attractor_beside_it_in_any_units(unit: float) -> None:
    """x = 0 has the multiplier a = 1.7; fixed points beside it have x^2 = a - 1, and beyond x^2 = a + 1 all diverge."""
    line = ns.sweep(cubic(unit, scale={"x": unit}), "a", [1.7], start={"x": 0.0}, **QUIET)
    assert line["period_number"].item() == 1
    np.testing.assert_allclose(np.abs(line["section"]) / unit, np.sqrt(0.7), rtol=1e-9)


def test_states_far_below_their_scale_are_named() -> None:
    small = cubic(1e-6)
    for call in (
        lambda: ns.basins(
            ns.System(
                states=["x", "y"],
                parameters={"a": 1.0},
                period=1.0,
                modes={"only": lambda t, u, p: (u.x - u.x**3, -p.a * u.y)},
            ),
            {"x": [-1.0, 1.0], "y": [1e-6]},
            transient=50,
            **QUIET,
        ),
        lambda: ns.chart(small, {"a": [1.7], "unit": [1e-6]}, start={"x": 3e-7}, **QUIET),
        lambda: ns.sweep(small, "a", [1.7], start={"x": 3e-7}, **QUIET),
        lambda: ns.basin_fractions(small, "a", [1.7], box={"x": (0.0, 1e-6)}, n_starts=3, **QUIET),
    ):
        with pytest.warns(UserWarning, match=r"give System\(scale="):
            call()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ns.chart(cubic(1.0), {"a": [1.7], "unit": [1.0]}, start={"x": 0.3}, **QUIET)


@pytest.mark.parametrize("method", ["exact", "taylor", "rkf45"])
@pytest.mark.filterwarnings("ignore:.*where a motion counts as rest")
def test_motion_about_a_large_value_has_its_period(method: str) -> None:
    """A linear oscillator about x = x0, driven or at rest: period 1, whatever rounding or steps leave of it."""
    system = ns.System(
        states=["x", "v"],
        parameters={"omega": 1.3, "force": 0.0, "x0": 1.0},
        modes={"only": lambda t, u, p: (u.v, -(u.x - p.x0) - 0.3 * u.v + p.force * np.cos(p.omega * t))},
    )
    grid = {"force": [0.0, 1.0], "x0": [1.0, 1e3, 1e5, 1e7]}
    plane = ns.chart(system, grid, start={"x": 1e5}, method=method, **QUIET)
    assert (plane["period_number"] == 1).all()
    for force in grid["force"]:
        line = ns.sweep(system.with_parameters(force=force), "x0", grid["x0"], method=method, keep=60, **QUIET)
        assert (line["period_number"] == 1).all()
