"""Charts against closed forms where the way they are asked for could mislead them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import nonsmooth as ns
from nonsmooth.errors import SystemDefinitionError

QUIET = {"progress": False}
OMEGA, DAMPING = np.array([2.0, 1.5, 0.7]), np.array([0.5, 0.2, 0.3])  # in no order


@pytest.fixture(scope="module")
def linear() -> ns.System:
    return ns.System(
        states=["x", "v"],
        parameters={"omega": 1.3, "c": 0.2, "force": 1.0},
        modes={"only": lambda t, u, p: (u.v, -u.x - p.c * u.v + p.force * np.cos(p.omega * t))},
        indicators={"speed": lambda t, u, p: u.v},
    )


def amplitude(omega: np.ndarray, c: np.ndarray) -> np.ndarray:
    return 1.0 / np.hypot(1.0 - omega**2, c * omega)


@pytest.mark.parametrize("options", [{}, {"carry": {"omega": "up"}}, {"carry": {"c": "down"}}, {"method": "rkf45"}])
def test_values_in_any_order(linear: ns.System, options: dict) -> None:
    """Extremes of the linear response at the place of their parameters, in either order of the two."""
    expected = amplitude(OMEGA[:, None], DAMPING)
    one = ns.chart(linear, {"omega": OMEGA, "c": DAMPING}, **options, **QUIET)
    other = ns.chart(linear, {"c": DAMPING, "omega": OMEGA}, **options, **QUIET).transpose("omega", "c", "state")
    for plane in (one, other):
        np.testing.assert_allclose(plane["maximum"].sel(state="x"), expected, rtol=1e-8)
        np.testing.assert_allclose(plane["minimum"].sel(state="v"), -expected * OMEGA[:, None], rtol=1e-8)


def test_few_kept_points_are_enough_for_short_periods(linear: ns.System) -> None:
    plane = ns.chart(linear, {"omega": OMEGA, "c": DAMPING}, keep=3, **QUIET)
    assert (plane["period_number"] == 1).all()


def test_exponents_do_not_depend_on_the_section(linear: ns.System) -> None:
    """-c / 2, also where returns to a surface come at other phases of the forcing."""
    for section in (ns.Stroboscopic(0.3), ns.Poincare("speed")):
        plane = ns.chart(
            linear, {"omega": [1.3], "c": DAMPING}, section=section, lyapunov=400, transient=200, keep=20, **QUIET
        )
        np.testing.assert_allclose(plane["lyapunov"].values[0], -DAMPING / 2, rtol=5e-3)


def test_extremes_are_those_of_the_cycle_alone(linear: ns.System) -> None:
    """Kept returns that begin before the motion has settled leave no mark: 40 returns passed over, then 60 kept."""
    for method in ("auto", "taylor"):
        plane = ns.chart(
            linear.with_parameters(omega=3.0), {"omega": [3.0], "c": [0.5]}, start={"x": 1e5}, method=method, **QUIET
        )
        assert float(plane["maximum"].sel(state="x")[0, 0]) == pytest.approx(amplitude(3.0, 0.5), rel=1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (2, 3)])
def test_small_charts_refined(linear: ns.System, shape: tuple[int, int]) -> None:
    """Some points are computed however small the part; every label is right."""
    grid = {"omega": np.linspace(2.0, 1.0, shape[0]), "c": np.linspace(0.5, 0.2, shape[1])}
    plane = ns.chart(linear, grid, refine=0.1, **QUIET)
    assert int(plane["computed"].sum()) >= 1
    assert (plane["period_number"] == 1).all() and (plane["status"] == 0).all()


def test_falling_axes_refined() -> None:
    """The picture does not depend on the sense in which values are given."""
    system = ns.models.discontinuous_support(g=0.02)
    omega, rho = np.linspace(3, 7, 24), np.linspace(0.1, 0.3, 20)
    falling = ns.chart(system, {"omega": omega[::-1], "rho": rho[::-1]}, refine=0.6, extremes=False, **QUIET)
    whole = ns.chart(system, {"omega": omega, "rho": rho}, extremes=False, **QUIET)
    same = falling.sortby(["omega", "rho"])["contacts_per_period"] == whole["contacts_per_period"]
    assert float(same.mean()) > 0.98


def test_starts_count_the_roots_they_reach() -> None:
    """x -> a x - b x^3: 0 for a < 1, +-sqrt((a - 1) / b) for a in (1, 2), two cycles of period 2 for a above 2."""
    system = ns.System(
        states=["x"],
        parameters={"a": 1.5, "b": 1.0},
        modes={"rest": lambda t, u, p: 0 * u.x},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: p.a * u.x - p.b * u.x**3)],
        period=1.0,
    )
    starts = [{"x": -0.3}, {"x": 0.2}, {"x": 0.5}]
    plane = ns.chart(system, {"a": [0.5, 1.9, 1.5, 2.1], "b": [1.0, 2.0]}, start=starts, **QUIET)
    assert plane["n_attractors"].values.T.tolist() == [[1, 2, 2, 2]] * 2
    assert plane["period_number"].values[:, 0].tolist() == [[1] * 3, [1] * 3, [1] * 3, [2] * 3]
    roots = np.sqrt(np.array([0.9, 0.5]))
    np.testing.assert_allclose(plane["maximum"].values[1:3, 0, :, 0], roots[:, None] * [-1, 1, 1], rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"max_period": 60}, "raise keep"),
        ({"keep": 9, "max_period": 9}, "up to 8"),
        ({"lyapunov": 100.5}, "whole number"),
    ],
)
def test_what_a_window_cannot_show_is_told(linear: ns.System, options: dict, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        ns.chart(linear, {"omega": [1.0], "c": [0.1]}, **options, **QUIET)


def test_a_value_that_cannot_be_is_told_before_anything_is_computed(tmp_path) -> None:
    system = ns.models.discontinuous_support()
    store = tmp_path / "chart.zarr"
    with pytest.raises(SystemDefinitionError, match="m = 0"):
        ns.chart(system, {"g": np.linspace(0, 0.01, 50), "m": np.linspace(1, 0, 50)}, store=store, **QUIET)
    assert not store.exists()


@pytest.mark.parametrize(("rising", "every", "period"), [(None, 1, 2), (None, 2, 1), (None, 3, 2), (True, 3, 1)])
def test_returns_that_are_passed_over_change_the_count_only(rising: bool | None, every: int, period: int) -> None:
    """r' = a r (1 - r^2) (4 - r^2) (9 - r^2): circles r = 1 and 3, at r = 1 with the exponent -48 a."""

    def field(t: Any, u: Any, p: Any) -> Any:
        r2 = u.x**2 + u.y**2
        rate = p.a * (1 - r2) * (4 - r2) * (9 - r2)
        return u.x * rate - p.w * u.y, u.y * rate + p.w * u.x

    system = ns.System(
        states=["x", "y"],
        parameters={"a": 0.02, "w": 1.0},
        modes={"only": field},
        indicators={"height": lambda t, u, p: u.y},
    )
    plane = ns.chart(
        system,
        {"a": [0.01, 0.02], "w": [1.0]},
        start=[{"x": 1.5}, {"x": 0.2, "y": -1.2}, {"x": -0.5, "y": 0.3}],
        section=ns.Poincare("height", rising=rising, every=every),
        lyapunov=400,
        **QUIET,
    )
    assert (plane["period_number"] == period).all() and (plane["n_attractors"] == 1).all()
    np.testing.assert_allclose(plane["lyapunov"].values[:, 0], [[-0.48] * 3, [-0.96] * 3], rtol=1e-3)
    np.testing.assert_allclose(plane["maximum"], 1.0, rtol=1e-8)


@pytest.mark.parametrize("method", ["exact", "taylor"])
@pytest.mark.parametrize("phase", [0.0, 0.3, 0.5])
def test_a_section_at_the_phase_of_a_transition_lies_behind_it(method: str, phase: float) -> None:
    """x'' = -k x, turned into -(x, v) / 2 once per period at phase 1/2: multipliers of modulus 1/2; and a
    force that changes its sign at phases 0 and 1/2: its extremes do not depend on the phase of the section.

    (Forces of size 0: a shape of code that is there.)"""
    section = ns.Stroboscopic(phase)
    kicked = ns.System(
        states=["x", "v"],
        parameters={"k": 1.3, "w": 1.0, "A": 0.0},
        modes={"free": lambda t, u, p: (u.v, -p.k * u.x + p.A * np.cos(p.w * t))},
        transitions=[ns.Transition("free", "free", at=0.5, reset=lambda t, u, p: (1.0 - u.x / 2, -u.v / 2))],
        period=lambda p: 2 * np.pi / p.w,
    )
    grid = {"k": [1.3], "w": [0.9, 1.1]}
    plane = ns.chart(kicked, grid, section=section, method=method, lyapunov=200, **QUIET)
    assert (plane["period_number"] == 1).all() and (plane["crossings_per_period"] == 1).all()
    np.testing.assert_allclose(plane["lyapunov"][0], np.log(0.5) * np.array([0.9, 1.1]) / (2 * np.pi), rtol=2e-2)

    force = ns.System(
        states=["x", "v"],
        parameters={"a": 6.0, "w": 1.05, "A": 0.0},
        modes={
            "plus": lambda t, u, p: (u.v, -u.x - 0.2 * u.v + p.a + p.A * np.cos(p.w * t)),
            "minus": lambda t, u, p: (u.v, -u.x - 0.2 * u.v - p.a + p.A * np.cos(p.w * t)),
        },
        transitions=[ns.Transition("plus", "minus", at=0.5), ns.Transition("minus", "plus", at=0.0)],
        period=lambda p: 2 * np.pi / p.w,
    )
    matrix, rest, half = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([6.0, 0.0]), np.pi / 1.05
    there = expm(half * matrix)
    begin = np.linalg.solve(np.eye(2) + there, there @ rest - rest)  # half a period on: rest + there (u - rest) = -u
    swing = np.array([rest + expm(s * matrix) @ (begin - rest) for s in np.linspace(0.0, half, 501)])
    most = np.abs(swing).max(axis=0)
    plane = ns.chart(force, {"a": [6.0], "w": [1.05]}, section=section, method=method, **QUIET)
    assert plane["period_number"].item() == 1 and plane["crossings_per_period"].item() == 2
    np.testing.assert_allclose(plane["maximum"].values[0, 0], most, rtol=1e-3)
    points = ns.poincare(force, section=section, n=3, transient=200, method=method)
    if phase in (0.0, 0.5):
        np.testing.assert_allclose(points["section"].values[-1], begin if phase == 0.0 else -begin, rtol=1e-8)
        assert (points["mode"] == (0 if phase == 0.0 else 1)).all()
