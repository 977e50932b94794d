"""Contacts that begin or end where a path leaves its signature, and the section that a crossing passes.

At the boundary itself one orbit satisfies the equations of both signatures: a visit of no length, or an impact of no
speed, is put in or taken out. With which orbit the branch goes on is for ``neighbours`` to find.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.path import NOTHING
from nonsmooth.continuation.problems.shooting import Solved
from nonsmooth.continuation.problems.signature import AT_ONCE, Round, Visit
from nonsmooth.continuation.problems.visits import anchored, led
from nonsmooth.system.symbolic.traced import ASKED, FOUND, Traced, TracedTransition

BEFORE_REST = 1e-4  # of the period: flights after an impact as slow as impacts are followed are shorter
TURNS = 1e-10  # of the period: a touch as near to the end of its visit lies in the crossing there
TOLERANCE = 1e-5  # of an indicator's size: a band as narrow as this stands for no width


#: The curve of a signature, its equations at the common orbit, and the tangent of the curve there.
Common = tuple[Orbits, Solved, FloatArray]


@dataclass
class Change:
    """A contact that begins or ends: the common orbit once round, with it and without it."""

    point: OrbitPoint
    contact: Round
    free: Round
    place: int  # the visit of the free round in which the contact stands
    count: int  # visits of the contact
    indicator: int
    gained: bool

    @property
    def new(self) -> Round:
        """The round beyond."""
        return self.contact if self.gained else self.free


def inserted(point: OrbitPoint) -> list[Change]:
    """The orbit with the transition that it touches, and if that leads to another mode with each of the ways back.

    None where it touches in a crossing: that lies in the contact then, and is another transition there."""
    path, flow, values, traced = point.path, point.shooting.flow, point.values, point.shooting.system.traced
    free = point.once
    place, k = path.touched
    k, row = traced.first_alike(k, int(path.which[place, k] - point.curve.walk.net.row_start[k]))
    t, (begin, end) = float(path.place[place, k]), map(float, point.solved.times[place : place + 2])
    if place < point.shooting.m and end - t < TURNS * point.period:
        return []
    z = led(flow, values, free.signature.visits[place].mode, begin, t - begin, free.states[place])
    indicator = traced.transitions[k].rows[row].indicator

    def change(new: list[Visit], after: list[FloatArray]) -> Change:
        return Change(point, free.with_inserted(place, new, t, after), free, place, len(new), indicator, True)

    found = []
    for taken, met in _answers(traced, k, row):
        jump, entry = traced.transitions[taken], flow.jump(values, taken, t, z, met)
        first = Visit(jump.source, taken, met)
        if jump.target == jump.source:
            found.append(change([first], [entry.z_after]))
            continue
        for k_back, back in enumerate(traced.transitions):
            if back.source != jump.target or back.target != jump.source or back.at is not None:
                continue
            for r in (*range(len(back.rows)), AT_ONCE):
                if r >= 0 and traced.first_alike(k_back, r)[0] != k_back:
                    continue
                leave = flow.jump(values, k_back, t, entry.z_after, r)
                found.append(change([first, Visit(jump.target, k_back, r)], [entry.z_after, leave.z_after]))
    return found


def _answers(traced: Traced, k: int, row: int) -> list[tuple[int, int]]:
    """A transition and its row that is met; where it is a question, those to which that has led so far."""
    jump = traced.transitions[k]
    if jump.kind != ASKED:
        return [(k, row)]
    return [
        (j, other.rows.index(jump.rows[row]))
        for j, other in enumerate(traced.transitions)
        if other.kind == FOUND and other.source == jump.source and {jump.rows[row]} <= {*other.rows} <= {*jump.rows}
    ]


def without(point: OrbitPoint, place: int, count: int) -> list[Change]:
    """The orbit without ``count`` visits that have no length, from ``place`` on, and what happens at once behind them;
    none where that leads to another mode."""
    contact = point.once
    visits = contact.signature.visits
    while visits[place + count].row == AT_ONCE:
        count += 1
    if visits[place + count].mode != visits[place].mode:
        return []
    indicator = point.shooting.system.traced.transitions[visits[place].transition].rows[visits[place].row].indicator
    return [Change(point, contact, contact.without(place, count), place, count, indicator, False)]


def rest_after(point: OrbitPoint, place: int) -> int | None:
    """The number of impacts from visit ``place`` on that rest follows at once; None where it does not, or none is."""
    visits, times = point.signature.visits, point.solved.times
    i = place
    if place >= point.shooting.m:  # of an orbit with fewer visits
        return None
    while visits[i].row >= 0 and visits[i + 1].mode == visits[place].mode:
        i += 1
    soon = float(times[i + 1] - times[place + 1]) < BEFORE_REST * float(times[-1])
    return i - place if soon and completes(point, visits[i]) else None


def completes(point: OrbitPoint, visit: Visit) -> bool:
    """Return whether a visit ends with an impact so slow that it is completed as rest."""
    jump = point.shooting.system.traced.transitions[visit.transition]
    return visit.row >= 0 and any(is_tolerance(point, row.indicator, (jump,)) for row in jump.rows)


def common_orbit(change: Change) -> Common | None:
    """The common orbit in the new signature."""
    once, point = change.new, change.point
    if not point.shooting.forced and len(once.times):
        once = anchored(point.shooting.flow, point.values, once)
    fresh, X = point.curve.around(once, point.X[-1:])
    solved = fresh.shooting.evaluate(X)
    if not np.isfinite(solved.jacobian).all():
        return None
    null = fresh.null_vectors(solved)
    return (fresh, solved, null[-1]) if len(null) else None


def past_the_section(point: OrbitPoint) -> OrbitPoint | None:
    """The same orbit where a crossing has passed the section: the last of the round in place of the first, or so.

    It faces in the same direction: that of the parameter, or of the state at the section near a fold."""
    shooting, values = point.shooting, point.values
    once = point.once
    visits, times, end = once.signature.visits, once.times, once.period
    tau = point.path.tau
    # All of one instant pass together.
    at_once = [one.row == AT_ONCE or short for one, short in zip(visits, tau <= NOTHING * point.period, strict=True)]
    if tau[0] <= tau[-1]:
        i = at_once.index(False, 1)
        z = led(shooting.flow, values, visits[i].mode, times[i - 1], -times[i - 1], once.states[i])
        moved = once.begun(i, 0.0, z)
    else:  # the state at the section lies before that crossing now
        i = max(k for k in range(len(times)) if not at_once[k])
        z = led(shooting.flow, values, visits[i].mode, times[i], end - times[i], point.solved.segments.z[i])
        moved = once.begun(i, end, z)
    fresh, X = point.curve.around(moved, point.X[shooting.size :])
    first = fresh.nearest(X / fresh.scale, point.value)
    if first is None:
        return None
    # The tangents of both live in different unknowns; the parameters and the later instants are common to them.
    new, old, n, own = first.tangent, point.tangent, shooting.n, shooting.size
    along = float(new[own:] @ old[own:] if np.abs(old[own:]).max() > 1e-3 else new[:n] @ old[:n])
    return first.turned() if along < 0.0 else first


def gained(point: OrbitPoint, fresh: OrbitPoint) -> int:
    """The indicator of the first transition that another signature has more often (-1: none)."""
    more = Counter((v.transition, v.row) for v in fresh.shooting.signature.crossings)
    more.subtract((v.transition, v.row) for v in point.signature.crossings)
    transitions = point.shooting.system.traced.transitions
    rows = [transitions[k].rows[row].indicator for (k, row), n in more.items() if n > 0 and row >= 0]
    return rows[0] if rows else -1


def is_tolerance(point: OrbitPoint, indicator: int, among: Sequence[TracedTransition] = ()) -> bool:
    """Return whether an indicator only sets a tolerance: below the creep of a stop impacts are completed as rest.

    It differs from another one of its condition, with the other sign, by a small number, in one ``among`` transitions
    (none given: in any)."""
    flow, values = point.shooting.flow, point.shooting.values
    z = np.linspace(0.3, 0.7, flow.n) * flow.scale
    for jump in among or flow.traced.transitions:
        for row, other in permutations(jump.rows, 2):
            if row.indicator != indicator or row.sign * other.sign >= 0:
                continue
            one, two = (flow.indicator(values, each.indicator, jump.source, 0.0, z) for each in (other, row))
            size = float(np.abs(two.h_z) @ flow.scale)
            if np.allclose(one.h_z, two.h_z, rtol=1e-9, atol=0.0) and 0.0 < abs(one.h - two.h) < TOLERANCE * size:
                return True
    return False
