"""The picture of basins: every start in the colour of the attractor it leads to, with the attractors on the section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.cells import cell_edges
from nonsmooth.plot.labels import name_plane, variable_along
from nonsmooth.results.labels import kind_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["basins", "names_of", "section_mark", "told_apart"]

_MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">")


def basins(result: xr.Dataset, ax: Axes | None = None, *, size: float = 3.6) -> Axes:
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
    from matplotlib.legend_handler import HandlerTuple
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
        names = names_of(result)
        states = result["state"].values.tolist()
        for k in range(n):
            patch = Patch(facecolor=palette.attractor_color(k), edgecolor="black", linewidth=0.4)
            points = result["section_points"].values[result["point_attractor"].values == k]
            mark = section_mark(result, k, size)
            drawn.plot(*(points[:, states.index(name)] for name in (first, second)), linestyle="", **mark)
            mark["markersize"] = max(mark["markersize"], 0.8 * size)
            handles.append((patch, Line2D([], [], linestyle="", **mark)))
            names[k] += f": {100 * float(result['fraction'][k]):.3g} %"
        for fate, color, name in ((-1, palette.UNKNOWN, "none reached"), (-2, palette.DIVERGED, "diverged")):
            if (labels == fate).any():
                handles.append(Patch(facecolor=color, edgecolor="black", linewidth=0.4))
                names.append(name)
        drawn.legend(
            handles, names, title="basins, with the section points of their attractors" if n else None,
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(len(handles), 3), handlelength=1.4,
            handleheight=1.2, columnspacing=1.0, handler_map={tuple: HandlerTuple(ndivide=1)},
        )  # fmt: skip
        drawn.set(xlim=xlim, ylim=ylim)
        name_plane(drawn, result, first, second)
    return drawn


def names_of(result: xr.Dataset) -> list[str]:
    """Each attractor by its kind, ``period 3`` or ``chaos``; of several of one kind (a), (b), ..."""
    if "name" in result:
        return told_apart([str(name) for name in result["name"].values])
    pairs = zip(result["period_number"].values, result["chaotic"].values, strict=True)
    return told_apart([kind_of(int(period), bool(chaotic)) for period, chaotic in pairs])


def told_apart(names: list[str]) -> list[str]:
    """The names, with (a), (b), ... behind those that are there more than once."""
    letters = {name: iter("abcdefghijklmnopqrstuvwxyz") for name in names}
    return [f"{name} ({next(letters[name], '...')})" if names.count(name) > 1 else name for name in names]


def section_mark(result: xr.Dataset, k: int, size: float) -> dict[str, Any]:
    """Looks of an attractor's section points: a mark of its own, white with a black edge; small dots of a cloud."""
    if int(result["period_number"][k]) > 0:
        return {
            "marker": _MARKS[k % len(_MARKS)], "markersize": size, "markerfacecolor": "white", "zorder": 5,
            "markeredgecolor": style.COLORS["section"], "markeredgewidth": 0.7,
        }  # fmt: skip
    return {
        "marker": "o", "markersize": 0.3 * size, "color": style.COLORS["section"], "markeredgewidth": 0, "zorder": 4,
        "rasterized": True,
    }  # fmt: skip
