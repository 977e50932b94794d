"""The picture of a sweep: section points over the parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import column, first_states, label, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["bifurcation"]

_COLORS = {"up": "first", "down": "second", "none": "section"}


def bifurcation(
    result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, size: float = 0.8, color: str | None = None
) -> Axes:
    """Draw the section points of a ``sweep`` over its parameter, up and down in two colours.

    Parameters
    ----------
    result
        A ``sweep`` (or ``frequency_response``); of one swept both ways, the falling one is drawn on top.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    size
        Diameter of a point in typographic points.
    color
        One colour for all points instead of one per direction.

    Notes
    -----
    The points are pixels in a vector figure: a diagram holds 10^5 of them. A point that diverged has none.
    """
    variable_along(result, "section", "sweep")
    (name,) = first_states(result, y)
    parameter = str(result["maximum"].dims[0])
    points = column(result, "section", name)
    directions = [str(word) for word in np.atleast_1d(result["direction"].values)]
    with style.axes(ax) as drawn:
        for i, direction in enumerate(directions):
            cloud = points.isel(direction=i) if "direction" in points.dims else points
            values = np.broadcast_to(result[parameter].values, cloud.transpose(..., parameter).shape)
            drawn.plot(
                values.ravel(), cloud.transpose(..., parameter).values.ravel(), ".", rasterized=True,
                markersize=size, markeredgewidth=0, color=color or style.COLORS[_COLORS[direction]],
                label=direction if len(directions) > 1 else None,
            )  # fmt: skip
        if len(directions) > 1:
            drawn.legend(markerscale=6 / max(size, 0.1), loc="best")
        # The whole sweep shows, its ends too where every point diverged.
        drawn.dataLim.update_from_data_x(result[parameter].values, ignore=False)
        drawn.margins(x=0)
        drawn.set(xlabel=label(result, parameter), ylabel=label(result, name))
    return drawn
