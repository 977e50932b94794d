"""Special points of branches of equilibria, and how a branch goes on at the boundary of a mode."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from nonsmooth.continuation.march.event import Crossing, Event, Fold, Met, Step
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.equilibrium import Equilibria, Rest, set_near
from nonsmooth.continuation.problems.multipliers import pairs

__all__ = ["AlongEquilibria", "beyond"]

COMMON = 1e-8  # of the states' scales: nearer than this two equilibria are one
BEYOND = 1e-6  # along the branch: the first equilibrium behind a boundary
NEAR = 1e-4  # of the states' scales: the ends of a set so little behind a boundary are as near
MEETS = 1e-9  # of an indicator: a condition farther from holding is not met


class Hopf(Event):
    """A pair of eigenvalues passes +-i omega; in a linear mode a focus becomes a centre."""

    name = "hopf"

    def number(self, curve: Any, point: Any) -> float:
        """The product of all sums of two eigenvalues."""
        if len(point.eigenvalues) < 2:
            return 1.0
        i, j = pairs(len(point.eigenvalues))
        return float(np.prod(point.eigenvalues[i] + point.eigenvalues[j]).real)

    def named(self, step: Step, point: Any) -> tuple[str, str | None] | None:
        """None where the sum of two real eigenvalues vanishes."""
        nearest = point.eigenvalues[np.argmin(np.abs(point.eigenvalues.real))]
        if abs(nearest.imag) <= 1e-9:
            return None
        return ("focus_centre" if step.curve.linear else "hopf"), None


class Edge(Event):
    """The equilibrium reaches the boundary of its mode."""

    name = "boundary_equilibrium"

    def number(self, curve: Any, point: Any) -> float:
        """The least distance to a transition."""
        return float(curve.margins(point)[0])

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the equilibrium leaves its mode on the step."""
        return now < 0.0 < was


class AlongEquilibria(Policy):
    """Folds, crossings, Hopf points and boundaries of equilibria."""

    kinds = (Fold(), Crossing(), Hopf())
    boundaries = (Edge(),)
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

    def behind(self, found: March, curve: Equilibria, met: list[Met]) -> tuple[Equilibria, Rest] | None:
        """Record the boundary, and whether the branch goes on behind it or turns back; the equilibrium there, or None.

        Persistence: on the other side of the boundary lies an equilibrium of the mode beyond. Non-smooth fold: it lies
        on the same side, and both meet and vanish."""
        rest = met[0].point
        after = beyond(curve, rest)
        if after is None:
            found.ending = "boundary"
        ahead = after is not None and float(rest.tangent[-1]) * float(after[1].tangent[-1]) > 0.0
        graze = "" if after is None else "persistence" if ahead else "non_smooth_fold"
        found.mark(met[0].name, curve, rest, graze=graze)
        return after


def beyond(curve: Equilibria, rest: Rest) -> tuple[Equilibria, Rest] | None:
    """The equilibrium, or the set of them, behind a boundary, where the two meet; None where there is none."""
    system, parameter, width = curve.system, curve.parameter, curve.width
    scale, facing = system.scale_vector(), float(rest.tangent[-1])
    met = [int(k) for k in np.argsort(-rest.margins) if rest.margins[k] > -MEETS]
    nearest = [*(system.transitions[k].target for k in met), curve.mode]
    for mode in dict.fromkeys([*nearest, *range(len(system.modes))]):  # two contacts may change at once
        other = Equilibria(system, mode, parameter, width)
        common = other.at(rest.u, rest.value) if mode != curve.mode else None
        if common is not None and np.abs((common.u - rest.u) / scale).max() <= COMMON:
            for one in (common.facing(facing), common.facing(-facing)):
                first = other.step(one, BEYOND)
                if first is not None and (first.margins < 0.0).all():
                    return other, first
        for ahead in (1.0, -1.0) if mode != curve.mode else (1.0,):  # back lies the branch that has come here
            found = set_near(other, rest.u, rest.value + float(np.copysign(BEYOND * width, facing * ahead)))
            if found is None:
                continue
            fresh, first = found[0], found[1].facing(facing * ahead)
            sides = [(np.min(one.ends, axis=0), np.max(one.ends, axis=0)) for one in (rest, first)]
            if np.abs((np.array(sides[0]) - sides[1]) / scale).max() <= NEAR:
                return fresh, first
    return None
