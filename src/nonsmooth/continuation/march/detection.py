r"""Test functions along a branch, and the exact location of their zeros.

fold
    the parameter turns: the tangent's last component vanishes;
pitchfork, branch_point
    another branch crosses: the bordered determinant changes sign;
flip
    det(M + I) = 0;
neimark_sacker
    :math:`\prod_{i<j} (\mu_i \mu_j - 1) = 0` with a complex pair;
and the six ways in which a path can leave its signature (``path.VIOLATIONS``).

Each is a number along the branch that changes its sign; the root is bracketed by two points and found by Brent's
method, every trial being an orbit corrected to rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.problems.multipliers import product_of_pairs, without_own
from nonsmooth.continuation.signature.path import VIOLATIONS

if TYPE_CHECKING:
    from nonsmooth.continuation.march.arclength import Curve, Point

__all__ = ["SMOOTH", "Tests", "locate"]

BEGUN = 1e-6
ROUNDING = 1e-13  # of the numbers at both ends: smaller than this is zero
SMOOTH = ("fold", "branch", "flip", "neimark_sacker")


class Tests:
    """The numbers at each point of a curve whose signs are watched."""

    def __init__(self, curve: Curve) -> None:
        shooting = curve.shooting
        self.forced = shooting.forced
        self.eye = np.eye(shooting.n)

    def smooth(self, point: Point) -> NDArray[np.float64]:
        """fold, branch, flip, neimark_sacker."""
        M = point.M
        if M.shape == (2, 2):
            det = M[0, 0] * M[1, 1] - M[0, 1] * M[1, 0]
            flip = 1.0 + M[0, 0] + M[1, 1] + det
        else:
            flip = np.linalg.det(M + self.eye)
        torus = product_of_pairs(without_own(point.multipliers, self.forced))
        return np.array([point.tangent[-1], point.orientation, flip, torus])

    def one(self, kind: str) -> Callable[[Point], float]:
        """The number of one kind."""
        if kind in SMOOTH:
            place = SMOOTH.index(kind)
            return lambda point: float(self.smooth(point)[place])
        place = VIOLATIONS.index(kind)
        return lambda point: float(point.path.violation()[place])


def locate(curve: Curve, a: Point, b: Point, number: Callable[[Point], float]) -> tuple[float, Point] | None:
    """The zero of ``number`` between two points of a curve: its distance from ``a``, and the point."""
    from scipy.optimize import brentq

    end = float(a.tangent @ (b.Y - a.Y))
    if number(a) * number(b) > 0.0 and abs(number(a)) < BEGUN * abs(number(b)):
        return 0.0, a  # the branch begins at the event itself
    found: dict[float, Point] = {}
    nothing = ROUNDING * max((abs(x) for x in (number(a), number(b)) if np.isfinite(x)), default=1.0)

    class _Lost(Exception):
        pass

    def value(s: float) -> float:
        if s == 0.0:
            return limited(number(a))
        if s == end:
            return limited(number(b))
        point = curve.between(a, b, s)
        if point is None:
            raise _Lost
        found[s] = point
        x = limited(number(point))
        return 0.0 if abs(x) < nothing else x

    try:
        s = brentq(value, 0.0, end, xtol=1e-16, rtol=1e-15, maxiter=200)
    except (_Lost, ValueError, RuntimeError):
        return None
    if s not in found:
        point = a if s == 0.0 else b if s == end else curve.between(a, b, s)
        if point is None:
            return None
        found[s] = point
    return float(s), found[s]


def limited(x: float) -> float:
    """Brent's method needs finite numbers; where nothing comes near, any positive one will do."""
    return float(min(max(x, -1e3), 1e3)) if x == x else 1.0
