"""The picture of a sweep: section points over the parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.branch import draw_branch
from nonsmooth.plot.labels import column, first_states, name_plane, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["bifurcation", "sorted_out"]

_LINES = ("section", "third", "fourth")
_COLORS = {"up": "first", "down": "second", "none": "section"}
_SEAM = 2.0  # a rising point over a falling one, which lies on it: both show


def bifurcation(
    result: xr.Dataset,
    *over: xr.Dataset | Axes | None,
    ax: Axes | None = None,
    y: str | None = None,
    size: float = 0.8,
    color: str | None = None,
) -> Axes:
    """Draw the section points of a ``sweep`` over its parameter, up and down in two colours, and branches over them.

    Parameters
    ----------
    result
        A ``sweep`` (or ``frequency_response``); of one swept both ways, the falling one lies on the rising one, whose
        points are larger and show round its own.
    *over
        Branches of ``continue_orbit`` over the same parameter: stable parts as a pale seam under the points, unstable
        ones dashed, special points marked. Axes to draw on may stand here too, as in the other plots.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    size
        Diameter of a point in typographic points; of a rising sweep under a falling one, half of it.
    color
        One colour for all points instead of one per direction.

    Notes
    -----
    The points are pixels in a vector figure: a diagram holds 10^5 of them. A point that diverged has none.
    """
    if "section" not in result and "density" in result:
        raise ValueError("this sweep counted its section points (density=...): draw it with plot.density")
    variable_along(result, "section", "sweep")
    (name,) = first_states(result, y)
    parameter = str(result["maximum"].dims[0])
    ax, branches = sorted_out(over, ax, parameter)
    points = column(result, "section", name)
    directions = [str(word) for word in np.atleast_1d(result["direction"].values)]
    with style.axes(ax) as drawn:
        for i, direction in enumerate(directions):
            mine = points.isel(direction=i) if "direction" in points.dims else points
            cloud = mine.transpose(..., parameter).values
            values = np.broadcast_to(result[parameter].values, cloud.shape)
            under = direction == "up" and "down" in directions
            style.cloud(
                drawn, (values, cloud), size * (_SEAM if under else 1.0),
                color or style.COLORS["pale" if under else _COLORS[direction]],
                direction if len(directions) > 1 else None,
            )  # fmt: skip
        for k, one in enumerate(branches):
            draw_branch(drawn, one, y=name, color=style.COLORS[_LINES[k % len(_LINES)]], behind=True)
        # The whole sweep shows, its ends too where every point diverged.
        drawn.dataLim.update_from_data_x(result[parameter].values, ignore=False)
        drawn.margins(x=0)
        name_plane(drawn, result, parameter, name)
        if len(directions) > 1 or branches:
            style.even_dots(style.clear_legend(drawn))
    return drawn


def sorted_out(
    over: tuple[xr.Dataset | Axes | None, ...], ax: Axes | None, parameter: str
) -> tuple[Axes | None, list[xr.Dataset]]:
    """Axes given in place of a branch, and the branches, which must be over the same parameter."""
    import xarray as xr

    branches: list[xr.Dataset] = []
    for one in over:
        if one is None:
            continue
        if not isinstance(one, xr.Dataset):
            ax = one
            continue
        of = one.attrs.get("parameter")
        if of != parameter:
            raise ValueError(f"the diagram is over {parameter!r}, this branch over {of!r}: they share no axis")
        branches.append(one)
    return ax, branches
