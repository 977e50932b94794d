"""The march along a branch: step size, range, budget, events in their order, and the end."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.blas import one_blas_thread
from nonsmooth.continuation.march.event import BESIDE, Event, Met, Step, first_met, special_on
from nonsmooth.continuation.problems.curve import Place, Point, passing

INTERRUPTED = "Interrupted: what was found until then stands"
FIRST = 1e-3  # step
LEAST_STEP = 1e-9
COSINE = 0.98  # of the angle between the tangents of neighbours
AT_LIMIT = 1e-8  # along the branch: as near to a boundary no point follows where it is one of the equations' own
HALVED = 20  # times, at most
SPREAD = 0.15  # change of what is known of neighbours (of orbits: chordal, of the multipliers)


@dataclass
class Limits:
    """Limits of a march."""

    box: tuple[tuple[int, float, float], ...]  # place of a parameter among the unknowns, low, high
    largest: float  # step
    points: int
    closed: Place | None = None  # where the branch would close
    virtual: bool = False  # go on beyond boundaries with the same signature


@dataclass
class SpecialRecord:
    """A special point: its kind, its data, and its place ``point`` in the branch; at a graze both sides of it."""

    kind: str
    indicator: str = ""
    grazing: str = ""
    sliding: str = ""
    bounded: bool = True
    doubled: bool = False
    contact: ComplexArray = field(default_factory=lambda: np.empty(0, dtype=complex))  # in the limit
    determinants: FloatArray = field(default_factory=lambda: np.empty(0))
    point: int = -1


@dataclass
class MarkedPoint:
    """A point of a branch, and what it is as a special one."""

    point: Any
    virtual: bool = False  # beyond a boundary that its path should obey
    mark: SpecialRecord | None = None

    @property
    def kind(self) -> str:
        """The kind of a special point, else nothing."""
        return self.mark.kind if self.mark else ""


@dataclass
class March:
    """Rows in the order of the march, and the ending: a key of the policy's ``endings``, with its sentence."""

    rows: list[MarkedPoint] = field(default_factory=list)
    ending: str = "points"
    said: str = ""

    @property
    def special(self) -> list[MarkedPoint]:
        """The rows that are special points."""
        return [row for row in self.rows if row.mark]

    def add(self, point: Point) -> None:
        """Append a point."""
        self.rows.append(MarkedPoint(point, point.virtual))

    def mark(self, kind: str, point: Point, virtual: bool = False, **more: Any) -> None:
        """Append a special point; on a boundary itself no path is virtual."""
        self.rows.append(MarkedPoint(point, virtual, SpecialRecord(kind, **more)))


class Policy(ABC):
    """Events that are searched for along the curves of a branch, and how the branch goes on or ends there.

    Attributes
    ----------
    kinds : sequence of Event
        Special points that every step is searched for.
    boundaries : sequence of Event
        Events at which the equations stop to hold; what explains the others first.
    unseen_on : sequence of str
        Causes of a step's end with which it is searched for what margins do not tell.
    endings : mapping
        The ways in which a branch can end, with the sentence for each.
    """

    kinds: Sequence[Event] = ()
    boundaries: Sequence[Event] = ()
    unseen_on: Sequence[str] = ("",)
    endings: ClassVar[Mapping[str, str]] = {}

    def record(self, found: March, step: Step, met: Met) -> None:
        """List an event that a branch passes."""
        found.mark(met.name, met.point, step.virtual and met.point.virtual)

    @abstractmethod
    def behind(self, found: March, met: list[Met]) -> Any:
        """Record the boundaries ``met`` at one place; the point behind, on a curve of its own, or None."""

    def unseen(self, step: Step) -> Met | None:
        """The first place on a step that margins do not tell lies beyond a boundary."""
        return None

    def passed_by(self, step: Step) -> list[Met]:
        """Boundaries that a branch passes on a step with the equations that it has."""
        return []

    def over(self, point: Any) -> str | None:
        """The ending of a branch whose last point this is; None where it goes on."""
        return None

    def why(self, point: Any) -> str:
        """The ending of a branch on which no point follows this one."""
        return "no_convergence"


@one_blas_thread()
def march(point: Any, limits: Limits, policy: Policy) -> March:
    """Follow a branch from a point along its tangent until it ends; the first row is the point after it."""
    found = March()
    try:
        _Marching(found, limits, policy).follow(point)
    except KeyboardInterrupt:  # `both_ways` raises it again, with what was found
        found.ending = "interrupted"
    return found


class _Marching:
    """A march under way: the curve and its last points, the step size, and the numbers that are watched."""

    def __init__(self, found: March, limits: Limits, policy: Policy) -> None:
        self.found, self.limits, self.policy = found, limits, policy
        self.ds, self.easy = min(FIRST, limits.largest), 1.0
        self.circle: Place | None = None  # a point that is met again if the branch goes round (Brent's method)
        self.again = 8

    def follow(self, point: Any) -> None:
        """March on, point by point."""
        found = self.found
        self._begin(point.curve.renewed(point) or point)
        while len(found.rows) < self.limits.points:
            new = self._next()
            step = None if new is None else self._within(new)
            met = None if step is None else first_met(step, self.policy.boundaries)
            if new is not None and met is None:  # an event that is not located: nearer
                self.ds *= 0.25
                if self.ds >= LEAST_STEP:
                    continue
            if step is None or met is None:
                limit = self._limit()
                if not limit:
                    found.ending = self.policy.why(self.point)
                if not limit or not self._change(limit):
                    return
                continue
            if not met and step.cause in self.policy.unseen_on and (unseen := self.policy.unseen(step)):
                met = [unseen]
            if met and (beyond := self._beyond(met[0].point, BESIDE)):  # behind a turn that lies beyond the edge
                step.ends("range", met[0].s, self._at_edge(step.a, met[0].point, *beyond[0]))
            elif met:
                step.ends("change", met[0].s, met[0].point)
            self._close(step)
            if self._special(step):
                return
            if step.cause in ("range", "closed"):
                found.add(step.last)
                found.ending = step.cause
                return
            if step.cause == "change":
                if not self._change(met):
                    return
            elif self._ended(step):
                return

    def _change(self, met: list[Met]) -> bool:
        """Go on behind the boundaries ``met``; False where the branch ends there."""
        after = self.policy.behind(self.found, met)
        if after is None:
            return False
        self._begin(after)
        self.ds = 0.1 * self.limits.largest
        self.found.add(after)
        return True

    def _limit(self) -> list[Met]:
        """The boundaries to which the branch has come in the limit: its equations have no derivatives there."""
        point, near = self.point, np.full(len(self.policy.boundaries), np.inf)  # as chords of the margins end
        for row in self.found.rows:
            if row.point.curve is self.curve:
                fallen = np.nan_to_num(self.curve.margins(row.point)) - np.nan_to_num(self.margins)
                s = np.where(fallen > 0.0, float(np.abs(point.Y - row.point.Y).max()), np.inf)
                near = np.fmin(near, np.abs(self.margins) * s / np.abs(fallen))
        return [
            Met(kind, 0.0, point, kind.name)
            for kind, s in zip(self.policy.boundaries, near, strict=True)
            if s < AT_LIMIT
        ]

    def _begin(self, point: Any) -> None:
        """Go on from a point of a curve."""
        self.curve, self.before, self.point = point.curve, None, point
        self.numbers, self.margins = self._watched(self.point)

    def _watched(self, point: Any) -> tuple[list[float], Any]:
        """The numbers of all kinds of events at a point, and its margins to the boundaries."""
        return [kind.number(point) for kind in self.policy.kinds], self.curve.margins(point)

    def _next(self) -> Any:
        """The next point, at a distance at which it is like the last one; None where there is none."""
        curve, point = self.curve, self.point
        while True:
            new = curve.step(point, self.ds, self.before)
            if new is None:
                self.ds *= 0.5
                if self.ds < LEAST_STEP:
                    return None
                continue
            cosine, spread = float(new.tangent @ point.tangent), curve.spread(new, point)
            if self.ds > 1e-6 and (cosine < COSINE or spread > SPREAD):
                self.ds *= max(0.2, min(0.7, 0.7 * SPREAD / max(spread, 1e-12)))
                continue
            self.easy = _easy(new.iterations, 1.0 - cosine, spread)
            return new

    def _within(self, new: Any) -> Step | None:
        """The step to the new point, or to the edge of the range before it; None where that is not found."""
        reached, s = new, np.inf
        for which, edge in self._beyond(new):
            last = self.curve.at_edge(self.point, new, edge, which)
            if last is None:
                return None
            if (there := self.point.along(last.Y)) < s:
                reached, s = last, there
        numbers, margins = self._watched(reached)
        return Step(
            self.point,
            reached,
            (self.numbers, numbers),
            (self.margins, margins),
            not self.found.rows,
            self.limits.virtual,
            "" if reached is new else "range",
        )

    def _close(self, step: Step) -> None:
        """End a step where the branch comes back to its beginning."""
        back = came_back(self.limits.closed, step) if len(self.found.rows) >= 3 else None
        if back is not None:
            step.ends("closed", *back)

    def _special(self, step: Step) -> bool:
        """List the special points of a step; True where the branch ends at one."""
        met = special_on(step, self.policy.kinds)
        if step.virtual:
            met = sorted([*met, *self.policy.passed_by(step)], key=lambda one: one.s)
        for one in met:
            for which, edge in self._beyond(one.point):  # a fold just beyond the edge of the range
                step.ends("range", one.s, self._at_edge(step.a, one.point, which, edge))
                return False
            self.policy.record(self.found, step, one)
            if one.ending is not None:
                self.found.ending = one.ending
                return True
        return False

    def _at_edge(self, a: Any, b: Any, which: int, edge: float) -> Any:
        """The point at an edge of the range between two points, the second if it is not found: beside a turn the parts
        are halved that a chord does not follow."""
        last = b
        for _ in range(HALVED):
            if (found := self.curve.at_edge(a, b, edge, which)) is not None:
                return found
            middle = self.curve.between(a, b, 0.5 * a.along(b.Y))
            if middle is None:
                break
            a, b = (a, middle) if self._beyond(middle) else (middle, b)
        return last

    def _beyond(self, point: Any, least: float = 0.0) -> list[tuple[int, float]]:
        """The edges of the range that a point lies beyond, by ``least`` of its width: places of parameters, each with
        its edge."""
        found = []
        for which, low, high in self.limits.box:
            edge = low if point.X[which] < low else high
            if not low <= point.X[which] <= high and abs(point.X[which] - edge) >= least * (high - low):
                found.append((which, edge))
        return found

    def _ended(self, step: Step) -> bool:
        """Take the step; True where the branch ends with it."""
        found, curve, new = self.found, self.curve, step.b
        found.add(new)
        ending = self.policy.over(new)
        if ending is None and new.virtual and came_back(self.circle, step) is not None:
            ending = "circle"
        if ending is not None:
            found.ending = ending
            return True
        if len(found.rows) >= 2 * self.again:
            self.circle, self.again = curve.landmark(new), len(found.rows)
        self.ds = min(self.ds * self.easy, self.limits.largest)
        if renewed := curve.renewed(new):
            self._begin(renewed)
        else:
            self.before, self.point = self.point, new
            self.numbers, self.margins = step.numbers[1], step.margins[1]
        return False


def _easy(iterations: int, bend: float, spread: float) -> float:
    """The factor of the next step, from Newton's iterations and how much neighbours differ."""
    easy = 2.0 if iterations <= 3 else 1.3
    if bend > 0.3 * (1.0 - COSINE):
        easy = min(easy, float(np.sqrt(0.5 * (1.0 - COSINE) / bend)))
    if spread > 0.3 * SPREAD:
        easy = min(easy, SPREAD / max(spread, 1e-12) * 0.6)
    return min(easy, 0.7) if iterations >= 6 else easy


def came_back(place: Place | None, step: Step) -> tuple[float, Any] | None:
    """Distance along the step at which the branch comes back to a place, and the point; None where it does not.

    A chord as near as this may belong to another part of the branch: the point is solved there."""
    if place is None or float(np.abs(step.b.Y - step.a.Y).max()) >= 0.2:
        return None
    (word, X, seen), curve = place, step.curve
    if word == curve.word():
        Y = X / curve.scale
        x, s = passing(Y, step.a.Y, step.b.Y), step.a.along(Y)
    else:
        x = passing(seen, curve.seen(step.a), curve.seen(step.b))
        s = (x or 0.0) * step.end
    if x is None or s > step.stop or (point := curve.between(step.a, step.b, s)) is None:
        return None
    last = curve.at_landmark(point, place)
    return None if last is None else (s, last)
