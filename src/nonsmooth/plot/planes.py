"""Cells of a plane: charts over two parameters and basins over two states; shares of starts over a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.labels import in_words, name_and_unit, name_axes, name_plane, only_states, variable_along
from nonsmooth.results.labels import kind_of
from nonsmooth.tables.quantities import quantities_of, quantity

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr
    from matplotlib.axes import Axes

__all__ = [
    "basin_fractions", "basins", "cell_edges", "chart", "classes_of", "held", "legend_of", "names_of", "section_mark",
    "told_apart",
]  # fmt: skip


def cell_edges(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of the cells around rising values (n,): the middles between them. One value has a cell too."""
    if len(values) == 1:
        half = 0.5 * max(abs(float(values[0])), 1e-3)
        return np.array([values[0] - half, values[0] + half])
    middles = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])


def chart(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    show: str = "period_number",
    y: str | None = None,
    start: int = 0,
    contours: Mapping[str, Any] | None = None,
    region: str | xr.DataArray | None = None,
) -> Axes:
    """Draw a ``chart``: each point of the plane in the colour of its period number, or of another quantity.

    Parameters
    ----------
    result
        Of ``chart``.
    ax
        Where to draw; a new figure of one column if None. The legend, or the colour bar, takes its room from it.
    show
        ``"period_number"``; or any quantity of the result: ``"lyapunov"`` (colours diverge from zero),
        ``"contacts_per_period"``, ``"n_attractors"``, ``"x_amplitude"``, ``"stop_impact_speed_maximum"``, ...
    y
        The state, for ``"maximum"``, ``"minimum"`` and ``"amplitude"``; by default the first.
    start
        Which start, where there are several.
    contours
        Lines of equal value: quantities and their values in the units of the result, ``{"x_amplitude": [1e-3, 2e-3]}``
    region
        A condition, or what :func:`nonsmooth.region` gave: it is outlined, and what lies outside is drawn pale.

    Raises
    ------
    ValueError
        A result of another verb, or without the quantity.
    """
    variable_along(result, "contacts_per_period", "chart")
    if len([dim for dim in result["status"].dims if dim not in ("start", "direction")]) != 2:
        raise ValueError("this result does not span two parameters: it is not the result of chart")
    first, second = (str(dim) for dim in result["status"].dims[:2])
    one = result.isel(start=start) if "start" in result["status"].dims else result
    one = one.sortby([first, second])  # values may come in any order, cells cannot
    if show in ("maximum", "minimum", "amplitude"):
        show = f"{only_states(result, y)[0]}_{show}"
    known = quantities_of(one)
    values = quantity(one, show, known)
    lines = {name: (quantity(one, name, known), np.sort(np.atleast_1d(at))) for name, at in (contours or {}).items()}
    inside = held(one, region)
    with style.axes(ax, ratio=0.8) as drawn:
        if show == "period_number":
            _periods(one, drawn, first, second)
        else:
            _numbers(values, drawn, first, second, show)
        for name, (heights, levels) in lines.items():
            _contours(heights, levels, drawn, first, second, name)
        if inside is not None:
            inside = inside.isel(start=start) if "start" in inside.dims else inside
            _outlined(inside.sortby([first, second]), drawn, first, second)
        name_plane(drawn, result, first, second)
    return drawn


def held(result: xr.Dataset, region: Any) -> Any:
    """A region given as a condition or as what ``region`` gave."""
    if not isinstance(region, str):
        return region
    from nonsmooth.tables.region import region as region_of

    return region_of(result, region)


def _contours(values: xr.DataArray, levels: Any, drawn: Axes, first: str, second: str, name: str) -> None:
    """Lines of equal value, each with its value in the unit that suits it."""
    from nonsmooth.plot.units import PREFIXES, power_for

    table, unit = values.transpose(second, first).values.astype(float), str(values.attrs.get("units", "1"))
    at = (values[first].values, values[second].values)
    found = drawn.contour(*at, table, levels, colors=style.COLORS["section"], linestyles="--", linewidths=0.8)
    found.set_path_effects(style.halo())
    power = power_for(unit, float(np.abs(levels).max()))
    words = {at: f"{at / 10.0**power:g} {PREFIXES[power]}{unit.removesuffix('1')}".strip() for at in found.levels}
    for text in drawn.clabel(found, fmt=words, fontsize=style.small(drawn), inline_spacing=1):
        text.set_path_effects(style.halo())
    _title(drawn, f"dashed: {name}")


def _outlined(inside: xr.DataArray, drawn: Axes, first: str, second: str) -> None:
    """The outline of a region along the edges of its cells, what is outside drawn pale."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap

    there = inside.transpose(second, first).values.astype(bool)
    x, y = (cell_edges(inside[name].values) for name in (first, second))
    pale = np.ma.masked_where(there, np.zeros(there.shape))
    drawn.pcolormesh(x, y, pale, shading="flat", cmap=ListedColormap(["white"]), alpha=0.6, rasterized=True)
    padded = np.pad(there, 1)
    up = np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])  # vertical edges: row, edge
    across = np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    edges = [[(x[i], y[j]), (x[i], y[j + 1])] for j, i in up] + [[(x[i], y[j]), (x[i + 1], y[j])] for j, i in across]
    drawn.add_collection(LineCollection(edges, colors=style.COLORS["section"], linewidths=1.4, capstyle="round"))
    _title(drawn, f"outlined: {inside.attrs.get('long_name', 'region')}")


def _title(drawn: Axes, words: str) -> None:
    """A line more above the axes, on the left."""
    before = drawn.get_title(loc="left")
    drawn.set_title(f"{before}\n{words}" if before else words, loc="left", fontsize=style.small(drawn))


def classes_of(result: xr.Dataset) -> tuple[Any, list[tuple[str, str]]]:
    """Classes of a chart as numbers, and the words and the colour of each."""
    period, told = result["period_number"].values.astype(int), in_words(result["status"])
    most = max(int(period.max(initial=0)), len(palette.PERIODS))
    colors = [*palette.PERIODS, *[palette.LONGER] * (most - len(palette.PERIODS))]
    entries = [(f"period {p}", color) for p, color in enumerate(colors, start=1)]
    unknown = np.where(told == "not_periodic", most, most + 1)
    return np.where(period > 0, period - 1, unknown), [
        *entries,
        ("no period", palette.NO_PERIOD),
        ("not settled", palette.UNKNOWN),
    ]


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
    shown = {words.replace("no period", "none found"): color for words, color in legend_of(classes, entries)}
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
    named = str(values.attrs.get("long_name", show)), str(values.attrs.get("units", "1"))
    name_axes(drawn.figure.colorbar(mesh, ax=drawn, extend=extend).ax, y=named)


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


_LARGEST = 7.0  # diameter in points of an attractor that all starts reach


def basin_fractions(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None) -> Axes:
    """Draw the result of ``basin_fractions``.

    Parameters
    ----------
    result
        Of ``basin_fractions``.
    ax
        Where to draw; a new one-column figure if None.
    y
        A state: its maximum on each attractor is drawn, with the area of a point in proportion to the share. By
        default the shares themselves, one upon the other.

    Raises
    ------
    ValueError
        A result of another verb, a name that is no state.
    """
    variable_along(result, "n_starts_99", "basin_fractions")
    parameter = str(result["n_starts_99"].dims[0])
    if y is not None:
        only_states(result, y)
    result = result.sortby(parameter)
    with style.axes(ax, ratio=0.85) as drawn:
        values = result[parameter].values
        if y is None:
            _shares(result, drawn, values)
            drawn.set(ylabel="share of starts (%)", ylim=(0, 100))
        else:
            _maxima(result, drawn, values, y)
        drawn.margins(x=0)
        if y is None:
            name_axes(drawn, name_and_unit(result, parameter))
        else:
            name_plane(drawn, result, parameter, y, "max ")
        drawn.legend(  # above the axes, and above the power of ten of the ordinate
            loc="lower center", bbox_to_anchor=(0.5, 1.0 if y is None else 1.06), ncols=2, handlelength=1.0,
            handleheight=1.0, columnspacing=1.0,
        )  # fmt: skip
    return drawn


def _names(result: xr.Dataset, k: int) -> str:
    """Kinds of an attractor along the parameter, each once, in the order met."""
    there = np.flatnonzero(result["period_number"].values[:, k] >= 0)
    if "name" in result:
        kinds = [str(result["name"].values[i, k]) for i in there]
    else:
        periods, chaotic = (result[key].values[:, k] for key in ("period_number", "chaotic"))
        kinds = [kind_of(int(periods[i]), bool(chaotic[i])) for i in there]
    distinct = list(dict.fromkeys(kinds))
    numbers = [kind.removeprefix("period ") for kind in distinct if kind.startswith("period")]
    words = [f"period {', '.join(numbers)}"] if numbers else []
    return ", ".join(words + [kind for kind in distinct if not kind.startswith("period")])


def _all_names(result: xr.Dataset) -> list[str]:
    return told_apart([_names(result, k) for k in range(result.sizes["attractor"])])


def _shares(result: xr.Dataset, drawn: Axes, values: np.ndarray) -> None:
    shares = [100 * result["fraction"].values[:, k] for k in range(result.sizes["attractor"])]
    shares.append(100 * (result["not_converged"] + result["diverged"]).values)
    colors = [palette.attractor_color(k) for k in range(len(shares) - 1)] + [palette.UNKNOWN]
    names = [*_all_names(result), "none reached"]
    if not shares[-1].any():
        shares, colors, names = shares[:-1], colors[:-1], names[:-1]
    drawn.stackplot(values, *shares, colors=colors, labels=names, edgecolor="black", linewidth=0.3)


def _maxima(result: xr.Dataset, drawn: Axes, values: np.ndarray, y: str) -> None:
    for k, name in enumerate(_all_names(result)):
        heights = result["maximum"].sel(state=y).values[:, k]
        share = result["fraction"].values[:, k]
        good = np.isfinite(heights)
        drawn.plot(values[good], heights[good], ".", color=palette.attractor_color(k), markersize=1.5)
        drawn.scatter(
            values[good], heights[good], s=_LARGEST**2 * share[good], color=palette.attractor_color(k),
            edgecolors="black", linewidths=0.3,
        )  # fmt: skip
        drawn.scatter(  # of one size in the legend, whatever the share
            [], [], s=25, color=palette.attractor_color(k), edgecolors="black", linewidths=0.3, label=name
        )
