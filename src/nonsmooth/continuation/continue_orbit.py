"""``continue_orbit``: follow a periodic orbit in a parameter, stable or not, through grazing."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.continuation.arguments import LargestStep
from nonsmooth.continuation.branches.following import MarchOptions, Start, curve_of
from nonsmooth.continuation.branches.orbit import Orbit
from nonsmooth.continuation.branches.other_branches import born, straight_on, switched
from nonsmooth.continuation.branches.reading import read_branch
from nonsmooth.continuation.branches.records import record_of
from nonsmooth.continuation.march.march import March, MarkedPoint
from nonsmooth.continuation.problems.multipliers import copies
from nonsmooth.errors import SolveError
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, at_least

if TYPE_CHECKING:
    import xarray as xr


@checked
def continue_orbit(
    start: Any,
    parameter: str | None = None,
    range: Range | None = None,
    *,
    step: LargestStep = 0.05,
    points: Annotated[int, at_least(1)] = 2000,
    virtual: bool = False,
) -> xr.Dataset:
    """Follow a periodic orbit in a parameter.

    Parameters
    ----------
    start : Orbit, branch, or one row of ``special_points``
        An orbit is followed both ways from its parameter. A branch goes on at each end that stopped at the edge of
        its range (give a wider ``range``), at the largest number of points or by Ctrl-C. A flip gives the branch of
        twice the period, a pitchfork or transcritical the other branch through it, a Hopf point of
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
        ``floquet_multipliers``, ``stable``, ``signature``, ``clearance``, and over ``return`` too ``returns``, all
        section points of the orbit; over ``special`` the special points (see :func:`special_points`); over ``end`` how
        the branch ends: ``ended`` and, in a sentence, ``ended_because``.

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
    asked = MarchOptions(range, step, points, virtual)
    if isinstance(start, Orbit):
        return _from_orbit(start, parameter, asked)
    if hasattr(start, "data_vars"):
        if "special_point" in start:
            return _go_on(start, parameter, asked)
        if "kind" in start and "eigenvalues" in start:
            return born(start, parameter, asked)
        if "kind" in start and "unknowns" in start:
            if virtual and str(np.squeeze(start["kind"].values)) in ("grazing", "corner"):
                return straight_on(start, parameter, asked)
            return switched(start, parameter, asked)
    raise TypeError(
        "continue_orbit takes an Orbit (of find_orbit), a branch (of continue_orbit), or one row of special_points, "
        f"not {type(start).__name__}"
    )


def _from_orbit(orbit: Orbit, name: str | None, asked: MarchOptions) -> xr.Dataset:
    """The branch through an orbit, both ways."""
    system = orbit.system
    if name is None or asked.range is None:
        raise ValueError(
            'continue_orbit(orbit, parameter, range): say which parameter, and its range: "rho", (0.2, 0.5)'
        )
    branch = asked.follow(system, name, here=system.values.get(name))
    if orbit.virtual:
        raise ValueError("this orbit is virtual: its path goes through a boundary that it should obey")
    curve, X = curve_of(orbit, name, branch.width)
    first = curve.nearest(X / curve.scale, system.values[name])
    if first is None:
        raise SolveError(
            "Newton's method did not converge at the orbit itself: give its parameter another value",
            status="no_convergence",
        )
    if copies(first.multipliers):
        warnings.warn(
            "multipliers of the orbit are equal: parts of the system do the same and do not feel each other. Where "
            "they reach a boundary or part, all at once, corners may be listed that rounding makes, and the branch may "
            "turn back: follow one of them alone",
            RuntimeWarning,
            stacklevel=4,
        )
    ahead = first.facing(1.0)
    middle = [record_of(MarkedPoint(ahead))]
    return branch.result(orbit.period_number, first.facing(-1.0), middle, ahead, closed=curve.landmark(first))


def _go_on(start: xr.Dataset, name: str | None, asked: MarchOptions) -> xr.Dataset:
    """Extend a branch at its open ends."""
    system, record = read_branch(start)
    if name is not None and name != record.parameter:
        raise ValueError(f"this branch was followed in {record.parameter!r}, not in {name!r}")
    branch = asked.follow(system, record.parameter, record.range)
    low, high = branch.bounds
    ends: list[Start] = []
    for side, point in ((0, record.points[0]), (1, record.points[-1])):
        ending, said = record.endings[side], record.sentences[side]
        open_end = ending in ("points", "interrupted") or (ending in ("range", "physical") and low < point.value < high)
        if not open_end and not (asked.virtual and ending in ("grazing", "corner")):
            ends.append(March(ending=ending, said=said))
            continue
        begin = branch.resumed(record.period_number, point, 1.0 if side else -1.0)
        ends.append(begin or March(ending="no_convergence"))
    return branch.result(record.period_number, ends[0], record.points, ends[1])
