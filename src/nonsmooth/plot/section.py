"""Section points in the plane of two states: the attractor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nonsmooth.plot import style
from nonsmooth.plot.labels import column, first_states, name_plane, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["section"]


def section(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    size: float = 0.8,
    color: str | None = None,
) -> Axes:
    """Draw the section points of a ``poincare`` result (or of a ``sweep``, all its points together).

    ``size`` is the diameter of a point in typographic points. Clouds are pixels in a vector figure.
    """
    variable_along(result, "section", "poincare or sweep")
    names = first_states(result, x, y)
    with style.axes(ax, ratio=0.85) as drawn:
        points = (column(result, "section", name).values for name in names)
        style.cloud(drawn, points, size, color or style.COLORS["section"])
        name_plane(drawn, result, *names)
    return drawn
