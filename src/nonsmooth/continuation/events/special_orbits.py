r"""Test functions of branches of orbits: special points that do not end a signature.

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

from collections.abc import Callable
from typing import Any

import numpy as np

from nonsmooth.continuation.march.event import BranchPoint, Event, Fold, Name, Step
from nonsmooth.continuation.problems.multipliers import copies, distinct, product_of_pairs, without_own
from nonsmooth.continuation.problems.primitive import is_doubled
from nonsmooth.continuation.problems.rounds import INSTANT
from nonsmooth.continuation.problems.shooting import Shooting

POLE = 1e-2  # of a multiplier from 1 or -1: farther off it is no fold, no flip, but a contact of no length
NOTHING = 2e-2  # of the first orbit's size: a fold there is the cycle's birth


class FoldOfOrbits(Fold):
    """Two orbits meet; a branch of cycles that emanates from a Hopf point turns there too."""

    def named(self, step: Step, point: Any) -> Name:
        """A Hopf point, which ends the branch, where the cycle is small."""
        if point.shooting.forced and np.abs(point.multipliers - 1.0).min() > POLE:
            return None  # a contact of no length turns the parameter too, without a multiplier 1
        return ("hopf", "equilibrium") if _is_born(point) else ("fold", None)

    def confirmed(self, point: Any, was: float, now: float) -> bool:
        """Return True for the birth of a cycle as well: of one without size the tangent is noise."""
        return _is_born(point) or super().confirmed(point, was, now)


def is_bare(shooting: Shooting) -> bool:
    """Return whether orbits are autonomous and take no transition: those that emanate from a Hopf point."""
    return not (shooting.forced or shooting.m)


def _is_born(point: Any) -> bool:
    """Return whether a cycle is so small that it emanates from where its parameter turns."""
    return is_bare(point.shooting) and point.curve.swing(point) < NOTHING


class BranchPointOfOrbits(BranchPoint):
    """Another branch of orbits crosses."""

    def number(self, point: Any) -> float:
        """The sign of the bordered determinant; of multipliers that stand more than once each counts once."""
        product = _once(point)
        return super().number(point) if product is None else float(np.sign(product * point.rise))

    def vanishing(self, step: Step) -> Callable[[Any], float]:
        """The bordered determinant, or the product over multipliers of which some stand more than once."""

        def product(point: Any) -> float:
            found = _once(point)
            return np.nan if found is None else found

        return super().vanishing(step) if _once(step.a) is None else product

    def named(self, step: Step, point: Any) -> Name:
        """The flip of the orbit of half the period, which ends the branch, or a crossing by its name."""
        if point.shooting.forced and np.abs(point.multipliers - 1.0).min() > POLE:
            return None  # a contact of no length turns the determinant's sign too
        if is_doubled(point):
            return "flip", "branching"
        # Where copies part many branches cross, and of what happens at one instant second derivatives know one order.
        several = _once(point) is not None or point.path.tau.min() <= INSTANT * point.period
        return (self.name, None) if several else super().named(step, point)


def _once(point: Any) -> float | None:
    """The product of (mu - 1) over distinct multipliers; None where no parts of the system are copies."""
    mu = without_own(point.multipliers, point.shooting.forced)
    return float(np.prod(np.array(distinct(mu)) - 1.0).real) if copies(mu) else None


class Flip(Event):
    """A multiplier passes -1."""

    name = "flip"

    def number(self, point: Any) -> float:
        """det(M + I); of multipliers that stand more than once each counts once."""
        M = point.M
        if M.shape == (2, 2):
            return float(1.0 + M[0, 0] + M[1, 1] + (M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]))
        if len(mu := distinct(point.multipliers)) < len(M):
            return float(np.prod(np.array(mu) + 1.0).real)
        return float(np.linalg.det(M + np.eye(len(M))))

    def named(self, step: Step, point: Any) -> Name:
        """None where no multiplier is near -1."""
        return None if np.abs(point.multipliers + 1.0).min() > POLE else (self.name, None)


class NeimarkSacker(Event):
    """A complex pair of multipliers passes the unit circle."""

    name = "neimark_sacker"

    def number(self, point: Any) -> float:
        """The product of (mu_i mu_j - 1) over all pairs; of a multiplier that stands more than once the others count as
        zeros."""
        mu = without_own(point.multipliers, point.shooting.forced)
        once = distinct(mu) if len(mu) > 2 else mu.tolist()
        return product_of_pairs(np.array([*once, *[0j] * (len(mu) - len(once))]))

    def named(self, step: Step, point: Any) -> Name:
        """None where two real multipliers have the product 1."""
        mu = point.multipliers
        near = mu[np.abs(np.abs(mu) - 1.0) < 1e-3]
        return (self.name, None) if (np.abs(near.imag) > 1e-6).any() else None
