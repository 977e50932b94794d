"""One motion: over time, in the plane of two states, its section points, once round an orbit, its spectrum."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray, IntArray
from nonsmooth.errors import unknown
from nonsmooth.plot import bands, style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import (
    Name,
    column,
    columns,
    first_states,
    in_lines,
    name_and_unit,
    name_axes,
    name_plane,
    variable_along,
)
from nonsmooth.results.labels import words_of_flags
from nonsmooth.system.kinds import Positive

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def with_gaps(result: xr.Dataset, *curves: FloatArray) -> list[FloatArray]:
    """The curves with NaN between the two limits of every crossing at which the state jumped."""
    segment, u = result["segment"].values, result["u"].values
    jump = (np.diff(segment) != 0) & np.any(np.abs(np.diff(u, axis=0)) > 0, axis=1)
    at = np.flatnonzero(jump) + 1
    return [np.insert(curve.astype(float), at, np.nan) for curve in curves]


def pieces_by_mode(mode: IntArray, *curves: FloatArray) -> list[list[FloatArray]]:
    """For each mode the curves, NaN where another mode rules; entry k belongs to mode k."""
    return [[np.where(mode == k, curve, np.nan) for curve in curves] for k in range(int(mode.max(initial=0)) + 1)]


@figure("simulate", "u")
def time_history(ax: Axes, result: xr.Dataset, *, y: Name | None = None, shade: bool | str = True) -> None:
    """Draw ``y`` (a state, by default the first, or an output) of a ``simulate`` result over time.

    The curve is cut where a reset makes the state jump. ``shade`` marks the time spent in any mode but the first; of a
    system with several elements the time in which a contact is closed (without contacts: in which something sticks).
    The name of an element, ``"stop"``: the time in which it does something else than in the first mode. Of a result of
    ``propagate`` the band is filled.
    """
    (name,) = first_states(result, y)
    time = result["time"].values
    if ends := bands.ends_of(result):
        curves = with_gaps(result, time, *(column(one, "u", name).values for one in ends))
        bands.fill(ax, result, *curves, color=style.COLORS["first"])
        if ax.get_legend_handles_labels()[1]:
            ax.legend()
    ax.plot(*with_gaps(result, time, column(result, "u", name).values), color=style.COLORS["first"])
    if shade:
        style.shade(ax, time, _away(result, shade))
    ax.margins(x=0)
    name_plane(ax, result, "time", name)


def _away(result: xr.Dataset, shade: bool | str) -> BoolArray:
    """The samples in another mode than the first, with a closed contact, or with an element in another phase."""
    mode = result["mode"]
    words = words_of_flags(mode)

    def phases(name: str) -> list[str]:
        found = (re.search(rf"(?:^|_){re.escape(name)}_([a-z]+)", word) for word in words)
        return ["" if one is None else one[1] for one in found]

    if isinstance(shade, str):
        own = phases(shade)
        if not own[0]:
            raise ValueError(f"shade = {shade!r}: no element of this name in the modes {', '.join(words[:6])}")
        return np.array([phase != own[0] for phase in own])[mode.values]
    forces = [str(name).removesuffix("_force") for name in result.data_vars if str(name).endswith("_force")]
    several = [own for name in forces if all(own := phases(name))]
    if len(several) < 2:
        return np.asarray(mode.values > 0)
    contacts = [own for own in several if {"open", "free"} & {*own}]  # a preloaded spring, above or below, is neither
    for elements, wanted in ((contacts, {"rest", "contact", "above", "below"}), (several, {"stick", "held"})):
        there = np.array([not wanted.isdisjoint(now) for now in zip(*elements, strict=True)])
        if there.any():
            break
    return there[mode.values]


@figure("simulate", "u", ratio=0.85)
def phase_portrait(
    ax: Axes,
    result: xr.Dataset,
    *,
    x: Name | None = None,
    y: Name | None = None,
    section: xr.Dataset | None = None,
    zone: float | str | None = None,
) -> None:
    """Draw a ``simulate`` result in the plane of two states, each mode in its own colour.

    Parameters
    ----------
    result
        A trajectory.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states (or outputs) of the two axes; by default the first two states.
    section
        A ``poincare`` (or one-point ``sweep``) result of the same system, its points drawn on top.
    zone
        The contact zone x > zone, shaded: a number, or the name of the parameter that holds it (``"g"``).
        Without it the zone shows by the colour of the orbit alone.
    """
    names = first_states(result, x, y)
    mode = result["mode"].values.astype(float)
    cut_mode, *cut = with_gaps(result, mode, *columns(result, "u", names))
    modes = words_of_flags(result["mode"])
    for k, (xs, ys) in enumerate(pieces_by_mode(np.nan_to_num(cut_mode, nan=-1).astype(int), *cut)):
        if np.isfinite(xs).any():
            words = in_lines(modes[k].replace("_", " "), 60)  # of a legend's line
            ax.plot(xs, ys, color=style.nth(k), label=words, zorder=2 + 0.1 * k)
    if section is not None:
        variable_along(section, "section", "poincare or sweep")
        x_points, y_points = map(np.ravel, columns(section, "section", names))
        many, color = x_points.size > 500, style.COLORS["section"]
        words = "section points"
        ax.plot(x_points, y_points, "o", label=words, markersize=2.6, color=color, zorder=4, rasterized=many)
    if zone is not None:
        shade_zone(ax, edge_of(result, zone))
    name_plane(ax, result, *names)


def edge_of(result: xr.Dataset, zone: float | str) -> float:
    """The edge of the contact zone, a number or the parameter that holds it."""
    if not isinstance(zone, str):
        return zone
    known = [str(name) for name, one in result.coords.items() if not one.dims and one.dtype.kind == "f"]
    if zone not in known:
        raise ValueError(f"zone: {unknown(zone, 'a parameter', 'this result', known)}; or give a number")
    return float(result[zone])


def shade_zone(ax: Axes, edge: float) -> None:
    """Shade the contact zone x > edge as far as the axes reach now, without moving them; call it at the end."""
    low, high = ax.get_xlim()
    ax.axvline(edge, color=style.COLORS["muted"], linewidth=0.6, linestyle="--", zorder=1)
    if edge < high:
        ax.axvspan(
            max(edge, low), high, color=style.COLORS["zone"], alpha=0.18, linewidth=0, zorder=0, label="contact zone"
        )
    ax.set_xlim(low, high)


@figure("poincare or sweep", "section", ratio=0.85)
def section(
    ax: Axes,
    result: xr.Dataset,
    *,
    x: Name | None = None,
    y: Name | None = None,
    size: Positive = 0.8,
) -> None:
    """Draw the section points of a ``poincare`` result (or of a ``sweep``, all its points together).

    ``size`` is the diameter of a point in typographic points. Clouds are pixels in a vector figure.
    """
    names = first_states(result, x, y)
    style.cloud(ax, columns(result, "section", names), size, style.COLORS["section"])
    name_plane(ax, result, *names)


@figure(ratio=0.85)
def orbit(ax: Axes, result: Any, *, x: Name | None = None, y: Name | None = None) -> None:
    """Draw an orbit once round, each mode in its own colour.

    Open circles are the states just before and after each transition, black dots the section points, and a cross is the
    place where the orbit comes nearest to a transition that does not happen.

    Parameters
    ----------
    result
        An ``Orbit``, or its Dataset.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the two axes; by default the first two.
    """
    from nonsmooth.continuation.branches.orbit import Orbit

    if not isinstance(result, Orbit):
        result = Orbit.from_dataset(result)
    run = result.trajectory()
    names = first_states(run, x, y)
    phase_portrait(run, ax, x=names[0], y=names[1])
    mark: style.Properties = {"size": 3.4, "zorder": 5, "markeredgewidth": 0.7}
    if run.sizes["crossing"]:
        sides = (columns(run, key, names) for key in ("u_before", "u_after"))
        style.mark(ax, np.concatenate([*sides], axis=1), "o", "crossing", **mark)
    # Phase 0 of each forcing period; of an autonomous orbit the one state it is held by.
    returns = max(result.period_number, 1)
    time = run["time"].values
    at = [int(np.abs(time - k * result.period / returns).argmin()) for k in range(returns)]
    points = columns(run.isel(time=at), "u", names)
    style.mark(ax, points, "o", "section", **mark, markerfacecolor=style.COLORS["section"])
    clearance = run["touch_clearance"].values
    if np.isfinite(clearance).any():
        near = int(np.nanargmin(clearance))
        words = f"least clearance {clearance[near]:.2g}"
        place = columns(run.isel(touch=near), "touch_u", names)
        ax.plot(*place, "x", zorder=6, label=words, color=style.COLORS["fourth"], markersize=5, markeredgewidth=1.1)
    style.clear_legend(ax)


_FLOOR = 1e-7  # of the largest line: below it rounding and the tolerance rule


def lines_of(result: xr.Dataset, name: str, highest: float) -> tuple[FloatArray, FloatArray, float]:
    """Multiples of the base frequency up to the highest, the amplitudes there, and the least that means something."""
    order, values = result["order"].values, column(result, "amplitude", name).values
    some = (order > 1e-9) & (order <= highest)
    return order[some], values[some], _FLOOR * (float(values[some].max(initial=0.0)) or 1.0)


@figure("amplitude_spectrum", "amplitude")
def amplitude_spectrum(ax: Axes, result: xr.Dataset, *, y: Name | None = None, highest: Positive = 20.0) -> None:
    """Draw an ``amplitude_spectrum`` of the state ``y`` (by default the first) over multiples of the base frequency.

    ``highest``: the largest multiple drawn. Lines below 1e-7 of the largest are left out, and so is the mean.
    """
    (name,) = first_states(result, y)
    order, values, floor = lines_of(result, name, highest)
    some = values > floor
    bottom = max(floor, 0.3 * float(values[some].min(initial=np.inf))) if some.any() else floor
    color = style.COLORS["first"]
    ax.set_yscale("log")
    if int(result["period_number"]):
        ax.vlines(order[some], bottom, values[some], color=color, linewidth=1.0)
        ax.plot(order[some], values[some], "o", color=color, markersize=3.0)
    else:
        ax.plot(order, np.maximum(values, bottom), color=color, linewidth=0.8)
    ax.set_ylim(bottom=bottom)
    ax.set_xlim(0.0, 1.02 * float(order[some].max(initial=1.0)))
    per, (symbol, unit) = result["base_frequency"].attrs["units"], name_and_unit(result, name)
    name_axes(ax, None, (f"amplitude of {symbol}", unit))
    base = f"frequency / {float(result['base_frequency']):.4g} {per.removesuffix('1')}".rstrip()
    ax.set_xlabel("frequency per iterate" if per == "per iterate" else base)
