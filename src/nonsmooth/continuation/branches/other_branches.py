"""The other branches through a special point: of twice the period, through a pitchfork, from a Hopf point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.born import first_cycle
from nonsmooth.continuation.branches.following import MarchOptions, Start, resumed_at
from nonsmooth.continuation.branches.reading import hopf_row, marks_of, one_row, special_row
from nonsmooth.continuation.branches.records import record_of
from nonsmooth.continuation.march.march import March, MarkedPoint, SpecialRecord
from nonsmooth.continuation.problems.curve import Point, tangents
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.continuation.problems.signature import Round
from nonsmooth.errors import SolveError

if TYPE_CHECKING:
    import xarray as xr

SWITCHES = ("flip", "pitchfork", "transcritical", "branch_point")
AWAY = (1e-3, 3e-3, 3e-4, 1e-2, 1e-4)  # from a crossing of branches


def switched(start: xr.Dataset, name: str | None, asked: MarchOptions) -> xr.Dataset:
    """The other branch through a special point."""
    system, kind, own, point, period_number, before = special_row(start, "continue_orbit")
    _check_parameter(name, own)
    branch = asked.follow(system, own, before)
    if kind not in SWITCHES:
        raise ValueError(
            f"no other branch passes through a {kind}: switching is possible at a {', '.join(SWITCHES)} "
            "(with virtual=True a grazing or corner row goes straight on)"
        )
    curve, X = resumed_at(system, period_number, point, own, branch.width)
    fresh, Y, ways = emanating(curve, X, point.tangent / curve.scale, kind)
    begun: list[OrbitPoint] = []
    for direction in ways:
        for away in AWAY:
            first = fresh.near(Y + away * direction, direction)
            if first is not None and not first.virtual:
                begun.append(first)
                break
    if not begun:
        raise SolveError(f"no other branch was found at this {kind}", status="no_convergence")
    here = fresh.described(Point(fresh, Y, ways[0], 0.0, 0, fresh.evaluate(Y)))
    assert here is not None
    middle = [record_of(MarkedPoint(here, mark=SpecialRecord(kind))), record_of(MarkedPoint(begun[0]))]
    back: Start = March(ending="branching", said=f"The branch begins at the {kind}.")
    if len(begun) > 1:
        back = begun[1]
        middle.insert(0, record_of(MarkedPoint(begun[1].turned())))
    number = fresh.shooting.period_number
    return branch.result(number, back, middle, begun[0], closed=fresh.landmark(here), origin=kind)


def straight_on(start: xr.Dataset, name: str | None, asked: MarchOptions) -> xr.Dataset:
    """The branch through a graze or a corner with the signature of the row, both ways."""
    system, kind, own, point, period_number, before = special_row(start, "continue_orbit")
    _check_parameter(name, own)
    branch = asked.follow(system, own, before, point.value)
    first = branch.resumed(period_number, point)
    if first is None:
        raise SolveError(f"Newton's method did not converge at this {kind}", status="no_convergence")
    middle = record_of(MarkedPoint(first))
    middle.marks.extend(marks_of(one_row(start, "continue_orbit"), system))
    return branch.result(period_number, first.turned(), [middle], first, origin=kind)


def born(start: xr.Dataset, name: str | None, asked: MarchOptions) -> xr.Dataset:
    """The cycles that emanate from a Hopf point, or from a focus-centre."""
    start = one_row(start, "continue_orbit")
    kind = str(start["kind"].values)
    if kind not in ("hopf", "focus_centre"):
        raise ValueError(f"no cycle emanates from a {kind}: that happens at a hopf point or a focus_centre")
    system, own, rest, before = hopf_row(start)
    _check_parameter(name, own)
    branch = asked.follow(system, own, before, rest.value)
    first = first_cycle(kind, system, own, rest, branch.width)
    if first is None:
        raise SolveError(f"no cycle was found at this {kind}", status="no_convergence")
    # The first cycle of a Hopf point is small; about a centre the one that touches the boundary is followed back to.
    back: Start = March(ending="branching", said="The branch begins at the Hopf point.")
    if kind == "focus_centre":
        back = first.turned()
    return branch.result(0, back, [record_of(MarkedPoint(first))], first, origin=kind)


def _check_parameter(name: str | None, own: str) -> None:
    if name is not None and name != own:
        raise ValueError(f"this special point lies on a branch in {own!r}, not in {name!r}")


def doubled(shooting: Shooting, X: FloatArray) -> tuple[Shooting, FloatArray]:
    """The same orbit gone round twice."""
    n, once = shooting.period_number, shooting.once(X)
    times = np.concatenate([once.times, once.times + once.period])
    # The second round begins at the section within the last visit, which is not a crossing.
    states = np.concatenate([once.states, once.states[1:]])
    twice = Round(2 * n, 2 * once.period, once.signature.repeated(2, n), times, states)
    fresh, X2 = Shooting.of(shooting.system, twice, shooting.active, X[shooting.size :])
    fresh.divided, fresh.alone, fresh.reference = 2 * shooting.divided, 2 * shooting.alone, shooting.reference
    return fresh, X2


def emanating(
    curve: Orbits, X: FloatArray, along: FloatArray, kind: str
) -> tuple[Orbits, FloatArray, list[FloatArray]]:
    """Curve and common point of the other branch at a special point, and the direction of each half of it.

    A flip has one (the orbit begun a round later is the same orbit), a crossing of branches two.
    """
    if kind == "flip":
        twice, X = doubled(curve.shooting, X)
        curve = Orbits(twice, curve.size, 2 * curve.period, curve.widths)
    both = tangents(curve, X / curve.scale)
    if both is None:
        return curve, X, []
    if kind == "flip":  # the parameter turns on the branch of twice the period
        return curve, X / curve.scale, [min(both, key=lambda v: abs(v[-1]))]
    other = min(both, key=lambda v: abs(v @ along))
    return curve, X / curve.scale, [other, -other]
