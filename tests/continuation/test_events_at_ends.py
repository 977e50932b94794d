"""Events at the very ends of a step or of a branch: met once, and only where they are."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from nonsmooth.continuation.events.boundaries import Boundary
from nonsmooth.continuation.march.event import Fold, Step, first_met, special_on
from nonsmooth.continuation.problems.curve import Curve, Point


class Circle(Curve[Point]):
    """x^2 + p^2 = 1."""

    scale = np.ones(2)

    def evaluate(self, Y: Any) -> Any:
        return SimpleNamespace(X=Y, F=np.array([Y @ Y - 1.0]), J=2.0 * Y[None, :])

    def fill(self, solved: Any, matrix: Any) -> None:
        matrix[:] = solved.J

    def residual(self, solved: Any) -> Any:
        return solved.F

    def moved(self, solved: Any, Y: Any) -> Any:
        return self.evaluate(Y)

    def at_angle(self, angle: float) -> Point:
        Y = np.array([np.sin(angle), np.cos(angle)])
        return Point(self, Y, np.array([Y[1], -Y[0]]), 1.0, 0, self.evaluate(Y))


def step(a: float, b: float, cause: str = "") -> Step:
    circle = Circle()
    ends = circle.at_angle(a), circle.at_angle(b)
    numbers = tuple([Fold().number(end)] for end in ends)
    return Step(*ends, numbers, (np.empty(0), np.empty(0)), cause=cause)


class Left(Boundary):
    """The circle is left at the angle 0.3."""

    def number(self, point: Any) -> float:
        return float(np.cos(0.3) * point.Y[1] - np.sin(0.3) * point.Y[0] - np.cos(0.6))

    def surface(self, point: Any, beyond: Any = None) -> int:
        return -1


@pytest.mark.parametrize(("begun", "place"), [(0.2, 0.1), (0.3 + 1e-12, 0.0), (0.35, 0.0)])
def test_a_march_that_begins_beyond_a_boundary_begins_at_it(begun: float, place: float) -> None:
    """By what an orbit is solved for, however much more that is than rounding."""
    one = step(begun, 0.4)
    one.first = True
    met = Left().met(one)
    assert met is not None
    assert met.s == pytest.approx(np.sin(place), abs=1e-11)


class Window(Left):
    """The circle is left between two angles."""

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def number(self, point: Any) -> float:
        angle = float(np.arctan2(*point.Y))
        return (angle - self.low) * (angle - self.high)


@pytest.mark.parametrize(("low", "high", "found"), [(0.22, 0.38, False), (0.22, 0.28, True), (0.32, 0.38, True)])
def test_a_boundary_is_met_where_every_other_one_is_obeyed(low: float, high: float, found: bool) -> None:
    """At 0.3, unless that lies in a window that both ends of the step obey: a shorter step meets that."""
    boundaries, one = (Left(), Window(low, high)), step(0.2, 0.4)
    one.margins = tuple(np.array([kind.number(end) for kind in boundaries]) for end in (one.a, one.b))
    met = first_met(one, boundaries)
    assert (met is not None) is found
    assert met is None or [type(each.kind) for each in met] == [Left]


@pytest.mark.parametrize(("beyond", "listed"), [(1e-2, 1), (1e-7, 0), (-1e-7, 0)])
def test_the_fold_at_which_a_closed_branch_begins_is_not_met_once_more(beyond: float, listed: int) -> None:
    """The last step ends where the branch began; a fold 1e-2 before that is another one."""
    last = step(-0.2, 0.05, "closed")
    end = Circle().at_angle(beyond)
    last.stop = float(last.a.tangent @ (end.Y - last.a.Y))
    assert len(special_on(last, [Fold()])) == listed
