"""One motion, measured and predicted: over time, in the plane of two states, its sections, its distances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, THEORY, check_kind, measured_label, one_phase, shade_reach
from nonsmooth.plot.labels import first_states, name_and_unit, name_axes, name_plane
from nonsmooth.plot.phase_portrait import shade_zone

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["comparison_distances", "comparison_phase_portrait", "comparison_section", "comparison_time"]


def comparison_time(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, periods: float = 8) -> Axes:
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
    (name,) = first_states(result, y)
    closed = "phase" in result.coords
    looks: dict[str, Any]
    with style.axes(ax) as drawn:
        for side in ("theory", "measured"):
            phase = result["phase" if closed else f"{side}_phase"].values
            shown = np.flatnonzero(phase < min(periods, phase[-1] + 1))
            values = result[f"{side}_orbit"].sel(state=name).values
            if side == "theory":
                looks = {"color": THEORY, "alpha": 0.25, "label": _band(result)}
                here = result.sel(state=name)
                shade_reach(drawn, here.isel({str(here["theory_orbit"].dims[0]): shown}), phase[shown], **looks)
                drawn.plot(phase[shown], values[shown], color=THEORY, label="theory")
            else:
                some, looks = shown[:: max(1, len(shown) // 120)], {"markersize": 1.6, "markeredgewidth": 0.0}
                drawn.plot(phase[some], values[some], "o", color=MEASURED, label=measured_label(result), **looks)
        drawn.margins(x=0)
        style.make_room(drawn, 0.22)
        drawn.legend(loc="upper center", ncols=3, columnspacing=1.0, handlelength=1.4)
        drawn.set_xlabel("time (forcing periods)")
        name_axes(drawn, y=name_and_unit(result, name))
    return drawn


def comparison_phase_portrait(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    zone: float | str | None = None,
) -> Axes:
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
    names = first_states(result, x, y)
    closed = "phase" in result.coords
    with style.axes(ax, ratio=0.85) as drawn:
        for side, color in (("theory", THEORY), ("measured", MEASURED)):
            curves = [result[f"{side}_orbit"].sel(state=name).values for name in names]
            if closed:
                curves = [np.append(curve, curve[0]) for curve in curves]
            ours = side == "theory"
            word, wide, line = ("theory", 1.2, "-") if ours else (measured_label(result), 0.6, (0, (4, 2)))
            looks: dict[str, Any] = {"linewidth": wide, "linestyle": line} if closed else {"linewidth": 0.4}
            drawn.plot(*curves, color=color, label=word, **looks)
            section = one_phase(result, f"{side}_section")
            points = [section.sel(state=name).values for name in names]
            # Rings about the few points of a closed orbit; of an attractor a cloud, the measured points on it.
            size, face, edge = (4.5, "none", 0.9) if ours and closed else (0.9 if ours else 2.0, color, 0)
            drawn.plot(
                *points, "o", color=color, markersize=size, markerfacecolor=face, markeredgewidth=edge,
                zorder=4 if ours else 5, rasterized=points[0].size > 500, label=f"section points, {word}",
            )  # fmt: skip
        if zone is not None:
            shade_zone(drawn, float(result[zone]) if isinstance(zone, str) else zone)
        style.make_room(drawn, 0.15)
        drawn.legend(loc="upper center", ncols=2)
        name_plane(drawn, result, *names)
    return drawn


def comparison_section(
    result: xr.Dataset, ax: Axes | None = None, *, x: str | None = None, y: str | None = None, phase: int = 0
) -> Axes:
    """Draw both section clouds in the plane of two states, with their energy distance beside that of halves.

    ``phase`` is the index of the section where several were compared.
    """
    check_kind(result, "motion")
    names = first_states(result, x, y)
    few = int(result["theory_period_number"])
    with style.axes(ax, ratio=0.85) as drawn:
        clouds = [
            [one_phase(result, f"{side}_section", phase).sel(state=name).values for name in names]
            for side in ("measured", "theory")
        ]
        style.cloud(drawn, clouds[0], 1.7, MEASURED, measured_label(result))
        if few:  # points that come round again: rings about the measured ones
            looks: dict[str, Any] = {"markersize": 6, "markerfacecolor": "none", "markeredgewidth": 0.9}
            drawn.plot(*(column[:few] for column in clouds[1]), "o", color=THEORY, label="theory", **looks)
        else:
            style.cloud(drawn, clouds[1], 1.2, THEORY, "theory")
        keys = "energy_distance_matched", "measured_halves_p95"
        distance, limit = (float(one_phase(result, name, phase)) for name in keys)
        if np.isfinite(distance):
            drawn.set_title(f"energy distance {distance:.3f}; 95 % of its own halves below {limit:.3f}", loc="left")
        drawn.legend(markerscale=1 if few else 4, loc="best")
        name_plane(drawn, result, *names)
    return drawn


def comparison_distances(result: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the energy distances of a comparison: measured to theory, drawn parameters, and the clouds' own halves.

    The bars of the halves reach from their median to their 95th percentile.
    """
    check_kind(result, "motion")
    with style.axes(ax, ratio=0.5) as drawn:
        word = "synthetic" if measured_label(result) != "measured" else "measured"
        names: list[str] = []
        for side, color in (("measured", MEASURED), ("theory", THEORY)):
            median, high = (float(one_phase(result, f"{side}_halves_{q}")) for q in ("median", "p95"))
            drawn.plot([median, high], [len(names)] * 2, "|-", color=color, linewidth=1.2, markersize=8)
            names.append(f"halves, {word if side == 'measured' else 'theory'}")
        if "draw_energy_distance" in result:
            draws = one_phase(result, "draw_energy_distance").values
            drawn.plot(draws, np.full(draws.shape, len(names)), ".", color=style.COLORS["muted"], markersize=3)
            names.append("drawn parameters")
        distance = float(one_phase(result, "energy_distance_matched"))
        drawn.plot([distance], [len(names)], "D", color=style.COLORS["second"], markersize=4)
        names.append(f"{word} to theory")
        drawn.set_yticks(range(len(names)), names)
        drawn.set_ylim(-0.6, len(names) - 0.4)
        drawn.set_xlim(left=0)
        drawn.set_xlabel("energy distance (scaled)")
    return drawn


def _band(result: xr.Dataset) -> str:
    from nonsmooth.results.provenance import read_provenance

    level = float(read_provenance(result)["options"].get("level", 0.95))
    return f"{100 * level:g} % band"


def _check_orbits(result: xr.Dataset) -> None:
    check_kind(result, "motion")
    if "theory_orbit" not in result or "measured_orbit" not in result:
        raise ValueError(
            "only section points were compared; this picture needs a motion, u(time, state) with phase(time)"
        )
