"""Marching along a branch: steps, what is met on the way, changes of signature, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.arclength import Curve, Point, chordal
from nonsmooth.continuation.change import changed, common_point, resumed
from nonsmooth.continuation.detection import SMOOTH, Tests, locate
from nonsmooth.continuation.grazing import Graze, graze
from nonsmooth.continuation.path import VIOLATIONS
from nonsmooth.continuation.solve import determinant
from nonsmooth.continuation.switching import branch_point, is_doubled
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
    "landing": (
        "A reset leads just onto a boundary: beyond this point it leads behind it, where another transition follows at "
        "the same instant."
    ),
}
LEAST_STEP = 1e-9
COSINE = 0.98  # of the angle between the tangents of neighbours
SPREAD = 0.15  # chordal change of the multipliers between neighbours
NOTHING = 2e-2  # of the first orbit's size: a fold there is the cycle's birth
SMALL = 2e-3  # of the first orbit's size: a cycle this small is about to vanish in a Hopf bifurcation
TURN = 1e-5  # along the branch: a fold nearer to a crossing of branches than this is that crossing
EXPLAINS = ("short", "slow", "own", "touch", "others", "landed")
BESIDE = 1e-6  # along the branch: nearer to a change of signature than this is the change itself


@dataclass
class Row:
    """One point of the branch with the curve it lies on."""

    curve: Curve
    point: Point


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
        self.rows.append(Row(curve, point))

    def mark(self, kind: str, curve: Curve, point: Point, **more: Any) -> None:
        """Append a special point, and a row for it."""
        self.rows.append(Row(curve, point))
        self.special.append(Special(kind, curve, point, len(self.rows) - 1, **more))


@dataclass
class Limits:
    """What bounds a march."""

    low: float
    high: float
    largest: float  # step
    points: int
    closed: tuple[Curve, Point] | None = None


def march(curve: Curve, point: Point, limits: Limits, first_step: float) -> March:
    """Follow a branch from a point along its tangent until it ends; the first row is the point after it."""
    found = March()
    ds = first_step
    if curve.shooting.reference is not None:
        point = curve.anchored_anew(point)
    tests = Tests(curve)
    numbers, violation = tests.smooth(point), point.path.violation()
    count = 0
    while len(found.rows) < limits.points:
        new = _stepped(curve, point, ds)
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
            last = _at_edge(curve, point, new, edge)
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
                   if now < 0.0 and (was >= 0.0 or not found.rows)]  # fmt: skip
        met = _first_met(curve, point, new, tests, crossed, stop)
        if crossed and not met and reason != "range":
            ds *= 0.25
            if ds < LEAST_STEP:
                found.ending = "no_convergence"
                break
            continue
        if met:
            stop, stop_point, reason = met[0][1], met[0][2], "change"
            numbers_new = tests.smooth(stop_point)
        for kind, _, special in _smooth_events(curve, point, new, tests, numbers, numbers_new, stop, reason):
            if not limits.low <= float(special.X[-1]) <= limits.high:  # a fold just beyond the edge of the range
                stop_point, reason = _edge_before_fold(curve, point, special, limits), "range"
                break
            found.mark(kind, curve, special)
            if kind in ("hopf", "flip_end"):
                found.ending = "equilibrium" if kind == "hopf" else "branching"
                found.special[-1].kind = "hopf" if kind == "hopf" else "flip"
                return found
        if reason == "range":
            found.add(curve, stop_point)
            found.ending = "range"
            break
        if reason == "change":
            after = _change(found, curve, met)
            if after is None:
                break
            curve, point, ds = after
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
        point, numbers, violation = new, numbers_new, violation_new
        if curve.shooting.reference is not None:
            point = curve.anchored_anew(point)
    return found


def _stepped(curve: Curve, point: Point, ds: float) -> Point | None:
    try:
        new = curve.step(point, ds)
    except SystemDefinitionError:
        return None
    if new is None or not np.isfinite(new.M).all():
        return None
    # Newton may have gone to another branch: then the point lies far from the predictor.
    if np.abs(new.Y - point.Y - ds * point.tangent).max() > 0.5 * ds + 1e-12:
        return None
    return new


def _first_met(
    curve: Curve, a: Point, b: Point, tests: Tests, crossed: list[str], stop: float
) -> list[tuple[str, float, Point]]:
    """The first boundary on the step from a to b: all that is met there, what explains it best first.

    Beyond the place where an impact or a short visit ends the path also goes through the boundary, and the other way
    round: what vanishes explains what is touched.
    """
    located = []
    for kind in crossed:
        there = locate(curve, a, b, tests.one(kind))
        if there is not None and there[0] <= stop * (1 + 1e-12):
            located.append((kind, *there))
    if not located:
        return []
    first = min(s for _, s, _ in located)
    together = [event for event in located if event[1] <= first + BESIDE]
    return sorted(together, key=lambda event: EXPLAINS.index(event[0]))


def _shrunk(curve: Curve, point: Point) -> bool:
    """Whether an autonomous orbit has all but shrunk to an equilibrium."""
    return _swing(curve, point) < SMALL


def _swing(curve: Curve, point: Point) -> float:
    """The range of an autonomous orbit without transitions, in units of the first one's; else 1."""
    if curve.shooting.forced or curve.shooting.m:
        return 1.0
    swing = (point.path.maximum - point.path.minimum) / curve.size[: len(point.path.maximum)]
    return float(np.nanmax(swing))


def _at_edge(curve: Curve, a: Point, b: Point, edge: float) -> Point | None:
    """The point at the edge of the range, between two points."""
    x = (edge / curve.width - a.Y[-1]) / (b.Y[-1] - a.Y[-1])
    point = curve.at_parameter(a.Y + x * (b.Y - a.Y), edge)
    if point is None or np.abs(point.Y - a.Y).max() > 4 * np.abs(b.Y - a.Y).max():
        return None
    if float(point.tangent @ a.tangent) < 0:
        point.tangent = -point.tangent
    return point


def _edge_before_fold(curve: Curve, point: Point, fold: Point, limits: Limits) -> Point:
    """Where the branch leaves the range before it turns; the fold itself where they are too near to tell apart."""
    edge = limits.low if float(fold.X[-1]) < limits.low else limits.high
    return _at_edge(curve, point, fold, edge) or fold


def _smooth_events(
    curve: Curve, a: Point, b: Point, tests: Tests, before: FloatArray, after: FloatArray, stop: float, reason: str
) -> list[tuple[str, float, Point]]:
    """Folds, flips, tori and branch points before ``stop``, in their order."""
    found = []
    last = after if reason != "change" else tests.smooth(b)
    for kind, was, now in zip(SMOOTH, before, last, strict=True):
        if not was * now < 0.0:
            continue
        there = locate(curve, a, b, tests.one(kind)) if kind != "branch" else _branch_point(curve, a, b, tests)
        # At a change of signature the parameter may turn too: that belongs to the change.
        if there is None or there[0] > stop - (BESIDE if reason == "change" else 0.0):
            continue
        s, point = there
        if kind == "neimark_sacker" and not _has_pair(point, tests):
            continue
        found.append((_name(kind, curve, point), s, point))
    # A branch that crosses another one where the parameter turns is one event, not two.
    crossings = [s for kind, s, _ in found if kind in ("pitchfork", "branch_point", "flip_end")]
    found = [event for event in found if event[0] != "fold" or all(abs(event[1] - s) > TURN for s in crossings)]
    return sorted(found, key=lambda event: event[1])


def _branch_point(curve: Curve, a: Point, b: Point, tests: Tests) -> tuple[float, Point] | None:
    """A branch point: the bordered determinant itself, scaled, goes through zero."""

    def number(point: Point) -> float:
        matrix = np.vstack([point.solved.jacobian * curve.weights, point.tangent])
        sign, size = determinant(matrix)
        return float(sign * np.exp(size - reference))

    reference = 0.0
    reference = determinant(np.vstack([a.solved.jacobian * curve.weights, a.tangent]))[1]
    there = locate(curve, a, b, number)
    if there is None:
        return None
    Y = branch_point(curve, there[1].Y)
    if Y is None or np.abs(Y - there[1].Y).max() > np.abs(b.Y - a.Y).max():
        return there
    solved = curve.shooting.evaluate(Y * curve.scale)
    point = curve.point(solved, Y, there[1].tangent)
    if point is None:
        return there
    # Any direction in the plane of both branches is null here: keep that of the branch.
    return float(a.tangent @ (Y - a.Y)), replace(point, tangent=there[1].tangent)


def _has_pair(point: Point, tests: Tests) -> bool:
    mu = point.multipliers
    near = mu[np.abs(np.abs(mu) - 1.0) < 1e-3]
    return bool((np.abs(near.imag) > 1e-6).any())


def _name(kind: str, curve: Curve, point: Point) -> str:
    """What a crossing of branches is: the flip where a doubled orbit is born, a pitchfork where a symmetry breaks."""
    if kind == "fold" and _swing(curve, point) < NOTHING:
        return "hopf"
    if kind != "branch":
        return kind
    from nonsmooth.continuation.switching import breaks_symmetry

    if is_doubled(curve, point):
        return "flip_end"
    return "pitchfork" if breaks_symmetry(curve, point) else "branch_point"


def _change(found: March, curve: Curve, met: list[tuple[str, float, Point]]) -> tuple[Curve, Point, float] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    for kind, _, point in met:
        for change in changed(curve, point, kind):
            after = resumed(curve, point, change, curve.shooting.active)
            if after is None:
                continue
            fresh, first, ds = after
            if change.kind == "grazing":
                judged = graze(curve, point, first, change)
                # The point is kept as the orbit without the contact, whichever side the branch came from.
                free = (curve, point) if change.gained else (fresh, common_point(curve, point, change) or first)
                found.mark("grazing", *free, indicator=change.indicator, graze=judged)
            elif change.kind == "corner":
                found.mark("corner", curve, point, indicator=change.indicator)
            if change.kind != "section" and is_doubled(fresh, first) and not is_doubled(curve, point):
                # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
                found.ending = "branching"
                return None
            return fresh, first, ds
    kind, _, point = met[0]
    name = "grazing" if kind in ("touch", "slow", "short") else "corner"
    ending = "landing" if kind == "landed" else name
    known = [change.indicator for change in changed(curve, point, kind)]
    found.mark(name, curve, point, indicator=known[0] if known else _indicator(curve, point, kind))
    found.ending = ending
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
