"""End of a signature on a march: the record of it, and the curve on which the march goes on."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from nonsmooth.continuation.events.boundaries import BOUNDARIES, Boundary, Crossed, Unseen
from nonsmooth.continuation.events.change import Change, common_point, is_tolerance, past_the_section, rest_after
from nonsmooth.continuation.events.grazing import graze
from nonsmooth.continuation.events.neighbours import beside
from nonsmooth.continuation.events.of_orbits import KINDS, SMALL
from nonsmooth.continuation.events.sliding import sliding_bifurcation
from nonsmooth.continuation.march.event import BESIDE, LARGEST, Met, Step, first_met
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.primitive import is_doubled
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.errors import SystemDefinitionError

__all__ = ["ENDINGS", "AlongOrbits"]

FARTHEST = 0.1  # along the branch: the end of a signature is not looked for from farther behind it
WITHIN = 1e-9  # of the range: as near as an event is located that only simulations show
AHEAD = 1e-6  # of the range
WAITS = 1e-3  # along the branch: an orbit whose section changes less is only longer, the parameter by the square of it
#: How a branch can end, with the sentence for each.
ENDINGS = {
    "range": "The branch reached the edge of the range.",
    "branching": "The branch begins where it leaves another one.",
    "closed": "The branch came back to where it began.",
    "points": "The largest number of points was reached; continue the branch with continue_orbit(branch).",
    "equilibrium": (
        "The cycle shrinks to an equilibrium, a Hopf bifurcation: continue_equilibrium finds it to the last digit."
    ),
    "focus_centre": (
        "The cycle ends in a focus-centre bifurcation: it only touches the boundary of a mode that is linear, and at "
        "this value all smaller orbits of that mode are closed."
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
    "interrupted": INTERRUPTED + "; continue the branch with continue_orbit(branch).",
    "homoclinic": (
        "The period grows beyond all bounds while states and parameter stand: the cycle ends in a homoclinic (or "
        "heteroclinic) orbit, a connection of equilibria beside which it waits ever longer."
    ),
}


class AlongOrbits(Policy):
    """Special points of periodic orbits, and the boundaries of their signatures."""

    kinds = KINDS
    boundaries = BOUNDARIES
    endings = ENDINGS

    def __init__(self) -> None:
        self._unwatched: Shooting | None = None  # of a curve whose points simulated rounds do not confirm

    def unseen(self, step: Step) -> Met | None:
        """The first place on a step where only a simulated round tells that the signature ends."""
        curve = step.curve
        if step.virtual or curve.shooting is self._unwatched or curve.shows(step.b):
            return None
        met = Unseen().met(step)
        if met is None or beside(curve, met.point) is not None:
            return met
        warnings.warn(
            f"a simulation of the orbit at {curve.shooting.active[-1]} = {met.point.value!r} takes other transitions "
            "than the branch: its points from here on are not confirmed",
            RuntimeWarning, stacklevel=2,
        )  # fmt: skip
        self._unwatched = curve.shooting
        return None

    def passed_by(self, step: Step) -> list[Met]:
        """Boundaries that a virtual branch passes, either way; of those met together the best explained.

        Left out are those where the march begins, and what turns the section."""
        found: list[Met] = []
        begun = BESIDE if step.first else 0.0
        for kind, was, now in zip(BOUNDARIES, *step.margins, strict=True):
            met = kind.met(step) if was * now < 0.0 else None
            if met is None or met.s > step.stop:
                continue
            ends = np.clip((was, now), -LARGEST, LARGEST)
            counts = kind.confirmed(step.curve, met.point, *ends) and kind.counts(met.point)
            if not counts or any(abs(met.s - one.s) <= BESIDE for one in found):
                continue
            if met.s > begun and not (step.cause == "change" and abs(met.s - step.stop) <= BESIDE):
                found.append(met)
        return found

    def record(self, found: March, step: Step, met: Met) -> None:
        """List a special point, or a boundary that a branch passes with its signature."""
        if isinstance(met.kind, Boundary):
            mark(found, step.curve, [met], beside(step.curve, met.point, contacts_of(step.curve, [met])))
        else:
            super().record(found, step, met)

    def behind(self, found: March, curve: Orbits, met: list[Met]) -> tuple[Orbits, OrbitPoint] | None:
        """Record a change of signature and begin anew behind it; None where the branch ends."""
        first = met[0]
        if len(met) == 1 and first.kind.at_section(curve, first.point):
            after = past_the_section(curve, first.point)
            if after is not None and (after[1].path.margins[1:] >= 0.0).all():
                return after  # else another boundary is met with the section
        beyond = beside(curve, first.point, contacts_of(curve, met))
        if beyond is not None and _completes(curve, met, beyond[0]):
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

    def over(self, curve: Orbits, point: OrbitPoint) -> str | None:
        """Return ``equilibrium`` where an autonomous orbit has all but shrunk to one, ``homoclinic`` where it only
        grows longer: states and parameter stand, beside an equilibrium it waits for ever."""
        shooting, along = curve.shooting, np.abs(point.tangent)
        if curve.swing(point) < SMALL:
            return "equilibrium"
        stands = along[-1] < WAITS**2 and along[shooting.z_at[0] : shooting.z_at[0] + shooting.n].max() < WAITS
        return "homoclinic" if not shooting.forced and stands and point.tangent[shooting.size - 1] > 0.0 else None

    def why(self, curve: Orbits, point: OrbitPoint) -> str:
        """Return ``physical`` where the equations do not allow the parameter ahead."""
        ahead = point.value + AHEAD * curve.width * float(np.sign(point.tangent[-1]))
        try:
            curve.shooting.system.with_parameters({curve.shooting.active[-1]: ahead})
        except (SystemDefinitionError, ValueError):
            return "physical"
        return "no_convergence"


def _completes(curve: Orbits, met: list[Met], fresh: Orbits) -> bool:
    """Return whether only the speed below which impacts are completed as rest is reached.

    An impact that vanishes far from rest passes that speed too, and is a graze."""
    passed = [one for one in met if is_tolerance(curve, one.kind.surface(curve, one.point, fresh))]
    if not passed:
        return False
    kind, point = passed[0].kind, passed[0].point
    same = fresh.shooting.m == curve.shooting.m or not isinstance(kind, Crossed)
    return same or rest_after(curve, point, kind.visit(curve, point)) is not None


def _is_centre(curve: Orbits, met: Met) -> bool:
    """Return whether an autonomous orbit has shrunk to a closed one of a linear mode."""
    if curve.shooting.forced:
        return False
    free = [change.new.signature for change in met.kind.contacts(curve, met.point) if not change.gained]
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
            if change.new.signature.cycle == cycle:
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
    met = first_met(Step(fresh, back, new, ([], []), (fresh.margins(back), fresh.margins(new)), True), BOUNDARIES)
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
