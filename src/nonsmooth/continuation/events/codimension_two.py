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
from itertools import combinations
from typing import Any, ClassVar, cast

import numpy as np

from nonsmooth.continuation.events.boundaries import BOUNDARIES, contacts_of, section_passed
from nonsmooth.continuation.events.change import inserted
from nonsmooth.continuation.events.grazing import both_sides
from nonsmooth.continuation.march.event import Event, Met, Name, Step, locate
from nonsmooth.continuation.march.march import INTERRUPTED, March, Policy
from nonsmooth.continuation.problems.locus import Locus
from nonsmooth.continuation.problems.multipliers import product_of_pairs, without_own
from nonsmooth.continuation.problems.normal_form import flip_coefficient, torus_coefficient
from nonsmooth.continuation.problems.orbits import OrbitPoint

PAIR = 1e-6  # imaginary part of a complex pair
NOISE = 1e-6  # a coefficient that stays below this balance vanishes all along (an area-preserving map)
DOUBLE = 1e-5  # two multipliers nearer to -1 than this: rounding decides on the coefficient, which has a pole there
#: Points at which a Neimark-Sacker curve ends: beyond, the two multipliers are real.
ENDED = ("resonance_1_1", "resonance_1_2")


class CodimensionTwo(Event):
    """A second number vanishes on a curve of special points: a function of the point and given numbers."""

    certain = False

    def __init__(self, name: str, function: Callable[..., float], *given: float) -> None:
        self.name, self._function, self._given = name, function, given

    def number(self, point: Any) -> float:
        """The number."""
        return self._function(point, *self._given)


class OfPair(CodimensionTwo):
    """A number of the pair on the unit circle of a Neimark-Sacker curve; at 1 and -1 the curve ends."""

    def named(self, step: Step, point: Any) -> Name:
        """Its name; None where the pair is real."""
        if self.name in ENDED:
            return self.name, "resonance"
        return (self.name, None) if np.abs(point.multipliers.imag).max() >= PAIR else None


class Coefficient(CodimensionTwo):
    """The coefficient of a normal form vanishes."""

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether its sign changes, and it is not zero all along."""
        balance = (abs(_coefficient(end, 1)) for end in (step.a, step.b))
        return was * now < 0.0 and max(balance) >= NOISE

    def named(self, step: Step, point: Any) -> Name:
        """Its name; None at a 1:2 resonance."""
        resonant = int((np.abs(point.multipliers + 1.0) < DOUBLE).sum()) > 1
        return None if resonant else (self.name, None)


class Cusp(Event):
    """Both parameters turn round together."""

    name = "cusp"
    certain = False

    def number(self, point: Any) -> float:
        """Nothing to watch at one point: two directions are compared."""
        return np.nan

    def happened(self, step: Step, was: float, now: float) -> bool:
        """Return whether the direction of the parameters turns on the step."""
        return float(step.a.tangent[-2:] @ step.b.tangent[-2:]) < 0.0

    def confirmed(self, point: Any, was: float, now: float) -> bool:
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
        self._graze, every, of_forced = KINDS[kind]
        self.kinds = (*every, *of_forced) if forced else every

    def behind(self, found: March, met: list[Met]) -> OrbitPoint | None:
        """Go on behind the section; at a graze or a corner, which is recorded, the curve ends."""
        if (after := section_passed(met)) is not None:
            return after
        grazes = contacts_of(met) or met[0].kind.name == "grazing"
        found.ending = "grazing" if grazes else "corner"
        found.mark(self._graze if grazes else found.ending, met[0].point)
        return None


def _coefficient(place: OrbitPoint, which: int = 0) -> float:
    """The normal form's coefficient (1: its balance), on a curve of flips or of Neimark-Sacker points; NaN: none."""
    try:
        if cast(Locus, place.curve).kind == "flip":
            return flip_coefficient(place.shooting, place.solved, place.curve.scale)[which]
        mu = complex(place.multipliers[_pair(place)[0]])
        if abs(mu.imag) > PAIR:
            return torus_coefficient(place.shooting, place.solved, place.curve.scale, mu)[which]
    except np.linalg.LinAlgError:  # at a resonance or another multiplier 1 there is none
        pass
    return np.nan


def _polynomial(place: OrbitPoint, x: float, order: int) -> float:
    """The characteristic polynomial of M or a derivative at x; NaN where too few multipliers are left for it."""
    own = 0 if place.shooting.forced else 1  # derivatives that vanish at 1 anyway
    if order > 0 and len(place.M) < 2 + own:
        return np.nan
    return float(np.polyval(np.polyder(np.poly(place.M), order + (own if x == 1.0 else 0)), x))


def _others(place: OrbitPoint, own: float) -> float:
    """prod (mu_i mu_j - 1) of the multipliers without the critical one; NaN without a complex pair."""
    mu = np.delete(place.multipliers, np.abs(place.multipliers - own).argmin())
    mu = without_own(mu, place.shooting.forced)
    return product_of_pairs(mu) if (np.abs(mu.imag) > PAIR).any() else np.nan


def _sum_and(place: OrbitPoint, x: float) -> float:
    """The sum of the pair on the unit circle, and x."""
    return float(place.multipliers[list(_pair(place))].sum().real) + x


def _rest(place: OrbitPoint, sign: float) -> float:
    """prod (1 +- mu) of the multipliers without the pair; NaN where there are none."""
    rest = without_own(np.delete(place.multipliers, _pair(place)), place.shooting.forced)
    return float(np.prod(1.0 + sign * rest).real) if len(rest) else np.nan


def _pair(place: OrbitPoint) -> tuple[int, int]:
    """The two multipliers whose product is 1."""
    mu, choice = place.multipliers, list(range(len(place.multipliers)))
    if not place.shooting.forced and len(mu) > 2:  # the own 1 is none of them, unless it has become double
        choice.remove(int(np.abs(mu - 1.0).argmin()))
    i, j = min(combinations(choice, 2), key=lambda pair: abs(mu[pair[0]] * mu[pair[1]] - 1.0))
    return (i, j) if mu[i].imag >= 0.0 else (j, i)


def _with_contact(place: OrbitPoint, sign: float) -> float:
    """det(I +- M+); where M+ is unbounded (a rigid impact), its leading coefficient."""
    for change in inserted(place):
        M, far, near = both_sides(change)
        if not (np.isfinite(far).all() and np.isfinite(near).all()):
            continue
        one = np.eye(len(M))
        if np.abs(near).max() < 1.5 * np.abs(far).max():
            return float(np.linalg.det(one + sign * (2 * near - far)))
        return float(np.linalg.det(one + sign * near) - np.linalg.det(one + sign * far)) / np.abs(far).max()
    return np.nan


#: The kinds that have curves, each with the point at which its curve meets a graze, the points of codimension two that
#: it is searched for, and those of forced orbits besides.
KINDS: dict[str, tuple[str, tuple[Event, ...], tuple[Event, ...]]] = {
    "fold": (
        "grazing_fold",
        (
            CodimensionTwo("fold_flip", _polynomial, -1.0, 0),
            CodimensionTwo("resonance_1_1", _polynomial, 1.0, 1),
            CodimensionTwo("fold_neimark_sacker", _others, 1.0),
            Cusp(),
        ),
        (),
    ),
    "flip": (
        "grazing_flip",
        (
            CodimensionTwo("fold_flip", _polynomial, 1.0, 0),
            CodimensionTwo("resonance_1_2", _polynomial, -1.0, 1),
            CodimensionTwo("flip_neimark_sacker", _others, -1.0),
        ),
        (Coefficient("generalised_flip", _coefficient),),
    ),
    "neimark_sacker": (
        "grazing_neimark_sacker",
        (
            OfPair("resonance_1_1", _sum_and, -2.0),
            OfPair("resonance_1_2", _sum_and, 2.0),
            OfPair("resonance_1_3", _sum_and, 1.0),
            OfPair("resonance_1_4", _sum_and, 0.0),
            OfPair("fold_neimark_sacker", _rest, -1.0),
            OfPair("flip_neimark_sacker", _rest, 1.0),
        ),
        (Coefficient("chenciner", _coefficient),),
    ),
    "grazing": (
        "double_grazing",
        (
            CodimensionTwo("grazing_fold", _polynomial, 1.0, 0),
            CodimensionTwo("grazing_flip", _polynomial, -1.0, 0),
        ),
        (CodimensionTwo("grazing_fold", _with_contact, -1.0), CodimensionTwo("grazing_flip", _with_contact, 1.0)),
    ),
}
