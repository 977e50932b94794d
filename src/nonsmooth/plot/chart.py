"""The picture of a chart: period numbers, or another quantity, over a plane of two parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.cells import cell_edges
from nonsmooth.plot.labels import in_words, name_axes, name_plane, only_states, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["chart", "classes_of", "legend_of"]


def chart(
    result: xr.Dataset, ax: Axes | None = None, *, show: str = "period_number", y: str | None = None, start: int = 0
) -> Axes:
    """Draw a ``chart``: each point of the plane in the colour of its period number.

    Parameters
    ----------
    result
        Of ``chart``.
    ax
        Where to draw; a new figure of one column if None. The legend, or the colour bar, takes its room from it.
    show
        ``"period_number"``; or any variable of the result: ``"lyapunov"`` (colours diverge from zero),
        ``"contacts_per_period"``, ``"n_attractors"``, ``"confidence"``, ``"maximum"``, ...
    y
        The state, for ``"maximum"`` and ``"minimum"``; by default the first.
    start
        Which start, where there are several.

    Raises
    ------
    ValueError
        A result of another verb, or without the variable.
    """
    variable_along(result, "contacts_per_period", "chart")
    if len([dim for dim in result["status"].dims if dim not in ("start", "direction")]) != 2:
        raise ValueError("this result does not span two parameters: it is not the result of chart")
    variable_along(result, show, "chart")
    first, second = (str(dim) for dim in result["status"].dims[:2])
    one = result.isel(start=start) if "start" in result["status"].dims else result
    one = one.sortby([first, second])  # values may come in any order, cells cannot
    with style.axes(ax, ratio=0.8) as drawn:
        if show == "period_number":
            _periods(one, drawn, first, second)
        else:
            values = one[show]
            if "state" in values.dims:
                (name,) = only_states(result, y)
                values = values.sel(state=name)
            _numbers(values, drawn, first, second, show)
        name_plane(drawn, result, first, second)
    return drawn


def classes_of(result: xr.Dataset) -> tuple[Any, list[tuple[str, str]]]:
    """Classes of a chart as numbers, and the words and the colour of each."""
    period, told = result["period_number"].values.astype(int), in_words(result["status"])
    most = max(int(period.max(initial=0)), len(palette.PERIODS))
    colors = [*palette.PERIODS, *[palette.LONGER] * (most - len(palette.PERIODS))]
    entries = [(f"period {p}", color) for p, color in enumerate(colors, start=1)]
    unknown = np.where(told == "not_periodic", most, most + 1)
    return np.where(period > 0, period - 1, unknown), [
        *entries, ("no period", palette.NO_PERIOD), ("not settled", palette.UNKNOWN)
    ]  # fmt: skip


def legend_of(classes: Any, entries: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Words and colour of the classes that are there; long periods are one."""
    above = f"above {len(palette.PERIODS)}"
    there = (entries[k] for k in np.unique(classes))
    return [
        (above if color == palette.LONGER else words.removeprefix("period "), color)
        for color, words in {color: words for words, color in there}.items()
    ]


def _periods(result: xr.Dataset, drawn: Axes, first: str, second: str) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    classes, entries = classes_of(result.transpose(second, first, ...))
    drawn.pcolormesh(
        cell_edges(result[first].values), cell_edges(result[second].values), classes, shading="flat", rasterized=True,
        cmap=ListedColormap([color for _, color in entries]), vmin=-0.5, vmax=len(entries) - 0.5,
    )  # fmt: skip
    looks: dict[str, Any] = {"edgecolor": "black", "linewidth": 0.4}
    shown = {words.replace("no period", "none"): color for words, color in legend_of(classes, entries)}
    drawn.legend(
        handles=[Patch(facecolor=color, label=words, **looks) for words, color in shown.items()], title="period",
        loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, handlelength=1.0, handleheight=1.0,
    )  # fmt: skip


def _numbers(values: xr.DataArray, drawn: Axes, first: str, second: str, show: str) -> None:
    table = values.transpose(second, first).values.astype(float)
    options: dict[str, Any] = {"cmap": "cividis"}
    if show == "lyapunov":
        # beyond the 98th percentile a few periodic points of strong contraction would take all the colours
        finite = np.abs(table[np.isfinite(table)])
        limit = float(np.percentile(finite, 98)) if len(finite) else 1.0
        options = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
    edges = (cell_edges(values[name].values) for name in (first, second))
    mesh = drawn.pcolormesh(*edges, table, shading="flat", rasterized=True, **options)
    extend = "both" if show == "lyapunov" else "neither"
    named = values.attrs.get("long_name", show), values.attrs.get("units", "1")
    name_axes(drawn.figure.colorbar(mesh, ax=drawn, extend=extend).ax, y=named)
