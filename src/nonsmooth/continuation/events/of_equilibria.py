"""Special points of branches of equilibria, and how a branch goes on at the boundary of a mode."""

from __future__ import annotations

from itertools import combinations
from math import prod
from typing import Any, ClassVar

import numpy as np

from nonsmooth.continuation.march.event import BranchPoint, Event, Fold, Met, Name, Step, first_beyond
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.equilibrium import FREE, Rest, equilibria_near, goes_on

BEYOND = 1e-6  # along the branch: the first equilibrium behind a boundary
NEAR = 1e-4  # of the states' scales: equilibria so little behind a boundary are as near
LOCATED = 1e-9  # of a step: the place where two sets touch


class Hopf(Event):
    """A pair of eigenvalues passes +-i omega; in a linear mode a focus becomes a centre."""

    name = "hopf"

    def number(self, point: Any) -> float:
        """The product of all sums of two eigenvalues."""
        return complex(prod(a + b for a, b in combinations(point.eigenvalues.tolist(), 2))).real

    def named(self, step: Step, point: Any) -> Name:
        """None where the sum of two real eigenvalues vanishes."""
        nearest = point.eigenvalues[np.argmin(np.abs(point.eigenvalues.real))]
        if abs(nearest.imag) <= 1e-9:
            return None
        return ("focus_centre" if step.curve.linear else "hopf"), None


class Edge(Event):
    """The equilibrium reaches the boundary of its mode."""

    name = "boundary_equilibrium"

    def number(self, point: Any) -> float:
        """The least distance to a transition."""
        return float(point.curve.margins(point)[0])

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the equilibrium leaves its mode on the step."""
        return now < 0.0 < was


class AlongEquilibria(Policy):
    """Folds, crossings, Hopf points and boundaries of equilibria."""

    kinds = (Fold(), BranchPoint(), Hopf())
    boundaries = (Edge(),)
    unseen_on = ("", "range")
    endings: ClassVar = {
        "range": "The branch reached the edge of the range.",
        "points": "The largest number of points was reached.",
        "no_convergence": "Newton's method did not converge, however small the step.",
        "boundary": (
            "The equilibrium meets the boundary of its mode, and no equilibrium of the mode beyond continues it: on "
            "the other side it is virtual."
        ),
        "interrupted": f"{INTERRUPTED}.",
    }

    def unseen(self, step: Step) -> Met | None:
        """The place on a step where another set of equilibria runs into this one."""
        if step.curve.alone(step.b):
            return None
        there = first_beyond(step, step.curve.alone, LOCATED * step.end)
        return Met(self.boundaries[0], *there, self.boundaries[0].name)

    def behind(self, found: March, met: list[Met]) -> Rest | None:
        """Record the boundary, and whether the branch goes on behind it or turns back; the equilibrium there, or None.

        Persistence: on the other side of the boundary lies an equilibrium of the mode beyond. Non-smooth fold: it lies
        on the same side, and both meet and vanish."""
        rest = met[0].point
        after = beyond(rest)
        if after is None:
            found.ending = "boundary"
        corner = rest.margins[len(rest.curve.system.transitions) :].max(initial=-np.inf) > -0.5 * FREE
        if after is None or not corner:  # else another point of the set is its extreme from here on
            ahead = after is not None and rest.rise * after.rise > 0.0
            graze = "" if after is None else "persistence" if ahead else "non_smooth_fold"
            found.mark(met[0].name, rest, grazing=graze)
        return after


def standing(rest: Rest) -> Rest | None:
    """The equilibrium itself inside its mode, the one behind where it stands on the mode's boundary, else None."""
    return rest if (rest.margins < 0.0).all() else beyond(rest) if (rest.margins <= 0.0).all() else None


def beyond(rest: Rest) -> Rest | None:
    """The equilibrium, or the set of them, behind a boundary, where the two meet; None where there is none."""
    curve = rest.curve
    scale, facing = curve.system.scale_vector(), float(np.copysign(1.0, rest.tangent[-1]))
    for ahead in (facing, -facing):
        value = rest.value + BEYOND * curve.width * ahead
        for first in equilibria_near(curve.system, curve.parameter, curve.width, rest.u, value):
            if first.curve.word() == curve.word():
                continue  # back lies the branch that has come here
            if goes_on(rest, first, NEAR * scale) and (first.margins < 0.0).all():
                return first.facing(ahead)
    return None
