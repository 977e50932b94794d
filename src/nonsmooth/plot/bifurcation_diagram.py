"""Branches of a whole bifurcation diagram over the points of its sweeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.branch import draw_branch
from nonsmooth.plot.labels import first_states, name_plane, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["bifurcation_diagram", "one_branch"]


def bifurcation_diagram(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    y: str | None = None,
    special: bool = True,
    size: float = 0.8,
) -> Axes:
    """Draw all section points of every branch, stable parts solid and unstable ones dashed, over those of the sweeps.

    Parameters
    ----------
    result
        A ``bifurcation_diagram``.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    special
        Mark the special points, each kind with its own sign, named in the legend.
    size
        Diameter of a point of the sweeps in typographic points.
    """
    variable_along(result, "swept_section", "bifurcation_diagram")
    (name,) = first_states(result, y)
    parameter = str(result.attrs["parameter"])
    swept = result["swept_section"].sel(state=name).transpose("direction", "sample", "iterate").values
    values = np.broadcast_to(result["swept_value"].values[None, :, None], swept.shape)
    with style.axes(ax) as drawn:
        style.cloud(drawn, (values, swept), size, style.COLORS["pale"], "sweeps")
        for k in range(result.sizes["branch_id"]):
            draw_branch(drawn, one_branch(result, k), y=name, special=special)
        drawn.dataLim.update_from_data_x(result["swept_value"].values, ignore=False)
        drawn.margins(x=0)
        name_plane(drawn, result, parameter, name)
        style.even_dots(style.clear_legend(drawn))
    return drawn


def one_branch(result: xr.Dataset, k: int) -> xr.Dataset:
    """One of the branches, as ``draw_branch`` takes it."""
    points = np.flatnonzero(result["branch"].values == k)
    marks = np.flatnonzero(result["special_branch"].values == k)
    number = max(int(result["period_number"][k]), 1)
    one = result.isel({"point": points, "special": marks, "return": slice(0, number)})
    return one.assign(special_point=one["special_point"] - points[0])
