"""The picture of a sweep made with ``density``: how often the section points fall where, over the parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.cells import cell_edges
from nonsmooth.plot.labels import name_plane, only_states, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["density"]


def density(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, cmap: str = "magma_r") -> Axes:
    """Draw the histograms of a ``sweep(..., density=True)`` over its parameter, in a logarithmic scale of colour.

    Parameters
    ----------
    result
        Of ``sweep`` with ``density``; directions and starts are added up.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    cmap
        A colour map of Matplotlib. Bins without a point are white.

    Raises
    ------
    ValueError
        A sweep without ``density``, a name that is no state.

    Notes
    -----
    The colour is the share of a parameter value's points in one bin, in per cent. A point that failed has none.
    """
    variable_along(result, "density", "sweep(..., density=True)")
    (name,) = only_states(result, y)
    parameter = str(result["density"].dims[0])
    one = result.sortby(parameter).sel(state=name)
    counts = one["density"].sum([dim for dim in ("direction", "start") if dim in one["density"].dims])
    table = counts.transpose("bin", parameter).values.astype(float)
    total = table.sum(axis=0)
    beyond = one["outside"].sum([dim for dim in ("direction", "start") if dim in one["outside"].dims]).values
    total = total + beyond
    share = np.full(table.shape, np.nan)
    np.divide(100.0 * table, total, out=share, where=table > 0)
    from matplotlib.colors import LogNorm

    with style.axes(ax) as drawn:
        there = share[np.isfinite(share)]
        lowest, highest = (float(there.min()), float(there.max())) if len(there) else (1.0, 100.0)
        mesh = drawn.pcolormesh(
            cell_edges(one[parameter].values), one["bin_edge"].values, share, rasterized=True, cmap=cmap,
            norm=LogNorm(lowest, max(highest, 1.01 * lowest)),
        )  # fmt: skip
        drawn.figure.colorbar(mesh, ax=drawn, label="share of the points (%)")
        name_plane(drawn, result, parameter, name)
    return drawn
