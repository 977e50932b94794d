"""Branches as they are asked for: their first curves, the range, the marches both ways, and the result of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.arguments import allowed_range, limits
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.branches.reading import layout_attributes
from nonsmooth.continuation.branches.records import BranchRecord, PointRecord, SpecialRecord, record_of
from nonsmooth.continuation.events.of_orbits import AlongOrbits
from nonsmooth.continuation.march.event import BESIDE, Step
from nonsmooth.continuation.march.march import Limits, March, Policy, march
from nonsmooth.continuation.problems.curve import Place, Point
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits, size_of
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import Round, Signature
from nonsmooth.errors import Interrupted
from nonsmooth.system.system import System

if TYPE_CHECKING:
    import xarray as xr

ZERO = 1e-6  # of the numbers beside it: the first point is a special one

#: A point to march on from along its tangent, or a march that has ended.
Start = Point | March


def both_ways(policy: Policy, limits: Limits, back: Start, middle: Sequence[Any], ahead: Start) -> BranchRecord:
    """Follow a branch both ways from the records in its ``middle``.

    After a march that came round to its beginning or was interrupted there is none the other way."""
    found: list[March] = []
    for start in (ahead, back):
        if isinstance(start, March):
            found.append(start)
        elif found and found[0].ending in ("closed", "interrupted"):
            found.append(March(ending=found[0].ending))
        else:
            found.append(march(start, limits, policy))
    marched, before = found
    if isinstance(ahead, Point) and isinstance(back, Point) and ahead.curve is back.curve:
        middle[0].marks.extend(SpecialRecord(kind) for kind in _at_the_start(policy, ahead, before, marched))
    for row in before.rows:
        row.point = row.point.turned()
    points = [*(record_of(row) for row in before.rows[::-1]), *middle, *(record_of(row) for row in marched.rows)]
    said = [one.said or policy.endings[one.ending] for one in (before, marched)]
    return BranchRecord(points, [before.ending, marched.ending], said)


def _at_the_start(policy: Policy, first: Any, back: March, ahead: March) -> list[str]:
    """Special points at the first point itself: rounding decides whether a march from there sees them."""
    both = back, ahead
    if not all(march.rows and march.rows[0].point.curve is first.curve for march in both):
        return []
    before, after = back.rows[0].point.turned(), ahead.rows[0].point  # the march back has its tangents the other way
    seen = {
        row.kind
        for march in both
        for row in march.special
        if row.point.curve is first.curve and np.abs(row.point.Y - first.Y).max() < BESIDE
    }
    step, found = Step(before, after, ([], []), ([], [])), []
    for kind in policy.kinds:
        here, was, now = (kind.number(point) for point in (first, before, after))
        happened = kind.happened(step, was, now) and abs(here) <= ZERO * max(abs(was), abs(now))
        if happened and kind.certain and (named := kind.named(step, first)) and named[0] not in seen:
            found.append(named[0])
    return found


def dataset(
    system: System,
    verb: str,
    parameters: dict[str, list[float]],
    tables: Any,
    record: BranchRecord,
    policy: Policy,
    options: dict[str, Any],
    more: dict[str, Any],
    attrs: dict[str, str],
    method: str = "multiple shooting",
) -> xr.Dataset:
    """A branch or a curve as a Dataset.

    Raises
    ------
    Interrupted
        Ctrl-C ended a march: no caller goes on with a part.
    """
    from nonsmooth.results.branches import line
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    labels = labels_of(system)
    attrs = {**provenance(labels, verb, options, method=method), **attrs}
    ends = list(policy.endings), record.endings, record.sentences
    result = line(labels, attrs, parameters, tables, record.points, record.special, ends, more)
    if "interrupted" not in record.endings:
        return result
    said = record.sentences[record.endings.index("interrupted")]
    raise Interrupted(
        f"{said} Its {result.sizes['point']} points are in `result` of this exception (at a prompt: import sys; "
        "branch = sys.last_value.result)",
        result,
    )


@dataclass(frozen=True)
class MarchOptions:
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
    """A branch of orbits under way; ``bounds`` is the part of its range in which the equations allow the parameter."""

    system: System
    name: str
    range: tuple[float, float]
    bounds: tuple[float, float]
    asked: MarchOptions

    @property
    def width(self) -> float:
        """The width of the range."""
        return self.range[1] - self.range[0]

    def resumed(self, period_number: int, point: PointRecord, way: float = 1.0) -> OrbitPoint | None:
        """The orbit of a recorded point on a curve of its own, facing along the branch (1) or back (-1)."""
        curve, X = resumed_at(self.system, period_number, point, self.name, self.width)
        border = way * point.tangent / curve.scale
        return curve.near(X / curve.scale, border / np.linalg.norm(border))

    def result(
        self,
        period_number: int,
        back: Start,
        middle: Sequence[PointRecord],
        ahead: Start,
        closed: Place | None = None,
        origin: str | None = None,
    ) -> xr.Dataset:
        """The branch of a march back, the points in the middle, and a march ahead; ``closed``: where it would close.

        ``origin`` is the kind of the special point that it leaves.
        """
        asked, policy = self.asked, AlongOrbits()
        within = Limits(((-1, *self.bounds),), asked.step, asked.points, closed, asked.virtual)
        record = both_ways(policy, within, back, middle, ahead)
        for end in (0, -1):  # where the range was cut, that is the reason
            value = record.points[end].value
            side = 0 if abs(value - self.bounds[0]) < abs(value - self.bounds[1]) else 1
            if record.endings[end] == "range" and self.bounds[side] != self.range[side]:
                record.endings[end] = "physical"
                record.sentences[end] = f"{self.name} = {value:.6g}: {policy.endings['physical']}"
        return orbits_dataset(self, record, period_number, policy, {} if origin is None else {"from": origin})


def _returns(branch: Following, points: Sequence[PointRecord], p: int) -> FloatArray:
    """All section points (point, period number, state) of a branch's orbits, from their unknowns."""
    n = len(branch.system.states)
    found = np.empty((len(points), p, n))
    shootings: dict[Any, Shooting] = {}
    for i, point in enumerate(points):
        found[i] = point.section
        if p == 1:
            continue
        if point.signature not in shootings:
            shootings[point.signature] = Shooting(branch.system, point.signature, p, (branch.name,))
        shooting = shootings[point.signature]
        times, states = shooting.split(point.X)
        values = shooting.parameters(point.X)
        at = np.arange(1, p) * (point.period / p)
        begins = np.concatenate([[0.0], times])
        # The visit behind a transition that lies on the section itself.
        visit = np.searchsorted(begins, at + 1e-12 * point.period, side="right") - 1
        there = shooting.flow.segments(values, shooting.modes[visit], begins[visit], at - begins[visit], states[visit])
        found[i, 1:] = there.z[:, :n]
    return found


def orbits_dataset(
    branch: Following, record: BranchRecord, period_number: int, policy: Policy, origin: dict[str, str]
) -> xr.Dataset:
    """A branch of orbits as a Dataset.

    The text of the system, the table of signatures and the unknowns of every point stand in it, so that a branch read
    from a file goes on from where it stopped."""
    from nonsmooth.results.branches import ORBIT, SPECIAL_ORBIT
    from nonsmooth.results.labels import flag_attributes, labels_of, status_attributes

    points, asked, system = record.points, branch.asked, branch.system
    layouts = {one: i for i, one in enumerate(dict.fromkeys(point.signature for point in points))}
    cycles: dict[Any, Signature] = {}
    for one in layouts:
        cycles.setdefault(one.cycle, one)
    numbers = {one: list(cycles).index(one.cycle) for one in layouts}
    for point in points:
        point.layout, point.cycle = layouts[point.signature], numbers[point.signature]
    options = {
        "parameter": branch.name,
        "range": branch.range,
        "step": asked.step,
        "points": asked.points,
        "virtual": asked.virtual,
        **origin,
    }
    texts = [one.text(system.traced) for one in cycles.values()]
    more = {
        "signature": (
            "point",
            np.array([point.cycle for point in points], np.int32),
            {"long_name": "signature", **flag_attributes(texts, dtype=np.int32)},
        ),
        "period_number": ((), np.int64(period_number), {"long_name": f"{labels_of(system).turn}s (0: autonomous)"}),
        "returns": (
            ("point", "return", "state"),
            _returns(branch, points, max(period_number, 1)),
            {"long_name": "section points"},
        ),
        "status": ("point", np.zeros(len(points), np.int8), status_attributes()),
    }
    attrs = {"parameter": branch.name, **layout_attributes(layouts, system)}
    values = {branch.name: [point.value for point in points]}
    tables = ORBIT, SPECIAL_ORBIT
    return dataset(system, "continue_orbit", values, tables, record, policy, options, more, attrs)


def curve_of(orbit: Orbit, name: str, width: float) -> tuple[Orbits, FloatArray]:
    """The curve through an orbit, and its unknowns."""
    system = orbit.system
    states = np.vstack([np.concatenate([orbit.u, orbit.memory]), orbit.crossing_states])
    once = Round(orbit.period_number, orbit.period, orbit.signature, orbit.crossing_times, states)
    shooting, X = Shooting.of(system, once, (name,), [system.values[name]])
    return _through(shooting, X, orbit, width)


def resumed_at(
    system: System, period_number: int, point: PointRecord, name: str, width: float
) -> tuple[Orbits, FloatArray]:
    """The curve through a recorded point."""
    return _through(Shooting(system, point.signature, period_number, (name,)), point.X, point, width)


def _through(shooting: Shooting, X: FloatArray, orbit: Any, width: float) -> tuple[Orbits, FloatArray]:
    size = size_of(orbit.maximum, orbit.minimum, shooting.system)
    shooting.prepare(X, size)
    return Orbits(shooting, size, orbit.period, (width,)), X
