"""``continue_orbit``: follow a periodic orbit in a parameter, stable or not, through grazing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.arclength import Curve, Point
from nonsmooth.continuation.branch import ENDINGS, Limits, March, march
from nonsmooth.continuation.files import branch_dataset, read_branch
from nonsmooth.continuation.orbit import Orbit
from nonsmooth.continuation.physical import allowed_range
from nonsmooth.continuation.records import (
    BranchRecord,
    PointRecord,
    SpecialRecord,
    from_march,
    joined,
    point_record,
)
from nonsmooth.continuation.shooting import Shooting
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import real_number, whole_number

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

__all__ = ["continue_orbit", "size_of", "special_row"]

FloatArray = NDArray[np.float64]
Records = tuple[list[PointRecord], list[SpecialRecord]]
FIRST = 1e-3  # step
AWAY = (1e-3, 3e-3, 3e-4, 1e-2, 1e-4)  # from a crossing of branches


def continue_orbit(
    start: Any,
    parameter: str | None = None,
    range: tuple[float, float] | None = None,
    *,
    step: float = 0.05,
    points: int = 2000,
) -> xr.Dataset:
    """Follow a periodic orbit in a parameter.

    Parameters
    ----------
    start : Orbit, branch, or one row of ``special_points``
        An orbit is followed both ways from its parameter. A branch goes on at each end that stopped at the edge of
        its range (give a wider ``range``) or at the largest number of points. A flip gives the branch of twice the
        period, a pitchfork or branch_point the other branch through it, a Hopf point of ``continue_equilibrium`` the
        cycles that are born there.
    parameter : str
        Name of the parameter; that of the branch where not given.
    range : (low, high)
        Its range.
    step : float
        The largest step, in units of the branch's own size (range, amplitude and period are 1).
    points : int
        The largest number of points each way.

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

    Notes
    -----
    Pseudo-arclength continuation of the multiple-shooting equations in scaled unknowns. Special points are zeros of
    functions along the branch, found by Brent's method on orbits corrected to rounding.
    """
    largest, most = real_number(step, "step"), whole_number(points, "points", 1)
    if not 0 < largest <= 1:
        raise ValueError(f"step = {step!r}: the largest step lies between 0 and 1")
    if isinstance(start, Orbit):
        return _from_orbit(start, parameter, range, largest, most)
    if hasattr(start, "data_vars"):
        if "special_point" in start:
            return _go_on(start, parameter, range, largest, most)
        if "kind" in start and "eigenvalues" in start:
            return _born(start, parameter, range, largest, most)
        if "kind" in start and "unknowns" in start:
            return _switched(start, parameter, range, largest, most)
    raise TypeError(
        "continue_orbit takes an Orbit (of find_orbit), a branch (of continue_orbit), or one row of special_points, "
        f"not {type(start).__name__}"
    )


def _limits(system: System, name: Any, given: Any, here: float | None) -> tuple[float, float]:
    if not isinstance(name, str) or name not in system.values:
        system.with_parameters({str(name): 0.0})  # raises with the names there are
    try:
        low, high = (real_number(x, "an end of the range") for x in given)
    except (TypeError, ValueError):
        raise ValueError(f"range = {given!r}: give its two ends, (low, high)") from None
    if not low < high:
        raise ValueError(f"range = {given!r}: the first end must be below the second")
    if here is not None and not low <= here <= high:
        raise ValueError(f"the orbit lies at {name} = {here!r}, outside the range {low!r} ... {high!r}")
    return low, high


def _from_orbit(orbit: Orbit, name: str | None, given: Any, largest: float, most: int) -> xr.Dataset:
    system = orbit.system
    if name is None or given is None:
        raise ValueError(
            'continue_orbit(orbit, parameter, range): say which parameter, and its range: "rho", (0.2, 0.5)'
        )
    low, high = _limits(system, name, given, system.values.get(name))
    if orbit.virtual:
        raise ValueError("this orbit is virtual: its path goes through a boundary that it should obey")
    size = size_of(orbit.maximum, orbit.minimum, system)
    curve, X = _curve(system, orbit.signature, orbit.period_number, name, orbit, size, high - low)
    first = curve.at_parameter(X / curve.scale, system.values[name]) or _near(curve, X)
    if first is None:
        raise SolveError("Newton's method did not converge at the orbit itself: give its parameter another value",
                         status="no_convergence")  # fmt: skip
    first = _facing(first, 1.0)
    bounds = allowed_range(system, name, low, high)
    up, down = _both_ways(curve, first, bounds, largest, most)
    points, special = joined(from_march(down), [point_record(curve, first)], from_march(up))
    sentences = (_sentence(down, bounds, name, (low, high)), _sentence(up, bounds, name, (low, high)))
    record = BranchRecord(name, (low, high), orbit.period_number, points, special, (down.ending, up.ending), sentences)
    return branch_dataset(system, record, {"parameter": name, "range": (low, high), "step": largest, "points": most})


def _both_ways(
    curve: Curve, first: Point, bounds: tuple[float, float], largest: float, most: int
) -> tuple[March, March]:
    """Marches with rising and with falling parameter; a closed branch needs only one."""
    begin = min(FIRST, largest)
    up = march(curve, first, Limits(*bounds, largest, most, (curve, first)), begin)
    if up.ending == "closed":
        return up, March(ending="closed")
    return up, march(curve, _facing(first, -1.0), Limits(*bounds, largest, most), begin)


def _facing(point: Point, sign: float) -> Point:
    """The same point with its tangent towards rising (1) or falling (-1) values."""
    from dataclasses import replace

    towards = float(point.tangent[-1])
    if (towards or 1.0) * sign > 0:
        return point
    # The bordered determinant turns with the tangent.
    return replace(point, tangent=-point.tangent, orientation=-point.orientation)


def _near(curve: Curve, X: FloatArray) -> Point | None:
    """The first point where the parameter cannot be held: at a fold."""
    Y = X / curve.scale
    null = curve.null_vectors(curve.shooting.evaluate(X))
    if not len(null):
        return None
    found = curve.correct(Y, null[-1], float(null[-1] @ Y), most=20)
    return None if found is None else curve.point(found[0], found[1], null[-1])


def size_of(maximum: FloatArray, minimum: FloatArray, system: System) -> FloatArray:
    """Half the range of each state, and 1 for the memory."""
    half = np.maximum(np.nan_to_num(0.5 * (maximum - minimum)), 1e-3 * system.scale_vector())
    return np.concatenate([half, np.ones(len(system.memory))])


def _curve(
    system: System, signature: Any, period_number: int, name: str, orbit: Orbit, size: FloatArray, width: float
) -> tuple[Curve, FloatArray]:
    shooting = Shooting(system, signature, period_number, (name,))
    section = np.concatenate([orbit.u, orbit.memory])
    if not shooting.forced and not shooting.m:
        from nonsmooth.continuation.anchor import free_anchor

        shooting.reference = free_anchor(shooting.flow, shooting.values, shooting.at_section, section, size)
    X = shooting.join(
        orbit.crossing_times, np.vstack([section, orbit.crossing_states]), orbit.period, [system.values[name]]
    )
    shooting.look_at_surfaces(X)
    return Curve(shooting, size, orbit.period, width), X


def _sentence(found: March, bounds: tuple[float, float], name: str, asked: tuple[float, float]) -> str:
    """How a march ended, in words; where the range was cut, that is the reason."""
    if found.ending == "range" and found.rows:
        value = float(found.rows[-1].point.X[-1])
        side = 0 if abs(value - bounds[0]) < abs(value - bounds[1]) else 1
        if bounds[side] != asked[side]:
            found.ending = "physical"
            return f"{name} = {value:.6g}: {ENDINGS['physical']}"
    return ENDINGS[found.ending]


def _resume(
    system: System, record: BranchRecord, point: PointRecord, name: str, width: float
) -> tuple[Curve, FloatArray]:
    """The curve through a recorded point."""
    shooting = Shooting(system, point.signature, record.period_number, (name,))
    size = size_of(point.maximum, point.minimum, system)
    if not shooting.forced and not shooting.m:
        from nonsmooth.continuation.anchor import free_anchor

        shooting.reference = free_anchor(
            shooting.flow, shooting.parameters(point.X), shooting.at_section, point.X[: shooting.n], size
        )
    shooting.look_at_surfaces(point.X)
    return Curve(shooting, size, point.period, width), point.X


def _go_on(start: xr.Dataset, name: str | None, given: Any, largest: float, most: int) -> xr.Dataset:
    """Extend a branch at its open ends."""
    system, record = read_branch(start)
    if name is not None and name != record.parameter:
        raise ValueError(f"this branch was followed in {record.parameter!r}, not in {name!r}")
    name = record.parameter
    low, high = _limits(system, name, record.range if given is None else given, None)
    bounds = allowed_range(system, name, low, high)
    ends: list[Records] = []
    endings, sentences = list(record.endings), list(record.sentences)
    for side, point in ((0, record.points[0]), (1, record.points[-1])):
        ends.append(([], []))
        open_end = record.endings[side] == "points" or (
            record.endings[side] in ("range", "physical") and bounds[0] < point.value < bounds[1]
        )
        if not open_end:
            continue
        curve, X = _resume(system, record, point, name, high - low)
        border = point.tangent / curve.scale * (1.0 if side else -1.0)
        border /= np.linalg.norm(border)
        Y = X / curve.scale
        found = curve.correct(Y, border, float(border @ Y))
        begin = None if found is None else curve.point(found[0], found[1], border)
        if begin is None:
            endings[side], sentences[side] = "no_convergence", ENDINGS["no_convergence"]
            continue
        more = march(curve, begin, Limits(*bounds, largest, most), min(FIRST, largest))
        ends[side] = from_march(more)
        sentences[side] = _sentence(more, bounds, name, (low, high))
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
    return branch_dataset(system, record, {"parameter": name, "range": (low, high), "step": largest, "points": most})


def _switched(start: xr.Dataset, name: str | None, given: Any, largest: float, most: int) -> xr.Dataset:
    """The other branch through a special point."""
    from nonsmooth.continuation.switching import emanating

    system, kind, own, point, period_number, asked = special_row(start, "continue_orbit")
    if name is not None and name != own:
        raise ValueError(f"this special point lies on a branch in {own!r}, not in {name!r}")
    low, high = _limits(system, own, asked if given is None else given, None)
    bounds = allowed_range(system, own, low, high)
    if kind not in ("flip", "pitchfork", "branch_point"):
        raise ValueError(
            f"no other branch passes through a {kind}: switching is possible at a flip, a pitchfork or a branch_point"
        )
    record = BranchRecord(own, (low, high), period_number, [point], [])
    curve, X = _resume(system, record, point, own, high - low)
    ways = emanating(curve, X, point.tangent / curve.scale, kind)
    begun: list[tuple[Curve, Point]] = []
    for fresh, Y, direction in ways:
        for away in AWAY:
            guess = Y + away * direction
            found = fresh.correct(guess, direction, float(direction @ guess))
            first = None if found is None else fresh.point(found[0], found[1], direction)
            if first is not None and (first.path.violation() >= 0.0).all():
                begun.append((fresh, first))
                break
    if not begun:
        raise SolveError(f"no other branch was found at this {kind}", status="no_convergence")
    marches = [march(fresh, first, Limits(*bounds, largest, most), min(FIRST, largest)) for fresh, first in begun]
    number = begun[0][0].shooting.period_number
    sentences = [_sentence(one, bounds, own, (low, high)) for one in marches]
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
    return branch_dataset(system, record, {"parameter": own, "range": (low, high), "step": largest, "points": most,
                                           "from": kind})  # fmt: skip


def _born(start: xr.Dataset, name: str | None, given: Any, largest: float, most: int) -> xr.Dataset:
    """The cycles that are born at a Hopf point."""
    from nonsmooth.continuation.born import first_cycle, hopf_row

    if "special" in start.dims:
        if start.sizes["special"] != 1:
            raise ValueError(
                "continue_orbit takes one special point: choose it, special_points(branch).isel(special=0)"
            )
        start = start.isel(special=0)
    kind = str(start["kind"].values)
    if kind != "hopf":
        raise ValueError(f"no cycle is born at a {kind}: that happens at a hopf point")
    system, own, value, mode, u, asked = hopf_row(start)
    if name is not None and name != own:
        raise ValueError(f"this special point lies on a branch in {own!r}, not in {name!r}")
    low, high = _limits(system, own, asked if given is None else given, value)
    bounds = allowed_range(system, own, low, high)
    begun = first_cycle(system, own, value, mode, u, high - low)
    if begun is None:
        raise SolveError("no cycle was found at this Hopf point", status="no_convergence")
    curve, first = begun
    found = march(curve, first, Limits(*bounds, largest, most), min(FIRST, largest))
    sentences = ("The branch begins at the Hopf point.", _sentence(found, bounds, own, (low, high)))
    points, special = joined(([], []), [point_record(curve, first)], from_march(found))
    record = BranchRecord(own, (low, high), 0, points, special, ("branching", found.ending), sentences)
    return branch_dataset(system, record, {"parameter": own, "range": (low, high), "step": largest, "points": most,
                                           "from": kind})  # fmt: skip


def _origin(curve: Curve, Y: FloatArray, direction: FloatArray) -> PointRecord:
    """The special point itself, as a point of the branch that leaves it."""
    solved = curve.shooting.evaluate(Y * curve.scale)
    path = curve.walk.along(solved, curve.shooting.split(solved.X)[1])
    assert path is not None
    M = solved.monodromy
    return point_record(curve, Point(Y, direction, solved, M, curve.shooting.multipliers(M), path, 0.0, 0))


def special_row(start: Any, verb: str) -> tuple[System, str, str, PointRecord, int, Any]:
    """One row of ``special_points`` as data: system, kind, parameter, point, period number and the branch's range."""
    import json

    from nonsmooth.continuation.files import signature_from
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.system import System

    if not hasattr(start, "data_vars") or "kind" not in start or "unknowns" not in start:
        raise TypeError(f"{verb} takes one row of special_points, not {type(start).__name__}")
    if "special" in start.dims:
        if start.sizes["special"] != 1:
            raise ValueError(
                f"{verb} takes one special point, not {start.sizes['special']}: choose it, "
                "special_points(branch).isel(special=0)"
            )
        start = start.isel(special=0)
    source = read_provenance(start)
    system = System.from_text(source["system"]["text"]).with_parameters(source["system"]["parameters"])
    own = str(start.attrs["parameter"])
    signature = signature_from(json.loads(start.attrs["layouts"])[int(start["layout"])])
    X = start["unknowns"].values
    known = ~np.isnan(X)
    point = PointRecord(
        float(start[own]), signature, X[known], start["tangent"].values[known], int(start["mode"]),
        start["section"].values, start["maximum"].values, start["minimum"].values, float(start["period"]),
        start["floquet_multipliers"].values, bool(start["stable"]), start["clearance"].values,
    )  # fmt: skip
    return system, str(start["kind"].values), own, point, int(start["period_number"]), source["options"]["range"]
