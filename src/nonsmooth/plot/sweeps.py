"""Results over a parameter: section points, densities, amplitudes, with branches over them; effects of smoothing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.plot import bands, style
from nonsmooth.plot.branches import check_axis, draw_branch
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import (
    Name,
    by_direction,
    column,
    first_states,
    in_lines,
    name_and_unit,
    name_axes,
    name_plane,
    only_states,
)
from nonsmooth.plot.planes import edges_of, held
from nonsmooth.system.kinds import Positive, at_least
from nonsmooth.tables.quantities import quantities_of
from nonsmooth.tables.quantities import quantity as quantity_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_LINES = tuple(style.COLORS[name] for name in ("section", "third", "fourth"))
_LONGEST = 30  # characters of a line of a condition in a legend
_SEAM = 2.0  # a rising point over a falling one, which lies on it: both show


@figure("sweep", "direction")
def bifurcation(
    ax: Axes,
    result: xr.Dataset,
    *over: xr.Dataset,
    y: Name | None = None,
    size: Positive = 0.8,
    color: Any = None,
) -> None:
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
        The state of the ordinate; by default the first. Or a quantity of each point, such as ``"x_amplitude"`` or a
        load (``"stop_impact_speed_maximum"``), which :func:`nonsmooth.table` lists.
    size
        Diameter of a point in typographic points; of a rising sweep under a falling one it is twice that, and three
        times of a quantity, which has one point where a state has as many as were kept.
    color
        One colour for all points instead of one per direction.

    Notes
    -----
    The points are pixels in a vector figure: a diagram holds 10^5 of them. A point that diverged has none.
    """
    if "section" not in result and "density" in result:
        raise ValueError("this sweep counted its section points (density=...): draw it with plot.density")
    (name,) = first_states(result, y)
    parameter = str(result["status"].dims[0])
    for branch in over:
        check_axis(branch, parameter)
    if name in result["state"].values:
        points = column(result, "section", name)
    else:
        points = quantity_of(result, name, also=result["state"].values.tolist()).expand_dims("iterate")
        size *= 3.0
    directions = dict(by_direction(result, points))
    for direction, mine in directions.items():
        under = direction == "up" and "down" in directions
        shade = color or (style.COLORS["pale"] if under else LOOKS[direction]["color"])
        cloud = result[parameter].values, mine.transpose(..., parameter).values
        style.cloud(ax, cloud, size * (_SEAM if under else 1.0), shade, direction if len(directions) > 1 else None)
    for k, one in enumerate(over):
        draw_branch(ax, one, y=name, color=style.nth(k, _LINES), behind=True)
    _whole(ax, result[parameter].values)
    _name(ax, result, parameter, name, points)
    if len(directions) > 1 or over:
        style.clear_legend(ax)


def _whole(ax: Axes, values: Any) -> None:
    """Show the whole range of a parameter, its ends too where every point diverged."""
    ax.dataLim.update_from_data_x(values, ignore=False)
    ax.margins(x=0)


def _name(ax: Axes, result: xr.Dataset, parameter: str, name: str, values: xr.DataArray, before: str = "") -> None:
    """Label the axes with a parameter and a state, an output or another quantity."""
    if name in result["state"].values:
        return name_plane(ax, result, parameter, name, before)
    own = before + name_and_unit(result, name)[0]
    return name_axes(ax, name_and_unit(result, parameter), (own, values.attrs.get("units", "1")))


@figure("bifurcation_diagram", "swept_section")
def bifurcation_diagram(
    ax: Axes, result: xr.Dataset, *, y: Name | None = None, special: bool = True, size: Positive = 0.8
) -> None:
    """Draw all section points of every branch, stable parts solid and unstable ones dashed, over those of the sweeps.

    Parameters
    ----------
    result
        A ``bifurcation_diagram``.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    special
        Mark the special points, each kind with its own sign, named in the legend.
    size
        Diameter of a point of the sweeps in typographic points.
    """
    (name,) = first_states(result, y)
    parameter = result.attrs["parameter"]
    swept = result["swept_section"].sel(state=name).transpose(..., "sample").values
    style.cloud(ax, (result["swept_value"].values, swept), size, style.COLORS["pale"], "sweeps")
    for k in range(result.sizes["branch_id"]):
        draw_branch(ax, one_branch(result, k), y=name, special=special)
    _whole(ax, result["swept_value"].values)
    name_plane(ax, result, parameter, name)
    style.clear_legend(ax)


def one_branch(result: xr.Dataset, k: int) -> xr.Dataset:
    """One branch of a bifurcation diagram, as :func:`nonsmooth.plot.branch` draws it and with its special points.

    Parameters
    ----------
    result : Dataset
        Of :func:`nonsmooth.bifurcation_diagram`.
    k : int
        The branch, ``0 <= k < result.sizes["branch_id"]``.

    Returns
    -------
    Dataset
        Its points, its special points, and as many returns as its orbits have periods.

    Examples
    --------
    >>> import nonsmooth as ns
    >>> oscillator = ns.models.impact_oscillator(A=0.1)
    >>> diagram = ns.bifurcation_diagram(oscillator, "omega", (0.4, 0.5), progress=False)
    >>> first = ns.plot.one_branch(diagram, 0)
    >>> first.sizes["point"] == int((diagram["branch"] == 0).sum())
    True
    """
    points = np.flatnonzero(result["branch"].values == k)
    marks = np.flatnonzero(result["special_branch"].values == k)
    number = max(int(result["period_number"][k]), 1)
    one = result.isel({"point": points, "special": marks, "return": slice(0, number)})
    return one.assign(special_point=one["special_point"] - points[0])


#: Lines, words and markers of a sweep's directions, in every picture.
LOOKS: dict[str, style.Properties] = {
    "up": {"color": style.COLORS["first"], "linestyle": "-"},
    "down": {"color": style.COLORS["second"], "linestyle": "--"},
    "none": {"color": style.COLORS["section"], "linestyle": "none", "marker": ".", "markersize": 1.5},
}
WORDS = {"up": "increasing", "down": "decreasing", "none": "each from its start"}
MARKERS = {"up": "^", "down": "v"}


@figure("frequency_response", "amplitude")
def frequency_response(
    ax: Axes,
    result: xr.Dataset,
    *over: xr.Dataset,
    y: Name | None = None,
    quantity: Literal["amplitude", "maximum", "minimum"] = "amplitude",
    jumps: bool = True,
    digits: Annotated[int, at_least(1, 17)] = 4,
    region: str | xr.DataArray | None = None,
) -> None:
    """Draw a ``frequency_response`` result.

    Parameters
    ----------
    result
        A ``frequency_response``; with the bands of ``propagate`` where it has them.
    *over
        Branches of ``continue_orbit`` over the same parameter, as :func:`bifurcation` draws them.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state or the output; by default the first state. Or a quantity of each point: a load (``"stop_energy"``).
    quantity
        ``"amplitude"`` (half the peak-to-peak value), ``"maximum"`` or ``"minimum"`` of a state or an output.
    jumps
        Mark each jump of what is drawn by a dotted arrow and its value of the parameter with ``digits`` significant
        digits. A load jumps where a state does.
    region
        A condition, or what :func:`nonsmooth.region` gave: the values of the parameter at which it holds, in every
        direction and from every start, are shaded.
    """
    (name,) = first_states(result, y)
    parameter, known = str(result["status"].dims[0]), quantities_of(result)
    values = result[parameter].values
    alone = f"{name}_{quantity}" not in known
    ranges = [one.removesuffix("_amplitude") for one in known if one.endswith("_amplitude")]
    drawn = name if alone else f"{name}_{quantity}"
    heights = quantity_of(result, drawn, known, also=ranges)
    ends = (quantity_of(one, drawn) for one in bands.ends_of(result))
    arrays = [dict(by_direction(result, one)) for one in (heights, *ends)]
    inside = held(result, region)
    jumping = result["state"].values.tolist() if alone else [name]
    for branch in over:
        check_axis(branch, parameter)
    marks = []
    for direction in arrays[0]:
        alike = (one[direction].transpose(parameter, ...).values.reshape(len(values), -1).T for one in arrays)
        for k, (curve, *band) in enumerate(zip(*alike, strict=True)):
            if band:
                bands.fill(ax, result, values, *band, color=LOOKS[direction]["color"])
            found = _intervals(values, curve, _jumps(result, jumping, direction, k))
            at = [i for _, i in found]
            broken = np.insert(values, at, np.nan), np.insert(curve, at, np.nan)
            style.line(ax, *broken, label=WORDS[direction] if k == 0 else None, **LOOKS[direction])
            for place, i in found if jumps else ():
                marks.append(_mark(ax, values, curve, i, place, direction, digits))
    for behind in over:
        draw_branch(ax, behind, y=name, quantity=quantity, color=style.COLORS["section"], width=0.7, behind=True)
    _whole(ax, values)
    if inside is not None:
        _shade(ax, inside, parameter)
    _name(ax, result, parameter, name, heights, "" if alone else f"{quantity} of ")
    style.clear_legend(ax)
    style.apart(ax, marks)


def _shade(ax: Axes, inside: xr.DataArray, parameter: str) -> None:
    """Shade the cells of an axis in which a condition holds."""
    whole = inside.all([dim for dim in inside.dims if dim != parameter]).sortby(parameter)
    values, there = whole[parameter].values, np.repeat(whole.values, 2)
    words = in_lines(inside.attrs.get("long_name", "region"), _LONGEST) if there.any() else None
    ends = np.repeat(edges_of(values), 2)[1:-1]
    style.shade(ax, ends, there, color=style.COLORS["third"], alpha=0.15, zorder=0, label=words)
    ax.set_xlim(values[0], values[-1])


def _jumps(result: xr.Dataset, names: list[str], direction: str, start: int) -> list[float]:
    """The jumps of one curve: those of its states, its direction and, where there are several starts, of its start."""
    if "jump_value" not in result:
        return []
    mine = (result["jump_direction"].values == direction) & np.isin(result["jump_variable"].values, names)
    return np.unique(result["jump_value"].values[mine & (result["jump_start"].values == start)]).tolist()


def _intervals(values: FloatArray, curve: FloatArray, places: list[float]) -> list[tuple[float, int]]:
    """Each jump with the i such that it lies between the points i - 1 and i.

    A jump may be reported at a point itself, on either side: of the intervals next to it the steepest is meant.
    """
    order = np.argsort(values)
    steps = np.abs(np.diff(curve[order]))
    found = []
    for place in places:
        low = int(np.searchsorted(values[order], place)) - 1
        near = [i for i in (low - 1, low, low + 1) if 0 <= i < len(steps) and np.isfinite(steps[i])]
        if near:
            i = max(near, key=lambda k: steps[k])
            found.append((place, int(max(order[i], order[i + 1]))))
    return found


def _mark(
    ax: Axes,
    values: FloatArray,
    curve: FloatArray,
    at: int,
    place: float,
    direction: str,
    digits: int,
) -> Any:
    """An arrow from the height before the jump to the height after it, in the sense of the sweep; its label."""
    before, after = (
        (curve[at - 1], curve[at]) if (direction == "up") == (values[0] <= values[-1]) else (curve[at], curve[at - 1])
    )
    color = LOOKS[direction]["color"]
    arrow = {"arrowstyle": "->", "color": color, "linestyle": ":", "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (place, after), (place, before), arrowprops=arrow)
    share = (place - values.min()) / np.ptp(values)
    side = 2 if share < 0.05 or (direction == "up" and share < 0.95) else -2  # not beyond the edge of the picture
    small = abs(after - before) < 0.2 * np.ptp(curve[np.isfinite(curve)])  # no room beside the arrow: below it
    where, offset = (min(before, after), (side, -3)) if small else ((before + after) / 2, (side, 0))
    sides = {"va": "top" if small else "center", "ha": "left" if side > 0 else "right"}
    return style.annotate(ax, f"{place:.{digits}g}", (place, where), offset, color=color, rotation=90, **sides)


@figure("sweep(..., density=True)", "density")
def density(ax: Axes, result: xr.Dataset, *, y: Name | None = None, cmap: str = "magma_r") -> None:
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
    from matplotlib.colors import LogNorm

    (name,) = only_states(result, y)
    parameter = str(result["density"].dims[0])
    one = result.sortby(parameter).sel(state=name)
    counts, beyond = (one[key].sum({"direction", "start"} & {*one[key].dims}) for key in ("density", "outside"))
    table = counts.transpose("bin", parameter).values.astype(float)
    share = np.full(table.shape, np.nan)
    np.divide(100.0 * table, table.sum(axis=0) + beyond.values, out=share, where=table > 0)
    there = share[np.isfinite(share)]
    lowest, highest = (float(there.min()), float(there.max())) if len(there) else (1.0, 100.0)
    edges = edges_of(one[parameter].values), one["bin_edge"].values
    mesh = ax.pcolormesh(*edges, share, rasterized=True, cmap=cmap, norm=LogNorm(lowest, max(highest, 1.01 * lowest)))
    ax.figure.colorbar(mesh, ax=ax, label="share of the points (%)")
    name_plane(ax, result, parameter, name)


_QUANTITIES = {
    "state": r"difference of the states, $d_u$",
    "multiplier": r"difference of the multipliers, $d_\mu$",
    "exponent": "difference of the exponents",
    "period": "relative difference of the period",
}
_MARKS = {"linear": ("first", "o"), "tanh": ("second", "s"), "arctan": ("third", "^")}
_LOST = 0.04  # height of the mark where there is no such orbit, in the axes


@figure("smoothing_report", "state_difference")
def smoothing_report(
    ax: Axes, result: xr.Dataset, *, y: Literal["state", "multiplier", "exponent", "period"] = "state"
) -> None:
    """Draw the result of ``smoothing_report``: one line for each band, with its order at the smallest widths.

    Parameters
    ----------
    result
        Of ``smoothing_report``.
    ax
        Where to draw; a new one-column figure if None.
    y
        ``"state"``, ``"multiplier"``, ``"exponent"`` or ``"period"``. An orbit that is unstable where the event-driven
        one is stable, or the other way round, is hollow; a cross at the lower edge is a width at which a band
        has no such orbit.

    Raises
    ------
    ValueError
        A result of another verb, or another quantity.
    """
    eta = result["eta"].values
    lost: set[float] = set()
    for band in result["band"].values:
        one = result.sel(band=band)
        shade, mark = _MARKS[str(band)]
        color, values = style.COLORS[shade], one[f"{y}_difference"].values
        shown = np.isfinite(values) & (values > 0)
        orders = one[f"{y}_order"].values
        known = orders[np.isfinite(orders)]
        ax.plot(eta[shown], values[shown], "-", color=color, linewidth=0.8)
        words = band + (f", order {known[0]:.2f}" if len(known) else "")
        changed = one["stable"].values != bool(one["reference_stable"])
        for which, fill, label in ((shown & ~changed, color, words), (shown & changed, "none", None)):
            ax.plot(eta[which], values[which], mark, color=color, markerfacecolor=fill, markersize=3.5, label=label)
        lost |= set(eta[one["status"].values != 0].tolist())
    if lost:
        looks: style.Properties = {"color": style.COLORS["section"], "markersize": 4, "label": "no such orbit"}
        ax.plot(sorted(lost), [_LOST] * len(lost), "x", transform=ax.get_xaxis_transform(), **looks)
    ax.set(xscale="log", yscale="log", xlabel=r"half width of the bands, $\eta$", ylabel=_QUANTITIES[y])
    ax.legend()
