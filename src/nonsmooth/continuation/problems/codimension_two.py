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
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.roots import zero_on
from nonsmooth.continuation.problems.multipliers import product_of_pairs, without_own
from nonsmooth.continuation.problems.normal_form import flip_coefficient, torus_coefficient
from nonsmooth.continuation.signature.change import contacts
from nonsmooth.continuation.signature.grazing import both_sides

if TYPE_CHECKING:
    from nonsmooth.continuation.march.arclength import Point
    from nonsmooth.continuation.problems.locus import Locus

__all__ = ["ENDED", "Second", "name_of", "numbers", "root", "sign_changes"]

FloatArray = NDArray[np.float64]
PAIR = 1e-6  # imaginary part of a complex pair
NOISE = 1e-6  # a coefficient that stays below this balance vanishes all along (an area-preserving map)
POLE = 1e-3  # of the numbers at both ends: one that is larger at its root has gone through infinity
COEFFICIENTS = ("generalised_flip", "chenciner")
#: Names of the numbers of a grazing curve that stand for the same point seen from the other side.
_NAMES = {"contact_fold": "grazing_fold", "contact_flip": "grazing_flip"}
#: Points at which a Neimark-Sacker curve ends: beyond, the two multipliers are real.
ENDED = ("resonance_1_1", "resonance_1_2")


def name_of(number: str) -> str:
    """The point of codimension two at which a number vanishes."""
    return _NAMES.get(number, number)


def numbers(locus: Locus, place: Point) -> dict[str, float]:
    """The numbers at one place of a curve, in the order of the table above."""
    found = _of_multipliers(locus, place)
    if locus.shooting.forced and locus.kind == "flip":
        found["generalised_flip"] = _coefficient(locus, place)[0]
    elif locus.shooting.forced and locus.kind == "neimark_sacker":
        found["chenciner"] = _coefficient(locus, place)[0]
    return found


def _of_multipliers(locus: Locus, place: Point) -> dict[str, float]:
    M, forced = place.M, locus.shooting.forced
    at_one = 0 if forced else 1  # derivatives of p that vanish at 1 anyway
    p = np.poly(M)
    enough = len(M) >= (2 if forced else 3)
    found: dict[str, float] = {}
    if locus.kind == "fold":
        found["fold_flip"] = float(np.polyval(p, -1.0))
        if enough:
            found["resonance_1_1"] = _derivative(p, 1.0, at_one + 1)
            found["fold_neimark_sacker"] = _others(locus, place, 1.0)
    elif locus.kind == "flip":
        found["fold_flip"] = _derivative(p, 1.0, at_one)
        if enough:
            found["resonance_1_2"] = _derivative(p, -1.0, 1)
            found["flip_neimark_sacker"] = _others(locus, place, -1.0)
    elif locus.kind == "neimark_sacker":
        i, j = _pair(place, forced)
        mu = place.multipliers
        total = float((mu[i] + mu[j]).real)
        found = {"resonance_1_1": total - 2.0, "resonance_1_2": total + 2.0, "resonance_1_3": total + 1.0,
                 "resonance_1_4": total}  # fmt: skip
        rest = without_own(np.delete(mu, [i, j]), forced)
        if len(rest):
            found["fold_neimark_sacker"] = float(np.prod(1.0 - rest).real)
            found["flip_neimark_sacker"] = float(np.prod(1.0 + rest).real)
    elif locus.kind == "grazing":
        found["grazing_fold"] = _derivative(p, 1.0, at_one)
        found["grazing_flip"] = float(np.linalg.det(M + np.eye(len(M))))
        if forced:
            found |= _with_contact(locus, place)
    return found


def _coefficient(locus: Locus, place: Point) -> tuple[float, float]:
    """The normal form's coefficient and its balance, on a curve of flips or of Neimark-Sacker points; NaN: none."""
    try:
        if locus.kind == "flip":
            return flip_coefficient(locus.shooting, place.solved, locus.scale)
        mu = complex(place.multipliers[_pair(place, locus.shooting.forced)[0]])
        if abs(mu.imag) > PAIR:
            return torus_coefficient(locus.shooting, place.solved, locus.scale, mu)
    except np.linalg.LinAlgError:  # at a resonance or another multiplier 1 there is none
        pass
    return np.nan, np.nan


def _derivative(p: Any, x: float, order: int) -> float:
    return float(np.polyval(np.polyder(p, order), x)) if order else float(np.polyval(p, x))


def _others(locus: Locus, place: Point, own: float) -> float:
    """prod (mu_i mu_j - 1) of the multipliers without the critical one; NaN without a complex pair."""
    mu = np.delete(place.multipliers, np.abs(place.multipliers - own).argmin())
    mu = without_own(mu, locus.shooting.forced)
    return product_of_pairs(mu) if (np.abs(mu.imag) > PAIR).any() else np.nan


def _pair(place: Point, forced: bool) -> tuple[int, int]:
    """The two multipliers whose product is 1."""
    mu = place.multipliers
    i, j = np.triu_indices(len(mu), 1)
    far = np.abs(mu[i] * mu[j] - 1.0)
    if not forced:  # the own multiplier 1 is none of them, unless it has become double
        own = int(np.abs(mu - 1.0).argmin())
        if len(mu) > 2:
            far[(i == own) | (j == own)] = np.inf
    at = int(far.argmin())
    return (int(i[at]), int(j[at])) if mu[i[at]].imag >= 0.0 else (int(j[at]), int(i[at]))


def _with_contact(locus: Locus, place: Point) -> dict[str, float]:
    """det(I -+ M+); where M+ is unbounded (a rigid impact), its leading coefficient."""
    as_curve: Any = locus  # what is asked of a curve here is its shooting and its walk
    for change in contacts(as_curve, place, "touch"):
        M, far, near = both_sides(locus.shooting, place.solved, change)
        if not (np.isfinite(far).all() and np.isfinite(near).all()):
            continue
        one = np.eye(len(M))
        if np.abs(near).max() < 1.5 * np.abs(far).max():
            limit = 2 * near - far
            fold, flip = (float(np.linalg.det(one + sign * limit)) for sign in (-1.0, 1.0))
            return {"contact_fold": fold, "contact_flip": flip}
        size = np.abs(far).max()
        return {
            name: float(np.linalg.det(one + sign * near) - np.linalg.det(one + sign * far)) / size
            for name, sign in (("contact_fold", -1.0), ("contact_flip", 1.0))
        }
    return {}


def sign_changes(locus: Locus, a: Point, b: Point, before: dict[str, float], after: dict[str, float],
                 stop: float) -> list[tuple[float, str, Point]]:  # fmt: skip
    """Points of codimension two between two places of a curve, nearer to the first than ``stop``."""
    found: list[tuple[float, str, Point]] = []
    for name, was in before.items():
        now = after.get(name, np.nan)
        if not was * now < 0.0:
            continue
        if name in COEFFICIENTS and max(abs(_coefficient(locus, place)[1]) for place in (a, b)) < NOISE:
            continue
        second = Second(locus, name)
        there = root(locus, a, b, second)
        if there is None or there[0] >= stop or abs(second(there[1])) > POLE * max(abs(was), abs(now)):
            continue
        if locus.kind == "neimark_sacker" and name not in ENDED and abs(np.abs(there[1].multipliers.imag).max()) < PAIR:
            continue
        found.append((there[0], name_of(name), there[1]))
    return found


@dataclass
class Second:
    """The number that vanishes at a point of codimension two."""

    locus: Locus
    name: str

    def __call__(self, place: Point) -> float:
        if self.name in COEFFICIENTS:
            return _coefficient(self.locus, place)[0]
        return _of_multipliers(self.locus, place).get(self.name, np.nan)


def root(locus: Locus, a: Point, b: Point, number: Callable[[Point], float]) -> tuple[float, Point] | None:
    """The zero of ``number`` on the curve between two of its places: its distance from the first, and the place."""
    end = float(a.tangent @ (b.Y - a.Y))
    return zero_on(lambda s: a if s == 0.0 else b if s == end else locus.between(a, b, s), end, number)
