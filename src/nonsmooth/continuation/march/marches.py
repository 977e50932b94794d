"""Points and special points that a march along a branch collects, its ending, and its answer to Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import Interrupted

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.continuation.march.arclength import Curve, Point
    from nonsmooth.continuation.signature.grazing import Graze

__all__ = [
    "ENDINGS", "INTERRUPTED", "Limits", "March", "Place", "Row", "Special", "both_ways", "in_turn",
    "unless_interrupted",
]  # fmt: skip

INTERRUPTED = "Interrupted: what was found until then stands"
#: How a branch can end, with the sentence for each.
ENDINGS = {
    "range": "The branch reached the edge of the range.",
    "branching": "The branch begins where it leaves another one.",
    "closed": "The branch came back to where it began.",
    "points": "The largest number of points was reached; continue the branch with continue_orbit(branch).",
    "equilibrium": (
        "The cycle shrinks to an equilibrium, a Hopf bifurcation: continue_equilibrium finds it to the last digit."
    ),
    "focus_centre": (
        "The cycle ends in a focus-centre bifurcation: it only touches the boundary of a mode that is linear, and at "
        "this value all smaller orbits of that mode are closed."
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
    "interrupted": INTERRUPTED + "; continue the branch with continue_orbit(branch).",
}


def in_turn(*begin: Callable[[], March]) -> list[March]:
    """Marches, one after the other; empty ones after one that came round to its beginning or was interrupted."""
    found: list[March] = []
    for one in begin:
        ended = bool(found) and found[-1].ending in ("closed", "interrupted")
        found.append(March(ending=found[-1].ending) if ended else one())
    return found


def both_ways(back: March, first: Row, ahead: March) -> tuple[list[Row], list[tuple[str, int]]]:
    """Rows of a march back, reversed, the first point, a march ahead; special points with their places."""
    n = len(back.rows)
    special = [(one.kind, n - 1 - one.row) for one in back.special[::-1]]
    special += [(one.kind, n + 1 + one.row) for one in ahead.special]
    return [*back.rows[::-1], first, *ahead.rows], special


def unless_interrupted(result: xr.Dataset, endings: Sequence[str]) -> xr.Dataset:
    """Return a branch, or raise ``Interrupted`` with it where Ctrl-C ended a march: no caller goes on with a part."""
    if "interrupted" not in endings:
        return result
    raise Interrupted(
        f"interrupted: the {result.sizes['point']} points that were found are in `result` of this exception "
        "(at a prompt: import sys; branch = sys.last_value.result). continue_orbit(branch) goes on with orbits",
        result,
    )


#: The word of a curve (of orbits: the signature), the unknowns, and what other curves of the branch have of them.
Place = tuple[Any, NDArray[np.float64], NDArray[np.float64]]


@dataclass
class Row:
    """One point of the branch with the curve it lies on; ``virtual`` beyond a boundary that its path should obey."""

    curve: Any
    point: Any
    virtual: bool = False


@dataclass
class Special:
    """A special point: its kind, its place among the rows, and what belongs to its kind."""

    kind: str
    curve: Any
    point: Any
    row: int = -1
    indicator: int = -1
    graze: Graze | None = None
    sliding: str = ""


@dataclass
class March:
    """Rows in the order of the march, special points, and the ending (a key of the curve's ``endings``).

    ``said`` is the sentence for the ending, where it is not that of ``endings``."""

    rows: list[Row] = field(default_factory=list)
    special: list[Special] = field(default_factory=list)
    ending: str = "points"
    said: str = ""

    def add(self, curve: Curve[Any], point: Point) -> None:
        """Append a point."""
        self.rows.append(Row(curve, point, point.virtual))

    def mark(self, kind: str, curve: Curve[Any], point: Point, *, virtual: bool = False, **more: Any) -> None:
        """Append a special point, and a row for it; on a boundary itself no path is virtual."""
        self.rows.append(Row(curve, point, virtual))
        self.special.append(Special(kind, curve, point, len(self.rows) - 1, **more))


@dataclass
class Limits:
    """Limits of a march."""

    box: tuple[tuple[int, float, float], ...]  # place of a parameter among the unknowns, low, high
    largest: float  # step
    points: int
    closed: Place | None = None  # where the branch would close
    virtual: bool = False  # go on beyond boundaries with the same signature
