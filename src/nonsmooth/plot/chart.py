"""The picture of a chart: period numbers, or another quantity, over a plane of two parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.cells import cell_edges
from nonsmooth.plot.labels import name_and_unit, name_axes, only_states, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["chart"]

_NOT_PERIODIC = "not_periodic"


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
        name_axes(drawn, name_and_unit(result, first), name_and_unit(result, second))
    return drawn


def _periods(result: xr.Dataset, drawn: Axes, first: str, second: str) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    flags = result["status"].attrs
    words = dict(zip(flags["flag_values"], flags["flag_meanings"].split(), strict=True))
    period = result["period_number"].transpose(second, first).values
    status = result["status"].transpose(second, first).values
    classes: list[tuple[str, str, Any]] = [
        (str(p), color, period == p) for p, color in enumerate(palette.PERIODS, start=1)
    ]
    classes.append((f"above {len(palette.PERIODS)}", palette.LONGER, period > len(palette.PERIODS)))
    names = np.array([words.get(code, "") for code in range(int(max(words)) + 1)])[np.clip(status, 0, None)]
    classes.append(("none", palette.NO_PERIOD, (period == 0) & (names == _NOT_PERIODIC)))
    classes.append(("not settled", palette.UNKNOWN, (period == 0) & (names != _NOT_PERIODIC)))
    there = [item for item in classes if item[2].any()]
    number = np.zeros(period.shape, dtype=int)
    for k, (_, _, mask) in enumerate(there):
        number[mask] = k
    drawn.pcolormesh(
        cell_edges(result[first].values), cell_edges(result[second].values), number, shading="flat", rasterized=True,
        cmap=ListedColormap([color for _, color, _ in there]), vmin=-0.5, vmax=len(there) - 0.5,
    )  # fmt: skip
    patches = [Patch(facecolor=color, edgecolor="black", linewidth=0.4, label=text) for text, color, _ in there]
    drawn.legend(
        handles=patches, title="period", loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0,
        handlelength=1.0, handleheight=1.0,
    )  # fmt: skip


def _numbers(values: xr.DataArray, drawn: Axes, first: str, second: str, show: str) -> None:
    table = values.transpose(second, first).values.astype(float)
    options: dict[str, Any] = {"cmap": "cividis"}
    if show == "lyapunov":
        # beyond the 98th percentile a few periodic points of strong contraction would take all the colours
        finite = np.abs(table[np.isfinite(table)])
        limit = float(np.percentile(finite, 98)) if len(finite) else 1.0
        options = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}
    mesh = drawn.pcolormesh(
        cell_edges(values[first].values),
        cell_edges(values[second].values),
        table,
        shading="flat",
        rasterized=True,
        **options,
    )
    unit = values.attrs.get("units", "1")
    text = values.attrs.get("long_name", show)
    extend = "both" if show == "lyapunov" else "neither"
    name_axes(drawn.figure.colorbar(mesh, ax=drawn, extend=extend).ax, y=(text, unit))
