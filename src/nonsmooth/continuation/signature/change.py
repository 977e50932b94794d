"""Contacts that begin or end where a path leaves its signature, and the section that a crossing passes.

At the boundary itself one orbit satisfies the equations of both signatures: a visit of no length, or an impact of no
speed, is put in or taken out. With which orbit the branch goes on is for ``neighbours`` to find.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.march.arclength import Curve, Point
from nonsmooth.continuation.problems.anchor import anchored
from nonsmooth.continuation.signature.signature import AT_ONCE, Signature, Visit

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Solved

__all__ = ["Change", "common_orbit", "common_point", "contacts", "past_the_section"]

FloatArray = NDArray[np.float64]


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


def contacts(curve: Curve, point: Point, kind: str) -> list[Change]:
    """Contacts that may begin or end at a located event ``kind``; none where it is about something else."""
    found = {"touch": _touched, "short": _shortened, "slow": _slowed}.get(kind)
    return found(curve, point) if found else []


def _parts(curve: Curve, point: Point) -> tuple[tuple[Visit, ...], FloatArray, FloatArray]:
    times, states = curve.shooting.split(point.X)
    return curve.shooting.signature.visits, times, states


def _touched(curve: Curve, point: Point) -> list[Change]:
    """A transition that has only been touched: put it in, and if it leads to another mode the ways back too."""
    visits, times, states = _parts(curve, point)
    path, flow, values = point.path, curve.shooting.flow, point.solved.values
    place, k = path.touched
    traced = curve.shooting.system.traced
    jump = traced.transitions[k]
    row = int(path.which[place, k] - curve.walk.net.row_start[k])
    t = float(path.place[place, k])
    begin = float(point.solved.times[place])
    z = flow.segments(values, [visits[place].mode], [begin], [t - begin], states[place][None, :]).z[0]
    entry, indicator = flow.jump(values, k, t, z, row), jump.rows[row].indicator

    def change(new: list[Visit], after: list[FloatArray]) -> Change:
        signature = curve.shooting.signature.with_inserted(place, new)
        t_new = np.concatenate([times[:place], np.full(len(new), t), times[place:]])
        z_new = np.concatenate([states[: place + 1], np.array(after), states[place + 1 :]])
        return Change(signature, t_new, z_new, indicator, True, place, tuple(new), t)

    first = Visit(jump.source, k, row)
    if jump.target == jump.source:
        return [change([first], [entry.z_after])]
    found = []
    for k_back, back in enumerate(traced.transitions):
        if back.source != jump.target or back.target != jump.source or back.at is not None:
            continue
        for r in (*range(len(back.rows)), AT_ONCE):
            leave = flow.jump(values, k_back, t, entry.z_after, r)
            found.append(change([first, Visit(jump.target, k_back, r)], [entry.z_after, leave.z_after]))
    return found


def _shortened(curve: Curve, point: Point) -> list[Change]:
    """A visit that has shrunk to nothing between two visits of one mode, without speed: take it out."""
    visits = curve.shooting.signature.visits
    i = int(point.path.tau.argmin())
    if i in (0, len(visits) - 1) or visits[i - 1].mode != visits[i + 1].mode or visits[i - 1].row < 0:
        return []
    slope = point.path.slope[curve.walk.conditional.tolist().index(i - 1)]
    steepest = float(np.abs(point.path.slope).max())
    if not (slope < 1e-3 * max(steepest, 1e-300) or len(point.path.slope) < 3):
        return []
    return [_without(curve, point, i - 1, 2)]


def _slowed(curve: Curve, point: Point) -> list[Change]:
    """A crossing that has become a touch: an impact of no speed is taken out."""
    visits = curve.shooting.signature.visits
    i = int(curve.walk.conditional[int(point.path.slope.argmin())])
    count = 1
    while visits[i + count].row == AT_ONCE:  # an impact made of several transitions
        count += 1
    return [_without(curve, point, i, count)] if visits[i + count].mode == visits[i].mode else []


def _without(curve: Curve, point: Point, place: int, count: int) -> Change:
    visits, times, states = _parts(curve, point)
    jump = curve.shooting.system.traced.transitions[visits[place].transition]
    gone = np.arange(place, place + count)
    return Change(
        curve.shooting.signature.without(place, count), np.delete(times, gone), np.delete(states, gone + 1, axis=0),
        jump.rows[visits[place].row].indicator, False, place, visits[place : place + count], float(times[place]),
    )  # fmt: skip


def common_orbit(curve: Curve, point: Point, change: Change) -> tuple[Curve, Solved, FloatArray] | None:
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


def common_point(curve: Curve, point: Point, change: Change) -> tuple[Curve, Point] | None:
    """The common orbit as a point of the new signature, on its curve."""
    found = common_orbit(curve, point, change)
    if found is None:
        return None
    fresh, solved, tangent = found
    there = fresh.point(solved, solved.X / fresh.scale, tangent)
    return None if there is None else (fresh, there)


def past_the_section(curve: Curve, point: Point) -> tuple[Curve, Point] | None:
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
