"""Branches of orbits: their special points, and the end of a signature and how it goes on there."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from nonsmooth.continuation.events.boundaries import (
    BOUNDARIES,
    Boundary,
    Crossed,
    Own,
    Unseen,
    contacts_of,
    section_passed,
)
from nonsmooth.continuation.events.change import (
    BEFORE_REST,
    common_orbit,
    completes,
    is_tolerance,
    rest_after,
)
from nonsmooth.continuation.events.grazing import graze
from nonsmooth.continuation.events.neighbours import beside
from nonsmooth.continuation.events.sliding import TOUCHES, sliding_bifurcation
from nonsmooth.continuation.events.special_orbits import (
    BranchPointOfOrbits,
    Flip,
    FoldOfOrbits,
    NeimarkSacker,
    is_bare,
)
from nonsmooth.continuation.march.event import BESIDE, LARGEST, Met, Step, first_met, special_on
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.curve import Point
from nonsmooth.continuation.problems.equilibrium import Equilibria
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.primitive import is_doubled
from nonsmooth.continuation.problems.shooting import Shooting, in_a_family
from nonsmooth.continuation.problems.signature import AT_ONCE
from nonsmooth.continuation.searches.settled import touching
from nonsmooth.errors import SystemDefinitionError

NOTHING = 1e-5  # of the first orbit's size: a cycle this small has vanished, as far as is computed
FARTHEST = 0.1  # along the branch: the end of a signature is not looked for from farther behind it
WITHIN = 1e-9  # of the range: as near as an event is located that only simulations show
AHEAD = 1e-6  # of the range
NEARER = 60  # steps back to a boundary from the first orbit behind it, at most
REACH = 60.0  # times the first of them: as far in all
WAITS = 1e-3  # along the branch: an orbit whose section changes less is only longer, the parameter by the square of it
STANDS = 1e-2  # along the branch: extremes that change less stand, while the orbit is longer
UNTOLD = 1e8  # of a multiplier: a simulated round in which rounding grows by more shows another motion
GROWS = 1e3  # times the first orbit's size and the states' scale: so large, while the parameter stands, it has no bound
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
    "family": (
        "Beyond this point the motion is one of a family, such as a mass that friction holds wherever it is: no orbit "
        "stands alone."
    ),
    "homoclinic": (
        "The period grows beyond all bounds while states and parameter stand: the cycle ends in a homoclinic (or "
        "heteroclinic) orbit, a connection of equilibria beside which it waits ever longer."
    ),
    "boundary_equilibrium": "The cycle shrinks to an equilibrium on a boundary; continue_equilibrium follows that.",
    "infinity": (
        "The orbit grows beyond all bounds while the parameter stands: here what damps it balances what drives it "
        "however large it is (a bifurcation at infinity, a resonance without damping)."
    ),
}


class AlongOrbits(Policy):
    """Special points of periodic orbits, and the boundaries of their signatures."""

    kinds = (FoldOfOrbits(), BranchPointOfOrbits(), Flip(), NeimarkSacker())
    boundaries = BOUNDARIES
    endings = ENDINGS

    def __init__(self) -> None:
        self._unwatched: Shooting | None = None  # of a curve whose points simulated rounds do not confirm

    def unseen(self, step: Step) -> Met | None:
        """The first place on a step where only a simulated round tells that the signature ends."""
        shooting = step.b.shooting
        if step.virtual or shooting is self._unwatched or np.abs(step.b.multipliers).max(initial=0.0) > UNTOLD:
            return None
        if step.curve.shows(step.b):
            return None
        met = Unseen().met(step)
        if met is None or beside(met.point) is not None:
            return met
        warnings.warn(
            f"a simulation of the orbit at {shooting.active[-1]} = {met.point.value!r} takes other transitions than "
            "the branch: its points from here on are not confirmed",
            RuntimeWarning,
            stacklevel=2,
        )
        self._unwatched = shooting
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
            counts = kind.confirmed(met.point, *ends) and kind.counts(met.point)
            if not counts or any(abs(met.s - one.s) <= BESIDE for one in found):
                continue
            if met.s > begun and not (step.cause == "change" and abs(met.s - step.stop) <= BESIDE):
                found.append(met)
        return found

    def record(self, found: March, step: Step, met: Met) -> None:
        """List a special point, or a boundary that a branch passes with its signature."""
        if isinstance(met.kind, Boundary):
            beyond = beside(met.point, contacts_of([met]))
            mark(found, [met], beyond, self._between(met.point, beyond)[1] if beyond is not None else None)
        else:
            super().record(found, step, met)

    def behind(self, found: March, met: list[Met]) -> OrbitPoint | None:
        """Record a change of signature and begin anew behind it; None where the branch ends."""
        first = met[0]
        if _is_nothing(first.point):
            found.ending = mark(found, met, None, name="boundary_equilibrium")
            return None
        if (after := section_passed(met)) is not None:
            return after
        if (family := _in_family(first.point)) is not None:
            near = WITHIN * first.point.curve.width  # the multiplier that comes to 1 there is 1 to rounding before
            while found.rows and found.rows[-1].mark and abs(found.rows[-1].point.value - first.point.value) < near:
                found.rows.pop()
            mark(found, met, family)
            found.ending = "family"
            return None
        before = first.point, contacts_of(met), [row.point for row in found.rows]
        slow = isinstance(first.kind, Own) and is_tolerance(first.point, first.kind.surface(first.point))
        beyond = (beside(*before, onward=True) if slow else None) or beside(*before)  # at a tolerance nothing turns
        special, end = ([], None) if beyond is None else self._between(first.point, beyond)
        if beyond is None or not (_completes(met, beyond) or (end is not None and _completes([end], first.point))):
            centre = beyond is None and _is_centre(first)
            name = mark(found, met, beyond, end, "focus_centre" if centre else "")
            if beyond is None:
                found.ending = name if centre else first.kind.ending or name
            elif is_doubled(beyond) and not is_doubled(first.point):
                # Beyond the graze at which a doubled orbit is born there is only the shorter one, gone round twice.
                found.ending = "branching"
                return None
        for one in reversed(special):
            found.mark(one.name, one.point.turned())
        return beyond

    def _between(self, point: OrbitPoint, first: OrbitPoint) -> tuple[list[Met], Met | None]:
        """The special points from the first orbit of a new signature back to ``point``, where the old one ends, and the
        end of the new one there."""
        found: list[Met] = []
        if first.signature.cycle == point.signature.cycle:  # the same orbits on: back lie those that have been passed
            return found, None
        away, steep = abs(first.value - point.value) / first.curve.width, abs(first.rise)
        b, ds = first.turned(), 2.0 * away / steep if steep * FARTHEST > away else 0.0
        numbers, left, grows = [kind.number(b) for kind in self.kinds], REACH * ds, 2.0
        for _ in range(NEARER):
            if not left > 0.0:
                break
            new = b.curve.step(b, ds)
            if new is None:  # no values beyond the boundary
                ds, grows = 0.25 * ds, 1.0
                continue
            now = [kind.number(new) for kind in self.kinds]
            step = Step(b, new, (numbers, now), (b.curve.margins(b), b.curve.margins(new)), True)
            ends = first_met(step, BOUNDARIES)
            if ends:
                step.ends("change", ends[0].s, ends[0].point)
            found += special_on(step, self.kinds)
            if ends != []:
                return found, replace(ends[0], point=ends[0].point.turned()) if ends else None
            b, numbers, left = new, now, left - ds
            ds = min(grows * ds, left)
        return found, None

    def over(self, point: OrbitPoint) -> str | None:
        """Return ``infinity`` where an orbit grows while the parameter stands, ``homoclinic`` where it only grows
        longer: states, extremes and parameter stand, beside an equilibrium it waits for ever."""
        shooting, along = point.shooting, np.abs(point.tangent)
        if not along[-1] < WAITS**2:
            return None
        if point.curve.swing(point, shooting.system.scale_vector()) > GROWS:
            return "infinity"
        longer = not shooting.forced and point.tangent[shooting.size - 1] > 0.0
        if not (longer and along[: shooting.n].max() < WAITS):
            return None
        on = point.curve.step(point, WAITS)  # a steep explosion of canards grows as well
        if on is None:
            return None
        moved = np.array([on.path.maximum - point.path.maximum, on.path.minimum - point.path.minimum])
        size = point.curve.size[: moved.shape[1]]
        return "homoclinic" if np.nanmax(np.abs(moved) / size) < STANDS * WAITS else None

    def why(self, point: OrbitPoint) -> str:
        """Return ``physical`` where the equations do not allow the parameter ahead, or that a cycle has shrunk to an
        equilibrium, on a boundary where it has transitions."""
        if _is_nothing(point):
            return "equilibrium" if is_bare(point.shooting) else "boundary_equilibrium"
        ahead = point.value + AHEAD * point.curve.width * float(np.sign(point.tangent[-1]))
        try:
            point.shooting.system.with_parameters({point.shooting.active[-1]: ahead})
        except (SystemDefinitionError, ValueError):
            return "physical"
        return "no_convergence"


def _completes(met: list[Met], beyond: OrbitPoint) -> bool:
    """Return whether only the number of impacts before rest changes, or the speed below which they are completed as
    rest is reached.

    An impact that vanishes far from rest passes that speed too, and is a graze: rest follows on neither side."""
    point = met[0].point
    if _but_completed(point, beyond):
        return True
    passed = [one.kind for one in met if is_tolerance(point, one.kind.surface(point, beyond))]
    return any(
        not isinstance(kind, Crossed)
        or beyond.shooting.m == point.shooting.m
        or rest_after(side, kind.visit(point)) is not None
        for kind in passed
        for side in (point, beyond)
    )


def _but_completed(*sides: OrbitPoint) -> bool:
    """Return whether two orbits take the same transitions but for impacts that rest follows at once in one of them, and
    for what an impact as slow as that leads to: a rest left at once is none."""
    rests = [side.solved.times[i + 1] for side in sides for i in range(side.shooting.m) if rest_after(side, i) == 0]
    soon, words = BEFORE_REST * sides[0].period, []
    for side in sides:
        visits, times = side.signature.visits, side.solved.times[1:]
        slow = {v.transition: completes(side, v) for v in visits[:-1]}
        words.append(
            [
                "slow" if slow[v.transition] else (v.transition, v.row)
                for before, v, after, t in zip((visits[-1], *visits), visits[:-1], visits[1:], times, strict=False)
                if not (v.row == AT_ONCE and slow.get(before.transition))
                and (v.mode != after.mode or slow[v.transition] or not any(0.0 <= rest - t < soon for rest in rests))
            ]
        )
    return bool(rests) and words[0] == words[1]


def _is_centre(met: Met) -> bool:
    """Return whether an autonomous orbit has shrunk to a closed one of a linear mode."""
    point = met.point
    if point.shooting.forced:
        return False
    system, name, width = point.shooting.system, point.shooting.active[0], point.curve.width
    free = [change.new.signature for change in met.kind.contacts(point) if not change.gained]
    return any(not one.crossings and Equilibria(system, one.visits[0].mode, name, width).linear for one in free)


def _is_nothing(point: OrbitPoint) -> bool:
    """Return whether an autonomous orbit has shrunk to one point."""
    return not point.shooting.forced and point.curve.swing(point) < NOTHING


def _in_family(point: OrbitPoint) -> OrbitPoint | None:
    """The orbit without the visits that have shrunk to nothing, where it does not stand alone; else None."""
    for once in touching(point.once, point.shooting.system):
        curve, X = point.curve.around(once, point.X[point.shooting.size :])
        solved = curve.shooting.evaluate(X)
        if in_a_family(curve.shooting, solved):
            return curve.described(Point(curve, X / curve.scale, np.empty(0), 0.0, 0, solved))
    return None


def mark(found: March, met: list[Met], beyond: OrbitPoint | None, end: Met | None = None, name: str = "") -> str:
    """Record the end of a signature, by the contact that begins or ends there where no name is given; its name.

    ``end`` is that place seen from behind, so that it is named alike from either side."""
    point = met[0].point
    names, sliding = list(point.shooting.system.indicators), ""
    if beyond is not None:
        sliding = sliding_bifurcation(point, beyond)
        for change in contacts_of(met):
            if change.new.signature.cycle == beyond.signature.cycle:
                free = change.point  # the orbit without the contact, whichever side the branch came from
                if not change.gained:
                    fresh, solved, tangent = common_orbit(change) or (beyond.curve, beyond.solved, beyond.tangent)
                    free = fresh.point(solved, solved.X / fresh.scale, tangent) or beyond
                judged = graze(beyond, change)
                found.mark("grazing", free, indicator=names[change.indicator], sliding=sliding, **judged)
                return "grazing"
    sides = [met[0]]
    if end is not None:
        sides.insert(0 if _is_better(met[0], end.point) else 1, end)
    kind, point = sides[0].kind, sides[0].point
    own = [change.indicator for side in sides for change in side.kind.contacts(side.point)]
    indicator = own[0] if own else kind.surface(point, beyond)
    touches = sliding in TOUCHES if sliding else own or kind.name == "grazing"
    name = name or ("grazing" if touches else "corner")
    if name == "grazing":  # the orbit without the contact
        point = min((side.point for side in sides), key=lambda one: one.shooting.m)
    found.mark(name, point, indicator=names[indicator] if indicator >= 0 else "", sliding=sliding)
    return name


def _is_better(met: Met, there: OrbitPoint) -> bool:
    """Return whether the end of the new signature, ``there``, is a better place of a corner than that of the old one.

    A visit that ends as it begins, at a double zero, is located badly."""
    if met.kind.place < 0:  # no margin tells where it is: within the interval that simulations leave
        return abs(there.value - met.point.value) < WITHIN * there.curve.width
    new, old = (np.linalg.cond(point.solved.jacobian * point.curve.weights) for point in (there, met.point))
    return bool(new < old)
