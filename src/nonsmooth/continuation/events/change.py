"""Contacts that begin or end where a path leaves its signature, and the section that a crossing passes.

At the boundary itself one orbit satisfies the equations of both signatures: a visit of no length, or an impact of no
speed, is put in or taken out. With which orbit the branch goes on is for ``neighbours`` to find.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.anchor import anchored
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.shooting import Solved
from nonsmooth.continuation.problems.signature import AT_ONCE, Signature, Visit
from nonsmooth.system.symbolic.traced import ASKED, FOUND, Traced

__all__ = [
    "Change", "by_others", "common_orbit", "common_point", "gained", "inserted", "is_tolerance", "past_the_section",
    "rest_after", "without",
]  # fmt: skip

BEFORE_REST = 1e-4  # of the period: flights after an impact as slow as impacts are followed are shorter
TOLERANCE = 1e-5  # of an indicator's size: a band as narrow as this stands for no width


@dataclass
class Change:
    """The common orbit in the new signature."""

    signature: Signature
    times: FloatArray
    states: FloatArray
    indicator: int
    gained: bool
    place: int  # the visit, in the signature without the contact, in which the contact stands
    inserted: tuple[Visit, ...]
    touch: float  # when


def _parts(curve: Orbits, point: OrbitPoint) -> tuple[tuple[Visit, ...], FloatArray, FloatArray]:
    times, states = curve.shooting.split(point.X)
    return curve.shooting.signature.visits, times, states


def inserted(curve: Orbits, point: OrbitPoint) -> list[Change]:
    """The orbit with the transition that it touches, and if that leads to another mode with each of the ways back."""
    visits, times, states = _parts(curve, point)
    path, flow, values = point.path, curve.shooting.flow, point.solved.values
    place, k = path.touched
    traced = curve.shooting.system.traced
    row = int(path.which[place, k] - curve.walk.net.row_start[k])
    t = float(path.place[place, k])
    begin = float(point.solved.times[place])
    z = flow.segments(values, [visits[place].mode], [begin], [t - begin], states[place][None, :]).z[0]
    indicator = traced.transitions[k].rows[row].indicator

    def change(new: list[Visit], after: list[FloatArray]) -> Change:
        signature = curve.shooting.signature.with_inserted(place, new)
        t_new = np.concatenate([times[:place], np.full(len(new), t), times[place:]])
        z_new = np.concatenate([states[: place + 1], np.array(after), states[place + 1 :]])
        return Change(signature, t_new, z_new, indicator, True, place, tuple(new), t)

    found = []
    for taken in _answers(traced, k):
        jump, entry = traced.transitions[taken], flow.jump(values, taken, t, z, row)
        first = Visit(jump.source, taken, row)
        if jump.target == jump.source:
            found.append(change([first], [entry.z_after]))
            continue
        for k_back, back in enumerate(traced.transitions):
            if back.source != jump.target or back.target != jump.source or back.at is not None:
                continue
            for r in (*range(len(back.rows)), AT_ONCE):
                leave = flow.jump(values, k_back, t, entry.z_after, r)
                found.append(change([first, Visit(jump.target, k_back, r)], [entry.z_after, leave.z_after]))
    return found


def _answers(traced: Traced, k: int) -> list[int]:
    """A transition; where it is a question, those to which it has led so far."""
    jump = traced.transitions[k]
    if jump.kind != ASKED:
        return [k]
    return [
        j for j, other in enumerate(traced.transitions)
        if other.kind == FOUND and other.source == jump.source and other.rows == jump.rows
    ]  # fmt: skip


def without(curve: Orbits, point: OrbitPoint, place: int, count: int) -> Change:
    """The orbit without ``count`` visits that have no length, from ``place`` on."""
    visits, times, states = _parts(curve, point)
    jump = curve.shooting.system.traced.transitions[visits[place].transition]
    gone = np.arange(place, place + count)
    return Change(
        curve.shooting.signature.without(place, count), np.delete(times, gone), np.delete(states, gone + 1, axis=0),
        jump.rows[visits[place].row].indicator, False, place, visits[place : place + count], float(times[place]),
    )  # fmt: skip


def rest_after(curve: Orbits, point: OrbitPoint, place: int) -> int | None:
    """The number of impacts from visit ``place`` on that rest follows at once; None where it does not."""
    visits, times = curve.shooting.signature.visits, point.solved.times
    i = place
    while visits[i].row >= 0 and visits[i + 1].mode == visits[place].mode:
        i += 1
    soon = float(times[i + 1] - times[place + 1]) < BEFORE_REST * float(times[-1])
    return i - place if visits[i].row >= 0 and soon else None


def by_others(curve: Orbits, point: OrbitPoint, place: int, indicator: int) -> list[Change]:
    """The same orbit where one of its transitions is another one that needs an indicator with the other sign."""
    visits, times, states = _parts(curve, point)
    jumps, visit = curve.shooting.system.traced.transitions, visits[place]
    own = jumps[visit.transition]
    fired = own.rows[visit.row]
    signs = {row.indicator: row.sign for row in own.rows}
    found = []
    for k, other in enumerate(jumps):
        there = {row.indicator: row.sign for row in other.rows}
        if (
            (other.source, other.target) == (own.source, own.target)
            and fired in other.rows
            and (there.get(indicator, 0.0) * signs.get(indicator, 0.0) < 0.0)
        ):
            new = replace(visit, transition=k, row=other.rows.index(fired))
            signature = Signature((*visits[:place], new, *visits[place + 1 :]))
            found.append(Change(signature, times, states, indicator, True, place, (new,), float(times[place])))
    return found


def common_orbit(curve: Orbits, point: OrbitPoint, change: Change) -> tuple[Orbits, Solved, FloatArray] | None:
    """The common orbit in the new signature: its curve, the equations there, and the tangent of the curve."""
    signature, times, states = change.signature, change.times, change.states
    if not curve.shooting.forced and len(times):
        end = float(point.solved.times[-1])
        signature, times, states = anchored(curve.shooting.flow, point.solved.values, signature, times, states, end)
    fresh, X = curve.with_signature(signature, times, states, float(point.solved.times[-1]), point.X[-1:])
    solved = fresh.shooting.evaluate(X)
    if not np.isfinite(solved.jacobian).all():
        return None
    null = fresh.null_vectors(solved)
    return (fresh, solved, null[-1]) if len(null) else None


def common_point(curve: Orbits, point: OrbitPoint, change: Change) -> OrbitPoint | None:
    """The common orbit as a point of the new signature."""
    found = common_orbit(curve, point, change)
    if found is None:
        return None
    fresh, solved, tangent = found
    return fresh.point(solved, solved.X / fresh.scale, tangent)


def past_the_section(curve: Orbits, point: OrbitPoint) -> tuple[Orbits, OrbitPoint] | None:
    """The same orbit where a crossing has passed the section: the last of the round in place of the first, or so.

    It faces in the same direction: that of the parameter, or of the state at the section near a fold."""
    visits, times, states = _parts(curve, point)
    shooting, values = curve.shooting, point.solved.values
    end = float(point.solved.times[-1])
    if int(point.path.tau.argmin()) == 0:
        order = [*visits[1:-1], Visit(visits[-1].mode, visits[0].transition, visits[0].row)]
        z0 = shooting.flow.segments(values, [visits[1].mode], times[:1], -times[:1], states[1][None, :]).z
        moved = np.concatenate([times[1:], times[:1] + end])
        after = np.concatenate([z0, states[2:], states[1:2]])
        mode = visits[1].mode
    else:
        order = [Visit(visits[-2].mode, visits[-2].transition, visits[-2].row), *visits[:-2]]
        moved = np.concatenate([times[-1:] - end, times[:-1]])
        mode = visits[-2].mode
        # The state at the section lies before that crossing now.
        z_before = point.solved.segments.z[-2]
        z0 = shooting.flow.segments(values, [mode], times[-1:], end - times[-1:], z_before[None, :]).z
        after = np.concatenate([z0, states[-1:], states[1:-1]])
    turns = max(shooting.period_number, 1)
    fixed = [replace(v, turn=v.turn % turns) if v.row == -1 and v.transition >= 0 else v for v in order]
    fresh, X = curve.with_signature(Signature((*fixed, Visit(mode))), moved, after, end, point.X[-1:])
    Y = X / fresh.scale
    border = np.zeros(fresh.n)
    border[-1] = 1.0
    found = fresh.correct(Y, border, float(Y[-1]))
    if found is None:
        null = fresh.null_vectors(fresh.shooting.evaluate(X))
        found = fresh.correct(Y, null[0], float(null[0] @ Y)) if len(null) == 1 else None
    null = fresh.null_vectors(found[0]) if found is not None else np.empty(0)
    if found is None or not len(null):
        return None
    tangent, old, n = null[-1], point.tangent, shooting.n
    # The tangents of both live in different unknowns; the parameter and the later instants are common to them.
    along = tangent[-1] * old[-1] if abs(old[-1]) > 1e-3 else float(tangent[:n] @ old[:n])
    first = fresh.point(found[0], found[1], tangent * (np.sign(along) or 1.0))
    return None if first is None else (fresh, first)


def gained(curve: Orbits, fresh: Orbits) -> int:
    """The indicator of the first transition that another signature has more often (-1: none)."""
    more = Counter((v.transition, v.row) for v in fresh.shooting.signature.crossings)
    more.subtract((v.transition, v.row) for v in curve.shooting.signature.crossings)
    transitions = curve.shooting.system.traced.transitions
    rows = [transitions[k].rows[row].indicator for (k, row), n in more.items() if n > 0 and row >= 0]
    return rows[0] if rows else -1


def is_tolerance(curve: Orbits, indicator: int) -> bool:
    """Return whether an indicator only sets a tolerance: below the creep of a stop impacts are completed as rest.

    It differs from another one of its condition, with the other sign, by a small number."""
    flow, values = curve.shooting.flow, curve.shooting.values
    z = np.linspace(0.3, 0.7, flow.n) * flow.scale
    for jump in flow.traced.transitions:
        signs = {row.indicator: row.sign for row in jump.rows}
        for other, sign in signs.items():
            if sign * signs.get(indicator, 0) >= 0:
                continue
            one, two = (flow.indicator(values, i, jump.source, 0.0, z) for i in (indicator, other))
            size = float(np.abs(two.h_z) @ flow.scale)
            if np.allclose(one.h_z, two.h_z, rtol=1e-9, atol=0.0) and 0.0 < abs(one.h - two.h) < TOLERANCE * size:
                return True
    return False
