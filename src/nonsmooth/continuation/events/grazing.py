r"""Both linearisations at a graze, and Feigin's test of what happens there.

Without the contact the return map has the derivative M-. With it, just beyond the graze, M+ is M- with the saltation
matrices of the contact put in at the touch, in the limit of a contact of no length,

.. math:: S = \lim R_z + \frac{(f^+ - R_z f^- - R_t) h_z}{h_t + h_z f^-}.

Equal signs of det(I - M-) and det(I - M+): the orbit goes on (persistence). Unequal ones: both orbits lie on the same
side and meet (a non-smooth fold). Unequal signs of det(I + M-) and det(I + M+): an orbit of twice the period branches
off at the graze. A rigid impact has f+ - R_z f- not zero at the touch and a multiplier without bound; the signs still
decide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.events.change import Change
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.shooting import Shooting, Solved
from nonsmooth.continuation.problems.signature import AT_ONCE, Visit
from nonsmooth.flow.saltation import chained
from nonsmooth.flow.variational import VariationalFlow

__all__ = ["Graze", "both_sides", "graze"]

ASIDE = 1e-6  # of the period: the touch is looked at from this far before and behind


@dataclass
class Graze:
    """Outcome of a graze; ``kind`` is ``"persistence"`` or ``"non_smooth_fold"``."""

    kind: str
    bounded: bool
    M_free: FloatArray  # M-
    M_contact: FloatArray  # M+ (unbounded: just beyond the graze)
    multipliers_free: ComplexArray
    multipliers_contact: ComplexArray
    doubled: bool  # an orbit of twice the period is born here


def graze(curve: Orbits, point: OrbitPoint, first: OrbitPoint, change: Change) -> Graze | None:
    """Judge the graze at ``point``, where ``curve`` ends; ``first`` is the first point behind it."""
    shooting = curve.shooting
    M, M_far, M_near = both_sides(shooting, point.solved, change)
    if not (np.isfinite(M).all() and np.isfinite(M_far).all() and np.isfinite(M_near).all()):
        return None
    bounded = bool(np.abs(M_near).max() < 1.5 * np.abs(M_far).max())
    M_plus = 2 * M_near - M_far if bounded else M_near
    one = np.eye(len(M))
    if shooting.forced:
        same = bool(np.linalg.det(one - M) * np.linalg.det(one - M_plus) > 0)
    else:  # a multiplier 1 by nature makes det(I - M) vanish: the parameter's own turn tells the side
        same = float(point.tangent[-1]) * float(first.X[-1] - point.X[-1]) > 0.0
    doubled = bool(np.linalg.det(one + M) * np.linalg.det(one + M_plus) < 0)
    return Graze(
        "persistence" if same else "non_smooth_fold", bounded, M, M_plus,
        multipliers_of(M), multipliers_of(M_plus), doubled,
    )  # fmt: skip


def both_sides(shooting: Shooting, solved: Solved, change: Change) -> tuple[FloatArray, FloatArray, FloatArray]:
    """M-, and M+ looked at from ``ASIDE`` and from half of it (their limit, where there is one)."""
    if change.gained:
        visits, (times, states) = shooting.signature.visits, shooting.split(solved.X)
    else:
        visits, times, states = change.signature.visits, change.times, change.states
    product = _Product(shooting.flow, solved.values, visits, times, states, float(solved.times[-1]), change)
    matrices = product(0.0), product(ASIDE), product(0.5 * ASIDE)
    for matrix in matrices:
        matrix[shooting.free], matrix[:, shooting.free] = 0.0, 0.0
    return matrices


@dataclass
class _Product:
    """The monodromy matrix of the orbit at the graze, without its contact or with it."""

    flow: VariationalFlow
    values: FloatArray
    visits: tuple[Visit, ...]
    times: FloatArray
    states: FloatArray
    end: float
    change: Change

    def __call__(self, aside: float) -> FloatArray:
        """With ``aside`` > 0 the contact's saltation matrices are put in, looked at so far from the touch (periods)."""
        M = np.eye(self.flow.n)
        begin, taken = 0.0, None
        for i, visit in enumerate(self.visits):
            end = self.end if i == len(self.times) else float(self.times[i])
            if i == self.change.place and aside > 0.0:
                step, z = self._through(visit.mode, begin, end, self.states[i], aside * self.end)
            else:
                step, z = self._leg(visit.mode, begin, end, self.states[i])
            M = step @ M
            if i < len(self.times):
                jump = self.flow.jump(self.values, visit.transition, end, z, visit.row)
                taken = chained([taken, jump]) if taken is not None and visit.row == AT_ONCE else jump
                if self.visits[i + 1].row != AT_ONCE:
                    M = taken.saltation @ M
            begin = end
        return np.asarray(M)

    def _leg(self, mode: int, begin: float, end: float, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        segments = self.flow.segments(self.values, [mode], [begin], [end - begin], z[None, :])
        return segments.Phi[0], segments.z[0]

    def _through(
        self, mode: int, begin: float, end: float, z: FloatArray, aside: float
    ) -> tuple[FloatArray, FloatArray]:
        """The visit that the contact interrupts: entered a little before the touch, left as long after it.

        An impact is looked at before the touch, where the indicator still rises; the motion goes on from the touch."""
        touch, inserted = self.change.touch, self.change.inserted
        first, z = self._leg(mode, begin, touch - aside, z)
        taken = [inserted[0].transition]
        for visit in inserted[1:]:
            if visit.row == AT_ONCE:
                taken.append(visit.transition)
        entry = self.flow.jump(self.values, taken, touch - aside, z, inserted[0].row)
        if len(taken) == len(inserted):
            there, z = self._leg(mode, touch - aside, touch, z)
            rest, z = self._leg(mode, touch, end, z)
            # Phi of the last stretch before the touch belongs behind the impact, to the order of ``aside``.
            return rest @ there @ entry.saltation @ first, z
        # The way back is looked at where the touch is, unless that is a touch for it too (no damper).
        inside, at_touch = self._leg(inserted[1].mode, touch - aside, touch, entry.z_after)
        leave = self.flow.jump(self.values, inserted[1].transition, touch, at_touch, inserted[1].row)
        leaves = touch
        if abs(leave.rate) < abs(entry.rate):
            inside, z = self._leg(inserted[1].mode, touch - aside, touch + aside, entry.z_after)
            leaves = touch + aside
            leave = self.flow.jump(self.values, inserted[1].transition, leaves, z, inserted[1].row)
        rest, z = self._leg(mode, leaves, end, leave.z_after)
        return rest @ leave.saltation @ inside @ entry.saltation @ first, z
