"""A branch of orbits that is asked for: its range, its marches, and the result made of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nonsmooth.continuation.branches.files import branch_dataset
from nonsmooth.continuation.branches.records import BranchRecord, PointRecord, SpecialRecord, from_march, joined
from nonsmooth.continuation.march.begin import limits
from nonsmooth.continuation.march.march import march
from nonsmooth.continuation.march.marches import ENDINGS, Limits, March, Place
from nonsmooth.continuation.march.physical import allowed_range

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
    from nonsmooth.system.system import System

__all__ = ["Asked", "Following"]


@dataclass(frozen=True)
class Asked:
    """Options of ``continue_orbit`` that every march shares; ``range`` is None where not given."""

    range: Any
    step: float
    points: int
    virtual: bool

    def follow(self, system: System, name: str, before: Any = None, here: float | None = None) -> Following:
        """The branch in a parameter, over the range that is asked for or the one of ``before``.

        Raises
        ------
        ValueError
            No range, or one that does not hold ``here``.
        """
        low, high = limits(system, name, before if self.range is None else self.range, here)
        return Following(system, name, (low, high), allowed_range(system, name, low, high), self)


@dataclass(frozen=True)
class Following:
    """A branch under way; ``bounds`` is the part of its range in which the equations allow the parameter."""

    system: System
    name: str
    range: tuple[float, float]
    bounds: tuple[float, float]
    asked: Asked

    @property
    def width(self) -> float:
        """The width of the range."""
        return self.range[1] - self.range[0]

    def march(self, curve: Orbits, point: OrbitPoint, closed: Place | None = None) -> March:
        """Follow the branch from a point along its tangent; ``closed``: where it would close."""
        asked = self.asked
        return march(curve, point, Limits(((-1, *self.bounds),), asked.step, asked.points, closed, asked.virtual))

    def result(
        self, period_number: int, back: March, middle: Sequence[PointRecord], ahead: March,
        marks: Sequence[SpecialRecord] = (), origin: str | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """The branch of a march back, the points in the middle with their ``marks``, and a march ahead.

        ``origin`` is the kind of the special point that it leaves.

        Raises
        ------
        Interrupted
            Ctrl-C ended a march.
        """
        said = self._sentence(back), self._sentence(ahead)
        for mark in marks:
            mark.place += len(back.rows)
        points, special = joined(from_march(back), list(middle), from_march(ahead))
        special = sorted([*special, *marks], key=lambda one: one.place)
        endings = back.ending, ahead.ending
        record = BranchRecord(self.name, self.range, period_number, points, special, endings, said)
        asked = self.asked
        return branch_dataset(self.system, record, {
            "parameter": self.name, "range": self.range, "step": asked.step, "points": asked.points,
            "virtual": asked.virtual, **({} if origin is None else {"from": origin}),
        })  # fmt: skip

    def _sentence(self, found: March) -> str:
        """Return the end of a march in words; where the range was cut, that is the reason."""
        if found.said:
            return found.said
        if found.ending == "range" and found.rows:
            value = found.rows[-1].point.value
            side = 0 if abs(value - self.bounds[0]) < abs(value - self.bounds[1]) else 1
            if self.bounds[side] != self.range[side]:
                found.ending = "physical"
                return f"{self.name} = {value:.6g}: {ENDINGS['physical']}"
        return ENDINGS[found.ending]
