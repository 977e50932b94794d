"""``continue_orbit``: follow a periodic orbit in a parameter, stable or not, through grazing."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.branches.files import branch_dataset
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.branches.other_branches import born, straight_on, switched
from nonsmooth.continuation.branches.reading import read_branch
from nonsmooth.continuation.branches.records import (
    BranchRecord,
    PointRecord,
    SpecialRecord,
    from_march,
    joined,
    point_record,
)
from nonsmooth.continuation.march.begin import Asked, curve_of, largest_step, limits, resumed_at, sentence
from nonsmooth.continuation.march.event import BESIDE, Crossing
from nonsmooth.continuation.march.march import march
from nonsmooth.continuation.march.marches import ENDINGS, March, in_turn
from nonsmooth.continuation.march.physical import allowed_range
from nonsmooth.continuation.problems.orbit_events import NeimarkSacker
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import whole_number
from nonsmooth.system.names import by_name

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["continue_orbit"]

FloatArray = NDArray[np.float64]
Records = tuple[list[PointRecord], list[SpecialRecord]]
ZERO = 1e-6  # of the numbers beside it: the first orbit is a special point


@by_name
def continue_orbit(
    start: Any,
    parameter: str | None = None,
    range: tuple[float, float] | None = None,
    *,
    step: float = 0.05,
    points: int = 2000,
    virtual: bool = False,
) -> xr.Dataset:
    """Follow a periodic orbit in a parameter.

    Parameters
    ----------
    start : Orbit, branch, or one row of ``special_points``
        An orbit is followed both ways from its parameter. A branch goes on at each end that stopped at the edge of
        its range (give a wider ``range``), at the largest number of points or by Ctrl-C. A flip gives the branch of
        twice the period, a pitchfork or branch_point the other branch through it, a Hopf point of
        ``continue_equilibrium`` the cycles that emanate from it.
    parameter : str
        Name of the parameter; that of the branch where not given.
    range : (low, high)
        Its range.
    step : float
        The largest step, in units of the branch's own size (range, amplitude and period are 1).
    points : int
        The largest number of points each way.
    virtual : bool
        Keep the signature: at a graze or a corner the branch goes straight on, and its orbits beyond are marked
        ``virtual`` (their paths go through a boundary, visits have a negative length, impacts a negative speed). A
        ``grazing`` or ``corner`` row of ``special_points`` may then be the start too.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the branch: the parameter, ``section``, ``maximum``, ``minimum``, ``period``,
        ``floquet_multipliers``, ``stable``, ``signature``, ``clearance``; over ``special`` the special points (see
        :func:`special_points`); over ``end`` how the branch ends: ``ended`` and, in a sentence, ``ended_because``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit: the orbit lies outside the range, a parameter that does not exist.
    SolveError
        The first point could not be computed.
    Interrupted
        Ctrl-C; its ``result`` is the branch that was found until then, which ``continue_orbit`` takes to go on.

    Notes
    -----
    Pseudo-arclength continuation of the multiple-shooting equations in scaled unknowns. Special points are zeros of
    functions along the branch, found by Brent's method on orbits corrected to rounding.
    """
    asked = Asked(largest_step(step), whole_number(points, "points", 1), bool(virtual))
    if isinstance(start, Orbit):
        return _from_orbit(start, parameter, range, asked)
    if hasattr(start, "data_vars"):
        if "special_point" in start:
            return _go_on(start, parameter, range, asked)
        if "kind" in start and "eigenvalues" in start:
            return born(start, parameter, range, asked)
        if "kind" in start and "unknowns" in start:
            if virtual and str(np.squeeze(start["kind"].values)) in ("grazing", "corner"):
                return straight_on(start, parameter, range, asked)
            return switched(start, parameter, range, asked)
    raise TypeError(
        "continue_orbit takes an Orbit (of find_orbit), a branch (of continue_orbit), or one row of special_points, "
        f"not {type(start).__name__}"
    )


def _from_orbit(orbit: Orbit, name: str | None, given: Any, asked: Asked) -> xr.Dataset:
    system = orbit.system
    if name is None or given is None:
        raise ValueError(
            'continue_orbit(orbit, parameter, range): say which parameter, and its range: "rho", (0.2, 0.5)'
        )
    low, high = limits(system, name, given, system.values.get(name))
    if orbit.virtual:
        raise ValueError("this orbit is virtual: its path goes through a boundary that it should obey")
    curve, X = curve_of(orbit, name, high - low)
    first = curve.at_parameter(X / curve.scale, system.values[name]) or _near(curve, X)
    if first is None:
        raise SolveError("Newton's method did not converge at the orbit itself: give its parameter another value",
                         status="no_convergence")  # fmt: skip
    first = first.facing(1.0)
    bounds = allowed_range(system, name, low, high)
    up, down = _both_ways(curve, first, bounds, asked)
    points, special = joined(from_march(down), [point_record(curve, first)], from_march(up))
    special += [SpecialRecord(kind, len(down.rows)) for kind in _at_the_start(curve, first, down, up)]
    special.sort(key=lambda one: one.place)
    sentences = (sentence(down, bounds, name, (low, high)), sentence(up, bounds, name, (low, high)))
    record = BranchRecord(name, (low, high), orbit.period_number, points, special, (down.ending, up.ending), sentences)
    return branch_dataset(system, record, asked.options(name, (low, high)))


def _both_ways(curve: Orbits, first: OrbitPoint, bounds: tuple[float, float], asked: Asked) -> tuple[March, March]:
    """Marches with rising and with falling parameter; a closed branch needs only one."""
    up, down = in_turn(
        lambda: march(curve, first, asked.limits(bounds, (curve.shooting.signature, first.X))),
        lambda: march(curve, first.facing(-1.0), asked.limits(bounds)),
    )
    return up, down


def _at_the_start(curve: Orbits, first: OrbitPoint, down: March, up: March) -> list[str]:
    """Folds, flips and tori at the first orbit itself: rounding decides whether a march from there sees them."""
    if not (down.rows and up.rows) or not all(march.rows[0].curve is curve for march in (down, up)):
        return []
    before, after = down.rows[0].point.turned(), up.rows[0].point  # the march down has its tangents the other way
    seen = {one.kind for march in (down, up) for one in march.special
            if one.curve is curve and np.abs(one.point.Y - first.Y).max() < BESIDE}  # fmt: skip
    found = []
    for kind in curve.kinds:
        if isinstance(kind, Crossing) or kind.name in seen:
            continue
        here, was, now = (kind.number(curve, point) for point in (first, before, after))
        if not was * now < 0.0 or abs(here) > ZERO * max(abs(was), abs(now)):
            continue
        if not isinstance(kind, NeimarkSacker) or (np.abs(first.multipliers.imag) > BESIDE).any():
            found.append(kind.name)
    return found


def _near(curve: Orbits, X: FloatArray) -> OrbitPoint | None:
    """The first point where the parameter cannot be held: at a fold."""
    Y = X / curve.scale
    null = curve.null_vectors(curve.shooting.evaluate(X))
    if not len(null):
        return None
    return curve.near(Y, null[-1], most=20)


def _go_on(start: xr.Dataset, name: str | None, given: Any, asked: Asked) -> xr.Dataset:
    """Extend a branch at its open ends."""
    system, record = read_branch(start)
    if name is not None and name != record.parameter:
        raise ValueError(f"this branch was followed in {record.parameter!r}, not in {name!r}")
    name = record.parameter
    low, high = limits(system, name, record.range if given is None else given, None)
    bounds = allowed_range(system, name, low, high)
    ends: list[Records] = [([], []), ([], [])]
    begun: dict[int, Callable[[], March]] = {}
    endings, sentences = list(record.endings), list(record.sentences)
    for side, point in ((0, record.points[0]), (1, record.points[-1])):
        open_end = record.endings[side] in ("points", "interrupted") or (
            record.endings[side] in ("range", "physical") and bounds[0] < point.value < bounds[1]
        )
        if not open_end and not (asked.virtual and record.endings[side] in ("grazing", "corner")):
            continue
        curve, X = resumed_at(system, record, point, name, high - low)
        border = point.tangent / curve.scale * (1.0 if side else -1.0)
        border /= np.linalg.norm(border)
        Y = X / curve.scale
        begin = curve.near(Y, border)
        if begin is None:
            endings[side], sentences[side] = "no_convergence", ENDINGS["no_convergence"]
            continue
        other = record.points[-1 if side == 0 else 0]
        closed = (other.signature, other.X) if len(record.points) > 1 else None
        begun[side] = partial(march, curve, begin, asked.limits(bounds, closed))
    for side, more in zip(begun, in_turn(*begun.values()), strict=True):
        ends[side] = from_march(more)
        sentences[side] = sentence(more, bounds, name, (low, high))
        endings[side] = more.ending
    middle = record.points
    n = len(ends[0][0])
    points, special = joined(ends[0], middle, ends[1])
    for one in record.special:
        one.place += n
    record = BranchRecord(
        name, (low, high), record.period_number, points, sorted([*special, *record.special], key=lambda s: s.place),
        (endings[0], endings[1]), (sentences[0], sentences[1]),
    )  # fmt: skip
    return branch_dataset(system, record, asked.options(name, (low, high)))
