"""End of a signature on a march: the record of it, and the curve on which the march goes on."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.symmetry import is_doubled
from nonsmooth.continuation.signature.change import Change, common_point, past_the_section
from nonsmooth.continuation.signature.grazing import graze
from nonsmooth.continuation.signature.neighbours import beside

if TYPE_CHECKING:
    from nonsmooth.continuation.march.event import Met
    from nonsmooth.continuation.march.marches import March
    from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits

__all__ = ["behind", "gained", "mark"]


def behind(found: March, curve: Orbits, met: list[Met]) -> tuple[Orbits, OrbitPoint] | None:
    """Record a change of signature and begin anew behind it; None where the branch ends."""
    for one in met:
        if one.kind.at_section(curve, one.point):
            after = past_the_section(curve, one.point)
            if after is None:
                found.ending = "no_convergence"
            return after
    first = met[0]
    beyond = beside(curve, first.point)
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


def mark(found: March, curve: Orbits, met: list[Met], beyond: tuple[Orbits, OrbitPoint] | None) -> str:
    """Record the end of a signature, by the contact that begins or ends there where one does; its name."""
    kind, point = met[0].kind, met[0].point
    if beyond is not None:
        cycle = beyond[0].shooting.signature.cycle
        for one in met:
            for change in one.kind.contacts(curve, one.point):
                if change.signature.cycle == cycle:
                    _mark_graze(found, curve, one.point, change, beyond)
                    return "grazing"
    own = kind.contacts(curve, point)
    name = "grazing" if own else kind.name
    indicator = own[0].indicator if own else kind.surface(curve, point, beyond and beyond[0])
    found.mark(name, curve, point, indicator=indicator)
    return name


def _mark_graze(
    found: March, curve: Orbits, point: OrbitPoint, change: Change, after: tuple[Orbits, OrbitPoint]
) -> None:
    """Record a graze: the orbit without the contact, whichever side the branch came from."""
    fresh, first = after
    judged = graze(curve, point, first, change)
    free = (curve, point) if change.gained else (fresh, common_point(curve, point, change) or first)
    found.mark("grazing", *free, indicator=change.indicator, graze=judged)


def gained(curve: Orbits, fresh: Orbits) -> int:
    """The indicator of the first transition that another signature has more often (-1: none)."""
    more = Counter((v.transition, v.row) for v in fresh.shooting.signature.crossings)
    more.subtract((v.transition, v.row) for v in curve.shooting.signature.crossings)
    transitions = curve.shooting.system.traced.transitions
    rows = [transitions[k].rows[row].indicator for (k, row), n in more.items() if n > 0 and row >= 0]
    return rows[0] if rows else -1
