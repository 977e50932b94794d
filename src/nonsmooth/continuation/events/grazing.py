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

from dataclasses import dataclass, replace

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.continuation.events.change import Change
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import AT_ONCE, Round
from nonsmooth.continuation.problems.visits import led
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


def graze(point: OrbitPoint, first: OrbitPoint, change: Change) -> Graze | None:
    """Judge the graze at ``point``, where its curve ends; ``first`` is the first point behind it."""
    M, M_far, M_near = both_sides(point, change)
    if not (np.isfinite(M).all() and np.isfinite(M_far).all() and np.isfinite(M_near).all()):
        return None
    bounded = bool(np.abs(M_near).max() < 1.5 * np.abs(M_far).max())
    M_plus = 2 * M_near - M_far if bounded else M_near
    one = np.eye(len(M))
    if point.shooting.forced:
        same = bool(np.linalg.det(one - M) * np.linalg.det(one - M_plus) > 0)
    else:  # a multiplier 1 by nature makes det(I - M) vanish: the parameter's own turn tells the side
        same = float(point.tangent[-1]) * float(first.X[-1] - point.X[-1]) > 0.0
    doubled = bool(np.linalg.det(one + M) * np.linalg.det(one + M_plus) < 0)
    return Graze(
        "persistence" if same else "non_smooth_fold", bounded, M, M_plus,
        multipliers_of(M), multipliers_of(M_plus), doubled,
    )  # fmt: skip


def both_sides(point: OrbitPoint, change: Change) -> list[FloatArray]:
    """M-, and M+ looked at from ``ASIDE`` and from half of it (their limit, where there is one)."""
    old, flow = point.shooting, point.shooting.flow
    found = []
    for once in (change.free, *(_beside(flow, point.solved.values, change, x) for x in (ASIDE, 0.5 * ASIDE))):
        shooting, X = Shooting.of(old.system, once, old.active, point.X[old.size :])
        shooting.anchor(X[: old.n], point.solved.values, point.curve.size)
        found.append(shooting.evaluate(X).monodromy)
    return found


def _beside(flow: VariationalFlow, values: FloatArray, change: Change, aside: float) -> Round:
    """The round with the contact entered so far (periods) before the touch, and left at it or as long after it.

    An impact is looked at before the touch, where the indicator still rises; the motion goes on from the touch."""
    once, i, aside = change.contact, change.place, aside * change.contact.period
    visits, times, states = once.signature.visits[i : i + change.count], once.times.copy(), once.states.copy()
    touch, begin = float(times[i]), float(times[i - 1]) if i else 0.0
    times[i : i + len(visits)] = enters = touch - aside
    before = after = led(flow, values, visits[0].mode, begin, enters - begin, states[i])
    rate = flow.jump(values, visits[0].transition, enters, before, visits[0].row).rate
    for visit in visits:
        i += 1
        if visit is not visits[0] and visit.row != AT_ONCE:  # the way back
            # It is looked at where the touch is, unless that is a touch for it too (no damper).
            for leaves in (touch, touch + aside):
                z = led(flow, values, visit.mode, enters, leaves - enters, after)
                leave = flow.jump(values, visit.transition, leaves, z, visit.row)
                if abs(leave.rate) >= abs(rate):
                    break
            times[i - 1], states[i] = leaves, leave.z_after
            return replace(once, times=times, states=states)
        states[i] = after = flow.jump(values, visit.transition, enters, after, visit.row).z_after
    states[i] = before
    return replace(once, times=times, states=states)
