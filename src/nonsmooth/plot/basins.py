"""The picture of basins: every start in the colour of the attractor it leads to, with the attractors on the section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.cells import cell_edges
from nonsmooth.plot.labels import name_and_unit, name_axes, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["basins", "kind_of"]


def basins(result: xr.Dataset, ax: Axes | None = None, *, size: float = 3.0) -> Axes:
    """Draw the result of ``basins``.

    Parameters
    ----------
    result
        Of ``basins``.
    ax
        Where to draw; a new one-column figure if None.
    size
        Diameter of an attractor's points in typographic points; those of one that is no cycle are drawn smaller.

    Raises
    ------
    ValueError
        A result of another verb.
    """
    variable_along(result, "label", "basins")
    from matplotlib.colors import ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    first, second = (str(dim) for dim in result["label"].dims)
    labels = result["label"].transpose(second, first).values
    n = result.sizes["attractor"]
    x, y = result[first].values, result[second].values
    with style.axes(ax, ratio=0.85) as drawn:
        drawn.pcolormesh(
            cell_edges(x), cell_edges(y), np.maximum(labels, -2), shading="flat", rasterized=True,
            vmin=-2.5, vmax=n - 0.5,
            cmap=ListedColormap([palette.DIVERGED, palette.UNKNOWN, *(palette.attractor_color(k) for k in range(n))]),
        )  # fmt: skip
        xlim, ylim = drawn.get_xlim(), drawn.get_ylim()
        handles: list[Any] = []
        for k in range(n):
            points = result["section_points"].values[result["point_attractor"].values == k]
            states = result["state"].values.tolist()
            cycle = int(result["period_number"][k]) > 0
            drawn.plot(
                points[:, states.index(first)], points[:, states.index(second)], "o", linestyle="",
                color="black", markersize=size if cycle else 0.3 * size, markeredgewidth=0.5 if cycle else 0,
                markeredgecolor="white", rasterized=not cycle,
            )  # fmt: skip
            share = 100 * float(result["fraction"][k])
            handles.append(Patch(
                facecolor=palette.attractor_color(k), edgecolor="black", linewidth=0.4,
                label=f"{kind_of(int(result['period_number'][k]), bool(result['chaotic'][k]))}: {share:.3g} %",
            ))  # fmt: skip
        for fate, color, name in ((-1, palette.UNKNOWN, "none reached"), (-2, palette.DIVERGED, "diverged")):
            if (labels == fate).any():
                handles.append(Patch(facecolor=color, edgecolor="black", linewidth=0.4, label=name))
        if n:
            handles.append(Line2D([], [], marker="o", color="black", linestyle="", markersize=size, label="attractor"))
        drawn.legend(
            handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(len(handles), 3),
            handlelength=1.0, handleheight=1.0, columnspacing=1.0,
        )  # fmt: skip
        drawn.set(xlim=xlim, ylim=ylim)
        name_axes(drawn, name_and_unit(result, first), name_and_unit(result, second))
    return drawn


def kind_of(period: int, chaotic: bool) -> str:
    """An attractor in a word or two."""
    if period > 0:
        return f"period {period}"
    return "chaos" if chaotic else "no period"
