"""Events on one step of a branch: boundaries of the signature, special points, the edge of the range."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.branches.switching import branch_point, is_doubled
from nonsmooth.continuation.march.arclength import Curve, Point
from nonsmooth.continuation.march.detection import SMOOTH, Tests, locate
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.solve import determinant
from nonsmooth.continuation.signature.path import VIOLATIONS
from nonsmooth.continuation.signature.rounds import Rounds

__all__ = [
    "BESIDE", "Event", "at_edge", "at_section", "edge_before_fold", "first_met", "first_unseen", "passed",
    "smooth_events", "swing",
]  # fmt: skip

FloatArray = NDArray[np.float64]
Event = tuple[str, float, Point]  # kind, distance from the last point, the orbit there
NOTHING = 2e-2  # of the first orbit's size: a fold there is the cycle's birth
UNSEEN = 1e-10  # along the branch: as near as an event is located that only simulations show
TURN = 1e-5  # along the branch: a fold nearer to a crossing of branches than this is that crossing
EXPLAINS = ("short", "slow", "own", "touch", "others", "landed")
BESIDE = 1e-6  # along the branch: nearer to a change of signature than this is the change itself
ABOUT = 1e-2  # along the branch: steps are short beside a crossing of branches, and its first place is rough
CLOSING = 1e-4  # along the branch: nearer to its first point than this is that point, a crossing of branches maybe
ROUNDING = 1e-13  # numbers below this are zero, however short the step
SAME = 1e-9  # of the numbers at both ends: smaller than this at the place of another event is the same event
POLE = 1e-2  # of a multiplier from 1 or -1: farther off it is no fold, no flip, but a contact of no length
ENDS = 1e-4  # of the period: a maximum as near to a crossing belongs to it
JUMP = 1e-3  # of the numbers at both ends: one larger than this at its root has jumped there


def first_met(curve: Curve, a: Point, b: Point, tests: Tests, crossed: list[str], stop: float) -> list[Event]:
    """The first boundary on the step from a to b: all that is met there, what explains it best first.

    Beyond the place where an impact or a short visit ends the path also goes through the boundary, and the other way
    round: what vanishes explains what is touched.
    """
    located: list[Event] = []
    for kind in sorted(crossed, key=EXPLAINS.index):
        number = tests.one(kind)
        known = [(number(point), s, point) for _, s, point in located]
        # Both are infinite where a visit has turned negative: it is not followed.
        largest = max((abs(x) for x in (number(a), number(b)) if np.isfinite(x)), default=0.0)
        same = [(kind, s, point) for value, s, point in known if abs(value) < max(SAME * largest, ROUNDING)]
        if same or any(value > 0.0 for value, _, _ in known):  # met at the same place, or farther on
            located += same[:1]
            continue
        there = locate(curve, a, b, number)
        if there is not None and there[0] <= stop * (1 + 1e-12):
            located.append((kind, *there))
    if not located:
        return []
    first = min(s for _, s, _ in located)
    together = [event for event in located if event[1] <= first + BESIDE]
    return sorted(together, key=lambda event: EXPLAINS.index(event[0]))


def first_unseen(curve: Curve, rounds: Rounds, a: Point, b: Point) -> tuple[float, Point] | None:
    """The first place on the step from a to b where a simulated round takes other transitions than the signature.

    Margins are looked at in parts of a step: of two extremes within a part none shows. A simulation isolates them."""
    low, high, there = 0.0, float(a.tangent @ (b.Y - a.Y)), b
    while high - low > UNSEEN:
        middle = 0.5 * (low + high)
        point = curve.between(a, b, middle)
        if point is None:
            return None
        if rounds.shows(curve.shooting, point.X, point.solved.values):
            low = middle
        else:
            high, there = middle, point
    return high, there


def swing(curve: Curve, point: Point) -> float:
    """The range of an autonomous orbit without transitions, in units of the first one's; else 1."""
    if curve.shooting.forced or curve.shooting.m:
        return 1.0
    swing = (point.path.maximum - point.path.minimum) / curve.size[: len(point.path.maximum)]
    return float(np.nanmax(swing))


def at_edge(curve: Curve, a: Point, b: Point, edge: float) -> Point | None:
    """The point at the edge of the range, between two points."""
    x = (edge / curve.width - a.Y[-1]) / (b.Y[-1] - a.Y[-1])
    point = curve.at_parameter(a.Y + x * (b.Y - a.Y), edge)
    if point is None or np.abs(point.Y - a.Y).max() > 4 * np.abs(b.Y - a.Y).max():
        return None
    if float(point.tangent @ a.tangent) < 0:
        point.tangent = -point.tangent
    return point


def at_section(curve: Curve, point: Point) -> bool:
    """Return whether the visit that has become shortest begins or ends at the section of a forced orbit."""
    return curve.shooting.forced and int(point.path.tau.argmin()) in (0, curve.shooting.m)


def edge_before_fold(curve: Curve, point: Point, fold: Point, low: float, high: float) -> Point:
    """Return where the branch leaves the range before it turns; the fold where they are too near to tell apart."""
    edge = low if float(fold.X[-1]) < low else high
    return at_edge(curve, point, fold, edge) or fold


def passed(
    curve: Curve, a: Point, b: Point, tests: Tests, before: FloatArray, after: FloatArray, stop: float
) -> list[Event]:
    """Boundaries that a virtual branch passes before ``stop``, either way; of those met together the best explained."""
    found: list[Event] = []
    for kind, was, now in zip(VIOLATIONS, before, after, strict=True):
        if not was * now < 0.0:
            continue
        number = tests.one(kind)
        there = locate(curve, a, b, number)
        if there is None or there[0] > stop or abs(number(there[1])) > JUMP * min(max(abs(was), abs(now)), 1e3):
            continue
        if kind == "touch" and _at_an_end(there[1]):
            continue  # the other side of an impact of no speed
        if kind == "landed" and int(there[1].path.landed.argmax()) == 0:
            continue  # the section passes behind the boundary, the orbit was there before
        found.append((kind, *there))
    found.sort(key=lambda event: EXPLAINS.index(event[0]))
    kept: list[Event] = []
    for event in found:
        if all(abs(event[1] - other[1]) > BESIDE for other in kept):
            kept.append(event)
    return kept


def _at_an_end(point: Point) -> bool:
    """Return whether the largest margin stands where its visit begins or ends."""
    visit, k = point.path.touched
    times = point.solved.times
    ends = np.abs(times[visit : visit + 2] - point.path.place[visit, k])
    return float(ends.min()) < ENDS * float(times[-1])


def smooth_events(
    curve: Curve, a: Point, b: Point, tests: Tests, before: FloatArray, after: FloatArray, stop: float, reason: str
) -> list[Event]:
    """Folds, flips, tori and branch points before ``stop``, in their order."""
    found = []
    last = after if reason != "change" else tests.smooth(b)
    for kind, was, now in zip(SMOOTH, before, last, strict=True):
        if not was * now < 0.0:
            continue
        there = locate(curve, a, b, tests.one(kind)) if kind != "branch" else _branch_point(curve, a, b, tests)
        # Beyond a change of signature nothing is missed.
        if there is None and kind != "branch" and (reason != "change" or was * after[SMOOTH.index(kind)] < 0.0):
            warnings.warn(
                f"a {kind.replace('_', '-')} between the parameter's values {float(a.X[-1])!r} and {float(b.X[-1])!r} "
                "was met but not located, and is not listed",
                RuntimeWarning,
                stacklevel=2,
            )
        # At a change of signature the parameter may turn too: that belongs to the change. Where a branch closes its
        # first point has been looked at.
        if there is None or there[0] > stop - {"change": BESIDE, "closed": CLOSING}.get(reason, 0.0):
            continue
        s, point = there
        if kind == "neimark_sacker" and not _has_pair(point):
            continue
        if kind == "flip" and np.abs(point.multipliers + 1.0).min() > POLE:
            continue
        if kind in ("fold", "branch") and curve.shooting.forced and np.abs(point.multipliers - 1.0).min() > POLE:
            continue  # a contact of no length turns the parameter or the determinant's sign too, without a multiplier 1
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
    if Y is None or np.abs(Y - there[1].Y).max() > max(float(np.abs(b.Y - a.Y).max()), ABOUT):
        return there
    shooting = curve.shooting
    solved = shooting.evaluate(Y * curve.scale)
    path, M = curve.walk.along(solved, shooting.split(solved.X)[1]), solved.monodromy
    if path is None or not np.isfinite(M).all():
        return there
    # Any direction in the plane of both branches is null here, and the border is singular: keep that of the branch.
    point = replace(there[1], Y=Y, solved=solved, M=M, multipliers=multipliers_of(M), path=path)
    return float(a.tangent @ (Y - a.Y)), point


def _has_pair(point: Point) -> bool:
    mu = point.multipliers
    near = mu[np.abs(np.abs(mu) - 1.0) < 1e-3]
    return bool((np.abs(near.imag) > 1e-6).any())


def _name(kind: str, curve: Curve, point: Point) -> str:
    """Name a crossing of branches: the flip of the orbit of half the period, a pitchfork where a symmetry breaks."""
    if kind == "fold" and swing(curve, point) < NOTHING:
        return "hopf"
    if kind != "branch":
        return kind
    from nonsmooth.continuation.branches.switching import breaks_symmetry

    if is_doubled(curve, point):
        return "flip_end"
    return "pitchfork" if breaks_symmetry(curve, point) else "branch_point"
