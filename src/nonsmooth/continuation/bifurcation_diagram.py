"""``bifurcation_diagram``: sweeps, the orbits behind them, and the branches that leave their special points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.arguments import LargestStep, limits
from nonsmooth.continuation.branches.other_branches import SWITCHES
from nonsmooth.continuation.branches.reading import renumbered
from nonsmooth.continuation.continue_orbit import continue_orbit
from nonsmooth.continuation.find import find_orbit
from nonsmooth.continuation.searches.search import Search, search_within
from nonsmooth.continuation.special import special_points
from nonsmooth.errors import SolveError
from nonsmooth.flow.options import Varied, as_called
from nonsmooth.results.progress import Progress
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Range, above, at_least

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

SAME = 1e-8  # of the range: special points nearer than this are one
ON_BRANCH = 0.02  # of a branch's size: a point of the sweep nearer to it than this lies on it


@dataclass
class _Branch:
    """A branch, the one that it leaves (-1: found in a sweep), and how many switches lead to it."""

    data: xr.Dataset
    parent: int
    level: int
    values: FloatArray  # of the parameter
    returns: FloatArray  # (point, period number, state) all section points

    def holds(self, value: float, u: FloatArray) -> bool:
        """Return whether a point of a sweep lies on it."""
        high, low = self.data["maximum"].values, self.data["minimum"].values
        size = np.maximum(np.nanmax(high, 0) - np.nanmin(low, 0), 1e-12)
        nearest = float(np.clip(value, self.values.min(), self.values.max()))
        if abs(nearest - value) <= SAME * np.ptp(self.values):  # an edge of the range, to rounding
            value = nearest
        a, b = self.values[:-1], self.values[1:]
        at = np.flatnonzero(((a - value) * (b - value) <= 0.0) & (a != b))
        x = ((value - a[at]) / (b[at] - a[at]))[:, None, None]
        there = (1.0 - x) * self.returns[at] + x * self.returns[at + 1]
        return bool((np.abs((there - u) / size).max(axis=2) < ON_BRANCH).any())

    def begins_at(self, row: xr.Dataset, near: float) -> bool:
        """Return whether it is the other branch through a special point."""
        doubles, data = str(row["kind"].values) == "flip", self.data
        if int(data["period_number"]) != (2 if doubles else 1) * int(row["period_number"]):
            return False
        value = row[data.attrs["parameter"]].values
        same = (data["special_kind"] == row["kind"]) & (np.abs(data["special_value"] - value) < near)
        ends = data["special_point"].isin([0, data.sizes["point"] - 1]) if doubles else True  # a doubled one ends there
        return bool((same & ends).any())


def _branch(data: xr.Dataset, parent: int, level: int) -> _Branch:
    return _Branch(data, parent, level, data[data.attrs["parameter"]].values, data["returns"].values)


@checked
def bifurcation_diagram(
    system: System,
    parameter: Varied,
    range: Range,
    *,
    n: Annotated[int, at_least(2)] = 101,
    start: Any = None,
    transient: Annotated[int, at_least(0)] = 300,
    depth: Annotated[int, at_least(0)] = 3,
    max_period: Annotated[int, at_least(1)] = 8,
    step: LargestStep = 0.05,
    points: Annotated[int, at_least(1)] = 2000,
    budget: Annotated[float, above(0)] = 60.0,
    progress: Progress = True,
) -> xr.Dataset:
    """Compute the branches of periodic orbits over a range of a parameter, stable and unstable, with special points.

    The parameter is swept up and down; the orbit behind each periodic interval of the sweeps is found and followed both
    ways, unless it lies on a branch that is known. At flips and where branches cross the other branch is followed
    too, and from its special points again, ``depth`` times.

    Parameters
    ----------
    system : System
        With forcing, or a map.
    parameter : str
    range : (low, high)
    n : int
        Points of each sweep.
    start : state, optional
        Where the sweeps begin; zeros where not given.
    transient : int
        Forcing periods that each point of a sweep passes over.
    depth : int
        Switches from branch to branch in a row: 3 leads from period 1 to period 8.
    max_period : int
        The longest period of the orbits, in the sweeps and behind flips.
    step, points
        As in :func:`continue_orbit`.
    budget : float
        Seconds of processor time after which no further branch is begun; ``complete`` is False then.
    progress : bool, or function
        A bar of the budget, on a terminal and in a notebook; nothing elsewhere.

    Returns
    -------
    xarray.Dataset
        Over ``point``, branch after branch: ``branch`` and all that :func:`continue_orbit` gives; over ``special`` the
        special points, with ``special_branch`` (:func:`special_points` makes a table of them); over ``branch``:
        ``period_number``, ``parent`` (the branch it leaves, -1: found in a sweep), ``ended`` and ``ended_because``. Of
        the sweeps: ``swept_value``, ``swept_section``, ``swept_period_number``.

    Raises
    ------
    ValueError, TypeError
        Arguments that do not fit.
    SolveError
        No periodic orbit was found.
    """
    asked = as_called(locals())
    if system.period() is None and not system.is_map:
        raise ValueError(
            f"{system.name!r} has no forcing: follow its equilibria with continue_equilibrium, its cycles with "
            "find_orbit and continue_orbit"
        )
    low, high = limits(system, parameter, range, None)
    swept = _swept(system, parameter, np.linspace(low, high, n), start, transient, max_period)
    found, complete = list[_Branch](), True
    more: dict[str, Any] = {"step": step, "points": points}
    with search_within(budget, "bifurcation_diagram", progress) as search:
        for value, period, u in _periodic(swept, parameter):
            if any(int(one.data["period_number"]) == period and one.holds(value, u) for one in found):
                continue
            if not complete or search.over():
                complete = False
                break
            try:
                here = system.with_parameters({parameter: value})
                orbit = find_orbit(here, start=u, transient=0, period_number=period, progress=False)
                found.append(_branch(continue_orbit(orbit, parameter, (low, high), **more), -1, 0))
            except SolveError:
                continue
            complete = _switched(found, depth, max_period, search, more, SAME * (high - low))
    if not found and not complete:
        raise SolveError(f"the budget of {budget:g} s was spent before a branch was found", status="budget")
    if not found:
        raise SolveError(
            f"no periodic orbit was found over {parameter} = {low!r} ... {high!r}: the sweeps show none up to period "
            f"{max_period}, or Newton's method converged to none of them. Give another start, range or transient",
            status="not_periodic",
        )
    return _dataset(system, parameter, found, swept, asked, complete)


def _swept(system: System, name: str, values: FloatArray, start: Any, transient: int, most: int) -> xr.Dataset:
    from nonsmooth.diagrams.sweep import sweep

    at = system.with_parameters({name: float(values[0])})
    return sweep(
        at,
        name,
        values,
        direction="both",
        start=start,
        transient=transient,
        keep=2 * most,
        max_period=most,
        progress=False,
    )


def _periodic(swept: xr.Dataset, name: str) -> list[tuple[float, int, FloatArray]]:
    """Values, period numbers and last section points of the sweeps: the middle of each interval, then its quarters."""
    numbers = swept["period_number"].transpose("direction", name).values
    last = swept["section"].transpose("direction", name, "iterate", "state").values[:, :, -1]
    values, found = swept[name].values, []
    for one, states in zip(numbers, last, strict=True):
        ends = np.flatnonzero(np.diff(one)) + 1
        for interval in np.split(np.arange(len(one)), ends):
            if one[interval[0]] > 0:
                for rank, part in enumerate((0.5, 0.25, 0.75, 0.0, 1.0)):
                    i = interval[round(part * (len(interval) - 1))]
                    found.append((rank, int(one[i]), float(values[i]), states[i]))
    found.sort(key=lambda one: (one[0], one[1]))
    return [(value, number, u) for _, number, value, u in found]


def _switched(found: list[_Branch], depth: int, most: int, search: Search, more: dict[str, Any], near: float) -> bool:
    """Follow the branches that leave the last one, and those that leave these; False where the budget ends it."""
    todo = [len(found) - 1]
    for at in todo:
        branch = found[at]
        table, last = special_points(branch.data), branch.data.sizes["point"] - 1
        for i in range(table.sizes["special"] if branch.level < depth else 0):
            row = table.isel(special=i)
            kind, number = str(row["kind"].values), int(row["period_number"])
            if kind not in SWITCHES or int(row["point"]) in (0, last) or (kind == "flip" and 2 * number > most):
                continue
            if any(other is not branch and other.begins_at(row, near) for other in found):
                continue
            if search.over():
                return False
            try:
                found.append(_branch(continue_orbit(row, **more), at, branch.level + 1))
            except SolveError:
                continue
            todo.append(len(found) - 1)
    return True


def _dataset(
    system: System, name: str, found: list[_Branch], swept: xr.Dataset, options: dict[str, Any], complete: bool
) -> xr.Dataset:
    from nonsmooth.results.branches import diagram
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    branches, parents = zip(*((renumbered(one.data, system), one.parent) for one in found), strict=True)
    labels = labels_of(system)  # with the modes of all branches
    attrs = dict(provenance(labels, "bifurcation_diagram", options, method="multiple shooting"))
    return diagram(labels, attrs, name, branches, parents, swept, complete)
