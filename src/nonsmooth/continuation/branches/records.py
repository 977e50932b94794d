"""Points and special points of a branch as plain data: what is kept, saved and read back.

Their fields are those of the tables in ``nonsmooth.results.branches``."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.march.march import MarkedPoint, SpecialRecord
from nonsmooth.continuation.problems.equilibrium import Rest
from nonsmooth.continuation.problems.multipliers import stable_by
from nonsmooth.continuation.problems.signature import Signature


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
    crossings: float  # per period
    contacts: float
    virtual: bool = False
    marks: list[SpecialRecord] = field(default_factory=list)
    layout: int = -1  # its signature in the tables of a branch, as it begins at the section
    cycle: int = -1  # and as a cycle


@dataclass
class RestRecord:
    """One equilibrium of a branch."""

    value: float
    u: FloatArray  # of a set its middle
    lower: FloatArray
    upper: FloatArray
    eigenvalues: ComplexArray
    stable: bool
    mode: int
    marks: list[SpecialRecord] = field(default_factory=list)


@dataclass
class BranchRecord:
    """A branch: points in order, and how each end came about (a key of the policy's endings; a sentence)."""

    points: list[Any]
    endings: list[str]
    sentences: list[str]
    parameter: str = ""
    range: tuple[float, float] = (-np.inf, np.inf)
    period_number: int = 0

    @property
    def special(self) -> list[SpecialRecord]:
        """The special points, each with its place."""
        return [replace(mark, point=i) for i, point in enumerate(self.points) for mark in point.marks]


def record_of(row: MarkedPoint) -> Any:
    """The record of a solved point of a branch."""
    point = row.point
    if isinstance(point, Rest):
        record: Any = RestRecord(
            point.value,
            point.u,
            point.lower,
            point.upper,
            point.eigenvalues,
            point.curve.stable(point),
            point.curve.mode,
        )
    else:
        record = _of_orbit(row)
    if row.mark:
        record.marks.append(row.mark)
    return record


def _of_orbit(row: MarkedPoint) -> PointRecord:
    point, curve = row.point, row.point.curve
    shooting, path = curve.shooting, point.path
    crossings, contacts = shooting.signature.rates(shooting.system.traced.transitions, shooting.period_number)
    return PointRecord(
        point.value,
        shooting.signature,
        point.X,
        point.tangent * curve.scale,
        shooting.at_section,
        point.X[: len(path.maximum)],
        path.maximum,
        path.minimum,
        point.period,
        point.multipliers,
        stable_by(point.multipliers, shooting.forced),
        curve.walk.clearance(path, len(shooting.system.indicators)),
        crossings,
        contacts,
        row.virtual,
    )
