"""Experiment and theory in one picture: motions, sections, diagrams and responses, and what is synthetic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.figure import figure
from nonsmooth.plot.labels import Name, columns, name_and_unit, name_axes, name_plane, one_of, only_states, with_unit
from nonsmooth.plot.sweeps import LOOKS, MARKERS, WORDS
from nonsmooth.plot.trajectories import edge_of, shade_zone
from nonsmooth.results.provenance import read_provenance
from nonsmooth.system.kinds import Count, Positive, at_least

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Theory is a blue line or cloud with a pale band, the experiment black points.
THEORY = style.COLORS["first"]
MEASURED = style.COLORS["section"]


def measured_label(result: xr.Dataset | Any) -> str:
    """The word for the measured side; it says ``synthetic`` where a virtual rig made the data."""
    attrs = getattr(result, "attrs", {})
    return "virtual rig (synthetic)" if str(attrs.get("synthetic", "no")) in ("yes", "True", "1") else "measured"


def check_kind(result: xr.Dataset, wanted: str) -> None:
    """ValueError where ``result`` is no comparison of this kind."""
    kind = getattr(result, "attrs", {}).get("comparison", "")
    if kind != wanted:
        what = f"a comparison of a {kind}" if kind else "no result of compare"
        raise ValueError(f"this picture needs a comparison of a {wanted}; this is {what}")


def shade_reach(ax: Axes, result: xr.Dataset, x: Any, **looks: Any) -> None:
    """Shade the band of drawn parameters, where the comparison of one state and direction has one."""
    if "theory_low" in result:
        ax.fill_between(x, result["theory_low"], result["theory_high"], linewidth=0, **looks)


def one_phase(result: xr.Dataset, phase: int = 0) -> Any:
    """A comparison at one of its sections."""
    return one_of(result, "section_phase", phase, "phase")


@figure()
def comparison_time(ax: Axes, result: xr.Dataset, *, y: Name | None = None, periods: Positive = 8) -> None:
    """Draw a state over the phase of the drive: measured points, the predicted curve and its band.

    Parameters
    ----------
    result
        A comparison of a motion.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state; by default the first.
    periods
        Forcing periods shown at most. Of a motion without a period the predicted curve begins at the measured state
        and parts from it, as any two chaotic motions do.
    """
    _check_orbits(result)
    (name,) = only_states(result, y)
    closed, here = "phase" in result.coords, result.sel(state=name)
    for side in ("theory", "measured"):
        phase = result["phase" if closed else f"{side}_phase"].values
        shown = np.flatnonzero(phase < min(periods, phase[-1] + 1))
        values = here[f"{side}_orbit"].values
        if side == "theory":
            part = here.isel({str(here["theory_orbit"].dims[0]): shown})
            level = 100 * read_provenance(result)["options"].get("level", 0.95)
            shade_reach(ax, part, phase[shown], color=THEORY, alpha=0.25, label=f"{level:g} % band")
            ax.plot(phase[shown], values[shown], color=THEORY, label="theory")
        else:
            some, word = shown[:: max(1, len(shown) // 120)], measured_label(result)
            ax.plot(phase[some], values[some], "o", label=word, color=MEASURED, markersize=1.6, markeredgewidth=0)
    ax.margins(x=0)
    ax.set_xlabel("time (forcing periods)")
    name_axes(ax, y=name_and_unit(result, name))
    style.legend(ax, columns=3)


@figure()
def comparison_record(ax: Axes, result: xr.Dataset, *, y: Name | None = None) -> None:
    """Draw a record under measured inputs over its time: readings, the predicted motion and its band.

    Parameters
    ----------
    result
        A comparison of a record; of a part of it ``result.sel(time=slice(2, 5))``.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state or output; by default the first.
    """
    check_kind(result, "record")
    (name,) = only_states(result, y)
    here, time = result.sel(state=name), result["time"].values
    level = 100 * read_provenance(result)["options"].get("level", 0.95)
    shade_reach(ax, here, time, color=THEORY, alpha=0.25, label=f"{level:g} % band")
    ax.plot(time, here["theory"].values, color=THEORY, label="theory")
    looks: style.Properties = {"color": MEASURED, "markersize": 1.6, "markeredgewidth": 0}
    ax.plot(time, here["measured"].values, "o", label=measured_label(result), **looks)
    ax.margins(x=0)
    name_axes(ax, name_and_unit(result, "time"), name_and_unit(result, name))
    style.legend(ax, columns=3)


@figure(ratio=0.85)
def comparison_phase_portrait(
    ax: Axes,
    result: xr.Dataset,
    *,
    x: Name | None = None,
    y: Name | None = None,
    zone: float | str | None = None,
) -> None:
    """Draw both motions in the plane of two states, each with its section points.

    Parameters
    ----------
    result
        A comparison of a motion.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the axes; by default the first two.
    zone
        The edge of the contact zone x > zone: a number, or the parameter that holds it (``"g"``).
    """
    _check_orbits(result)
    names = only_states(result, x, y)
    closed = "phase" in result.coords
    for side, color in (("theory", THEORY), ("measured", MEASURED)):
        curves = columns(result, f"{side}_orbit", names)
        if closed:
            curves = [np.append(curve, curve[0]) for curve in curves]
        ours = side == "theory"
        word, wide, line = ("theory", 1.2, "-") if ours else (measured_label(result), 0.6, (0, (4, 2)))
        looks: style.Properties = {"linewidth": wide, "linestyle": line} if closed else {"linewidth": 0.4}
        ax.plot(*curves, color=color, label=word, **looks)
        points = columns(one_phase(result), f"{side}_section", names)
        # Rings about the few points of a closed orbit; of an attractor a cloud, the measured points on it.
        size, face, edge = (4.5, "none", 0.9) if ours and closed else (0.9 if ours else 2.0, color, 0)
        looks = {"color": color, "markersize": size, "markerfacecolor": face, "markeredgewidth": edge}
        looks |= {"zorder": 4 if ours else 5, "rasterized": points[0].size > 500}
        ax.plot(*points, "o", label=f"section points, {word}", **looks)
    if zone is not None:
        shade_zone(ax, edge_of(result, zone))
    name_plane(ax, result, *names)
    style.legend(ax)


@figure(ratio=0.85)
def comparison_section(
    ax: Axes,
    result: xr.Dataset,
    *,
    x: Name | None = None,
    y: Name | None = None,
    phase: Count = 0,
) -> None:
    """Draw both section clouds in the plane of two states, with their energy distance beside that of halves.

    ``phase`` is the index of the section where several were compared.
    """
    check_kind(result, "motion")
    names = only_states(result, x, y)
    few = int(result["theory_period_number"])
    here = one_phase(result, phase)
    measured, theory = (columns(here, f"{side}_section", names) for side in ("measured", "theory"))
    style.cloud(ax, measured, 1.7, MEASURED, measured_label(result))
    if few:  # points that come round again: rings about the measured ones
        x_ring, y_ring = (column[:few] for column in theory)
        looks: style.Properties = {"color": THEORY, "markersize": 6, "markerfacecolor": "none", "markeredgewidth": 0.9}
        ax.plot(x_ring, y_ring, "o", label="theory", **looks)
    else:
        style.cloud(ax, theory, 1.2, THEORY, "theory")
    distance, limit = (float(here[name]) for name in ("energy_distance_matched", "measured_halves_p95"))
    if np.isfinite(distance):
        ax.set_title(f"energy distance {distance:.3f}; 95 % of its own halves below {limit:.3f}", loc="left")
    ax.legend(markerscale=1 if few else 4, loc="best")
    name_plane(ax, result, *names)


@figure(ratio=0.5)
def comparison_distances(ax: Axes, result: xr.Dataset) -> None:
    """Draw the energy distances of a comparison: measured to theory, drawn parameters, and the clouds' own halves.

    The bars of the halves reach from their median to their 95th percentile.
    """
    check_kind(result, "motion")
    here, word = one_phase(result), "synthetic" if measured_label(result) != "measured" else "measured"
    names: list[str] = []
    for side, own, color in (("measured", word, MEASURED), ("theory", "theory", THEORY)):
        ends = [float(here[f"{side}_halves_{q}"]) for q in ("median", "p95")]
        ax.plot(ends, [len(names)] * 2, "|-", color=color, linewidth=1.2, markersize=8)
        names.append(f"halves, {own}")
    if "draw_energy_distance" in result:
        draws = here["draw_energy_distance"].values
        ax.plot(draws, np.full(draws.shape, len(names)), ".", color=style.COLORS["muted"], markersize=3)
        names.append("drawn parameters")
    ax.plot([float(here["energy_distance_matched"])], [len(names)], "D", color=style.COLORS["second"], markersize=4)
    names.append(f"{word} to theory")
    ax.set_yticks(range(len(names)), names)
    ax.set(ylim=(-0.6, len(names) - 0.4), xlabel="energy distance (scaled)")
    ax.set_xlim(left=0)


def _check_orbits(result: xr.Dataset) -> None:
    check_kind(result, "motion")
    if "theory_orbit" not in result or "measured_orbit" not in result:
        raise ValueError(
            "only section points were compared; this picture needs a motion, u(time, state) with phase(time)"
        )


@figure()
def comparison_diagram(ax: Axes, result: xr.Dataset, *, y: Name | None = None, size: Positive = 1.6) -> None:
    """Draw a comparison of a diagram: theory as a pale cloud, measured points in black, flips as marks at the top.

    Parameters
    ----------
    result
        A comparison of a diagram.
    ax
        Where to draw; a new one-column figure if None.
    y
        The state of the ordinate; by default the first.
    size
        Diameter of a measured point in typographic points.
    """
    check_kind(result, "diagram")
    parameter = str(result["theory_section"].dims[0])
    (name,) = only_states(result, y)
    values, one = result[parameter].values, result.sel(state=name)
    style.cloud(ax, (values, one["theory_section"].transpose(..., parameter).values), 0.9, THEORY, "theory")
    shade_reach(ax, one, values, color=THEORY, alpha=0.12, zorder=0, label="reach for drawn parameters")
    read = one[f"measured_{parameter}"].values, one["measured_section"].values
    style.cloud(ax, read, size, MEASURED, measured_label(result))
    _flips(ax, result)
    ax.margins(x=0)
    name_plane(ax, result, parameter, name)
    style.legend(ax)


def _flips(ax: Axes, result: xr.Dataset) -> None:
    """Ticks at the top: where theory flips, where the record does, and where it would without its delay.

    A parameter that moves while it is recorded delays a flip; an arrow leads from the flip as read to the one with the
    delay taken out, whose bar is its uncertainty.
    """
    top, word = ax.get_xaxis_transform(), measured_label(result)
    none = np.full(result.sizes.get("flip", 0), np.nan)
    keys = ("theory_flip", "measured_flip_read", "measured_flip", "measured_flip_error")
    found = (result[key].values if key in result else none for key in keys)
    tick: style.Properties = {"transform": top, "zorder": 6, "solid_capstyle": "butt"}
    for expected, read, still, error in zip(*found, strict=True):
        for place, color, width, words in ((expected, THEORY, 2.0, "theory"), (read, MEASURED, 1.2, word)):
            if np.isfinite(place):
                label = style.once(ax, f"flip, {words}")
                ax.plot([place] * 2, [0.93, 1.0], color=color, linewidth=width, label=label, **tick)
        if np.isfinite(still) and read != still:
            if np.isfinite(read):
                arrow = {"arrowstyle": "->", "color": MEASURED, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3}
                ax.annotate("", (still, 0.965), (read, 0.965), xycoords=top, zorder=5, arrowprops=arrow)
            label = style.once(ax, f"flip, {word}, delay taken out")
            looks: style.Properties = {"size": 3.5, "markeredgewidth": 0.8, "elinewidth": 0.8, "capsize": 1.5}
            looks |= {"face": "white", "mark": "D", "transform": top, "zorder": 6}
            style.points(ax, [still], [0.965], xerr=[error], label=label, **looks)


@figure()
def comparison_response(ax: Axes, result: xr.Dataset, *, digits: Annotated[int, at_least(0, 15)] = 3) -> None:
    """Draw a comparison of a response.

    Parameters
    ----------
    result
        A comparison of a response.
    ax
        Where to draw; a new one-column figure if None.
    digits
        Digits after the point of the differences between jumps, predicted less measured.
    """
    check_kind(result, "response")
    parameter = str(result["theory_amplitude"].dims[0])
    (state,) = only_states(result, None)
    values, runs, word = result[parameter].values, result["measured_direction"].values, measured_label(result)
    for i, direction in enumerate(result["direction"].values.astype(str)):
        looks, name = LOOKS[direction], WORDS[direction]
        color = looks["color"]
        shade_reach(ax, result.isel(direction=i), values, color=color, alpha=0.2)
        ax.plot(values, result["theory_amplitude"].values[:, i], label=f"theory, {name}", **looks)
        keys = (f"measured_{parameter}", "measured_amplitude", "measured_amplitude_error")
        at, heights, error = (result[key].values[runs == direction] for key in keys)
        looks = {"color": color, "face": "white", "mark": MARKERS[direction], "label": f"{word}, {name}"}
        style.points(ax, at, heights, yerr=error, **looks)
    written = _jumps(ax, result, digits)
    ax.set_ylim(bottom=0)
    ax.margins(x=0.02)
    name_plane(ax, result, parameter, state, "amplitude of ")
    style.legend(ax)
    style.apart(ax, written)


def _jumps(ax: Axes, result: xr.Dataset, digits: int) -> list[Any]:
    """A mark at the foot for each jump: filled where measured, open where predicted, with the difference."""
    foot = ax.get_xaxis_transform()
    names: style.Properties = {"color": style.COLORS["muted"], "markersize": 3.5, "linestyle": "none"}
    for key, word, face in (("measured_jump", measured_label(result), None), ("theory_jump", "theory", "white")):
        if np.isfinite(result[key].values if key in result else np.nan).any():
            ax.plot([], [], "D", markerfacecolor=face, label=f"jump, {word}", **names)
    written: list[Any] = []
    for row in range(result.sizes.get("jump", 0)):
        direction = str(result["jump_direction"].values[row])
        color = LOOKS[direction]["color"]
        seen, expected = (float(result[name].values[row]) for name in ("measured_jump", "theory_jump"))
        for place, face in ((seen, color), (expected, "white")):
            if np.isfinite(place):
                looks: style.Properties = {"markersize": 3.5, "transform": foot, "clip_on": False, "zorder": 6}
                ax.plot([place], [0.03], "D", color=color, markerfacecolor=face, **looks)
        if np.isfinite(seen) and np.isfinite(expected):
            number = f"{expected - seen:+.{digits}f}".replace("-", "\N{MINUS SIGN}")
            between = (seen + expected) / 2, 0.03
            written.append(style.annotate(ax, number, between, (0, 5), xycoords=foot, ha="center", color=color))
    if written:
        unit = name_and_unit(result, str(result["theory_amplitude"].dims[0]))[1]
        ax.plot([], [], linestyle="none", label=with_unit("numbers: theory less measured", unit))
    return written
