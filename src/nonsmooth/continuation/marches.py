"""What a march along a branch collects: rows, special points, and how it ended."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.grazing import Graze

__all__ = ["ENDINGS", "Limits", "March", "Row", "Special"]

#: How a branch can end, with the sentence for each.
ENDINGS = {
    "range": "The branch reached the edge of the range.",
    "branching": "The branch begins where it leaves another one.",
    "closed": "The branch came back to where it began.",
    "points": "The largest number of points was reached; continue the branch with continue_orbit(branch).",
    "equilibrium": (
        "The cycle shrinks to an equilibrium, a Hopf bifurcation: continue_equilibrium finds it to the last digit."
    ),
    "no_convergence": (
        "Newton's method did not converge, however small the step; the orbit may end in an event that is not known "
        "here (a chatter, an infinite period)."
    ),
    "grazing": (
        "The orbit touches a boundary and no orbit near it goes on: beyond this point the motion leaves for another "
        "attractor."
    ),
    "corner": "The orbit meets the corner of two boundaries, and no orbit near it goes on.",
    "physical": "Beyond this value the equations do not allow the parameter: the range was cut there.",
    "circle": "The virtual branch came back to an earlier point of its own and goes round from here on.",
    "landing": (
        "A reset leads just onto a boundary: beyond this point it leads behind it, where another transition follows at "
        "the same instant."
    ),
    "interrupted": "Interrupted: what was found until then stands; continue the branch with continue_orbit(branch).",
}


@dataclass
class Row:
    """One point of the branch with the curve it lies on; ``virtual`` beyond a boundary that its path should obey."""

    curve: Curve
    point: Point
    virtual: bool = False


@dataclass
class Special:
    """A special point: its kind, its place among the rows, and what belongs to its kind."""

    kind: str
    curve: Curve
    point: Point
    row: int = -1
    indicator: int = -1
    graze: Graze | None = None


@dataclass
class March:
    """Rows in the order of the march, special points, and the ending (a key of ``ENDINGS``)."""

    rows: list[Row] = field(default_factory=list)
    special: list[Special] = field(default_factory=list)
    ending: str = "points"

    def add(self, curve: Curve, point: Point) -> None:
        """Append a point."""
        self.rows.append(Row(curve, point, bool((point.path.violation() < 0.0).any())))

    def mark(self, kind: str, curve: Curve, point: Point, *, virtual: bool = False, **more: Any) -> None:
        """Append a special point, and a row for it; on a boundary itself no path is virtual."""
        self.rows.append(Row(curve, point, virtual))
        self.special.append(Special(kind, curve, point, len(self.rows) - 1, **more))


@dataclass
class Limits:
    """What bounds a march."""

    low: float
    high: float
    largest: float  # step
    points: int
    closed: tuple[Curve, Point] | None = None
    virtual: bool = False  # go on beyond boundaries with the same signature
