"""Signatures that can follow where a path leaves its own, and their first unknowns.

At the boundary itself one orbit satisfies the equations of both signatures: a visit of no length, or an impact of no
speed, is put in or taken out. How the branch goes on from that common orbit stands in ``resuming``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.corners import other_ways, short_run
from nonsmooth.continuation.signature import AT_ONCE, Signature, Visit

__all__ = ["Change", "changed"]

FloatArray = NDArray[np.float64]


@dataclass
class Change:
    """The common orbit in the new signature."""

    kind: str  # grazing, corner, or section (no bifurcation: a crossing passes through the section)
    signature: Signature
    times: FloatArray
    states: FloatArray
    indicator: int = -1
    gained: bool = False
    place: int = -1  # the visit, in the signature without the contact, in which the contact stands
    inserted: tuple[Visit, ...] = ()
    touch: float = 0.0  # when


def changed(curve: Curve, point: Point, kind: str) -> list[Change]:
    """Return what may come after the event ``kind`` at a located point, likeliest first; none if nothing is known."""
    if kind == "touch":
        return _touched(curve, point)
    if kind == "short":
        i = int(point.path.tau.argmin())
        inside = 0 < i < curve.shooting.m
        return [*_shortened(curve, point), *(_around(curve, point, *short_run(point, i)) if inside else [])]
    if kind == "slow":
        return _slowed(curve, point)
    if kind == "own":
        return _other_row(curve, point)
    if kind == "landed":
        return _landed(curve, point)
    i = int(point.path.others.argmax())
    at_once = curve.shooting.signature.visits[i].row == AT_ONCE
    return _instead(curve, point, i) if at_once else _around(curve, point, i, i + 1)


def _parts(curve: Curve, point: Point) -> tuple[tuple[Visit, ...], FloatArray, FloatArray]:
    times, states = curve.shooting.split(point.X)
    return curve.shooting.signature.visits, times, states


def _touched(curve: Curve, point: Point) -> list[Change]:
    """A transition that has only been touched: put it in, and if it leads to another mode the way back too."""
    visits, _, states = _parts(curve, point)
    path, flow, values = point.path, curve.shooting.flow, point.solved.values
    place, k = path.touched
    traced = curve.shooting.system.traced
    jump = traced.transitions[k]
    row = int(path.which[place, k] - curve.walk.net.row_start[k])
    t = float(path.place[place, k])
    begin = float(point.solved.times[place])
    z = flow.segments(values, [visits[place].mode], [begin], [t - begin], states[place][None, :]).z[0]
    return _inserted(curve, point, "grazing", place, Visit(jump.source, k, row), row, t, z)


def _landed(curve: Curve, point: Point) -> list[Change]:
    """A reset leads onto the boundary of a transition: it is taken at once, and led back by a visit of no length."""
    visits, times, states = _parts(curve, point)
    place = int(point.path.landed.argmax())
    if place and visits[place].row == AT_ONCE:
        return _instead(curve, point, place)
    if place == 0:
        return []
    k = int(point.path.landing[place])
    t, z = float(times[place - 1]), states[place]
    row = curve.shooting.flow.jump(point.solved.values, k, t, z).row
    first = Visit(visits[place].mode, k, AT_ONCE)
    return _inserted(curve, point, "corner", place, first, row, t, z)


def _instead(curve: Curve, point: Point, place: int) -> list[Change]:
    """A condition that holds at once is about to fail: another transition to the same mode takes its place.

    For a map this is a border collision: beyond it the point is mapped by another branch."""
    visits, times, states = _parts(curve, point)
    traced = curve.shooting.system.traced
    was = visits[place].transition
    found = []
    for k, jump in enumerate(traced.transitions):
        if k == was or jump.at is not None or jump.source != visits[place].mode:
            continue
        if jump.target != traced.transitions[was].target:
            continue
        there = curve.shooting.flow.jump(point.solved.values, k, float(times[place]), states[place])
        after = states.copy()
        after[place + 1] = there.z_after
        new = (*visits[:place], Visit(jump.source, k, AT_ONCE), *visits[place + 1 :])
        found.append(Change("corner", Signature(new), times, after, there.indicator))
    return found


def _inserted(
    curve: Curve, point: Point, kind: str, place: int, first: Visit, row: int, t: float, z: FloatArray
) -> list[Change]:
    """The crossing ``first``, of the given row, put in at (t, z) in visit ``place``, and the ways back."""
    _, times, states = _parts(curve, point)
    flow, values, k = curve.shooting.flow, point.solved.values, first.transition
    traced = curve.shooting.system.traced
    jump = traced.transitions[k]
    entry = flow.jump(values, k, t, z, row)
    indicator = jump.rows[row].indicator

    def change(new: list[Visit], after: list[FloatArray]) -> Change:
        signature = curve.shooting.signature.with_inserted(place, new)
        t_new = np.concatenate([times[:place], np.full(len(new), t), times[place:]])
        z_new = np.concatenate([states[: place + 1], np.array(after), states[place + 1 :]])
        return Change(kind, signature, t_new, z_new, indicator, True, place, tuple(new), t)

    if jump.target == jump.source:
        return [change([first], [entry.z_after])]
    found = []
    for k_back, back in enumerate(traced.transitions):
        if back.source != jump.target or back.target != jump.source:
            continue
        if back.at is not None:
            continue
        for r in (*range(len(back.rows)), AT_ONCE):
            leave = flow.jump(values, k_back, t, entry.z_after, r)
            found.append(change([first, Visit(jump.target, k_back, r)], [entry.z_after, leave.z_after]))
    return found


def _shortened(curve: Curve, point: Point) -> list[Change]:
    """A visit that has shrunk to nothing: take it out."""
    visits, times, states = _parts(curve, point)
    i = int(point.path.tau.argmin())
    traced = curve.shooting.system.traced
    if i in (0, len(visits) - 1):
        return [_rotated(curve, point, i == 0)] if curve.shooting.forced else []
    before, here, after = visits[i - 1], visits[i], visits[i + 1]
    if before.mode != after.mode:
        return []
    jump = traced.transitions[before.transition]
    at = curve.walk.conditional.tolist()
    slope = point.path.slope[at.index(i - 1)] if before.row >= 0 else np.inf
    steepest = float(np.abs(point.path.slope).max())
    kind = "grazing" if slope < 1e-3 * max(steepest, 1e-300) or len(point.path.slope) < 3 else "corner"
    indicator = jump.rows[before.row].indicator if before.row >= 0 else -1
    if before.row == AT_ONCE:
        kind, indicator = "corner", jump.rows[0].indicator if len(jump.rows) == 1 else -1
    signature = curve.shooting.signature.without(i - 1, 2)
    return [
        Change(
            kind, signature, np.delete(times, [i - 1, i]), np.delete(states, [i, i + 1], axis=0), indicator,
            False, i - 1, (before, here), float(times[i]),
        )
    ]  # fmt: skip


def _rotated(curve: Curve, point: Point, first: bool) -> Change:
    """A crossing has reached the section: it is now the last of the round in place of the first, or the reverse."""
    visits, times, states = _parts(curve, point)
    shooting, values = curve.shooting, point.solved.values
    end = float(point.solved.times[-1])
    if first:
        order = [*visits[1:-1], Visit(visits[-1].mode, visits[0].transition, visits[0].row)]
        z0 = shooting.flow.segments(values, [visits[1].mode], times[:1], -times[:1], states[1][None, :]).z
        moved = np.concatenate([times[1:], times[:1] + end])
        after = np.concatenate([z0, states[2:], states[1:2]])
        mode = visits[1].mode
    else:
        order = [Visit(visits[-2].mode, visits[-2].transition, visits[-2].row), *visits[:-2]]
        moved = np.concatenate([times[-1:] - end, times[:-1]])
        before = visits[-2].mode
        # The state at the section lies before that crossing now.
        z_before = point.solved.segments.z[-2]
        z0 = shooting.flow.segments(values, [before], times[-1:], end - times[-1:], z_before[None, :]).z
        after = np.concatenate([z0, states[-1:], states[1:-1]])
        mode = before
    turns = shooting.period_number
    fixed = []
    for visit in order:
        if visit.row == -1 and visit.transition >= 0:
            visit = Visit(visit.mode, visit.transition, -1, visit.turn % max(turns, 1))
        fixed.append(visit)
    return Change("section", Signature((*fixed, Visit(mode))), moved, after)


def _slowed(curve: Curve, point: Point) -> list[Change]:
    """A crossing that has become a touch: an impact of no speed is taken out."""
    visits, times, states = _parts(curve, point)
    i = int(curve.walk.conditional[int(point.path.slope.argmin())])
    visit = visits[i]
    jump = curve.shooting.system.traced.transitions[visit.transition]
    count = 1
    while visits[i + count].row == AT_ONCE:  # an impact made of several transitions
        count += 1
    if visits[i + count].mode != visit.mode:
        return []
    signature, gone = curve.shooting.signature.without(i, count), np.arange(i, i + count)
    return [
        Change(
            "grazing", signature, np.delete(times, gone), np.delete(states, gone + 1, axis=0),
            jump.rows[visit.row].indicator, False, i, visits[i : i + count], float(times[i]),
        )
    ]  # fmt: skip


def _other_row(curve: Curve, point: Point) -> list[Change]:
    """A corner of a condition: from here on another of its rows is the last to become true."""
    visits, times, states = _parts(curve, point)
    i = int(curve.walk.conditional[int(point.path.own.argmin())])
    visit = visits[i]
    jump = curve.shooting.system.traced.transitions[visit.transition]
    z, t = point.solved.segments.z[i], float(times[i])
    found = []
    for r, row in enumerate(jump.rows):
        if r != visit.row:
            h = curve.shooting.flow.jump(point.solved.values, visit.transition, t, z, r).h
            found.append((abs(h), r, row.indicator))
    if not found:
        return []
    _, r, indicator = min(found)
    new = (*visits[:i], Visit(visit.mode, visit.transition, r), *visits[i + 1 :])
    return [Change("corner", Signature(new), times, states, indicator)]


def _around(curve: Curve, point: Point, first: int, last: int) -> list[Change]:
    """Other ways through a corner of two transitions, in place of the crossings ``first`` to ``last - 1``."""
    visits, times, states = _parts(curve, point)
    found = []
    for way, after, indicator in other_ways(curve, point, first, last):
        signature = Signature((*visits[:first], *way, *visits[last:]))
        t_new = np.concatenate([times[:first], np.full(len(way), times[first]), times[last:]])
        z_new = np.concatenate([states[: first + 1], np.array(after), states[last + 1 :]])
        found.append(Change("corner", signature, t_new, z_new, indicator))
    return found
