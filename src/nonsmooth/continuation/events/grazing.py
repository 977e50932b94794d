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

from dataclasses import replace
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.events.change import Change
from nonsmooth.continuation.problems.multipliers import multipliers_of
from nonsmooth.continuation.problems.orbits import OrbitPoint
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import AT_ONCE, Round
from nonsmooth.continuation.problems.visits import led

ASIDE = 1e-6  # of the period: the touch is looked at from this far before and behind


def graze(first: OrbitPoint, change: Change) -> dict[str, Any]:
    """Judge a graze, beyond which ``first`` is the first point: fields of a ``SpecialRecord``; none: M+ is unknown.

    M+ is that just beyond the graze where it is unbounded."""
    M, M_far, M_near = both_sides(change)
    if not (np.isfinite(M).all() and np.isfinite(M_far).all() and np.isfinite(M_near).all()):
        return {}
    bounded = bool(np.abs(M_near).max() < 1.5 * np.abs(M_far).max())
    M_plus, one = 2 * M_near - M_far if bounded else M_near, np.eye(len(M))
    determinants = np.array([np.linalg.det(one + sign * side) for sign in (-1.0, 1.0) for side in (M, M_plus)])
    same, point = determinants[0] * determinants[1] > 0.0, change.point
    if not point.shooting.forced:  # its own multiplier 1 makes det(I - M) vanish: the parameter's turn tells the side
        same = point.rise * (first.value - point.value) > 0.0
    return {
        "grazing": "persistence" if same else "non_smooth_fold",
        "bounded": bounded,
        "determinants": determinants,
        "contact": multipliers_of(M_plus),
        "doubled": bool(determinants[2] * determinants[3] < 0.0),
    }


def both_sides(change: Change) -> list[FloatArray]:
    """M-, and M+ looked at from ``ASIDE`` and from half of it (their limit, where there is one)."""
    point, old, found = change.point, change.point.shooting, []
    for once in (change.free, _beside(change, ASIDE), _beside(change, 0.5 * ASIDE)):
        shooting, X = Shooting.of(old.system, once, old.active, point.X[old.size :])
        shooting.anchor(X[: old.n], point.values, point.curve.size)
        found.append(shooting.evaluate(X).monodromy)
    return found


def _beside(change: Change, aside: float) -> Round:
    """The round with the contact entered so far (periods) before the touch, and left at it or as long after it.

    An impact is looked at before the touch, where the indicator still rises; the motion goes on from the touch."""
    once, i, flow, values = change.contact, change.place, change.point.shooting.flow, change.point.values
    visits, times, states = once.signature.visits[i : i + change.count], once.times.copy(), once.states.copy()
    touch, begin, aside = float(times[i]), float(times[i - 1]) if i else 0.0, aside * once.period
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
