"""End of a signature on a march: the record of it, and the curve on which the march goes on."""

from __future__ import annotations

from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.change import Change, changed
from nonsmooth.continuation.events import Event
from nonsmooth.continuation.grazing import graze
from nonsmooth.continuation.marches import March
from nonsmooth.continuation.neighbours import beside
from nonsmooth.continuation.resuming import common_point, resumed
from nonsmooth.continuation.switching import is_doubled

__all__ = ["change_of_signature", "passed_by"]


def passed_by(found: March, curve: Curve, kind: str, point: Point) -> None:
    """Record a boundary that a virtual branch passes with its signature."""
    for change in changed(curve, point, kind):
        after = resumed(curve, point, change)
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


def change_of_signature(found: March, curve: Curve, met: list[Event]) -> tuple[Curve, Point, float] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    kind, _, point = met[0]
    for event, _, there in met:
        for change in changed(curve, there, event):
            if change.kind == "section":
                return resumed(curve, there, change)
    beyond = beside(curve, point)
    if beyond is None:
        name = _mark_unexplained(found, curve, kind, point)
        found.ending = "landing" if kind == "landed" else name
        return None
    fresh, first = beyond
    explained = [
        change for event, _, there in met for change in changed(curve, there, event)
        if change.signature.cycle == fresh.shooting.signature.cycle
    ]  # fmt: skip
    if explained and explained[0].kind == "grazing":
        _mark_graze(found, curve, point, explained[0], (fresh, first, 0.0))
    elif explained:
        found.mark("corner", curve, point, indicator=explained[0].indicator)
    else:
        _mark_unexplained(found, curve, kind, point)
    if is_doubled(fresh, first) and not is_doubled(curve, point):
        # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
        found.ending = "branching"
        return None
    return fresh, first, 0.0


def _indicator(curve: Curve, point: Point, kind: str) -> int:
    """The indicator that an unexplained event is about (-1: not known)."""
    if kind == "touch":
        visit, k = point.path.touched
        return int(curve.walk.net.rows[point.path.which[visit, k], 0])
    if kind == "landed":
        k = int(point.path.landing[int(point.path.landed.argmax())])
        net = curve.walk.net
        rows = net.rows[net.row_start[k] : net.row_start[k + 1], 0]
        return int(rows[0]) if len(rows) == 1 else -1
    return -1
