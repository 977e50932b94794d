"""The other branches through a special point: of twice the period, through a pitchfork, from a Hopf point."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.branches.files import branch_dataset
from nonsmooth.continuation.branches.reading import hopf_row, one_row, special_row
from nonsmooth.continuation.branches.records import (
    BranchRecord,
    PointRecord,
    SpecialRecord,
    from_march,
    joined,
    point_record,
)
from nonsmooth.continuation.march.begin import Asked, limits, resumed_at, sentence
from nonsmooth.continuation.march.crossing import other_direction
from nonsmooth.continuation.march.march import march
from nonsmooth.continuation.march.marches import March, in_turn
from nonsmooth.continuation.march.physical import allowed_range
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.shooting import Shooting
from nonsmooth.errors import SolveError

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["born", "straight_on", "switched"]

FloatArray = NDArray[np.float64]
AWAY = (1e-3, 3e-3, 3e-4, 1e-2, 1e-4)  # from a crossing of branches


def switched(start: xr.Dataset, name: str | None, given: Any, asked: Asked) -> xr.Dataset:
    """The other branch through a special point."""
    system, kind, own, point, period_number, before = special_row(start, "continue_orbit")
    _check_parameter(name, own)
    low, high = limits(system, own, before if given is None else given, None)
    bounds = allowed_range(system, own, low, high)
    if kind not in ("flip", "pitchfork", "branch_point"):
        raise ValueError(
            f"no other branch passes through a {kind}: switching is possible at a flip, a pitchfork or a branch_point "
            "(with virtual=True a grazing or corner row goes straight on)"
        )
    record = BranchRecord(own, (low, high), period_number, [point], [])
    curve, X = resumed_at(system, record, point, own, high - low)
    ways = emanating(curve, X, point.tangent / curve.scale, kind)
    begun: list[tuple[Orbits, OrbitPoint]] = []
    for fresh, Y, direction in ways:
        for away in AWAY:
            guess = Y + away * direction
            first = fresh.near(guess, direction)
            if first is not None and not first.virtual:
                begun.append((fresh, first))
                break
    if not begun:
        raise SolveError(f"no other branch was found at this {kind}", status="no_convergence")
    closed = (ways[0][0].shooting.signature, ways[0][1] * ways[0][0].scale)
    marches = in_turn(*(partial(march, *point, asked.limits(bounds, closed)) for point in begun))
    number = begun[0][0].shooting.period_number
    sentences = [sentence(one, bounds, own, (low, high)) for one in marches]
    forward = from_march(marches[0])
    last = [point_record(*begun[0])]
    origin = [_origin(*ways[0])]
    mark = SpecialRecord(kind, 0)
    if len(begun) == 1:
        points, special = joined(([], []), [*origin, *last], forward)
        said = (f"The branch begins at the {kind}.", sentences[0])
        endings = ("branching", marches[0].ending)
    else:
        back = from_march(marches[1])
        mark.place = len(back[0]) + 1
        middle = [point_record(*begun[1])]
        middle[0].tangent = -middle[0].tangent
        points, special = joined(back, [*middle, *origin, *last], forward)
        endings, said = (marches[1].ending, marches[0].ending), (sentences[1], sentences[0])
    special = sorted([*special, mark], key=lambda one: one.place)
    record = BranchRecord(own, (low, high), number, points, special, endings, said)
    return branch_dataset(system, record, asked.options(own, (low, high), **{"from": kind}))


def straight_on(start: xr.Dataset, name: str | None, given: Any, asked: Asked) -> xr.Dataset:
    """The branch through a graze or a corner with the signature of the row, both ways."""
    system, kind, own, point, period_number, before = special_row(start, "continue_orbit")
    _check_parameter(name, own)
    low, high = limits(system, own, before if given is None else given, point.value)
    bounds = allowed_range(system, own, low, high)
    curve, X = resumed_at(system, BranchRecord(own, (low, high), period_number, [point], []), point, own, high - low)
    border = point.tangent / curve.scale
    border /= np.linalg.norm(border)
    first = curve.near(X / curve.scale, border)
    if first is None:
        raise SolveError(f"Newton's method did not converge at this {kind}", status="no_convergence")
    both = (first.turned(), first)
    marches = in_turn(*(partial(march, curve, one, asked.limits(bounds)) for one in both))
    points, special = joined(from_march(marches[0]), [point_record(curve, first)], from_march(marches[1]))
    here = one_row(start, "continue_orbit")
    mark = SpecialRecord(
        kind, len(marches[0].rows), ["", *system.indicators].index(str(here["touched"].values)) - 1,
        str(here["grazing"].values), bool(here["bounded"]), bool(here["doubled"]),
        here["contact_multipliers"].values, here["determinant"].values,
    )  # fmt: skip
    special = sorted([*special, mark], key=lambda one: one.place)
    ends = (sentence(marches[0], bounds, own, (low, high)), sentence(marches[1], bounds, own, (low, high)))
    endings = (marches[0].ending, marches[1].ending)
    record = BranchRecord(own, (low, high), period_number, points, special, endings, ends)
    return branch_dataset(system, record, asked.options(own, (low, high), **{"from": kind}))


def born(start: xr.Dataset, name: str | None, given: Any, asked: Asked) -> xr.Dataset:
    """The cycles that emanate from a Hopf point, or from a focus-centre."""
    from nonsmooth.continuation.branches.born import cycle_about_a_centre, first_cycle

    start = one_row(start, "continue_orbit")
    kind = str(start["kind"].values)
    if kind not in ("hopf", "focus_centre"):
        raise ValueError(f"no cycle emanates from a {kind}: that happens at a hopf point or a focus_centre")
    system, own, value, mode, u, before = hopf_row(start)
    _check_parameter(name, own)
    low, high = limits(system, own, before if given is None else given, value)
    bounds = allowed_range(system, own, low, high)
    begun = (first_cycle if kind == "hopf" else cycle_about_a_centre)(system, own, value, mode, u, high - low)
    if begun is None:
        raise SolveError(f"no cycle was found at this {kind}", status="no_convergence")
    curve, first = begun
    # The first cycle of a Hopf point is small; about a centre the one that touches the boundary is followed back to.
    back = March(ending="branching")
    if kind == "focus_centre":
        back = march(curve, first.turned(), asked.limits(bounds))
    found = march(curve, first, asked.limits(bounds))
    words = "The branch begins at the Hopf point." if kind == "hopf" else sentence(back, bounds, own, (low, high))
    points, special = joined(from_march(back), [point_record(curve, first)], from_march(found))
    sentences = (words, sentence(found, bounds, own, (low, high)))
    record = BranchRecord(own, (low, high), 0, points, special, (back.ending, found.ending), sentences)
    return branch_dataset(system, record, asked.options(own, (low, high), **{"from": kind}))


def _check_parameter(name: str | None, own: str) -> None:
    if name is not None and name != own:
        raise ValueError(f"this special point lies on a branch in {own!r}, not in {name!r}")


def _origin(curve: Orbits, Y: FloatArray, direction: FloatArray) -> PointRecord:
    """The special point itself, as a point of the branch that leaves it."""
    point = curve.described(Y, direction, 0.0, 0, curve.evaluate(Y))
    assert point is not None
    return point_record(curve, point)


def doubled(shooting: Shooting, X: FloatArray) -> tuple[Shooting, FloatArray]:
    """The same orbit gone round twice."""
    n = shooting.period_number
    times, states = shooting.split(X)
    period = shooting.period(X)
    signature = shooting.signature.repeated(2, n)
    twice = Shooting(shooting.system, signature, 2 * n, shooting.active)
    # The second round begins at the section within the last visit, which is not a crossing.
    t2 = np.concatenate([times, times + period])
    z2 = np.concatenate([states, states[1:]])
    X2 = twice.join(t2, z2, 2 * period, X[shooting.size :])
    twice.divided, twice.alone = 2 * shooting.divided, 2 * shooting.alone
    if shooting.reference is not None:
        twice.reference = shooting.reference
    return twice, X2


def emanating(
    curve: Orbits, X: FloatArray, along: FloatArray, kind: str
) -> list[tuple[Orbits, FloatArray, FloatArray]]:
    """Curve, common point and direction of each new half branch at a special point.

    A flip has one (the orbit begun a round later is the same orbit); a pitchfork or a branch point two.
    """
    if kind == "flip":
        twice, X2 = doubled(curve.shooting, X)
        fresh = Orbits(twice, curve.size, 2 * curve.period, curve.widths)
        # Across the branch gone round twice: the null vector without a change of the parameter.
        direction = other_direction(fresh, X2 / fresh.scale, None)
        return [] if direction is None else [(fresh, X2 / fresh.scale, direction)]
    direction = other_direction(curve, X / curve.scale, along / np.linalg.norm(along))
    if direction is None:
        return []
    return [(curve, X / curve.scale, direction), (curve, X / curve.scale, -direction)]
