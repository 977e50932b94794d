"""End of a signature on a march: the record of it, and the curve on which the march goes on."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.continuation.march.event import Met, Step, first_met
from nonsmooth.continuation.problems.doubled import is_doubled
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.signature.change import Change, common_point, past_the_section
from nonsmooth.continuation.signature.grazing import graze
from nonsmooth.continuation.signature.neighbours import beside
from nonsmooth.continuation.signature.sliding import sliding_bifurcation

if TYPE_CHECKING:
    from nonsmooth.continuation.march.marches import March
    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits

__all__ = ["behind", "contacts_of", "gained", "is_tolerance", "mark"]

FARTHEST = 0.1  # along the branch: the end of a signature is not looked for from farther behind it
WITHIN = 1e-9  # of the range: as near as an event is located that only simulations show
TOLERANCE = 1e-5  # of an indicator's size: a band as narrow as this stands for no width


def behind(found: March, curve: Orbits, met: list[Met]) -> tuple[Orbits, OrbitPoint] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    for one in met:
        if one.kind.at_section(curve, one.point):
            after = past_the_section(curve, one.point)
            if after is None:
                found.ending = "no_convergence"
            return after
    first = met[0]
    beyond = beside(curve, first.point, contacts_of(curve, met))
    if beyond is not None and any(is_tolerance(curve, one.kind.surface(curve, one.point, beyond[0])) for one in met):
        return beyond
    name = mark(found, curve, met, beyond)
    if beyond is None and _is_centre(curve, first):
        found.ending = found.special[-1].kind = "focus_centre"
    elif beyond is None:
        found.ending = first.kind.ending or name
    elif is_doubled(*beyond) and not is_doubled(curve, first.point):
        # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
        found.ending = "branching"
        return None
    return beyond


def _is_centre(curve: Orbits, met: Met) -> bool:
    """Return whether an autonomous orbit has shrunk to a closed one of a linear mode."""
    if curve.shooting.forced:
        return False
    free = [change.signature for change in met.kind.contacts(curve, met.point) if not change.gained]
    name = curve.shooting.active[0]
    return any(
        not one.crossings and Equilibria(curve.shooting.system, one.visits[0].mode, name, curve.width).linear
        for one in free
    )


def contacts_of(curve: Orbits, met: list[Met]) -> list[tuple[Change, OrbitPoint]]:
    """The contacts that may begin or end with what is met, each with the orbit there."""
    return [(change, one.point) for one in met for change in one.kind.contacts(curve, one.point)]


def mark(found: March, curve: Orbits, met: list[Met], beyond: tuple[Orbits, OrbitPoint] | None) -> str:
    """Record the end of a signature, by the contact that begins or ends there where one does; its name."""
    kind, point = met[0].kind, met[0].point
    sliding = "" if beyond is None else sliding_bifurcation(curve, point, *beyond)
    if beyond is not None:
        cycle = beyond[0].shooting.signature.cycle
        for change, there in contacts_of(curve, met):
            if change.signature.cycle == cycle:
                _mark_graze(found, curve, there, change, beyond, sliding)
                return "grazing"
        end = _from_behind(point, *beyond)
        if end is not None and _is_better(curve, met[0], beyond[0], end.point):
            curve, kind, point = beyond[0], end.kind, end.point
    own = kind.contacts(curve, point)
    name = "grazing" if own else kind.name
    indicator = own[0].indicator if own else kind.surface(curve, point, beyond and beyond[0])
    found.mark(name, curve, point, indicator=indicator, sliding=sliding)
    return name


def _from_behind(point: OrbitPoint, fresh: Orbits, first: OrbitPoint) -> Met | None:
    """The end of the new signature, ``fresh``, seen from its first orbit: the place at which the old one ends."""
    away = abs(float(first.X[-1] - point.X[-1])) / fresh.width
    back, steep = first.turned(), abs(float(first.tangent[-1]))
    new = fresh.step(back, 2.0 * away / steep) if steep * FARTHEST > away else None
    if new is None:
        return None
    met = first_met(Step(fresh, back, new, ([], []), (fresh.margins(back), fresh.margins(new)), True))
    return replace(met[0], point=met[0].point.turned()) if met else None


def _is_better(curve: Orbits, met: Met, fresh: Orbits, there: OrbitPoint) -> bool:
    """Return whether the end of the new signature, ``there``, is a better place of a corner than that of the old one.

    A visit that ends as it begins, at a double zero, is located badly."""
    if met.kind.place < 0:  # no margin tells where it is: within the interval that simulations leave
        return abs(float(there.X[-1] - met.point.X[-1])) < WITHIN * curve.width
    return _condition(fresh, there) < _condition(curve, met.point)


def _condition(curve: Orbits, point: OrbitPoint) -> float:
    """Condition number of the equations."""
    values = np.linalg.svd(point.solved.jacobian * curve.weights, compute_uv=False)
    return float(values[0] / values[-1])


def _mark_graze(
    found: March, curve: Orbits, point: OrbitPoint, change: Change, after: tuple[Orbits, OrbitPoint], sliding: str
) -> None:
    """Record a graze: the orbit without the contact, whichever side the branch came from."""
    fresh, first = after
    judged = graze(curve, point, first, change)
    free = (curve, point) if change.gained else (fresh, common_point(curve, point, change) or first)
    found.mark("grazing", *free, indicator=change.indicator, graze=judged, sliding=sliding)


def gained(curve: Orbits, fresh: Orbits) -> int:
    """The indicator of the first transition that another signature has more often (-1: none)."""
    more = Counter((v.transition, v.row) for v in fresh.shooting.signature.crossings)
    more.subtract((v.transition, v.row) for v in curve.shooting.signature.crossings)
    transitions = curve.shooting.system.traced.transitions
    rows = [transitions[k].rows[row].indicator for (k, row), n in more.items() if n > 0 and row >= 0]
    return rows[0] if rows else -1


def is_tolerance(curve: Orbits, indicator: int) -> bool:
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
