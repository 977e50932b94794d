"""Marching along a curve of special points: steps, what is met on the way, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Point, passes_through
from nonsmooth.continuation.march.marches import INTERRUPTED, march_until
from nonsmooth.continuation.problems.anchor import plane_across
from nonsmooth.continuation.problems.codimension_two import ENDED, root, sign_changes
from nonsmooth.continuation.problems.codimension_two import numbers as numbers_of
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.continuation.signature.path import VIOLATIONS

__all__ = ["ENDS", "CurveMarch", "march_curve"]

FloatArray = NDArray[np.float64]
ENDS = {
    "range": "The curve reached the edge of the box.",
    "closed": "The curve came back to where it began.",
    "points": "The largest number of points was reached.",
    "no_convergence": "Newton's method did not converge, however small the step.",
    "grazing": "A contact begins or ends here: beyond this point the orbit has another signature.",
    "corner": "The orbit meets the corner of two boundaries: beyond this point it has another signature.",
    "resonance": "Both multipliers meet on the real axis: beyond this point they are real, and there is no torus.",
    "interrupted": f"{INTERRUPTED}.",
}
#: The point of codimension two at which a curve meets a graze (another one, for a grazing curve).
MEETS = {
    "fold": "grazing_fold", "flip": "grazing_flip", "neimark_sacker": "grazing_neimark_sacker",
    "grazing": "double_grazing",
}  # fmt: skip
FIRST, LEAST = 1e-3, 1e-8
COSINE = 0.97
BESIDE = 1e-6


@dataclass
class CurveMarch:
    """Places in the order of the march, points of codimension two with their places, and the ending (of ``ENDS``)."""

    places: list[Point] = field(default_factory=list)
    special: list[tuple[str, int]] = field(default_factory=list)
    ending: str = "points"


def _violation(locus: Locus, place: Point) -> FloatArray:
    """Margin of the path to leaving its signature; on a grazing curve by another touch than its own."""
    path = place.path
    if locus.kind == "grazing":
        inner = path.inner.copy()
        inner[locus.touched or path.touched] = -np.inf
        path = replace(path, touch=float(inner.max(initial=-np.inf)))
    return path.violation()


def march_curve(
    locus: Locus, place: Point, box: Any, largest: float, most: int, begin: Point | None = None
) -> CurveMarch:
    """Follow a curve from a place along its tangent until it ends; ``begin``: where it would close."""
    return march_until(CurveMarch(), _follow, locus, place, box, largest, most, begin)


def _follow(
    found: CurveMarch, locus: Locus, place: Point, box: Any, largest: float, most: int, begin: Point | None
) -> None:
    """March on, place by place, into ``found``."""
    ds = min(FIRST, largest)
    second, safe = numbers_of(locus, place), _violation(locus, place)
    while len(found.places) < most:
        new = locus.step(place, ds)
        if new is not None and ds > LEAST and float(new.tangent @ place.tangent) < COSINE:
            new = None
        if new is None:
            ds *= 0.5
            if ds < LEAST:
                found.ending = "no_convergence"
                break
            continue
        events: list[tuple[float, str, Point]] = []
        for i, (low, high) in enumerate(box):
            value = float(new.X[-2 + i])
            if not low <= value <= high:
                edge = low if value < low else high
                there = root(locus, place, new, _Edge(i, edge))
                if there is not None:
                    events.append((there[0], "range", there[1]))
        now = _violation(locus, new)
        for i, name in enumerate(VIOLATIONS):
            if now[i] < 0.0 <= safe[i]:
                there = root(locus, place, new, _Leaving(locus, i))
                if there is not None:
                    events.append((there[0], "corner" if name in ("own", "others", "landed") else "grazing", there[1]))
        outside = any(not low <= float(new.X[-2 + i]) <= high for i, (low, high) in enumerate(box))
        if not events and (outside or ((now < 0.0) & (safe >= 0.0)).any()):  # not located: nearer
            ds *= 0.25
            if ds < LEAST:
                found.ending = "no_convergence"
                break
            continue
        stop = min((s for s, _, _ in events), default=np.inf)
        after = numbers_of(locus, new)
        events += sign_changes(locus, place, new, second, after, stop - BESIDE)
        # A cusp: both parameters turn round together.
        if float(place.tangent[-2:] @ new.tangent[-2:]) < 0.0:
            there = root(locus, place, new, _Turning(place))
            if there is not None and there[0] < stop - BESIDE:
                events.append((there[0], "cusp" if locus.kind == "fold" else "turn", there[1]))
        ended = False
        for _, name, there_place in sorted(events, key=lambda event: event[0]):
            if name == "turn":
                continue
            found.places.append(there_place)
            ends = name if name in ENDS else "resonance" if locus.kind == "neimark_sacker" and name in ENDED else ""
            if name == "grazing":
                name = MEETS[locus.kind]
            if name != "range":
                found.special.append((name, len(found.places) - 1))
            if ends:
                found.ending, ended = ends, True
                break
        if ended:
            break
        found.places.append(new)
        if begin is not None and len(found.places) > 3 and passes_through(begin.Y, place.Y, new.Y):
            found.ending = "closed"
            break
        ds = min(ds * (1.7 if new.iterations <= 4 else 1.0), largest)
        place, second, safe = new, after, now
        if locus.shooting.reference is not None:
            _anchor_anew(locus, place)


def _anchor_anew(locus: Locus, place: Point) -> None:
    """Put the phase condition of an orbit without transitions through the last point."""
    locus.shooting.reference = plane_across(place.X[: locus.shooting.n], place.solved.segments.f_begin[0], locus.size)
    found = locus.place((place.solved, place.Y, place.tangent, 0), place.tangent)
    if found is not None:
        place.tangent = found.tangent


@dataclass
class _Edge:
    """A parameter's distance from the edge of its range."""

    which: int
    edge: float

    def __call__(self, place: Point) -> float:
        return float(place.X[-2 + self.which]) - self.edge


@dataclass
class _Leaving:
    """Margin of the path to leaving its signature in one of the ways of ``VIOLATIONS``."""

    locus: Locus
    way: int

    def __call__(self, place: Point) -> float:
        return float(np.clip(_violation(self.locus, place)[self.way], -1e3, 1e3))


@dataclass
class _Turning:
    """Test function of a turn: the parameters' direction against the earlier one."""

    before: Point

    def __call__(self, place: Point) -> float:
        return float(place.tangent[-2:] @ self.before.tangent[-2:])
