"""Charts over two parameters and basins over two states as cells with their legends; shares over a parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.errors import shortened
from nonsmooth.plot import style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import Name, columns, in_lines, name_and_unit, name_axes, name_plane, one_of, only_states
from nonsmooth.plot.prefixes import PREFIXES, power_for
from nonsmooth.results.labels import in_words
from nonsmooth.system.kinds import Count, Positive
from nonsmooth.tables.quantities import quantities_of, quantity

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def edges_of(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of the cells around rising values (n,): the middles between them. One value has a cell too."""
    if len(values) == 1:
        half = 0.5 * max(abs(float(values[0])), 1e-3)
        return np.array([values[0] - half, values[0] + half])
    middles = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])


def cells(
    ax: Axes, x: np.ndarray, y: np.ndarray, table: Any, colors: Sequence[str] = (), least: int = 0, **looks: Any
) -> Any:
    """Draw a table (y, x) as cells around rising values; classes, whole numbers from ``least`` on, in ``colors``."""
    if colors:
        from matplotlib.colors import ListedColormap

        looks |= {"cmap": ListedColormap(colors), "vmin": least - 0.5, "vmax": least + len(colors) - 0.5}
    return ax.pcolormesh(edges_of(x), edges_of(y), table, shading="flat", rasterized=True, **looks)


def _box(color: str, words: str = "") -> Any:
    """A class in a legend."""
    from matplotlib.patches import Patch

    return Patch(facecolor=color, edgecolor="black", linewidth=0.4, label=words)


_LONGEST = 46  # characters of a line above the axes or beside them
#: A legend above the axes, in the middle.
_ABOVE: style.Properties = {"loc": "lower center", "columnspacing": 1.0}


@figure("chart", "contacts_per_period", ratio=0.8)
def chart(
    ax: Axes,
    result: xr.Dataset,
    *,
    show: str = "period_number",
    y: Name | None = None,
    start: Count = 0,
    contours: Mapping[str, float | Sequence[float]] | None = None,
    region: str | xr.DataArray | None = None,
) -> None:
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
    if len([dim for dim in result["status"].dims if dim not in ("start", "direction")]) != 2:
        raise ValueError("this result does not span two parameters: it is not the result of chart")
    first, second = (str(dim) for dim in result["status"].dims[:2])

    def sorted_one(of: Any) -> Any:
        """From one start, over rising values: values may come in any order, cells cannot."""
        return one_of(of, "start", start, "start").sortby([first, second])

    one = sorted_one(result)
    x, values_of_y = one[first].values, one[second].values
    if show in ("maximum", "minimum", "amplitude"):
        show = f"{only_states(result, y)[0]}_{show}"
    elif y is not None:
        raise ValueError(f"y = {y!r} goes with show='maximum', 'minimum' or 'amplitude'; show = {show!r} has no state")
    known = quantities_of(one)
    values = quantity(one, show, known)
    lines = {name: (quantity(one, name, known), np.sort(np.atleast_1d(at))) for name, at in (contours or {}).items()}
    inside = held(one, region)
    if show == "period_number":
        classes, entries = classes_of(one.transpose(second, first, ...))
        cells(ax, x, values_of_y, classes, [color for _, color in entries])
        there = [_box(color, words.replace("no period", "none found")) for words, color in legend_of(classes, entries)]
        ax.legend(handles=there, title="period", handlelength=1.0, handleheight=1.0, **style.beside(1.0))
    else:
        table, extend = values.transpose(second, first).values.astype(float), "neither"
        looks: style.Properties = {"cmap": "cividis"}
        if show == "lyapunov":
            # beyond the 98th percentile a few periodic points of strong contraction would take all the colours
            finite = np.abs(table[np.isfinite(table)])
            limit = float(np.percentile(finite, 98)) if len(finite) else 1.0
            looks, extend = {"cmap": "RdBu_r", "vmin": -limit, "vmax": limit}, "both"
        bar = ax.figure.colorbar(cells(ax, x, values_of_y, table, **looks), ax=ax, extend=extend)
        words = in_lines(values.attrs.get("long_name", show), _LONGEST)
        name_axes(bar.ax, y=(words, values.attrs.get("units", "1")))
    for name, (heights, levels) in lines.items():
        _contours(ax, heights.transpose(second, first), levels, name)
    if inside is not None:
        _outlined(ax, sorted_one(inside).transpose(second, first))
    name_plane(ax, result, first, second)


def held(result: xr.Dataset, region: Any) -> Any:
    """A region given as a condition or as what ``region`` gave."""
    from nonsmooth.tables.region import region as region_of

    inside = region_of(result, region) if isinstance(region, str) else region
    if inside is not None and not {*map(str, result["status"].dims)} - {"start", "direction"} <= {
        *getattr(inside, "dims", ())
    }:
        raise ValueError(f"region = {shortened(region)}: give a condition, or what ns.region found in this result")
    return inside


def _contours(ax: Axes, heights: xr.DataArray, levels: Any, name: str) -> None:
    """Lines of equal value, each with its value in the unit that suits it."""
    unit = heights.attrs.get("units", "1")
    y, x = (heights[dim].values for dim in heights.dims)
    if min(heights.shape) < 2:
        raise ValueError(f"contours of {name} take two values and more of each parameter, not {dict(heights.sizes)}")
    found = ax.contour(
        x, y, heights.values.astype(float), levels, colors=style.COLORS["section"], linestyles="--", linewidths=0.8
    )
    found.set_path_effects(style.halo())
    power = power_for(unit, float(np.abs(levels).max()))
    words = {at: f"{at / 10.0**power:g} {PREFIXES[power]}{unit.removesuffix('1')}".strip() for at in found.levels}
    for text in ax.clabel(found, fmt=words, fontsize=style.small(ax), inline_spacing=1):
        text.set_path_effects(style.halo())
    _title(ax, f"dashed: {name}")


def _outlined(ax: Axes, inside: xr.DataArray) -> None:
    """The outline of a region along the edges of its cells, what is outside drawn pale."""
    from matplotlib.collections import LineCollection

    there = inside.values.astype(bool)
    heights, places = (inside[dim].values for dim in inside.dims)
    cells(ax, places, heights, np.ma.masked_where(there, np.zeros(there.shape)), ["white"], alpha=0.6)
    x, y, padded = edges_of(places), edges_of(heights), np.pad(there, 1)
    up = np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])  # vertical edges: row, edge
    across = np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    edges = [[(x[i], y[j]), (x[i], y[j + 1])] for j, i in up] + [[(x[i], y[j]), (x[i + 1], y[j])] for j, i in across]
    ax.add_collection(LineCollection(edges, colors=style.COLORS["section"], linewidths=1.4, capstyle="round"))
    _title(ax, in_lines(f"outlined: {inside.attrs.get('long_name', 'region')}", _LONGEST))


def _title(ax: Axes, words: str) -> None:
    """A line more above the axes, on the left."""
    before = ax.get_title(loc="left")
    ax.set_title(f"{before}\n{words}" if before else words, loc="left", fontsize=style.small(ax))


def classes_of(result: xr.Dataset) -> tuple[Any, list[tuple[str, str]]]:
    """Classes of a chart as numbers, and the words and the colour of each."""
    period, told = result["period_number"].values.astype(int), in_words(result["status"])
    most = max(int(period.max(initial=0)), len(style.PERIODS))
    colors = [*style.PERIODS, *[style.LONGER] * (most - len(style.PERIODS))]
    entries = [(f"period {p}", color) for p, color in enumerate(colors, start=1)]
    unknown = np.where(told == "not_periodic", most, most + 1)
    return np.where(period > 0, period - 1, unknown), [
        *entries,
        ("no period", style.NO_PERIOD),
        ("not settled", style.UNKNOWN),
    ]


def legend_of(classes: Any, entries: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Words and colour of the classes that are there; long periods are one."""
    above = f"above {len(style.PERIODS)}"
    there = (entries[k] for k in np.unique(classes))
    return [
        (above if color == style.LONGER else words.removeprefix("period "), color)
        for color, words in {color: words for words, color in there}.items()
    ]


_MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p")  # one more than colours


@figure("basins", "label", ratio=0.85)
def basins(ax: Axes, result: xr.Dataset, *, size: Positive = 3.6) -> None:
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
    from matplotlib.legend_handler import HandlerTuple
    from matplotlib.lines import Line2D

    first, second = (str(dim) for dim in result["label"].dims)
    labels = result["label"].transpose(second, first).values
    colors = [style.attractor_color(k) for k in range(result.sizes["attractor"])]
    fates = [style.DIVERGED, style.UNKNOWN]
    cells(ax, result[first].values, result[second].values, np.maximum(labels, -2), [*fates, *colors], -2)
    ax.axis(ax.axis())  # the cells fill the axes, whatever lies on them
    handles: list[Any] = []
    names, points = names_of(result), columns(result, "section_points", (first, second))
    for k, color in enumerate(colors):
        here, mark = result["point_attractor"].values == k, section_mark(result, k, size)
        ax.plot(*(column[here] for column in points), linestyle="", **mark)
        mark["markersize"] = max(mark["markersize"], 0.8 * size)
        handles.append((_box(color), Line2D([], [], linestyle="", **mark)))
        names[k] += f": {100 * float(result['fraction'][k]):.3g} %"
    for fate, name in ((-1, "none reached"), (-2, "diverged")):
        if (labels == fate).any():
            handles.append(_box(fates[fate + 2]))
            names.append(name)
    looks: style.Properties = {"title": "basins, with the section points of their attractors" if colors else None}
    looks |= {"handlelength": 1.4, "handleheight": 1.2, "handler_map": {tuple: HandlerTuple(ndivide=1)}}
    ax.legend(handles, names, bbox_to_anchor=(0.5, 1.0), ncols=min(len(handles), 3), **_ABOVE, **looks)
    name_plane(ax, result, first, second)


def names_of(result: xr.Dataset) -> list[str]:
    """Each attractor by its kind; of several of one kind (a), (b), ..."""
    return told_apart([str(name) for name in result["name"].values])


def told_apart(names: list[str]) -> list[str]:
    """The names, with (a), (b), ... behind those that are there more than once."""
    letters = {name: iter("abcdefghijklmnopqrstuvwxyz") for name in names}
    return [f"{name} ({next(letters[name], '...')})" if names.count(name) > 1 else name for name in names]


def section_mark(result: xr.Dataset, k: int, size: float) -> style.Properties:
    """Looks of an attractor's section points: a mark of its own, white with a black edge; small dots of a cloud."""
    black: style.Properties = {"marker": "o", "color": style.COLORS["section"], "markeredgewidth": 0, "zorder": 4}
    if int(result["period_number"][k]) > 0:
        own = {"marker": _MARKS[k % len(_MARKS)], "markersize": size, "markerfacecolor": "white"}
        return black | own | {"markeredgewidth": 0.7, "zorder": 5}
    return black | {"markersize": 0.3 * size, "rasterized": True}


_LARGEST = 7.0  # diameter in points of an attractor that all starts reach


@figure("basin_fractions", "n_starts_99", ratio=0.85)
def basin_fractions(ax: Axes, result: xr.Dataset, *, y: Name | None = None) -> None:
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
    parameter = str(result["n_starts_99"].dims[0])
    if y is not None:
        only_states(result, y)
    result = result.sortby(parameter)
    values, fraction = result[parameter].values, result["fraction"].values
    names = told_apart([_along(result, k) for k in range(result.sizes["attractor"])])
    colors = [style.attractor_color(k) for k in range(len(names))]
    edge: style.Properties = {"edgecolor": "black", "linewidth": 0.3}
    ax.margins(x=0)
    if y is None:
        shares = [*fraction.T, (result["not_converged"] + result["diverged"]).values]
        if shares[-1].any():
            names, colors = [*names, "none reached"], [*colors, style.UNKNOWN]
        ax.stackplot(values, *(100 * one for one in shares[: len(names)]), colors=colors, labels=names, **edge)
        ax.set(ylabel="share of starts (%)", ylim=(0, 100))
        name_axes(ax, name_and_unit(result, parameter))
    else:
        heights = result["maximum"].sel(state=y).values
        for k, (name, color) in enumerate(zip(names, colors, strict=True)):
            ax.plot(values, heights[:, k], ".", color=color, markersize=1.5)
            ax.scatter(values, heights[:, k], s=_LARGEST**2 * fraction[:, k], color=color, **edge)
            ax.scatter([], [], s=25, color=color, label=name, **edge)  # of one size in the legend, whatever the share
        name_plane(ax, result, parameter, y, "max ")
    above = (0.5, 1.0 if y is None else 1.06)  # the power of ten of the ordinate, too
    ax.legend(bbox_to_anchor=above, ncols=2, handlelength=1.0, handleheight=1.0, **_ABOVE)


def _along(result: xr.Dataset, k: int) -> str:
    """Kinds of an attractor along the parameter, each once, in the order met; the periods together."""
    kinds = result["name"].values[result["period_number"].values[:, k] >= 0, k]
    distinct = sorted(dict.fromkeys(map(str, kinds)), key=lambda kind: not kind.startswith("period"))
    return ", ".join(distinct).replace(", period", ",")
