"""Marching along a branch: steps, what is met on the way, changes of signature, and how it ends."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Curve, Point, chordal, passes_through
from nonsmooth.continuation.march.detection import Tests
from nonsmooth.continuation.march.events import (
    BESIDE,
    Event,
    at_edge,
    at_section,
    edge_before_fold,
    first_met,
    first_unseen,
    passed,
    smooth_events,
    swing,
)
from nonsmooth.continuation.march.marches import Limits, March, Place, march_until
from nonsmooth.continuation.signature.leaving import change_of_signature, passed_by
from nonsmooth.continuation.signature.path import VIOLATIONS
from nonsmooth.continuation.signature.rounds import Rounds
from nonsmooth.errors import SystemDefinitionError

__all__ = ["march"]

FloatArray = NDArray[np.float64]

LEAST_STEP = 1e-9
COSINE = 0.98  # of the angle between the tangents of neighbours
SPREAD = 0.15  # chordal change of the multipliers between neighbours
SMALL = 2e-3  # of the first orbit's size: a cycle this small is about to vanish in a Hopf bifurcation


def march(curve: Curve, point: Point, limits: Limits, first_step: float) -> March:
    """Follow a branch from a point along its tangent until it ends; the first row is the point after it."""
    return march_until(March(), _follow, curve, point, limits, first_step)


def _follow(found: March, curve: Curve, point: Point, limits: Limits, first_step: float) -> None:
    """March on, point by point, into ``found``."""
    ds = first_step
    if curve.shooting.reference is not None:
        point = curve.anchored_anew(point)
    tests, rounds, watched = Tests(curve), Rounds(curve.shooting), not limits.virtual
    numbers, violation = tests.smooth(point), point.path.violation()
    before: Point | None = None
    circle: Place | None = None
    again = 8  # a point that is met again if the branch goes round (Brent's method)
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
            ds *= max(0.2, min(0.7, 0.7 * SPREAD / max(spread, 1e-12)))
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
                   and (not limits.virtual or (kind == "short" and at_section(curve, new)))]  # fmt: skip
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
        elif watched and not reason and not rounds.shows(curve.shooting, new.X, new.solved.values):
            there = first_unseen(curve, rounds, point, new)
            if there is not None:
                met = [("unseen", *there)]
                stop, stop_point, reason = *there, "change"
                numbers_new = tests.smooth(stop_point)
        back = came_back(limits.closed, curve, point, new) if len(found.rows) > 2 else None
        if back is not None and back <= stop:
            stop, stop_point, reason = back, curve.between(point, new, back) or new, "closed"
        events = smooth_events(curve, point, new, tests, numbers, numbers_new, stop, reason)
        if limits.virtual:
            beyond = passed(curve, point, new, tests, violation, violation_new, stop)
            events = sorted([*events, *_apart(beyond, found, met)], key=lambda event: event[1])
        for kind, _, special in events:
            if kind in VIOLATIONS:
                passed_by(found, curve, kind, special)
                continue
            if not limits.low <= float(special.X[-1]) <= limits.high:  # a fold just beyond the edge of the range
                stop_point, reason = edge_before_fold(curve, point, special, limits.low, limits.high), "range"
                break
            found.mark(kind, curve, special, virtual=limits.virtual and bool((special.path.violation() < 0.0).any()))
            if kind in ("hopf", "flip_end"):
                found.ending = "equilibrium" if kind == "hopf" else "branching"
                found.special[-1].kind = "hopf" if kind == "hopf" else "flip"
                return
        if reason in ("range", "closed"):
            found.add(curve, stop_point)
            found.ending = reason
            break
        if reason == "change":
            after = change_of_signature(found, curve, met)
            if after is None and met[0][0] == "unseen":
                warnings.warn(
                    f"a simulation of the orbit at {curve.shooting.active[0]} = {float(stop_point.X[-1])!r} takes "
                    "other transitions than the branch: its points from here on are not confirmed",
                    RuntimeWarning, stacklevel=2,
                )  # fmt: skip
                watched = False
                continue
            if after is None:
                break
            curve, point = after
            before, ds = None, 0.1 * limits.largest
            tests, rounds, watched = Tests(curve), Rounds(curve.shooting), not limits.virtual
            numbers, violation = tests.smooth(point), point.path.violation()
            found.add(curve, point)
            continue
        found.add(curve, new)
        if _shrunk(curve, new):
            found.ending = "equilibrium"
            break
        if found.rows[-1].virtual and came_back(circle, curve, point, new) is not None:
            found.ending = "circle"
            break
        if len(found.rows) >= 2 * again:
            circle, again = (curve.shooting.signature, new.X), len(found.rows)
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
    """Return whether an autonomous orbit has all but shrunk to an equilibrium."""
    return swing(curve, point) < SMALL


def _apart(passed_by: list[Event], found: March, met: list[Event]) -> list[Event]:
    """Boundaries passed that are not where the march begins, nor what turns the section."""
    begun = 0.0 if found.rows else BESIDE
    taken = [s for _, s, _ in met]
    return [event for event in passed_by if event[1] > begun and all(abs(event[1] - s) > BESIDE for s in taken)]


def came_back(place: Place | None, curve: Curve, a: Point, b: Point) -> float | None:
    """Distance along the step from a to b at which the branch comes back to a place; None where it does not."""
    if place is None or place[0] != curve.shooting.signature or float(np.abs(b.Y - a.Y).max()) >= 0.2:
        return None
    Y = place[1] / curve.scale
    return float(a.tangent @ (Y - a.Y)) if passes_through(Y, a.Y, b.Y) else None


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
