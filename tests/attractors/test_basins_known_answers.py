"""Basins of systems whose attractors and boundaries are known in closed form, chosen to mislead."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.attractors import basin_fractions, basins
from nonsmooth.attractors.basins_found import Patience
from nonsmooth.flow.sections import Stroboscopic

QUIET = {"progress": False}


@pytest.fixture
def hasty(monkeypatch) -> None:
    """Motion without a period is followed for a tenth of the usual time."""
    short = partial(Patience, candidate=2500, more=300, exponent=400)
    for module in (basins, basin_fractions):
        monkeypatch.setattr(module, "Patience", short)


def kicked(reset: Callable[..., Any], **parameters: float) -> ns.System:
    """(x, y) stands still but for a map once per period."""
    return ns.System(
        states=["x", "y"],
        parameters=parameters,
        modes={"rest": lambda t, u, p: (0 * u.x, 0 * u.y)},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=reset)],
        period=1.0,
    )


def flow(field: Callable[..., Any], states: list[str], **parameters: float) -> ns.System:
    return ns.System(states=states, parameters=parameters, modes={"only": field}, period=1.0)


def test_the_boundary_of_a_product_of_wells_is_a_pair_of_lines() -> None:
    """x' = x - x^3, y' = y - y^3: four corners (+-1, +-1); the boundaries are x = 0 and y = 0."""
    system = flow(lambda t, u, p: (u.x - p.a * u.x**3, u.y - u.y**3), ["x", "y"], a=1.0)
    x, y = np.linspace(-1.3, 1.0, 8), np.linspace(-0.75, 1.7, 7)
    found = ns.basins(system, {"x": x, "y": y}, **QUIET)
    corner = found["section"].values[found["label"].values]
    np.testing.assert_allclose(corner[..., 0], np.sign(x)[:, None] + 0 * y, atol=1e-9)
    np.testing.assert_allclose(corner[..., 1], np.sign(y) + 0 * x[:, None], atol=1e-9)
    assert found["confirmed"].values.tolist() == [1] * 4
    np.testing.assert_allclose(found["multiplier"], np.exp(-2.0), rtol=1e-6)
    np.testing.assert_allclose(found["lyapunov"], -2.0, rtol=1e-6)


def test_a_slow_departure_leaves_no_mark_on_the_attractor() -> None:
    """A start 2e-16 beside the fixed point of z' = x - z, far from it in z: its extremes are those of the point."""
    system = flow(lambda t, u, p: (u.x - p.a * u.x**3, -u.y, u.x - u.z), ["x", "y", "z"], a=1.0)
    found = ns.basins(system, {"x": [-1.0, 2e-16, 1.0], "y": [0.0, 0.1]}, fixed={"z": 5.0}, **QUIET)
    assert found.sizes["attractor"] == 2
    np.testing.assert_allclose(np.ptp([found["maximum"], found["minimum"]], axis=0), 0.0, atol=1e-9)


def test_the_least_shock_covers_the_states_outside_the_plane() -> None:
    """From (-1, 0, -1) to the plane z = 5 and over the boundary x = 0: at least sqrt(1 + 36), met at x = 0.1."""
    system = flow(lambda t, u, p: (u.x - p.a * u.x**3, -u.y, u.x - u.z), ["x", "y", "z"], a=1.0)
    found = ns.basins(system, {"x": [-1.5, -0.1, 0.1, 1.5], "y": [0.0]}, fixed={"z": 5.0}, **QUIET)
    left = int(found["label"][0, 0])
    assert float(found["minimal_shock"][left]) == pytest.approx(np.hypot(1.1, 6.0))
    assert float(found["minimal_shock"][1 - left]) == pytest.approx(np.hypot(1.1, 4.0))


def test_cycles_that_differ_by_a_shift_in_time_are_two() -> None:
    """x -> -(3 x - x^3) / 2 has the cycle +1, -1. Kicked twice per period it is two fixed points of equal extremes,
    kicked once it is one cycle of period 2."""

    def kick(t: Any, u: Any, p: Any) -> Any:
        return -(1.5 * u.x - 0.5 * u.x**3), p.b * u.y

    twice = ns.System(
        states=["x", "y"],
        parameters={"b": 0.5, "a": 0.0},
        modes={"rest": lambda t, u, p: (0 * u.x, 0 * u.y)},
        transitions=[ns.Transition("rest", "rest", at=phase, reset=kick) for phase in (0.25, 0.75)],
        period=1.0,
    )
    found = ns.basins(twice, {"x": [-0.8, -0.3, 0.3, 0.8], "y": [0.0, 0.5]}, **QUIET)
    assert found["period_number"].values.tolist() == [1, 1]
    np.testing.assert_array_equal(found["label"].values, np.repeat([[0], [0], [1], [1]], 2, axis=1))
    starts = [[-0.8, 0.0], [0.3, 0.0], [0.8, 0.1]]
    plane = ns.chart(twice, {"a": [0.0, 1.0], "b": [0.2, 0.5]}, start=starts, **QUIET)
    assert (plane["n_attractors"] == 2).all()

    once = kicked(kick, b=0.5, a=0.0)
    found = ns.basins(once, {"x": [-0.8, -0.3, 0.3, 0.8], "y": [0.0, 0.5]}, **QUIET)
    assert found["period_number"].values.tolist() == [2] and (found["label"] == 0).all()
    plane = ns.chart(once, {"a": [0.0, 1.0], "b": [0.2, 0.5]}, start=starts, **QUIET)
    assert (plane["n_attractors"] == 1).all() and (plane["period_number"] == 2).all()


def test_two_modes_at_the_same_section_point_are_two_attractors() -> None:
    """A relay that never switches on its attractor: the same motion in either mode."""
    relay = ns.System(
        states=["x", "y"],
        parameters={"w": 1.0, "force": 0.5, "h": 1.0},
        modes={name: lambda t, u, p: (p.force * np.cos(p.w * t) - u.x, -u.y) for name in ("up", "down")},
        indicators={"high": lambda t, u, p: u.x - p.h},
        transitions=[ns.Transition("up", "down", when="high > 0")],
    )
    found = ns.basins(relay, {"x": [-2.0, 0.5, 2.0], "y": [0.0]}, **QUIET)
    assert found["label"].values.ravel().tolist() == [0, 0, 1]
    np.testing.assert_allclose(found["section"][0], found["section"][1], atol=1e-12)


def test_memory_goes_on_where_a_run_goes_on() -> None:
    """The side on which a run began is kept in memory, and the motion goes to it."""
    system = ns.System(
        states=["x", "y"],
        parameters={"a": 1.0},
        memory={"side": 0.0},
        modes={"wait": lambda t, u, p: (0 * u.x, -p.a * u.y), "run": lambda t, u, p: (p.side - u.x, -p.a * u.y)},
        transitions=[
            ns.Transition("wait", "run", at=0.5, write={"side": lambda t, u, p: u.x / np.sqrt(u.x**2 + 1e-20)})
        ],
        period=1.0,
    )
    found = ns.basins(system, {"x": [-2.0, -0.5, 0.5], "y": [0.0, 1.0]}, **QUIET)
    assert found["confirmed"].values.tolist() == [1, 1]
    np.testing.assert_allclose(found["section"].sel(state="x"), [-1.0, 1.0], atol=1e-9)
    assert found["label"].values[:, 0].tolist() == [0, 0, 1]


@pytest.mark.parametrize("stiffening", [0.0, 1.0])
def test_a_start_late_in_the_period_is_on_the_force_of_that_time(stiffening: float) -> None:
    """A force +A, then -A in the second half: half a period later all is mirrored, x -> -x, v -> -v. Exact, Taylor."""
    system = ns.System(
        states=["x", "v"],
        parameters={"w": 1.05, "a": 6.0, "s": stiffening},
        modes={
            "plus": lambda t, u, p: (u.v, -u.x - stiffening * u.x**3 - 0.2 * u.v + p.a),
            "minus": lambda t, u, p: (u.v, -u.x - stiffening * u.x**3 - 0.2 * u.v - p.a),
        },
        transitions=[ns.Transition("plus", "minus", at=0.5), ns.Transition("minus", "plus", at=0.0)],
        period=lambda p: 2 * np.pi / p.w,
    )
    axis = np.linspace(-2.0, 2.0, 5)
    for phase in (0.0, 0.2):
        one, other = (
            ns.basins(system, {"x": axis, "v": axis}, section=Stroboscopic(phase + half), **QUIET) for half in (0, 0.5)
        )
        assert one.sizes["attractor"] == (2 if stiffening else 1)
        ends = one["section"].values[one["label"].values]
        mirrored = -other["section"].values[other["label"].values][::-1, ::-1]
        np.testing.assert_allclose(ends, mirrored, atol=1e-6)


def test_motion_without_damping_has_no_attractor(hasty) -> None:
    """Every start of a linear oscillator keeps a torus of its own."""
    system = ns.System(
        states=["x", "v"],
        parameters={"w": 1.0, "k": 2.3},
        modes={"only": lambda t, u, p: (u.v, -p.k * u.x + np.cos(p.w * t))},
    )
    found = ns.basins(system, {"x": [-1.0, 0.0, 1.0], "v": [0.0, 0.7]}, **QUIET)
    assert found.sizes["attractor"] == 0 and (found["label"] == -1).all()


def test_a_chaotic_sea_is_no_attractor() -> None:
    """(x, y) -> (1 - y + |x|, x) (smoothed) keeps areas; its exponent is positive, and neighbours stay in the sea."""
    found = ns.basins(
        kicked(lambda t, u, p: (1 - u.y + np.sqrt(u.x**2 + p.e), u.x), e=1e-4), {"x": [-1.0, 3.0], "y": [2.0]}, **QUIET
    )
    assert found.sizes["attractor"] == 0 and (found["label"] == -1).all()


def test_a_torus_is_one_attractor_with_the_exponent_zero(hasty) -> None:
    """r -> (3 r - r^3) / 2 on circles, turned by an angle that closes at no whole number of periods."""
    angle = np.pi * (np.sqrt(5.0) - 1.0)

    def turn(t: Any, u: Any, p: Any) -> Any:
        f = 1.5 - 0.5 * (u.x**2 + u.y**2)
        return f * (p.c * u.x - p.s * u.y), f * (p.s * u.x + p.c * u.y)

    system = kicked(turn, c=np.cos(angle), s=np.sin(angle))
    found = ns.basins(system, {"x": [-1.0, 0.3, 1.2], "y": [0.1, 0.7]}, **QUIET)
    assert found["period_number"].values.tolist() == [0] and (found["label"] == 0).all()
    assert abs(float(found["lyapunov"][0])) < 1e-3
    np.testing.assert_allclose(np.hypot(*found["section_points"].values.T), 1.0, atol=1e-9)


def test_two_chaotic_attractors_by_symmetry(hasty) -> None:
    """x -> a x - x^3 with a = 2.4 keeps the sign of x on its attractors: one for either sign, mirror images."""
    system = kicked(lambda t, u, p: (p.a * u.x - u.x**3, 0.5 * u.y), a=2.4)
    found = ns.basins(system, {"x": [-0.9, -0.4, 0.4, 0.9], "y": [0.1]}, **QUIET)
    assert found["label"].values.ravel().tolist() == [0, 0, 1, 1]
    assert (found["lyapunov"] > 0.2).all()
    np.testing.assert_allclose(found["maximum"][0, 0], -found["minimum"][1, 0], atol=5e-3)


def test_chaos_that_fills_an_area_is_counted_once(hasty) -> None:
    """Two such maps beside each other fill squares thinly: one for each pair of signs, however many starts."""
    system = kicked(lambda t, u, p: (p.a * u.x - u.x**3, p.a * u.y - u.y**3), a=2.4)
    x, y = np.array([-0.9, -0.7, -0.2, 0.3, 0.5, 1.1]), np.array([-0.8, -0.4, 0.9])
    found = ns.basins(system, {"x": x, "y": y}, **QUIET)
    assert found.sizes["attractor"] == 4
    signs = np.sign(found["section"].values[found["label"].values])
    np.testing.assert_array_equal(signs[..., 0], np.sign(x)[:, None] + 0 * y)
    np.testing.assert_array_equal(signs[..., 1], np.sign(y) + 0 * x[:, None])


def test_chaos_and_tori_in_four_dimensions(hasty) -> None:
    """A chaotic map and three states that follow it: an attractor for either sign; two circles with angles of their
    own: one."""
    names = ["x", "y", "z", "w"]

    def rest(t: Any, u: Any, p: Any) -> Any:
        return 0 * u.x, 0 * u.y, 0 * u.z, 0 * u.w

    def system(kick: Any, **parameters: float) -> ns.System:
        return ns.System(
            states=names,
            parameters=parameters,
            modes={"rest": rest},
            period=1.0,
            transitions=[ns.Transition("rest", "rest", at=0.5, reset=kick)],
        )

    chaos = system(
        lambda t, u, p: (p.a * u.x - u.x**3, 0.3 * u.y + 0.2 * u.x, 0.5 * u.z + 0.3 * u.x, 0.8 * u.w + 0.2 * u.x), a=2.4
    )
    found = ns.basins(chaos, {"x": [-0.9, 0.4], "y": [-0.5, 0.5]}, **QUIET)
    assert found["label"].values.tolist() == [[0, 0], [1, 1]] and found["chaotic"].values.tolist() == [1, 1]

    def turn(t: Any, u: Any, p: Any) -> Any:
        f, g = 1.5 - 0.5 * (u.x**2 + u.y**2), 1.5 - 0.5 * (u.z**2 + u.w**2)
        return (
            f * (p.c * u.x - p.s * u.y),
            f * (p.s * u.x + p.c * u.y),
            g * (p.c2 * u.z - p.s2 * u.w),
            g * (p.s2 * u.z + p.c2 * u.w),
        )

    a, b = np.pi * (np.sqrt(5.0) - 1.0), 2 * np.pi * np.sqrt(2.0)
    torus = system(turn, c=np.cos(a), s=np.sin(a), c2=np.cos(b), s2=np.sin(b))
    found = ns.basins(torus, {"x": [0.3, 1.2], "y": [0.1, 0.7]}, fixed={"z": 0.5}, **QUIET)
    assert (found["label"] == 0).all() and found["chaotic"].values.tolist() == [0]
    assert abs(float(found["lyapunov"][0])) < 1e-3


def test_motion_that_escapes_late_is_no_attractor() -> None:
    """x -> r x (1 - x) above r = 4 leaves after some hundred kicks from almost every start."""
    system = kicked(lambda t, u, p: (p.r * u.x * (1 - u.x), 0.3 * u.y), r=4.0001)
    found = ns.basins(system, {"x": np.linspace(0.01, 0.99, 8), "y": [0.0]}, **QUIET)
    assert found.sizes["attractor"] == 0 and (found["label"] < 0).all()


def test_a_cycle_longer_than_max_period_is_found_and_confirmed(hasty) -> None:
    """x -> r x (1 - x) at r = 3.5: the cycle of period 4 looked for up to period 3; multiplier of the closed form
    prod |r (1 - 2 x_i)| over its points."""
    system = kicked(lambda t, u, p: (p.r * u.x * (1 - u.x), 0.3 * u.y), r=3.5)
    found = ns.basins(system, {"x": [0.2, 0.4], "y": [0.1]}, max_period=3, **QUIET)
    assert found["period_number"].values.tolist() == [4] and found["confirmed"].values.tolist() == [1]
    points = found["section_points"].sel(state="x").values
    expected = np.abs(np.prod(3.5 * (1 - 2 * points)))
    assert float(found["multiplier"][0]) == pytest.approx(expected, rel=1e-6)
    assert float(found["lyapunov"][0]) == pytest.approx(np.log(expected) / 4, rel=1e-6)


@pytest.mark.parametrize("a", [0.05, 1.0])
def test_an_autonomous_cycle_has_the_multiplier_of_its_radius(a: float) -> None:
    """r' = a r (1 - r^2): the multiplier of the circle is exp(-4 pi a), however strongly it draws in."""
    system = ns.System(
        states=["x", "y"],
        parameters={"a": a},
        modes={
            "only": lambda t, u, p: (p.a * u.x * (1 - u.x**2 - u.y**2) - u.y, p.a * u.y * (1 - u.x**2 - u.y**2) + u.x)
        },
        indicators={"height": lambda t, u, p: u.y},
    )
    found = ns.basins(system, {"x": [-2.0, 0.5], "y": [0.1, 0.7]}, section=ns.Poincare("height"), **QUIET)
    assert (found["label"] == 0).all()
    assert float(found["multiplier"][0]) == pytest.approx(np.exp(-4 * np.pi * a), rel=1e-2, abs=2e-8)
    assert float(found["lyapunov"][0]) == pytest.approx(-2 * a, rel=1e-3)


def test_returns_that_are_passed_over_are_refused() -> None:
    """Every other return of a cycle with two of them: which one, depends on the start; that is no basin."""
    with pytest.raises(ValueError, match="leave `every` out"):
        ns.basins(
            ns.models.relief_valve(), {"y1": [1.0], "y3": [5.0]}, section=ns.Poincare("lift_velocity", every=2), **QUIET
        )


def test_starts_beyond_a_stop_say_so() -> None:
    found = ns.basins(ns.models.impact_oscillator(), {"x": [0.0, 2.0], "v": [0.0, 0.7]}, **QUIET)
    assert found["label"].values.tolist() == [[0, 0], [-1, -1]]
    assert found["status"].values[0].tolist() == [0, 0] and (found["status"].values[1] == 7).all()
    shares = ns.basin_fractions(
        ns.models.impact_oscillator(), "d", [1.0], box={"x": (0.9, 1.1)}, n_starts=40, seed=1, **QUIET
    )
    assert float(shares["failed"][0]) == float(shares["not_converged"][0]) > 0


def test_a_number_ends_where_its_branch_ends() -> None:
    """x -> x + (mu + x - x^3) / 4: the left root ends at mu = 2 / sqrt(27), and what takes its starts is another."""
    system = ns.System(
        states=["x"],
        parameters={"mu": 0.0},
        modes={"rest": lambda t, u, p: 0 * u.x},
        transitions=[ns.Transition("rest", "rest", at=0.5, reset=lambda t, u, p: u.x + (p.mu + u.x - u.x**3) / 4)],
        period=1.0,
    )
    mu = np.linspace(-0.6, 0.6, 9)
    found = ns.basin_fractions(system, "mu", mu, box={"x": (-1.5, -1.4)}, n_starts=4, **QUIET)
    left = mu < 2 / np.sqrt(27)
    assert found.sizes["attractor"] == 2
    np.testing.assert_array_equal(found["fraction"].values, np.stack([left, ~left], axis=1))
    root = found["section"].values[:, :, 0]
    assert (root[left, 0] < 0).all() and np.isnan(root[~left, 0]).all() and (root[~left, 1] > 1).all()


def test_a_number_goes_through_flips(hasty) -> None:
    """Along x -> r x (1 - x) one number from period 1 to 2, 4 and chaos."""
    system = kicked(lambda t, u, p: (p.r * u.x * (1 - u.x), 0.3 * u.y), r=3.0)
    found = ns.basin_fractions(
        system, "r", [2.8, 3.2, 3.5, 3.75], box={"x": (0.1, 0.9), "y": (0.0, 0.1)}, n_starts=5, **QUIET
    )
    assert found["period_number"].values.tolist() == [[1], [2], [4], [0]]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fixed": [1.0]}, "fixed="),
        ({"max_period": 60}, "raise keep"),
        ({"section": ns.Poincare("penetration")}, "Stroboscopic"),
    ],
)
def test_more_bad_input_is_told_at_the_door(options, message) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        ns.basins(ns.models.discontinuous_support(), {"x": [0.0], "v": [0.0]}, **options, **QUIET)
