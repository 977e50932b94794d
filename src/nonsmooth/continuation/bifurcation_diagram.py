"""``bifurcation_diagram``: sweeps, the orbits behind them, and the branches that leave their special points."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.arguments import LargestStep, limits
from nonsmooth.continuation.branches.other_branches import SWITCHES
from nonsmooth.continuation.branches.reading import read_branch
from nonsmooth.continuation.continue_orbit import continue_orbit
from nonsmooth.continuation.find import find_orbit
from nonsmooth.continuation.problems.shooting import Shooting
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

__all__ = ["bifurcation_diagram"]

SAME = 1e-8  # of the range: special points nearer than this are one
ON_BRANCH = 0.02  # of a branch's size: a point of the sweep nearer to it than this lies on it


@dataclass
class _Found:
    """Branches in the order in which they were found, and the branch that each one leaves (-1: found in a sweep)."""

    name: str
    width: float
    branches: list[xr.Dataset] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    levels: list[int] = field(default_factory=list)
    lines: list[tuple[FloatArray, FloatArray]] = field(default_factory=list)  # values, section points (point, p, state)

    def add(self, branch: xr.Dataset, parent: int, level: int) -> None:
        self.branches.append(branch)
        self.parents.append(parent)
        self.levels.append(level)
        self.lines.append((branch[self.name].values, returns_of(branch)))

    def holds(self, value: float, period: int, u: FloatArray) -> bool:
        """Return whether a point of a sweep lies on a branch."""
        for branch, (values, points) in zip(self.branches, self.lines, strict=True):
            if int(branch["period_number"]) != period:
                continue
            size = np.maximum(np.nanmax(branch["maximum"].values, 0) - np.nanmin(branch["minimum"].values, 0), 1e-12)
            a, b = values[:-1], values[1:]
            for i in np.flatnonzero(((a - value) * (b - value) <= 0.0) & (a != b)):
                x = (value - a[i]) / (b[i] - a[i])
                there = (1.0 - x) * points[i] + x * points[i + 1]
                if (np.abs((there - u) / size).max(axis=1) < ON_BRANCH).any():
                    return True
        return False

    def left(self, branch: int, row: xr.Dataset) -> bool:
        """Return whether the other branch through a special point of a branch is known."""
        kind, value, period = str(row["kind"].values), float(row[self.name]), int(row["period_number"])
        for i, other in enumerate(self.branches):
            number = int(other["period_number"])
            if i == branch or number != (2 * period if kind == "flip" else period):
                continue
            same = (other["special_kind"].values == kind) & (
                np.abs(other["special_value"].values - value) < SAME * self.width
            )
            if kind == "flip":  # a doubled branch ends there
                same &= np.isin(other["special_point"].values, [0, other.sizes["point"] - 1])
            if same.any():
                return True
        return False


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
        Over ``point``, branch after branch: ``branch`` and all that :func:`continue_orbit` gives, ``returns`` (all
        section points of an orbit); over ``special`` the special points, with ``special_branch``
        (:func:`special_points` makes a table of them); over ``branch``: ``period_number``, ``parent`` (the branch it
        leaves, -1: found in a sweep), ``ended`` and ``ended_because``. Of the sweeps: ``swept_value``,
        ``swept_section``, ``swept_period_number``.

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
    found, complete = _Found(parameter, high - low), True
    more: dict[str, Any] = {"step": step, "points": points}
    with search_within(budget, "bifurcation_diagram", progress) as search:
        for value, period, u in _periodic(swept, parameter):
            if found.holds(value, period, u):
                continue
            if not complete or _spent(search):
                complete = False
                break
            try:
                here = system.with_parameters({parameter: value})
                orbit = find_orbit(here, start=u, transient=0, period_number=period, progress=False)
                found.add(continue_orbit(orbit, parameter, (low, high), **more), -1, 0)
            except SolveError:
                continue
            complete = _switched(found, len(found.branches) - 1, depth, max_period, search, more)
    if not found.branches and not complete:
        raise SolveError(f"the budget of {budget:g} s was spent before a branch was found", status="budget")
    if not found.branches:
        raise SolveError(
            f"no periodic orbit was found over {parameter} = {low!r} ... {high!r}: the sweeps show none up to period "
            f"{max_period}, or Newton's method converged to none of them. Give another start, range or transient",
            status="not_periodic",
        )
    return _dataset(system, found, swept, asked, complete)


def _swept(system: System, name: str, values: FloatArray, start: Any, transient: int, most: int) -> xr.Dataset:
    from nonsmooth.diagrams.sweep import sweep

    at = system.with_parameters({name: float(values[0])})
    return sweep(
        at, name, values, direction="both", start=start, transient=transient, keep=2 * most, max_period=most,
        progress=False,
    )  # fmt: skip


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


def _spent(search: Search) -> bool:
    """Return whether the budget is spent."""
    try:
        search.look()
    except SolveError:
        return True
    return False


def _switched(found: _Found, at: int, depth: int, most: int, search: Search, more: dict[str, Any]) -> bool:
    """Follow the branches that leave those from ``at`` on; False where the budget ends it."""
    while at < len(found.branches):
        branch = found.branches[at]
        table = special_points(branch)
        for i in range(table.sizes["special"] if found.levels[at] < depth else 0):
            row = table.isel(special=i)
            place = int(row["point"])
            if str(row["kind"].values) not in SWITCHES or (place in (0, branch.sizes["point"] - 1)):
                continue
            doubles = str(row["kind"].values) == "flip"
            if found.left(at, row) or (doubles and 2 * int(row["period_number"]) > most):
                continue
            if _spent(search):
                return False
            try:
                other = continue_orbit(row, **more)
            except SolveError:
                continue
            found.add(other, at, found.levels[at] + 1)
        at += 1
    return True


def returns_of(branch: xr.Dataset) -> FloatArray:
    """All section points (point, period number, state) of a branch's orbits, from their unknowns."""
    system, record = read_branch(branch)
    p, n = max(record.period_number, 1), len(system.states)
    found = np.empty((len(record.points), p, n))
    shootings: dict[Any, Shooting] = {}
    for i, point in enumerate(record.points):
        found[i] = point.section
        if p == 1:
            continue
        if point.signature not in shootings:
            shootings[point.signature] = Shooting(system, point.signature, p, (record.parameter,))
        shooting = shootings[point.signature]
        times, states = shooting.split(point.X)
        values = shooting.parameters(point.X)
        at = np.arange(1, p) * (point.period / p)
        begins = np.concatenate([[0.0], times])
        # The visit behind a transition that lies on the section itself.
        visit = np.searchsorted(begins, at + 1e-12 * point.period, side="right") - 1
        there = shooting.flow.segments(values, shooting.modes[visit], begins[visit], at - begins[visit], states[visit])
        found[i, 1:] = there.z[:, :n]
    return found


def _dataset(system: System, found: _Found, swept: xr.Dataset, options: dict[str, Any], complete: bool) -> xr.Dataset:
    from nonsmooth.results.branches import diagram
    from nonsmooth.results.labels import labels_of
    from nonsmooth.results.provenance import provenance

    labels, returns = labels_of(system), [points for _, points in found.lines]
    attrs = dict(provenance(labels, "bifurcation_diagram", options, method="multiple shooting"))
    return diagram(labels, attrs, found.name, found.branches, returns, found.parents, swept, complete)
