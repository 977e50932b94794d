r"""Numbers that change their sign at a point of codimension two, and its location on a curve.

With the characteristic polynomial p of the monodromy matrix (an autonomous orbit's own multiplier 1 divided out by
differentiating once more at 1):

==================  ============================================================================================
curve               numbers
==================  ============================================================================================
fold                fold_flip p(-1); resonance_1_1 p'(1); fold_neimark_sacker; cusp: both parameters turn together
flip                fold_flip p(1); resonance_1_2 p'(-1); flip_neimark_sacker; generalised_flip: the coefficient c
neimark_sacker      with s the sum of the pair: resonance_1_1 s - 2, 1_2 s + 2, 1_3 s + 1, 1_4 s; chenciner: the
                    coefficient d; fold_neimark_sacker, flip_neimark_sacker: the other multipliers at 1, -1
grazing             grazing_fold det(I - M), grazing_flip det(I + M), for M- and for M+ (Feigin's signs change there)
==================  ============================================================================================
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from nonsmooth.continuation.events.boundaries import BOUNDARIES
from nonsmooth.continuation.events.change import inserted
from nonsmooth.continuation.events.grazing import both_sides
from nonsmooth.continuation.march.event import Event, Met, Step, locate
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.continuation.problems.multipliers import pairs, product_of_pairs, without_own
from nonsmooth.continuation.problems.normal_form import flip_coefficient, torus_coefficient
from nonsmooth.continuation.problems.orbits import OrbitPoint

__all__ = ["KINDS", "AlongCurve"]

#: The kinds that have curves, each with the point of codimension two at which its curve meets a graze.
KINDS = {
    "fold": "grazing_fold", "flip": "grazing_flip", "neimark_sacker": "grazing_neimark_sacker",
    "grazing": "double_grazing",
}  # fmt: skip
PAIR = 1e-6  # imaginary part of a complex pair
NOISE = 1e-6  # a coefficient that stays below this balance vanishes all along (an area-preserving map)
POLE = 1e-3  # of the numbers at both ends: one that is larger at its root has gone through infinity
DOUBLE = 1e-5  # two multipliers nearer to -1 than this: rounding decides on the coefficient, which has a pole there
#: Points at which a Neimark-Sacker curve ends: beyond, the two multipliers are real.
ENDED = ("resonance_1_1", "resonance_1_2")
Number = Callable[[Locus, OrbitPoint], float]


class CodimensionTwo(Event):
    """A second number vanishes on a curve of special points."""

    certain = False

    def __init__(self, name: str, number: Number) -> None:
        self.name, self._number = name, number

    def number(self, curve: Any, point: Any) -> float:
        """The number."""
        return self._number(curve, point)

    def named(self, step: Step, point: Any) -> tuple[str, str | None] | None:
        """Its name; None where the number went through infinity."""
        was, now = (self.number(step.curve, end) for end in (step.a, step.b))
        if abs(self.number(step.curve, point)) > POLE * max(abs(was), abs(now)):
            return None
        return self.name, None


class OfPair(CodimensionTwo):
    """A number of the pair on the unit circle of a Neimark-Sacker curve; at 1 and -1 the curve ends."""

    def named(self, step: Step, point: Any) -> tuple[str, str | None] | None:
        """Its name; None where the pair is real."""
        if self.name in ENDED:
            return self.name, "resonance"
        return super().named(step, point) if np.abs(point.multipliers.imag).max() >= PAIR else None


class Coefficient(CodimensionTwo):
    """The coefficient of a normal form vanishes."""

    def __init__(self, name: str) -> None:
        super().__init__(name, lambda curve, point: _coefficient(curve, point)[0])

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether its sign changes, and it is not zero all along."""
        balance = (abs(_coefficient(step.curve, end)[1]) for end in (step.a, step.b))
        return was * now < 0.0 and max(balance) >= NOISE

    def named(self, step: Step, point: Any) -> tuple[str, str | None] | None:
        """Its name; None at a 1:2 resonance."""
        resonant = int((np.abs(point.multipliers + 1.0) < DOUBLE).sum()) > 1
        return None if resonant else super().named(step, point)


class Cusp(Event):
    """Both parameters turn round together."""

    name = "cusp"
    certain = False

    def number(self, curve: Any, point: Any) -> float:
        """Nothing to watch at one point: two directions are compared."""
        return np.nan

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the direction of the parameters turns on the step."""
        return float(step.a.tangent[-2:] @ step.b.tangent[-2:]) < 0.0

    def confirmed(self, curve: Any, point: Any, was: float, now: float) -> bool:
        """Return True: it has no number of its own."""
        return True

    def located(self, step: Step) -> tuple[float, Any] | None:
        """The zero of the direction's component along the earlier one."""
        before = step.a.tangent[-2:]
        return locate(step, lambda point: float(point.tangent[-2:] @ before))


class AlongCurve(Policy):
    """Points of codimension two on a curve of special points of one kind; it ends at a graze or a corner."""

    boundaries = BOUNDARIES
    endings: ClassVar = {
        "range": "The curve reached the edge of the box.",
        "closed": "The curve came back to where it began.",
        "points": "The largest number of points was reached.",
        "no_convergence": "Newton's method did not converge, however small the step.",
        "grazing": "A contact begins or ends here: beyond this point the orbit has another signature.",
        "corner": "The orbit meets the corner of two boundaries: beyond this point it has another signature.",
        "resonance": "Both multipliers meet on the real axis: beyond this point they are real, and there is no torus.",
        "interrupted": f"{INTERRUPTED}.",
    }

    def __init__(self, kind: str, forced: bool) -> None:
        self.kinds, self._graze = _kinds_on(kind, forced), KINDS[kind]

    def behind(self, found: March, curve: Locus, met: list[Met]) -> None:
        """Record the point at which the curve meets a graze or a corner; it ends there."""
        found.ending = met[0].name
        found.mark(self._graze if met[0].name == "grazing" else met[0].name, curve, met[0].point)


def _kinds_on(kind: str, forced: bool) -> tuple[Event, ...]:
    """The points of codimension two that curves of one kind are searched for."""
    own = 0 if forced else 1  # derivatives of p that vanish at 1 anyway
    if kind == "fold":
        return (
            CodimensionTwo("fold_flip", _polynomial(-1.0, 0)),
            CodimensionTwo("resonance_1_1", _polynomial(1.0, own + 1)),
            CodimensionTwo("fold_neimark_sacker", _others(1.0)),
            Cusp(),
        )
    if kind == "flip":
        found: tuple[Event, ...] = (
            CodimensionTwo("fold_flip", _polynomial(1.0, own)),
            CodimensionTwo("resonance_1_2", _polynomial(-1.0, 1)),
            CodimensionTwo("flip_neimark_sacker", _others(-1.0)),
        )
        return (*found, Coefficient("generalised_flip")) if forced else found
    if kind == "neimark_sacker":
        found = (
            *(OfPair(name, _sum_and(x)) for name, x in (("resonance_1_1", -2.0), ("resonance_1_2", 2.0),
                                                        ("resonance_1_3", 1.0), ("resonance_1_4", 0.0))),
            OfPair("fold_neimark_sacker", _rest(-1.0)), OfPair("flip_neimark_sacker", _rest(1.0)),
        )  # fmt: skip
        return (*found, Coefficient("chenciner")) if forced else found
    found = (
        CodimensionTwo("grazing_fold", _polynomial(1.0, own)),
        CodimensionTwo("grazing_flip", lambda _, place: float(np.linalg.det(place.M + np.eye(len(place.M))))),
    )
    contact = (CodimensionTwo(name, _with_contact(x)) for name, x in (("grazing_fold", -1.0), ("grazing_flip", 1.0)))
    return (*found, *contact) if forced else found


def _coefficient(locus: Locus, place: OrbitPoint) -> tuple[float, float]:
    """The normal form's coefficient and its balance, on a curve of flips or of Neimark-Sacker points; NaN: none."""
    try:
        if locus.kind == "flip":
            return flip_coefficient(locus.shooting, place.solved, locus.scale)
        mu = complex(place.multipliers[_pair(locus, place)[0]])
        if abs(mu.imag) > PAIR:
            return torus_coefficient(locus.shooting, place.solved, locus.scale, mu)
    except np.linalg.LinAlgError:  # at a resonance or another multiplier 1 there is none
        pass
    return np.nan, np.nan


def _polynomial(x: float, order: int) -> Number:
    """The characteristic polynomial of M or a derivative at x; NaN where too few multipliers are left for it."""

    def number(locus: Locus, place: OrbitPoint) -> float:
        least = 2 if locus.shooting.forced else 3
        if order > (0 if locus.shooting.forced or x != 1.0 else 1) and len(place.M) < least:
            return np.nan
        p = np.poly(place.M)
        return float(np.polyval(np.polyder(p, order), x)) if order else float(np.polyval(p, x))

    return number


def _others(own: float) -> Number:
    """prod (mu_i mu_j - 1) of the multipliers without the critical one; NaN without a complex pair."""

    def number(locus: Locus, place: OrbitPoint) -> float:
        mu = np.delete(place.multipliers, np.abs(place.multipliers - own).argmin())
        mu = without_own(mu, locus.shooting.forced)
        return product_of_pairs(mu) if (np.abs(mu.imag) > PAIR).any() else np.nan

    return number


def _sum_and(x: float) -> Number:
    """The sum of the pair on the unit circle, and x."""

    def number(locus: Locus, place: OrbitPoint) -> float:
        i, j = _pair(locus, place)
        return float((place.multipliers[i] + place.multipliers[j]).real) + x

    return number


def _rest(sign: float) -> Number:
    """prod (1 +- mu) of the multipliers without the pair; NaN where there are none."""

    def number(locus: Locus, place: OrbitPoint) -> float:
        rest = without_own(np.delete(place.multipliers, _pair(locus, place)), locus.shooting.forced)
        return float(np.prod(1.0 + sign * rest).real) if len(rest) else np.nan

    return number


def _pair(locus: Locus, place: OrbitPoint) -> tuple[int, int]:
    """The two multipliers whose product is 1."""
    mu = place.multipliers
    i, j = pairs(len(mu))
    far = np.abs(mu[i] * mu[j] - 1.0)
    if not locus.shooting.forced:  # the own multiplier 1 is none of them, unless it has become double
        own = int(np.abs(mu - 1.0).argmin())
        if len(mu) > 2:
            far[(i == own) | (j == own)] = np.inf
    at = int(far.argmin())
    return (int(i[at]), int(j[at])) if mu[i[at]].imag >= 0.0 else (int(j[at]), int(i[at]))


def _with_contact(sign: float) -> Number:
    """det(I +- M+); where M+ is unbounded (a rigid impact), its leading coefficient."""

    def number(locus: Locus, place: OrbitPoint) -> float:
        for change in inserted(locus, place):
            M, far, near = both_sides(locus, place, change)
            if not (np.isfinite(far).all() and np.isfinite(near).all()):
                continue
            one = np.eye(len(M))
            if np.abs(near).max() < 1.5 * np.abs(far).max():
                return float(np.linalg.det(one + sign * (2 * near - far)))
            return float(np.linalg.det(one + sign * near) - np.linalg.det(one + sign * far)) / np.abs(far).max()
        return np.nan

    return number
