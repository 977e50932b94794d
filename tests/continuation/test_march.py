"""The march itself, on curves with a closed form: no orbit, no kernel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.continuation.branches.following import curve_of
from nonsmooth.continuation.march.event import BranchPoint, Event, Fold, Met, Step, locate
from nonsmooth.continuation.march.march import Limits, March, Policy, march
from nonsmooth.continuation.problems.curve import Curve, Point, tangents
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.continuation.problems.orbits import Orbits

Array = np.ndarray


@dataclass
class Solved:
    X: Array
    F: Array
    J: Array


class Zero(Event):
    """The state passes zero."""

    name = "zero"

    def number(self, point: Any) -> float:
        return float(point.X[0])


class Half(Event):
    """A boundary at x = 1/2, behind which another equation holds."""

    name = "half"

    def number(self, point: Any) -> float:
        return float(point.curve.margins(point)[0])

    def happened(self, step: Step, was: float, now: float) -> bool:
        return now < 0.0 <= was


class Plane(Curve[Point]):
    """f(x, p) = 0, in units that differ."""

    def __init__(self, f: Callable[[float, float], tuple[float, float, float]], beyond: Any = None) -> None:
        self.f, self.next, self.scale = f, beyond, np.array([2.0, 0.5])

    def evaluate(self, Y: Array) -> Solved:
        f, f_x, f_p = self.f(*(Y * self.scale))
        return Solved(Y * self.scale, np.array([f]), np.array([[f_x, f_p]]) * self.scale)

    def fill(self, solved: Solved, matrix: Array) -> None:
        matrix[:] = solved.J

    def residual(self, solved: Solved) -> Array:
        return solved.F

    def moved(self, solved: Solved, Y: Array) -> Solved:
        return self.evaluate(Y)

    def margins(self, point: Point) -> Array:
        return np.array([point.X[0] - 0.5 if self.next else np.inf])


class Along(Policy):
    kinds = (Fold(), BranchPoint(), Zero())
    boundaries = (Half(),)

    def behind(self, found: March, met: list[Met]) -> Point | None:
        point = met[0].point
        found.mark(met[0].name, point)
        return point.curve.next.at_parameter(point.X / point.curve.scale, point.value).facing(point.tangent[-1])


def circle() -> Plane:
    return Plane(lambda x, p: (x * x + p * p - 1.0, 2 * x, 2 * p))


def run(curve: Plane, x: float, p: float, way: float, *, low: float = -4.0, high: float = 4.0, **more: Any) -> March:
    first = curve.at_parameter(np.array([x, p]) / curve.scale, p)
    assert first is not None
    first = first.facing(way)
    closed = curve.landmark(first) if more.pop("closes", False) else None
    return march(first, Limits(((-1, low, high),), 0.05, more.pop("points", 500), closed), Along())


def test_a_circle_closes_with_two_folds() -> None:
    """x^2 + p^2 = 1: folds at p = 1 and -1, where x passes zero too; the last point is the first."""
    found = run(circle(), -0.8, 0.6, 1.0, closes=True)
    assert found.ending == "closed"
    assert sorted((one.kind, round(one.point.value)) for one in found.special) == [
        ("fold", -1),
        ("fold", 1),
        ("zero", -1),
        ("zero", 1),
    ]
    for one in found.special:
        assert one.point.X == pytest.approx([0.0, np.sign(one.point.value)], abs=1e-9)
    X = np.array([row.point.X for row in found.rows])
    assert np.hypot(*X.T) == pytest.approx(1.0, abs=1e-14)
    assert X[-1] == pytest.approx([-0.8, 0.6], abs=1e-12)


@pytest.mark.parametrize("beside", [0.0, 0.003])
def test_a_branch_that_comes_back_in_another_word_closes(beside: float) -> None:
    """The part of a point that all words have tells it, at the first parameter; what lies beside it is another point.

    A chord of the longest step, 0.05, lies nearer to the one 0.003 away than three tenths of its length."""
    curve = circle()
    first = curve.at_parameter(np.array([-0.8, 0.6]) / curve.scale, 0.6).facing(1.0)
    limits = Limits(((-1, -4.0, 4.0),), 0.05, 500, ("another word", first.X, first.Y + np.array([beside, 0.0])))
    found = march(first, limits, Along())
    assert found.ending == ("points" if beside else "closed")
    if not beside:
        assert found.rows[-1].point.X == pytest.approx([-0.8, 0.6], abs=1e-12)


class TwiceRound(Plane):
    """A closed curve that goes twice round a circle: at each angle its two strands lie 2 r apart.

    (rho - 1 + i z)^2 = r^2 exp(i phi), over the radius squared."""

    def __init__(self, r: float) -> None:
        self.r, self.scale = r, np.ones(3)

    def evaluate(self, Y: Array) -> Solved:
        x, z, y = Y
        rho, r = np.hypot(x, y), self.r
        a, c, s = rho - 1.0, x / rho, y / rho
        F = np.array([a * a - z * z - r * r * c, 2 * a * z - r * r * s]) / r**2
        rows = [
            [2 * a * c - r * r * s * s / rho, -2 * z, 2 * a * s + r * r * s * c / rho],
            [2 * z * c + r * r * s * c / rho, 2 * a, 2 * z * s - r * r * c * c / rho],
        ]
        return Solved(Y, F, np.array(rows) / r**2)

    def margins(self, point: Point) -> Array:
        return np.array([np.inf])


@pytest.mark.parametrize("r", [1e-3, 2e-5])
def test_a_branch_that_passes_close_to_its_beginning_has_not_come_back(r: float) -> None:
    """It is back after two turns, not after one, at which it passes its beginning at a distance of 2 r."""
    curve = TwiceRound(r)
    first = curve.near(np.array([1.0 + r, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
    found = march(first, Limits((), 0.02, 2000, curve.landmark(first)), Along())
    points = np.array([row.point.X for row in found.rows])
    assert found.ending == "closed"
    turned = np.unwrap(np.arctan2(points[:, 2], points[:, 0]))[-1]
    assert abs(turned) == pytest.approx(4 * np.pi, abs=1e-9)
    assert points[-1] == pytest.approx(first.X, abs=1e-12)


@pytest.mark.parametrize("low", [0.7, 0.8, 0.9])
def test_a_fold_beside_a_boundary_is_met_where_the_same_equations_turn_back_beyond_it(low: float) -> None:
    """p' = 10 (x - 0.505) (x - 0.495): the first fold lies before the boundary at x = 1/2, the second behind it."""

    def f(x: float, p: float) -> tuple[float, float, float]:
        return p - 10 * (x**3 / 3 - 0.5 * x * x + 0.249975 * x), -10 * (x - 0.505) * (x - 0.495), 1.0

    curve = Plane(f, Plane(lambda x, p: (x - 0.5, 1.0, 0.0)))
    first = curve.at_parameter(np.array([low, 0.0]) / curve.scale, -f(low, 0.0)[0])
    assert first is not None
    down = first if first.tangent[0] < 0 else first.turned()
    found = march(down, Limits(((-1, 0.0, 4.0),), 0.05, 99), Along())
    assert [one.kind for one in found.special] == ["fold", "half"]
    assert found.special[0].point.X[0] == pytest.approx(0.505, abs=1e-9)


def test_a_branch_goes_on_behind_a_boundary_beyond_which_its_equations_have_no_values() -> None:
    """p = sqrt(x - 1/2), with slopes that grow without bound; x = p + 1/2 behind it."""

    def f(x: float, p: float) -> tuple[float, float, float]:
        root = np.sqrt(x - 0.5) if x > 0.5 else np.nan
        return p - root, -0.5 / root, 1.0

    found = run(Plane(f, Plane(lambda x, p: (x - p - 0.5, 1.0, -1.0))), 0.75, 0.5, -1.0, low=-0.1)
    assert [one.kind for one in found.special] == ["half"] and found.ending == "range"
    assert found.special[0].point.X == pytest.approx([0.5, 0.0], abs=1e-7)
    assert found.rows[-1].point.X == pytest.approx([0.4, -0.1], abs=1e-14)


def test_a_boundary_that_is_not_found_on_a_long_step_is_looked_for_on_shorter_ones() -> None:
    """On x = p + 1/2 it is passed on every step that reaches p < 0, and found on those up to 0.003 only."""

    class Shy(Half):
        def located(self, step: Step) -> tuple[float, Any] | None:
            return super().located(step) if step.stop < 3e-3 else None

    class Shyly(Along):
        boundaries = (Shy(),)

    curve = Plane(lambda x, p: (x - p - 0.5, 1.0, -1.0), Plane(lambda x, p: (x - 2 * p - 0.5, 1.0, -2.0)))
    first = curve.at_parameter(np.array([0.9, 0.4]) / curve.scale, 0.4)
    assert first is not None
    found = march(first.facing(-1.0), Limits(((-1, -0.2, 4.0),), 0.05, 500, None), Shyly())
    assert [one.kind for one in found.special] == ["half"] and found.ending == "range"
    assert found.special[0].point.X == pytest.approx([0.5, 0.0], abs=1e-9)
    assert found.rows[-1].point.X == pytest.approx([0.1, -0.2], abs=1e-14)


def test_a_zero_at_the_beginning_is_not_met_once_more() -> None:
    """(p - p_a) (p_m - p) vanishes where the step begins and at p_m: the second one is the next."""
    line = Plane(lambda x, p: (x, 1.0, 0.0))
    a = line.at_parameter(np.array([0.0, 0.1]) / line.scale, 0.1).facing(1.0)
    b = line.step(a, 0.5)
    step = Step(a, b, ([], []), (np.empty(0), np.empty(0)))
    s, there = locate(step, lambda point: (point.value - a.value) * (0.2 - point.value))
    assert there.value == pytest.approx(0.2, abs=1e-14) and s == pytest.approx(0.2, abs=1e-14)


def test_a_range_ends_exactly_at_its_edge() -> None:
    """The last value is the edge itself; nothing beyond it is listed."""
    found = run(circle(), 0.8, 0.6, 1.0, high=0.9)
    assert found.ending == "range" and found.rows[-1].point.value == 0.9 and not found.special
    assert found.rows[-1].point.X[0] == pytest.approx(np.sqrt(0.19), abs=1e-15)
    assert run(circle(), 0.8, 0.6, 1.0, points=3).ending == "points"


def test_another_branch_crosses() -> None:
    """x (x - p) = 0: along x = 0 the line x = p is met at the origin, which is no fold."""
    found = run(Plane(lambda x, p: (x * (x - p), 2 * x - p, -x)), 0.0, -1.0, 1.0, high=1.0)
    assert [one.kind for one in found.special if one.kind != "zero"] == ["transcritical"]
    (origin,) = (one.point for one in found.special if one.kind == "transcritical")
    assert origin.X == pytest.approx([0.0, 0.0], abs=1e-12)
    assert found.ending == "range"


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_pitchfork_without_symmetry(way: float) -> None:
    """x (x^2 - p + 3 x p) = 0: along x = 0 the curve p = x^2 / (1 - 3 x) is met, which turns there."""

    def f(x: float, p: float) -> tuple[float, float, float]:
        return x**3 - x * p + 3 * x * x * p, 3 * x * x - p + 6 * x * p, 3 * x * x - x

    found = run(Plane(f), 0.0, way, -way, low=-1.0, high=1.0)
    assert [one.kind for one in found.special if one.kind != "zero"] == ["pitchfork"]


def test_both_tangents_at_a_crossing() -> None:
    """x (x - p) = 0 in units 2 and 1/2: (0, 1) and (1 / 2, 2), of length 1."""
    both = tangents(Plane(lambda x, p: (x * (x - p), 2 * x - p, -x)), np.zeros(2))
    straight, sloping = sorted(both, key=lambda v: abs(v[0]))
    assert np.abs(straight) == pytest.approx([0.0, 1.0], abs=1e-9)
    assert sloping / sloping[0] == pytest.approx([1.0, 4.0], abs=1e-9)


def test_no_tangents_where_no_branches_cross() -> None:
    """x^2 + p^2 = 0 holds at the origin alone."""
    assert tangents(Plane(lambda x, p: (x * x + p * p, 2 * x, 2 * p)), np.zeros(2)) is None


def test_a_branch_goes_on_behind_a_boundary() -> None:
    """x = p above 1/2, 2 x = p + 1/2 below it: both meet at the boundary, and the end is that of the second."""
    below = Plane(lambda x, p: (2 * x - p - 0.5, 2.0, -1.0))
    found = run(Plane(lambda x, p: (x - p, 1.0, -1.0), below), 1.0, 1.0, -1.0, low=-0.1)
    assert [one.kind for one in found.special] == ["half"] and found.ending == "range"
    assert found.special[0].point.X == pytest.approx([0.5, 0.5], abs=1e-14)
    assert found.rows[-1].point.X == pytest.approx([0.2, -0.1], abs=1e-14)


def test_no_point_follows_where_the_curve_ends() -> None:
    """x = sqrt(p), not defined below p = 0.01: Newton's method fails however small the step."""

    def f(x: float, p: float) -> tuple[float, float, float]:
        return (x - np.sqrt(p) if p >= 0.01 else np.nan), 1.0, -0.5 / np.sqrt(max(p, 0.01))

    found = run(Plane(f), 1.0, 1.0, -1.0)
    assert found.ending == "no_convergence" and found.rows[-1].point.value == pytest.approx(0.01, abs=1e-7)


@pytest.mark.parametrize("problem", [Orbits, Equilibria, Locus])
@pytest.mark.parametrize("step", ["predicted", "correct", "tangent", "step", "between", "at_edge"])
def test_problems_share_predictor_and_corrector(problem: type, step: str) -> None:
    """A second one would have limits of its own."""
    assert getattr(problem, step) is getattr(Curve, step)


def test_nothing_lands_at_the_section() -> None:
    """Margins of an orbit between a wall and a spring, but for the lengths of its visits, are those of the motion.

    At the second phase the section lies nearer to the wall than the mass is to anything behind its impact."""
    found = []
    for phase in (0.0, 1.0):
        system = ns.mechanical(
            1.0,
            0.2,
            1.0,
            parameters={"w": 0.8, "s": phase},
            forcing={"q": lambda t, p: np.cos(p.w * t + p.s)},
            elements={
                "wall": ns.elements.Stop(at="q", position=0.5, restitution=0.6),
                "spring": ns.elements.ElasticStop(at="q", position=-3.0, side=-1, stiffness=2.0),
            },
        )
        curve, X = curve_of(ns.find_orbit(system, progress=False), "w", 1.0)
        path = curve.walk.along(curve.shooting.evaluate(X), curve.shooting.split(X)[1].copy())
        found.append(path.margins[1:])
    assert np.isfinite(found[0]).all() and found[1] == pytest.approx(found[0], abs=1e-9)


@pytest.mark.parametrize("start", [-9e-7, -1.05e-6, 3e-5])
def test_a_residual_that_the_last_step_s_square_leaves_is_no_rounding(start: float) -> None:
    """x (x + 2 p) = 0 beside the crossing of its branches, at p = 1e-6: a first step of 5e-6 from between the roots 0
    and -2e-6 takes a residual of 1e-12 to 2e-11; the corrector goes on, to a root."""
    curve = Plane(lambda x, p: (x * (x + 2 * p), 2 * (x + p), 2 * x))
    found = curve.correct(np.array([start, 1e-6]) / curve.scale, np.array([0.0, 1.0]), 2e-6)
    assert found is not None
    x, p = found[0].X
    assert min(abs(x), abs(x + 2 * p)) < 1e-12


@pytest.mark.parametrize("slope", [-1.0, -0.5, 0.3, 1.0, 3.5])
@pytest.mark.parametrize("bend", [0.0, 0.4])
def test_the_tangent_at_a_crossing_is_that_of_the_branch(slope: float, bend: float) -> None:
    """(x - 2 p - b p^2) (x - s p) = 0: along the first factor dx / dp = 2 at the crossing, at any angle."""

    def f(x: float, p: float) -> tuple[float, float, float]:
        one, other = x - 2 * p - bend * p * p, x - slope * p
        return one * other, one + other, -(2 + 2 * bend * p) * other - slope * one

    found = run(Plane(f), -1.0 + 0.25 * bend, -0.5, 1.0, low=-0.5, high=0.6)
    (crossing,) = [one.point for one in found.special if one.kind != "zero"]
    assert crossing.X == pytest.approx([0.0, 0.0], abs=1e-9)
    assert crossing.tangent[0] * 2.0 / (crossing.tangent[1] * 0.5) == pytest.approx(2.0, abs=1e-6)
