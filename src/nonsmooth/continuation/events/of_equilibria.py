"""Special points of branches of equilibria, and how a branch goes on at the boundary of a mode."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from nonsmooth.continuation.march.event import Crossing, Event, Fold, Met, Step
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.equilibrium import Equilibria, Rest
from nonsmooth.continuation.problems.multipliers import pairs

__all__ = ["AlongEquilibria"]

COMMON = 1e-8  # of the states' scales: nearer than this two equilibria are one
BEYOND = 1e-6  # along the branch: the first equilibrium behind a boundary


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
        """Record the boundary; the equilibrium of the mode behind it, or None."""
        found.mark(met[0].name, curve, met[0].point)
        after = _beyond(curve, met[0].point)
        if after is None:
            found.ending = "boundary"
        return after


def _beyond(curve: Equilibria, rest: Rest) -> tuple[Equilibria, Rest] | None:
    """The equilibrium of the mode behind a boundary, where the two meet; None where there is none."""
    jump = curve.system.transitions[int(rest.margins.argmax())]
    if jump.reset is not None or jump.target == curve.mode:
        return None
    other = Equilibria(curve.system, jump.target, curve.parameter, curve.width)
    common = other.at(rest.u, rest.value)
    if common is None or np.abs((common.u - rest.u) / curve.system.scale_vector()).max() > COMMON:
        return None
    for one in (common.facing(1.0), common.facing(-1.0)):
        first = other.step(one, BEYOND)
        if first is not None and (first.margins <= 0.0).all():
            return other, first
    return None
