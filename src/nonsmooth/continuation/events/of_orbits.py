r"""Special points of branches of orbits that do not end a signature.

fold
    the parameter turns: the tangent's last component vanishes;
pitchfork, transcritical
    another branch crosses: the bordered determinant changes sign;
flip
    det(M + I) = 0;
neimark_sacker
    :math:`\prod_{i<j} (\mu_i \mu_j - 1) = 0` with a complex pair.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth.continuation.march.event import Crossing, Event, Fold, Name, Step
from nonsmooth.continuation.problems.multipliers import product_of_pairs, without_own
from nonsmooth.continuation.problems.primitive import is_doubled

__all__ = ["KINDS", "SMALL", "Flip", "FoldOfOrbits", "NeimarkSacker"]

POLE = 1e-2  # of a multiplier from 1 or -1: farther off it is no fold, no flip, but a contact of no length
NOTHING = 2e-2  # of the first orbit's size: a fold there is the cycle's birth
SMALL = 2e-3  # of the first orbit's size: a cycle this small is about to vanish in a Hopf bifurcation


class FoldOfOrbits(Fold):
    """Two orbits meet; a branch of cycles that emanates from a Hopf point turns there too."""

    def named(self, step: Step, point: Any) -> Name:
        """A Hopf point, which ends the branch, where the cycle is small."""
        if step.curve.shooting.forced and np.abs(point.multipliers - 1.0).min() > POLE:
            return None  # a contact of no length turns the parameter too, without a multiplier 1
        return ("hopf", "equilibrium") if step.curve.swing(point) < NOTHING else ("fold", None)


class CrossingOfOrbits(Crossing):
    """Another branch of orbits crosses."""

    def named(self, step: Step, point: Any) -> Name:
        """The flip of the orbit of half the period, which ends the branch, or a crossing by its name."""
        if step.curve.shooting.forced and np.abs(point.multipliers - 1.0).min() > POLE:
            return None  # a contact of no length turns the determinant's sign too
        if is_doubled(step.curve, point):
            return "flip", "branching"
        return super().named(step, point)


class Flip(Event):
    """A multiplier passes -1."""

    name = "flip"

    def number(self, curve: Any, point: Any) -> float:
        """det(M + I)."""
        M = point.M
        if M.shape == (2, 2):
            return float(1.0 + M[0, 0] + M[1, 1] + (M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]))
        return float(np.linalg.det(M + np.eye(len(M))))

    def named(self, step: Step, point: Any) -> Name:
        """None where no multiplier is near -1."""
        return None if np.abs(point.multipliers + 1.0).min() > POLE else (self.name, None)


class NeimarkSacker(Event):
    """A complex pair of multipliers passes the unit circle."""

    name = "neimark_sacker"

    def number(self, curve: Any, point: Any) -> float:
        """The product of (mu_i mu_j - 1) over all pairs."""
        return product_of_pairs(without_own(point.multipliers, curve.shooting.forced))

    def named(self, step: Step, point: Any) -> Name:
        """None where two real multipliers have the product 1."""
        mu = point.multipliers
        near = mu[np.abs(np.abs(mu) - 1.0) < 1e-3]
        return (self.name, None) if (np.abs(near.imag) > 1e-6).any() else None


KINDS = (FoldOfOrbits(), CrossingOfOrbits(), Flip(), NeimarkSacker())
