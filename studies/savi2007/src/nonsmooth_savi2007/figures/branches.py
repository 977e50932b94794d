"""The periodic orbits behind Figs. 9, 10, 11, 13 and 17, stable and unstable, each figure's from one orbit.

The exact flow is followed over the figure's range. At the flips of the period-1 branch the branches of twice the period
are switched to; from the first flip on the cascade is followed further, flip by flip.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from nonsmooth import SolveError, System, continue_orbit, find_orbit, poincare, special_points
from nonsmooth_savi2007.figures.figure import Datasets
from nonsmooth_savi2007.flows import EXACT
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, FIGURE_11, FIGURE_13, FIGURE_17

_CLOSED = 1e-6  # of the orbit's size
_SAME = 1e-8  # of the value of a flip


class Beginning(NamedTuple):
    """Beginning of a figure's branches: a stable period-1 orbit at ``at``; ``longest``: the last period number."""

    parameters: Mapping[str, float]
    parameter: str
    range: tuple[float, float]
    at: float
    longest: int


BEGINNINGS = {
    "fig09": Beginning(FIGURE_9, "omega", (3.0, 7.0), 4.5, 2),
    "fig10": Beginning(FIGURE_10, "omega", (2.4, 7.4), 4.5, 1),
    "fig11": Beginning(FIGURE_11, "rho", (0.2, 0.5), 0.45, 8),
    "fig13": Beginning(FIGURE_13, "g", (-0.0015, 0.002), -0.0012, 8),
    "fig17": Beginning(FIGURE_17, "omega", (8.4, 10.4), 8.5, 8),
}


def branches(figure: str) -> Datasets:
    """The branches of a figure by key: ``branch`` (period 1), ``branch_2`` (period 2), ...; of several ``branch_2b``.

    Each has, beside what :func:`nonsmooth.continue_orbit` gives, ``returns(point, iterate, state)``: all section points
    of its orbits.
    """
    begin = BEGINNINGS[figure]
    system = EXACT.system(**begin.parameters)
    orbit = find_orbit(system.with_parameters({begin.parameter: begin.at}), progress=False)
    first = continue_orbit(orbit, begin.parameter, begin.range)
    found = {"branch": first}
    if begin.longest > 1:
        for i, flip in enumerate(_flips(first)):
            _follow(found, flip, begin, 2, cascade=i == 0)
    return {key: with_returns(system, one) for key, one in found.items()}


def _follow(found: Datasets, flip: xr.Dataset, begin: Beginning, period: int, cascade: bool) -> None:
    """The branch of twice the period at a flip, unless another one arrives there; its own first flip in a cascade."""
    value = float(flip[begin.parameter])
    same = [key for key in found if key.startswith(f"branch_{period}")]
    known = [at for key in same for at in found[key][begin.parameter].values[[0, -1]]]
    if any(abs(value - at) < _SAME * abs(value) for at in known):
        return
    doubled = continue_orbit(flip)
    found[f"branch_{period}" + ("bcdef"[len(same) - 1] if same else "")] = doubled
    if cascade and 2 * period <= begin.longest:
        for further in _flips(doubled)[:1]:
            _follow(found, further, begin, 2 * period, cascade)


def _flips(branch: xr.Dataset) -> list[xr.Dataset]:
    """The flips of a branch but for those at its ends, where it leaves another one."""
    table = rows_of(branch)
    return [table.isel(special=i) for i in np.flatnonzero(table["kind"].values == "flip")]


def rows_of(branch: xr.Dataset) -> xr.Dataset:
    """The special points of a branch itself, as a table: those at its ends belong to the branch that it leaves."""
    at_ends = np.isin(branch["special_point"].values, [0, branch.sizes["point"] - 1])
    return special_points(branch).isel(special=np.flatnonzero(~at_ends))


def branches_of(data: Datasets) -> list[xr.Dataset]:
    """The branches among the datasets of a figure, those of the shortest period first."""
    found = [one for key, one in data.items() if key.startswith("branch")]
    return sorted(found, key=lambda one: int(one["period_number"]))


def with_returns(system: System, branch: xr.Dataset) -> xr.Dataset:
    """The branch with all section points of its orbits, from their first by the exact flow; NaN where it diverges."""
    n, parameter = int(branch["period_number"]), str(branch.attrs["parameter"])
    section = branch["section"].transpose("point", "state").values
    returns = np.repeat(section[:, None, :], n, axis=1)
    size = np.ptp(section, axis=0).max(initial=0.0) + np.abs(section).max(axis=0)
    for i in range(len(section) if n > 1 else 0):
        one = system.with_parameters({parameter: float(branch[parameter][i])})
        try:
            points = poincare(one, n=n, start=section[i], **EXACT.options)["section"]
            after = points.transpose("iterate", "state").values
        except SolveError:
            after = np.full((n, section.shape[1]), np.nan)
        closed = (np.abs(after[-1] - section[i]) <= _CLOSED * size).all()
        returns[i, 1:] = after[:-1] if closed else np.nan
    return branch.assign(
        returns=(("point", "iterate", "state"), returns, {"long_name": "states at the section, all of the orbit"})
    )
