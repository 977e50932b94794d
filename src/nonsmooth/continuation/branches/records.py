"""Points and special points of a branch as plain data: what is kept, saved and read back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.multipliers import stable_by
from nonsmooth.continuation.signature.signature import Signature

if TYPE_CHECKING:
    from nonsmooth.continuation.march.marches import March, Special
    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits

__all__ = ["BranchRecord", "PointRecord", "SpecialRecord", "from_march", "joined"]


@dataclass
class PointRecord:
    """One orbit of a branch."""

    value: float  # of the parameter
    signature: Signature
    X: FloatArray
    tangent: FloatArray  # in unknowns, not scaled
    mode: int
    section: FloatArray  # (n_u,)
    maximum: FloatArray
    minimum: FloatArray
    period: float
    multipliers: ComplexArray
    stable: bool
    clearance: FloatArray  # (n_indicators,)
    virtual: bool = False


@dataclass
class SpecialRecord:
    """One special point: the place of its orbit among the points, and what belongs to its kind."""

    kind: str
    place: int
    indicator: int = -1
    grazing: str = ""
    sliding: str = ""
    bounded: bool = True
    doubled: bool = False
    contact: ComplexArray | None = None  # multipliers with the contact, in the limit
    determinants: FloatArray = field(default_factory=lambda: np.full(4, np.nan))


@dataclass
class BranchRecord:
    """A branch: points in order, special points, and how each end came about (ENDINGS; a sentence)."""

    parameter: str
    range: tuple[float, float]
    period_number: int
    points: list[PointRecord]
    special: list[SpecialRecord]
    endings: tuple[str, str] = ("points", "points")
    sentences: tuple[str, str] = ("", "")


def point_record(curve: Orbits, point: OrbitPoint, virtual: bool = False) -> PointRecord:
    """Record of a solved point."""
    shooting, path = curve.shooting, point.path
    n_u = len(shooting.system.states)
    return PointRecord(
        float(point.X[-1]), shooting.signature, point.X, point.tangent * curve.scale, shooting.at_section,
        point.X[:n_u], path.maximum, path.minimum, float(point.solved.times[-1]), point.multipliers,
        stable_by(point.multipliers, shooting.forced),
        curve.walk.clearance(path, len(shooting.system.indicators)), virtual,
    )  # fmt: skip


def special_record(special: Special) -> SpecialRecord:
    """Record of a special point."""
    record = SpecialRecord(special.kind, special.row, special.indicator, sliding=special.sliding)
    g = special.graze
    if g is not None:
        one = np.eye(len(g.M_free))
        record.grazing, record.bounded, record.doubled = g.kind, g.bounded, g.doubled
        record.contact = g.multipliers_contact
        record.determinants = np.array(
            [np.linalg.det(one + sign * M) for sign in (-1.0, 1.0) for M in (g.M_free, g.M_contact)]
        )
    return record


def from_march(found: March, offset: int = 0) -> tuple[list[PointRecord], list[SpecialRecord]]:
    """The records of a march; special points count from ``offset``."""
    points = [point_record(row.curve, row.point, row.virtual) for row in found.rows]
    special = []
    for one in found.special:
        record = special_record(one)
        if one.graze is not None:  # exactly at the graze: the multipliers of the side without contact
            points[one.row].multipliers = one.graze.multipliers_free
            points[one.row].stable = stable_by(one.graze.multipliers_free, one.curve.shooting.forced)
        record.place += offset
        special.append(record)
    return points, special


def joined(
    before: tuple[list[PointRecord], list[SpecialRecord]],
    middle: list[PointRecord],
    after: tuple[list[PointRecord], list[SpecialRecord]],
) -> tuple[list[PointRecord], list[SpecialRecord]]:
    """A march the other way, reversed; the points in the middle; a march this way."""
    points_back, special_back = before
    n = len(points_back)
    for point in points_back:
        point.tangent = -point.tangent
    for special in special_back:
        special.place = n - 1 - special.place
    for special in after[1]:
        special.place += n + len(middle)
    return points_back[::-1] + middle + after[0], special_back[::-1] + after[1]
