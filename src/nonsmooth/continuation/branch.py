"""Marching along a branch: steps, what is met on the way, changes of signature, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.arclength import Curve, Point, chordal
from nonsmooth.continuation.change import Change, changed, common_point, resumed
from nonsmooth.continuation.detection import Tests
from nonsmooth.continuation.events import (
    BESIDE,
    Event,
    at_edge,
    edge_before_fold,
    first_met,
    passed,
    smooth_events,
    swing,
)
from nonsmooth.continuation.grazing import Graze, graze
from nonsmooth.continuation.path import VIOLATIONS
from nonsmooth.continuation.switching import is_doubled
from nonsmooth.errors import SystemDefinitionError

__all__ = ["ENDINGS", "March", "Row", "Special", "march"]

FloatArray = NDArray[np.float64]

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
LEAST_STEP = 1e-9
COSINE = 0.98  # of the angle between the tangents of neighbours
SPREAD = 0.15  # chordal change of the multipliers between neighbours
SMALL = 2e-3  # of the first orbit's size: a cycle this small is about to vanish in a Hopf bifurcation


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


def march(curve: Curve, point: Point, limits: Limits, first_step: float) -> March:
    """Follow a branch from a point along its tangent until it ends; the first row is the point after it."""
    found = March()
    try:
        _follow(found, curve, point, limits, first_step)
    except KeyboardInterrupt:  # what was found stands
        found.ending = "interrupted"
    return found


def _follow(found: March, curve: Curve, point: Point, limits: Limits, first_step: float) -> None:
    """March on, point by point, into ``found``."""
    ds = first_step
    if curve.shooting.reference is not None:
        point = curve.anchored_anew(point)
    tests = Tests(curve)
    numbers, violation = tests.smooth(point), point.path.violation()
    before: Point | None = None
    count = 0
    circle, again = None, 8  # a point that is met again if the branch goes round (Brent's method)
    while len(found.rows) < limits.points:
        new = _stepped(curve, point, ds, before)
        if new is None:
            ds *= 0.5
            if ds < LEAST_STEP:
                found.ending = _reason(curve, point)
                break
            continue
        cosine = float(new.tangent @ point.tangent)
        spread = chordal(new.multipliers, point.multipliers)
        if ds > 1e-6 and (cosine < COSINE or spread > SPREAD):
            ds *= max(0.2, min(0.7, 0.7 * SPREAD / spread))
            continue
        numbers_new, violation_new = tests.smooth(new), new.path.violation()
        # What was met on this step, in the order in which it was met
        end = float(point.tangent @ (new.Y - point.Y))
        stop, stop_point, reason = end, new, ""
        value = float(new.X[-1])
        if not limits.low <= value <= limits.high:
            edge = limits.low if value < limits.low else limits.high
            last = at_edge(curve, point, new, edge)
            if last is not None:
                s = float(point.tangent @ (last.Y - point.Y))
                stop, stop_point, reason = s, last, "range"
                numbers_new, violation_new = tests.smooth(last), last.path.violation()
            else:
                ds *= 0.5
                if ds < LEAST_STEP:
                    found.ending = "no_convergence"
                    break
                continue
        crossed = [kind for kind, was, now in zip(VIOLATIONS, violation, violation_new, strict=True)
                   if now < 0.0 and (was >= 0.0 or not (found.rows or limits.virtual))
                   and (not limits.virtual or (kind == "short" and _at_section(curve, new)))]  # fmt: skip
        met = first_met(curve, point, new, tests, crossed, stop)
        if crossed and not met and reason != "range":
            ds *= 0.25
            if ds < LEAST_STEP:
                found.ending = "no_convergence"
                break
            continue
        if met:
            stop, stop_point, reason = met[0][1], met[0][2], "change"
            numbers_new = tests.smooth(stop_point)
        events = smooth_events(curve, point, new, tests, numbers, numbers_new, stop, reason)
        if limits.virtual:
            beyond = passed(curve, point, new, tests, violation, violation_new, stop)
            events = sorted([*events, *_apart(beyond, found, met)], key=lambda event: event[1])
        for kind, _, special in events:
            if kind in VIOLATIONS:
                _pass(found, curve, kind, special)
                continue
            if not limits.low <= float(special.X[-1]) <= limits.high:  # a fold just beyond the edge of the range
                stop_point, reason = edge_before_fold(curve, point, special, limits.low, limits.high), "range"
                break
            found.mark(kind, curve, special, virtual=limits.virtual and bool((special.path.violation() < 0.0).any()))
            if kind in ("hopf", "flip_end"):
                found.ending = "equilibrium" if kind == "hopf" else "branching"
                found.special[-1].kind = "hopf" if kind == "hopf" else "flip"
                return
        if reason == "range":
            found.add(curve, stop_point)
            found.ending = "range"
            break
        if reason == "change":
            after = _change(found, curve, met)
            if after is None:
                break
            curve, point, ds = after
            before = None
            ds = ds or 0.1 * limits.largest
            tests = Tests(curve)
            numbers, violation = tests.smooth(point), point.path.violation()
            count = 0
            found.add(curve, point)
            continue
        found.add(curve, new)
        count += 1
        if _shrunk(curve, new):
            found.ending = "equilibrium"
            break
        if limits.virtual and (found.rows[-1].virtual and circle and _closed(circle, curve, point, new)):
            found.ending = "circle"
            break
        if len(found.rows) >= 2 * again:
            circle, again = (curve, new), len(found.rows)
        if limits.closed is not None and count > 2 and _closed(limits.closed, curve, point, new):
            found.ending = "closed"
            break
        easy = 2.0 if new.iterations <= 3 else 1.3
        bend = 1.0 - cosine
        if bend > 0.3 * (1.0 - COSINE):
            easy = min(easy, float(np.sqrt(0.5 * (1.0 - COSINE) / bend)))
        if spread > 0.3 * SPREAD:
            easy = min(easy, SPREAD / max(spread, 1e-12) * 0.6)
        if new.iterations >= 6:
            easy = min(easy, 0.7)
        ds = min(ds * easy, limits.largest)
        before, point, numbers, violation = point, new, numbers_new, violation_new
        if curve.shooting.reference is not None:
            before, point = None, curve.anchored_anew(point)


def _stepped(curve: Curve, point: Point, ds: float, before: Point | None) -> Point | None:
    try:
        new = curve.step(point, ds, before)
    except SystemDefinitionError:
        return None
    if new is None or not np.isfinite(new.M).all():
        return None
    # Newton may have gone to another branch: then the point lies far from the predictor.
    if np.abs(new.Y - point.Y - ds * point.tangent).max() > 0.5 * ds + 1e-12:
        return None
    return new


def _shrunk(curve: Curve, point: Point) -> bool:
    """Whether an autonomous orbit has all but shrunk to an equilibrium."""
    return swing(curve, point) < SMALL


def _at_section(curve: Curve, point: Point) -> bool:
    """Whether the visit that has become shortest begins or ends at the section of a forced orbit."""
    return curve.shooting.forced and int(point.path.tau.argmin()) in (0, curve.shooting.m)


def _apart(passed_by: list[Event], found: March, met: list[Event]) -> list[Event]:
    """Boundaries passed that are not where the march begins, nor what turns the section."""
    begun = 0.0 if found.rows else BESIDE
    taken = [s for _, s, _ in met]
    return [event for event in passed_by if event[1] > begun and all(abs(event[1] - s) > BESIDE for s in taken)]


def _pass(found: March, curve: Curve, kind: str, point: Point) -> None:
    """Record a boundary that a virtual branch passes with its signature."""
    for change in changed(curve, point, kind):
        after = resumed(curve, point, change, curve.shooting.active)
        if after is None:
            continue
        if change.kind == "grazing":
            _mark_graze(found, curve, point, change, after)
            return
    _mark_unexplained(found, curve, kind, point)


def _mark_graze(found: March, curve: Curve, point: Point, change: Change, after: tuple[Curve, Point, float]) -> None:
    """Record a graze: the orbit without the contact, whichever side the branch came from."""
    fresh, first, _ = after
    judged = graze(curve, point, first, change)
    free = (curve, point) if change.gained else (fresh, common_point(curve, point, change) or first)
    found.mark("grazing", *free, indicator=change.indicator, graze=judged)


def _mark_unexplained(found: March, curve: Curve, kind: str, point: Point) -> str:
    """Record a boundary beyond which no orbit of another signature is known; its name."""
    name = "grazing" if kind in ("touch", "slow", "short") else "corner"
    if kind == "short" and 0 < (i := int(point.path.tau.argmin())) < curve.shooting.m:
        visits = curve.shooting.signature.visits
        name = "grazing" if visits[i - 1].mode == visits[i + 1].mode else "corner"
    known = [change.indicator for change in changed(curve, point, kind)]
    found.mark(name, curve, point, indicator=known[0] if known else _indicator(curve, point, kind))
    return name


def _change(found: March, curve: Curve, met: list[Event]) -> tuple[Curve, Point, float] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    for kind, _, point in met:
        for change in changed(curve, point, kind):
            after = resumed(curve, point, change, curve.shooting.active)
            if after is None:
                continue
            fresh, first, ds = after
            if change.kind == "grazing":
                _mark_graze(found, curve, point, change, after)
            elif change.kind == "corner":
                found.mark("corner", curve, point, indicator=change.indicator)
            if change.kind != "section" and is_doubled(fresh, first) and not is_doubled(curve, point):
                # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
                found.ending = "branching"
                return None
            return fresh, first, ds
    kind, _, point = met[0]
    name = _mark_unexplained(found, curve, kind, point)
    found.ending = "landing" if kind == "landed" else name
    return None


def _indicator(curve: Curve, point: Point, kind: str) -> int:
    """The indicator that an unexplained event is about (-1: not known)."""
    if kind == "touch":
        visit, k = point.path.touched
        return int(curve.walk.rows[point.path.which[visit, k], 0])
    if kind == "landed":
        k = int(point.path.landing[int(point.path.landed.argmax())])
        rows = curve.walk.rows[curve.walk.transitions[k, 2] : curve.walk.transitions[k, 3], 0]
        return int(rows[0]) if len(rows) == 1 else -1
    return -1


def _closed(begin: tuple[Curve, Point], curve: Curve, a: Point, b: Point) -> bool:
    """Whether the branch has come back to its first point on the step from a to b."""
    curve0, first = begin
    if curve0.shooting.signature != curve.shooting.signature or len(first.Y) != len(b.Y):
        return False
    first_Y = first.X / curve.scale
    step = b.Y - a.Y
    x = float(step @ (first_Y - a.Y)) / float(step @ step)
    near = float(np.abs(first_Y - a.Y - x * step).max())
    return 1e-9 < x <= 1.0 and near < 0.3 * float(np.abs(step).max()) and np.abs(step).max() < 0.2


def _reason(curve: Curve, point: Point) -> str:
    """Why no further point was found."""
    system = curve.shooting.system
    name = curve.shooting.active[0]
    ahead = float(point.X[-1]) + 1e-6 * curve.width * float(np.sign(point.tangent[-1]))
    try:
        system.with_parameters({name: ahead})
    except (SystemDefinitionError, ValueError):
        return "physical"
    return "no_convergence"
