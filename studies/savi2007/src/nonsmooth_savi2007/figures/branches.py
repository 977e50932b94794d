"""The periodic orbits behind Figs. 9, 10, 11, 13 and 17, stable and unstable, of the exact flow over each range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from nonsmooth import bifurcation_diagram, special_points
from nonsmooth.plot import one_branch
from nonsmooth_savi2007.figures.figure import Datasets
from nonsmooth_savi2007.flows import EXACT
from nonsmooth_savi2007.printed import FIGURE_9, FIGURE_10, FIGURE_11, FIGURE_13, FIGURE_17

_BUDGET = 600.0  # s of a processor; they take two


class Varied(NamedTuple):
    """Parameters of a figure, the one that it varies with its range, and the ``longest`` period of its branches."""

    parameters: Mapping[str, float]
    parameter: str
    range: tuple[float, float]
    longest: int


VARIED = {
    "fig09": Varied(FIGURE_9, "omega", (3.0, 7.0), 2),
    "fig10": Varied(FIGURE_10, "omega", (2.4, 7.4), 1),
    "fig11": Varied(FIGURE_11, "rho", (0.2, 0.5), 8),
    "fig13": Varied(FIGURE_13, "g", (-0.0015, 0.002), 8),
    "fig17": Varied(FIGURE_17, "omega", (8.4, 10.4), 8),
}


def branches(figure: str) -> Datasets:
    """The branches of a figure, all in one dataset."""
    one = VARIED[figure]
    system = EXACT.system(**one.parameters)
    found = bifurcation_diagram(
        system, one.parameter, one.range, max_period=one.longest, budget=_BUDGET, progress=False
    )
    return {"branches": found}


def branches_of(data: Datasets) -> list[xr.Dataset]:
    """The branches among the datasets of a figure, those of the shortest period first."""
    found, numbers = data["branches"], data["branches"]["period_number"].values
    order = np.argsort(numbers, kind="stable")
    return [one_branch(found, k).assign(period_number=numbers[k]) for k in order]


def rows_of(branch: xr.Dataset) -> xr.Dataset:
    """The special points of a branch itself, as a table: those at its ends belong to the branch that it leaves."""
    at_ends = np.isin(branch["special_point"].values, [0, branch.sizes["point"] - 1])
    return special_points(branch).isel(special=np.flatnonzero(~at_ends))
