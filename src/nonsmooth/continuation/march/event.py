r"""Events on one step of a branch: the number that vanishes there, its exact place, and the name it is listed by.

A kind of event is an object of a class below or of one that a problem adds. It watches a number along the branch; the
zero is bracketed by the ends of a step and found by Brent's method, every trial being a solved point.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nonsmooth.continuation.problems.curve import Point, branch_point, tangents
from nonsmooth.continuation.problems.solve import determinant

ROUNDING = 1e-13  # of the numbers at both ends: smaller than this is zero, however short the step
PLACE = 1e-11  # of a step: a bracket narrower than this is noise of solved points
LARGEST = 1e3  # of a number, for Brent's method: margins may be infinite
BESIDE = 1e-6  # along the branch: nearer to a boundary than this is the boundary itself
TURNED = 1e-7  # along the branch: nearer to a change of equations than this the parameter turns with it
CLOSING = 1e-4  # along the branch: nearer to its first point than this is that point, a crossing of branches maybe
TURN = 1e-4  # along the branch: a fold nearer to a crossing of branches than this is that crossing
ABOUT = 1e-2  # along the branch: steps are short beside a crossing of branches, and its first place is rough
TURNS = 1e-5  # of the other tangent's component in the parameter: smaller than this is zero
SURE = 1e-3  # of the numbers at both ends: one larger than this at its root has jumped there
SAME = 1e-9  # of the numbers at both ends: smaller than this at the place of another event is the same event


#: The name by which an event is listed, with the ending where the branch ends there; None where it is none of its kind.
Name = tuple[str, str | None] | None


@dataclass
class Met:
    """An event that was located: its kind, its distance from the last point, the point there, and its name.

    ``ending`` is a key of the curve's ``endings`` where the branch ends with it."""

    kind: Any  # an Event
    s: float
    point: Any
    name: str
    ending: str | None = None


@dataclass
class Step:
    """A step along a curve, from a to b; ``numbers`` of its kinds, ``margins`` of its boundaries, each at both ends."""

    a: Any
    b: Any
    numbers: tuple[list[float], list[float]]
    margins: tuple[Any, Any]
    first: bool = False  # of the march
    virtual: bool = False  # beyond a boundary the branch goes straight on
    cause: str = ""  # why the branch stops on this step: "range", "change" or "closed"
    stop: float = field(init=False)  # at this distance from a
    last: Any = field(init=False)  # at this point

    def __post_init__(self) -> None:
        self.end = self.a.along(self.b.Y)
        self.stop, self.last = self.end, self.b

    @property
    def curve(self) -> Any:
        """The curve."""
        return self.a.curve

    def ends(self, cause: str, s: float, point: Any) -> None:
        """The branch stops at a point at distance s."""
        self.cause, self.stop, self.last = cause, s, point


class Event(ABC):
    """A kind of event.

    Attributes
    ----------
    name : str
        As it is listed.
    certain : bool
        Where its number changes the sign it did happen: that it cannot be located is told.
    """

    name = ""
    certain = True

    @abstractmethod
    def number(self, point: Any) -> float:
        """The number that vanishes at the event."""

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the event lies on the step."""
        return was * now < 0.0

    def located(self, step: Step) -> tuple[float, Any] | None:
        """Distance from the beginning of the step, and the point there; None where it is not found."""
        return locate(step, self.number)

    def met(self, step: Step) -> Met | None:
        """The event on a step, by its own name."""
        there = self.located(step)
        return None if there is None else Met(self, *there, self.name)

    def named(self, step: Step, point: Any) -> Name:
        """Its name, and the ending where the branch ends there; None where the number vanished for another reason."""
        return self.name, None

    def confirmed(self, point: Any, was: float, now: float) -> bool:
        """Return whether the number does vanish at the corrected point: noise changes its sign elsewhere too."""
        return abs(self.number(point)) <= SURE * max(abs(was), abs(now))


class Fold(Event):
    """The parameter turns: the last component of the tangent vanishes."""

    name = "fold"

    def number(self, point: Any) -> float:
        """The last component of the tangent."""
        return point.rise


class BranchPoint(Event):
    """Another branch crosses: the bordered determinant changes its sign."""

    name = "branch_point"
    certain = False

    def number(self, point: Any) -> float:
        """The sign of the bordered determinant."""
        return float(point.orientation)

    def named(self, step: Step, point: Any) -> Name:
        """A pitchfork where the parameter turns on one of the two branches, and a transcritical where it does not."""
        both = tangents(step.curve, point.Y)
        if both is None:
            return self.name, None
        least, most = sorted(np.abs(both[:, -1]))
        return ("pitchfork" if least < TURNS * most else "transcritical"), None

    def vanishing(self, step: Step) -> Callable[[Any], float]:
        """The bordered determinant itself, as a part of that at the beginning of the step."""
        reference = determinant(step.curve.bordered(step.a.solved, step.a.tangent))[1]

        def number(point: Any) -> float:
            sign, size = determinant(step.curve.bordered(point.solved, point.tangent))
            return float(sign * np.exp(size - reference))

        return number

    def confirmed(self, point: Any, was: float, now: float) -> bool:
        """Return True: its place solves equations of its own."""
        return True

    def located(self, step: Step) -> tuple[float, Any] | None:
        """The zero of the determinant itself, made exact by a system that is regular there."""
        curve, a, b = step.curve, step.a, step.b
        there = locate(step, self.vanishing(step))
        if there is None:
            return None
        point = there[1]
        Y = branch_point(curve, point.Y)
        if Y is None or np.abs(Y - point.Y).max() > max(float(np.abs(b.Y - a.Y).max()), ABOUT):
            return there
        # Any direction in the plane of both branches is null here: of their own that along the step is this branch's.
        both, along = tangents(curve, Y), a.tangent + b.tangent
        tangent = point.tangent if both is None else max((*both, *-both), key=lambda one: float(one @ along))
        exact = curve.described(Point(curve, Y, tangent, point.orientation, point.iterations, curve.evaluate(Y)))
        return there if exact is None else (a.along(Y), exact)


def locate(step: Step, number: Callable[[Any], float]) -> tuple[float, Any] | None:
    """The zero of ``number`` on a step: its distance from the beginning, and the point there.

    None where there is no change of sign, or where a trial has no point or no number (NaN)."""
    from scipy.optimize import brentq

    at_ends = number(step.a), number(step.b)
    known: dict[float, Point] = {0.0: step.a, step.end: step.b}
    nothing = ROUNDING * max((min(abs(x), LARGEST) for x in at_ends if np.isfinite(x)), default=1.0)

    def value(s: float) -> float:
        if s not in known:
            point = step.curve.between(step.a, step.b, s)
            if point is None:
                raise ArithmeticError
            known[s] = point
        x = number(known[s])
        if x != x:
            raise ArithmeticError
        if x == 0.0 == s:  # begun where another one of its kind has been passed: not met once more
            return float(np.clip(-at_ends[1], -LARGEST, LARGEST))
        return 0.0 if abs(x) < nothing and 0.0 < s < step.end else min(max(x, -LARGEST), LARGEST)

    try:
        s = float(brentq(value, 0.0, step.end, xtol=PLACE * step.end, rtol=1e-15, maxiter=200))
        value(s)
    except (ArithmeticError, ValueError, RuntimeError):
        return None
    return s, known[s]


def first_beyond(step: Step, holds: Callable[[Any], bool], near: float) -> tuple[float, Any]:
    """The first place on a step at which something ``holds`` no more, as at its end, by halving; the point there."""
    low, high, there = 0.0, step.end, step.b
    while high - low > near:
        middle = 0.5 * (low + high)
        point = step.curve.between(step.a, step.b, middle)
        if point is not None and holds(point):
            low = middle
        else:
            high, there = middle, point or there
    return high, there


def first_met(step: Step, boundaries: Sequence[Event]) -> list[Met] | None:
    """The first boundary on a step: all that is met there, what explains it best first.

    Beyond the place where an impact or a short visit ends the path also goes through the boundary, and the other way
    round: what vanishes explains what is touched. None where a boundary was passed but not located, or the place lies
    beyond another one that both ends of the step obey.
    """
    located: list[Met] = []
    passed = False
    for kind, was, now in zip(boundaries, *step.margins, strict=True):
        if not kind.happened(step, was, now):
            continue
        passed = True
        known = [(kind.number(met.point), met) for met in located]
        # Both are infinite where a visit has turned negative: it is not followed.
        largest = max((abs(x) for x in (was, now) if np.isfinite(x)), default=0.0)
        same = [
            Met(kind, met.s, met.point, kind.name) for value, met in known if abs(value) < max(SAME * largest, ROUNDING)
        ]
        if same or any(value > 0.0 for value, _ in known):  # met at the same place, or farther on
            located += same[:1]
            continue
        met = kind.met(step)
        if met is not None and met.s <= step.stop * (1 + 1e-12):
            located.append(met)
    if not located:
        return None if passed and not step.cause else []
    first = min(located, key=lambda met: met.s)
    for kind, was, now in zip(boundaries, *step.margins, strict=True):
        if not step.virtual and min(was, now) > 0.0 and kind.number(first.point) < -SURE * min(was, now):
            return None
    return [met for met in located if met.s <= first.s + BESIDE]


def special_on(step: Step, kinds: Sequence[Event]) -> list[Met]:
    """The special points before the stop of a step, in their order."""
    found: list[Met] = []
    # At a change of equations the parameter may turn too: that belongs to the change. Where a branch closes its first
    # point has been looked at.
    stop = step.stop - {"change": TURNED, "closed": CLOSING}.get(step.cause, 0.0)
    if stop <= 0.0:
        return []
    curve, a, b, (before, after) = step.curve, step.a, step.b, step.numbers
    if stop < step.end and (last := curve.between(a, b, stop)):  # beyond its stop the same equations may turn back
        b, after = last, [kind.number(last) for kind in kinds]
        step = replace(step, b=b, numbers=(before, after))
    for kind, was, now in zip(kinds, before, after, strict=True):
        if not kind.happened(step, was, now):
            continue
        there: tuple[float, Any] | None = kind.located(step)
        if there is None:
            if kind.certain:
                warnings.warn(
                    f"a {kind.name.replace('_', '-')} between the parameter's values {a.value!r} and {b.value!r} was "
                    "met but not located, and is not listed",
                    RuntimeWarning,
                    stacklevel=2,
                )
        elif (
            there[0] <= stop
            and kind.confirmed(there[1], was, now)
            and (named := kind.named(step, there[1])) is not None
        ):
            found.append(Met(kind, *there, *named))
    # A branch that crosses another one where the parameter turns is one event, not two.
    crossings = [met.s for met in found if isinstance(met.kind, BranchPoint)]
    found = [met for met in found if not isinstance(met.kind, Fold) or all(abs(met.s - s) > TURN for s in crossings)]
    found.sort(key=lambda met: met.s)
    # Two numbers of one name may vanish together, of a part of the system that the other does not reach.
    return [b for i, b in enumerate(found) if all(a.name != b.name or b.s - a.s > BESIDE for a in found[:i])]
