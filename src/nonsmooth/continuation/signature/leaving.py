"""End of a signature on a march: the record of it, and the curve on which the march goes on."""

from __future__ import annotations

from collections import Counter

import numpy as np

from nonsmooth.continuation.branches.switching import is_doubled
from nonsmooth.continuation.march.arclength import Curve, Point
from nonsmooth.continuation.march.detection import Tests
from nonsmooth.continuation.march.events import Event, at_section, first_met
from nonsmooth.continuation.march.marches import March
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.signature.change import Change, common_point, contacts, past_the_section
from nonsmooth.continuation.signature.grazing import graze
from nonsmooth.continuation.signature.neighbours import beside
from nonsmooth.continuation.signature.path import VIOLATIONS

__all__ = ["change_of_signature", "passed_by"]

TWICE = 0.1  # along the branch: the end of a signature is not looked for from farther behind it
WITHIN = 1e-9  # of the range: as near as an event is located that only simulations show
TOLERANCE = 1e-5  # of an indicator's size: a band as narrow as this stands for no width


def change_of_signature(found: March, curve: Curve, met: list[Event]) -> tuple[Curve, Point] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    for kind, _, point in met:
        if kind == "short" and at_section(curve, point):
            after = past_the_section(curve, point)
            if after is None:
                found.ending = "no_convergence"
            return after
    known = _contacts(curve, met)
    beyond = beside(curve, met[0][2], known)
    if beyond is None and met[0][0] == "unseen":
        return None
    if beyond is not None and _is_tolerance(curve, _indicator(curve, met[0][2], met[0][0])):
        return beyond
    name = _mark(found, curve, met, known, beyond)
    if beyond is None and _is_centre(curve, met):
        found.ending = found.special[-1].kind = "focus_centre"
    elif beyond is None:
        found.ending = "landing" if met[0][0] == "landed" else name
    elif is_doubled(*beyond) and not is_doubled(curve, met[0][2]):
        # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
        found.ending = "branching"
        return None
    return beyond


def _is_centre(curve: Curve, met: list[Event]) -> bool:
    """Return whether an autonomous orbit has shrunk to a closed one of a linear mode."""
    if curve.shooting.forced:
        return False
    kind, _, point = met[0]
    free = [change.signature for change in contacts(curve, point, kind) if not change.gained]
    name = curve.shooting.active[0]
    return any(
        not one.crossings and Equilibria(curve.shooting.system, one.visits[0].mode, name, curve.width).linear
        for one in free
    )


def passed_by(found: March, curve: Curve, kind: str, point: Point) -> None:
    """Record a boundary that a virtual branch passes with its signature."""
    known = _contacts(curve, [(kind, 0.0, point)])
    _mark(found, curve, [(kind, 0.0, point)], known, beside(curve, point, known))


def _contacts(curve: Curve, met: list[Event]) -> list[tuple[Change, Point]]:
    """The contacts that may begin or end with what is met, each with the orbit there."""
    return [(change, there) for kind, _, there in met for change in contacts(curve, there, kind)]


def _mark(
    found: March, curve: Curve, met: list[Event], known: list[tuple[Change, Point]],
    beyond: tuple[Curve, Point] | None,
) -> str:  # fmt: skip
    """Record the end of a signature, by the contact that begins or ends there where one does; its name."""
    kind, _, point = met[0]
    if beyond is not None:
        cycle = beyond[0].shooting.signature.cycle
        for change, there in known:
            if change.signature.cycle == cycle:
                _mark_graze(found, curve, there, change, beyond)
                return "grazing"
    behind = None if beyond is None else _from_behind(point, *beyond)
    if beyond is not None and behind is not None and _is_better(curve, kind, point, beyond[0], behind[2]):
        curve, (kind, _, point) = beyond[0], behind
    own = contacts(curve, point, kind)
    name = "grazing" if own or kind in ("touch", "slow", "unseen") else "corner"
    if kind == "unseen" and beyond is not None:
        indicator = _gained(curve, beyond[0])
    else:
        indicator = own[0].indicator if own else _indicator(curve, point, kind)
    found.mark(name, curve, point, indicator=indicator)
    return name


def _from_behind(point: Point, fresh: Curve, first: Point) -> Event | None:
    """The end of the new signature, ``fresh``, seen from its first orbit: the place at which the old one ends."""
    away = abs(float(first.X[-1] - point.X[-1])) / fresh.width
    back, steep = first.turned(), abs(float(first.tangent[-1]))
    new = fresh.step(back, 2.0 * away / steep) if steep * TWICE > away else None
    if new is None:
        return None
    crossed = [kind for kind, now in zip(VIOLATIONS, new.path.violation(), strict=True) if now < 0.0]
    met = first_met(fresh, back, new, Tests(fresh), crossed, np.inf)
    return (met[0][0], met[0][1], met[0][2].turned()) if met else None


def _is_better(curve: Curve, kind: str, point: Point, fresh: Curve, there: Point) -> bool:
    """Return whether the end of the new signature, ``there``, is the better place of a corner than ``point``."""
    if kind == "unseen":  # within the interval that simulations leave
        return abs(float(there.X[-1] - point.X[-1])) < WITHIN * curve.width
    return _condition(fresh, there) < _condition(curve, point)


def _condition(curve: Curve, point: Point) -> float:
    """Condition number of the equations: a visit that ends as it begins, at a double zero, is located badly."""
    values = np.linalg.svd(point.solved.jacobian * curve.weights, compute_uv=False)
    return float(values[0] / values[-1])


def _mark_graze(found: March, curve: Curve, point: Point, change: Change, after: tuple[Curve, Point]) -> None:
    """Record a graze: the orbit without the contact, whichever side the branch came from."""
    judged = graze(curve, point, after[1], change)
    free = (curve, point) if change.gained else common_point(curve, point, change) or after
    found.mark("grazing", *free, indicator=change.indicator, graze=judged)


def _gained(curve: Curve, fresh: Curve) -> int:
    """The indicator of the first transition that another signature has more often (-1: none)."""
    more = Counter((v.transition, v.row) for v in fresh.shooting.signature.crossings)
    more.subtract((v.transition, v.row) for v in curve.shooting.signature.crossings)
    transitions = curve.shooting.system.traced.transitions
    rows = [transitions[k].rows[row].indicator for (k, row), n in more.items() if n > 0 and row >= 0]
    return rows[0] if rows else -1


def _indicator(curve: Curve, point: Point, kind: str) -> int:
    """The indicator of the surface that an event is about: of the row that is nearest to zero (-1: of none)."""
    path, visits, shooting = point.path, curve.shooting.signature.visits, curve.shooting
    if kind == "touch":
        place, k = path.touched
        return int(curve.walk.net.rows[path.which[place, k], 0])
    times, states = shooting.split(point.X)
    if kind == "landed":
        place = int(path.landed.argmax())
        k, z = int(path.landing[place]), states[place]
    else:
        if kind in ("short", "others"):
            place = int(path.tau.argmin() if kind == "short" else path.others.argmax())
        else:
            place = int(curve.walk.conditional[int((path.own if kind == "own" else path.slope).argmin())])
        k = int(path.other[place]) if kind == "others" else visits[place].transition
        z = point.solved.segments.z[place]
    rows = shooting.system.traced.transitions[k].rows
    skipped = visits[place].row if kind == "own" else -1
    t = float(times[min(place, len(times) - 1)])
    near = [(abs(shooting.flow.jump(point.solved.values, k, t, z, r).h), row.indicator)
            for r, row in enumerate(rows) if r != skipped]  # fmt: skip
    return min(near)[1] if near else -1


def _is_tolerance(curve: Curve, indicator: int) -> bool:
    """Return whether an indicator only sets a tolerance: below the creep of a stop impacts are completed as rest.

    It differs from another one of its condition, with the other sign, by a small number."""
    system = curve.shooting.system
    traced = system.traced
    for jump in traced.transitions:
        signs = {row.indicator: row.sign for row in jump.rows}
        for other, sign in signs.items():
            if sign * signs.get(indicator, 0) >= 0:
                continue
            h = traced.indicators[other]
            width = traced.indicators[indicator] - h
            size = sum(abs(h.diff(u)) * scale for u, scale in zip(traced.u, system.scale_vector(), strict=True))
            if width.is_number and size.is_number and 0.0 < abs(float(width)) < TOLERANCE * float(size):
                return True
    return False
