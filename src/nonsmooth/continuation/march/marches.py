"""Points and special points that a march along a branch collects, its ending, and its answer to Ctrl-C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Curve, Point
from nonsmooth.continuation.signature.grazing import Graze
from nonsmooth.continuation.signature.signature import Signature
from nonsmooth.errors import Interrupted

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "ENDINGS", "INTERRUPTED", "Limits", "March", "Place", "Row", "Special", "in_turn", "march_until",
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


class Marched(Protocol):
    """Any march: of orbits, of special points, of equilibria."""

    ending: str


M = TypeVar("M", bound=Marched)


def march_until(found: M, follow: Callable[..., None], *arguments: Any) -> M:
    """March into ``found`` by ``follow(found, *arguments)`` until the branch ends, or Ctrl-C ends it."""
    try:
        follow(found, *arguments)
    except KeyboardInterrupt:  # unless_interrupted raises it again, with what was found
        found.ending = "interrupted"
    return found


def in_turn(*begin: Callable[[], M]) -> list[M]:
    """Marches, one after the other; empty ones after one that came round to its beginning or was interrupted."""
    found: list[M] = []
    for one in begin:
        if found and found[-1].ending in ("closed", "interrupted"):
            empty = type(found[-1])()
            empty.ending = found[-1].ending
            found.append(empty)
        else:
            found.append(one())
    return found


def unless_interrupted(result: xr.Dataset, endings: Sequence[str]) -> xr.Dataset:
    """Return a branch, or raise ``Interrupted`` with it where Ctrl-C ended a march: no caller goes on with a part."""
    if "interrupted" not in endings:
        return result
    raise Interrupted(
        f"interrupted: the {result.sizes['point']} points that were found are in `result` of this exception "
        "(at a prompt: import sys; branch = sys.last_value.result). continue_orbit(branch) goes on with orbits",
        result,
    )


#: Signature and unknowns of an orbit.
Place = tuple[Signature, NDArray[np.float64]]


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
    """Limits of a march."""

    low: float
    high: float
    largest: float  # step
    points: int
    closed: Place | None = None  # where the branch would close
    virtual: bool = False  # go on beyond boundaries with the same signature
