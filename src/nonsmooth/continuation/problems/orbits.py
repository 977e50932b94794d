"""Periodic orbits of one signature over their active parameters, as curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.problems.curve import Curve, Point
from nonsmooth.continuation.problems.multipliers import without_own
from nonsmooth.continuation.problems.path import Path, Walk
from nonsmooth.continuation.problems.rounds import Rounds
from nonsmooth.continuation.problems.shooting import Shooting, Solved, plane_across
from nonsmooth.continuation.problems.signature import Round, Signature
from nonsmooth.flow.loads import within_held
from nonsmooth.results.memory import room_for
from nonsmooth.system.system import System

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

GROWN = 2.0  # times its size: the motion is measured anew


def size_of(maximum: FloatArray, minimum: FloatArray, system: System) -> FloatArray:
    """Half the range of each state, and 1 for the memory; of a state that no mode moves, or that stands on this orbit,
    at least its absolute value.

    Between two resets, or at rest, a state has no range that could tell how far it moves along a branch."""
    least = 1e-3 * system.scale_vector()
    half = np.maximum(np.nan_to_num(0.5 * (maximum - minimum)), least)
    largest = np.nan_to_num(np.maximum(np.abs(maximum), np.abs(minimum)))
    still = _still(system.traced) | (half == least)
    return np.concatenate([np.where(still, np.maximum(half, largest), half), np.ones(len(system.memory))])


@lru_cache(maxsize=32)
def _still(traced: Traced) -> NDArray[np.bool_]:
    """The states that no mode moves."""
    return np.array([all(field[i] == 0 for field in traced.fields) for i in range(len(traced.u))])


@dataclass
class OrbitPoint(Point):
    """A solved orbit."""

    curve: Orbits
    solved: Solved
    M: FloatArray
    multipliers: ComplexArray
    path: Path

    @property
    def shooting(self) -> Shooting:
        """The equations of its curve."""
        return self.curve.shooting

    @property
    def signature(self) -> Signature:
        """The signature."""
        return self.curve.shooting.signature

    @property
    def values(self) -> FloatArray:
        """All parameters."""
        return self.solved.values

    @property
    def period(self) -> float:
        """The time once round."""
        return float(self.solved.times[-1])

    @property
    def once(self) -> Round:
        """Once round it."""
        return self.curve.shooting.once(self.X)

    @property
    def virtual(self) -> bool:
        """True where its path goes through a boundary that it should obey."""
        return self.path.virtual


class Orbits(Curve[OrbitPoint]):
    """Orbits of one signature with their active parameters.

    Parameters
    ----------
    shooting : Shooting
        With one active parameter (two for curves of special points).
    size : array (n_z,)
        Sizes of the states (and memory).
    period : float
        Size of the times.
    widths : sequence of float
        Sizes of the parameters: the widths of their ranges.
    """

    def __init__(self, shooting: Shooting, size: FloatArray, period: float, widths: Sequence[float]) -> None:
        self.shooting, self.walk = shooting, Walk(shooting)
        m, self.first_size = shooting.m, size  # the size of the branch's first orbit
        remedy = "raise the creep of a stop, below which impacts end in rest, or take another orbit"
        room_for(24.0 * shooting.size**2, f"Newton's method on an orbit with {m} transitions", remedy)
        self.size, self.period, self.widths = size, period, tuple(widths)
        scale = shooting.join(np.full(m, period), np.tile(size, (m + 1, 1)), period, widths)
        # The length of a curve should not depend on how many visits an orbit is cut into.
        scale[: shooting.size] *= np.sqrt(m + 1)
        self.scale = scale
        self.rows = 1.0 / scale[: shooting.size]
        self.weights = self.rows[:, None] * scale[None, :]

    @property
    def width(self) -> float:
        """Size of the last parameter."""
        return self.widths[-1]

    @cached_property
    def rounds(self) -> Rounds:
        """Simulated rounds of its orbits."""
        return Rounds(self.shooting)

    def around(self, once: Round, parameters: Any) -> tuple[Orbits, FloatArray]:
        """The curve of another signature in the same units, and the unknowns of once round there."""
        shooting, X = Shooting.of(self.shooting.system, once, self.shooting.active, parameters)
        shooting.prepare(X, self.size)
        return self._like(shooting, self.size), X

    def _like(self, shooting: Shooting, size: FloatArray) -> Orbits:
        """The curve of other equations of the same branch, or in other units."""
        curve = Orbits(shooting, size, self.period, self.widths)
        curve.rounds, curve.first_size = self.rounds, self.first_size
        return curve

    def evaluate(self, Y: FloatArray) -> Solved:
        """The equations of multiple shooting."""
        return self.shooting.evaluate(Y * self.scale)

    def fill(self, solved: Solved, matrix: FloatArray) -> None:
        """Put the scaled Jacobian into ``matrix``."""
        np.multiply(solved.jacobian, self.weights, out=matrix[: self.shooting.size])

    def residual(self, solved: Solved) -> FloatArray:
        """The scaled residual."""
        return solved.residual * self.rows

    def moved(self, solved: Solved, Y: FloatArray) -> Solved:
        """The equations after a last step so small that their derivatives stay."""
        return self.shooting.moved(solved, Y * self.scale)

    def described(self, point: Point) -> OrbitPoint | None:
        """The orbit with its multipliers and its path."""
        solved, states = point.solved, self.shooting.split(point.X)[1]
        held = within_held(self.shooting.system, self.shooting.modes[0], solved.values, states[0])
        with np.errstate(over="ignore", invalid="ignore"):  # at a touch they may have no bound
            M = solved.monodromy @ held
        path = self.walk.along(solved, states)
        if path is None or not np.isfinite(M).all():
            return None
        return OrbitPoint(**vars(point), M=M, multipliers=solved.multipliers_of(M), path=path)

    def word(self) -> Signature:
        """The signature."""
        return self.shooting.signature

    def seen(self, point: OrbitPoint) -> FloatArray:
        """The extremes and the parameters.

        A branch may come back with another count of completed impacts, or forcing periods later in the orbit."""
        return self.shape(point.path.maximum, point.path.minimum, point.X)

    def shape(self, maximum: FloatArray, minimum: FloatArray, X: FloatArray) -> FloatArray:
        """The extremes and the parameters of an orbit, scaled."""
        size = self.first_size[: len(maximum)]
        return np.nan_to_num(np.concatenate([maximum / size, minimum / size, X[-len(self.widths) :] / self.widths]))

    def margins(self, point: OrbitPoint) -> FloatArray:
        """The margins of the path, in the order of the boundaries."""
        return point.path.margins

    def spread(self, a: OrbitPoint, b: OrbitPoint) -> float:
        """Largest distance, on the Riemann sphere, of a multiplier of one from the nearest of the other.

        1 where more than a pair enters or leaves the unit circle: two events of a step hide each other."""
        others = (without_own(one.multipliers, self.shooting.forced) for one in (a, b))
        inside = [int((np.abs(mu) < 1.0).sum()) for mu in others]
        if abs(inside[1] - inside[0]) > 2:
            return 1.0
        mu, nu = a.multipliers[:, None], b.multipliers
        apart = np.abs(mu - nu) / np.sqrt((1 + np.abs(mu) ** 2) * (1 + np.abs(nu) ** 2))
        return float(max(apart.min(axis=0).max(), apart.min(axis=1).max()))

    def shows(self, point: OrbitPoint) -> bool:
        """Return whether a simulated round of an orbit takes the transitions of the signature."""
        return self.rounds.shows(self.shooting, point.X, point.solved.values)

    def swing(self, point: OrbitPoint, least: FloatArray | float = 0.0) -> float:
        """The largest range of a state, in units of that of the branch's first orbit, but of ``least`` at least."""
        size = np.maximum(self.first_size[: len(point.path.maximum)], least)
        return float(np.nanmax((point.path.maximum - point.path.minimum) / size))

    def renewed(self, point: OrbitPoint) -> OrbitPoint | None:
        """The point in units of an orbit that has grown; or the phase condition of one without transitions put through
        it."""
        shooting, z = self.shooting, point.X[: self.shooting.n]
        if shooting.reference is None:
            farthest = np.fmax(np.abs(point.path.maximum), np.abs(point.path.minimum))
            if not (farthest > GROWN * self.size[: len(farthest)]).any():
                return None
            size = size_of(point.path.maximum, point.path.minimum, shooting.system)
            if not (size > GROWN * self.size).any():
                return None
            fresh = self._like(shooting, np.maximum(size, self.size))
            tangent = point.tangent * self.scale / fresh.scale
            tangent /= np.linalg.norm(tangent)
            return replace(point, curve=fresh, Y=point.X / fresh.scale, tangent=tangent)
        shooting.reference = plane_across(z, point.solved.segments.f_begin[0], self.size)
        row = point.solved.jacobian[-1]
        row[:] = 0.0
        row[: shooting.n] = shooting.reference[1]
        found = self.tangent(point.solved, point.tangent)
        return point if found is None else replace(point, tangent=found[0], orientation=found[1])
