"""One motion, measured and predicted: over time, in the plane of two states, its sections, its distances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, THEORY, check_kind, measured_label
from nonsmooth.plot.labels import first_states, name_and_unit, name_axes
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
    check_kind(result, "motion")
    _needs_orbits(result)
    (name,) = first_states(result, y)
    closed = "phase" in result.coords
    with style.axes(ax) as drawn:
        for side, color in (("theory", THEORY), ("measured", MEASURED)):
            axis = "phase" if closed else f"{side}_phase"
            phase = result[axis].values
            shown = phase < min(periods, phase[-1] + 1)
            values = result[f"{side}_orbit"].sel(state=name).values
            if side == "theory":
                if "theory_low" in result:
                    low, high = (result[f"theory_{edge}"].sel(state=name).values[shown] for edge in ("low", "high"))
                    drawn.fill_between(
                        phase[shown], low, high, color=color, alpha=0.25, linewidth=0, label=_band(result)
                    )
                drawn.plot(phase[shown], values[shown], color=color, label="theory")
            else:
                every = slice(None, None, max(1, int(np.count_nonzero(shown) // 120)))
                drawn.plot(
                    phase[shown][every], values[shown][every], "o", color=color, markersize=1.6, markeredgewidth=0,
                    label=measured_label(result),
                )  # fmt: skip
        drawn.margins(x=0)
        low_y, high_y = drawn.get_ylim()
        drawn.set_ylim(low_y, high_y + 0.22 * (high_y - low_y))  # room for the legend
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
    check_kind(result, "motion")
    _needs_orbits(result)
    names = first_states(result, x, y)
    closed = "phase" in result.coords
    with style.axes(ax, ratio=0.85) as drawn:
        for side, color in (("theory", THEORY), ("measured", MEASURED)):
            curves = [result[f"{side}_orbit"].sel(state=name).values for name in names]
            if closed:
                curves = [np.append(curve, curve[0]) for curve in curves]
            wide = 1.2 if side == "theory" else 0.6
            line = {"linestyle": "-"} if side == "theory" else {"linestyle": (0, (4, 2))}
            word = "theory" if side == "theory" else measured_label(result)
            drawn.plot(*curves, color=color, linewidth=wide if closed else 0.4, label=word, **line if closed else {})
            section = _one_phase(result, f"{side}_section")
            points = [section.sel(state=name).values for name in names]
            # Rings about the few points of a closed orbit; of an attractor a cloud, the measured points on it.
            ring = side == "theory" and closed
            drawn.plot(
                *points, "o", color=color, markersize=4.5 if ring else 0.9 if side == "theory" else 2.0,
                markerfacecolor="none" if ring else color, markeredgewidth=0.9 if ring else 0,
                zorder=4 if side == "theory" else 5, rasterized=points[0].size > 500, linestyle="none",
                label=f"section points, {word}",
            )  # fmt: skip
        if zone is not None:
            shade_zone(drawn, float(result[zone]) if isinstance(zone, str) else zone)
        low, high = drawn.get_ylim()
        drawn.set_ylim(low, high + 0.15 * (high - low))
        drawn.legend(loc="upper center", ncols=2)
        name_axes(drawn, name_and_unit(result, names[0]), name_and_unit(result, names[1]))
    return drawn


def comparison_section(
    result: xr.Dataset, ax: Axes | None = None, *, x: str | None = None, y: str | None = None, phase: int = 0
) -> Axes:
    """Draw both section clouds in the plane of two states, with their energy distance beside that of halves.

    ``phase`` is the index of the section where several were compared.
    """
    check_kind(result, "motion")
    names = first_states(result, x, y)
    few = int(result["theory_period_number"]) > 0
    with style.axes(ax, ratio=0.85) as drawn:
        for side, color, size in (("measured", MEASURED, 1.7), ("theory", THEORY, 1.2)):
            section = _one_phase(result, f"{side}_section", phase)
            points = [section.sel(state=name).values for name in names]
            word = "theory" if side == "theory" else measured_label(result)
            if side == "theory" and few:  # a few points that come round again: rings about the measured ones
                points = [column[: int(result["theory_period_number"])] for column in points]
                drawn.plot(
                    *points, "o", color=color, markersize=6, markerfacecolor="none", markeredgewidth=0.9, label=word
                )
                continue
            drawn.plot(
                *points, ".", color=color, markersize=size, markeredgewidth=0, rasterized=True, label=word,
            )  # fmt: skip
        distance, limit = (
            float(_at(result[name], phase)) for name in ("energy_distance_matched", "measured_halves_p95")
        )
        if np.isfinite(distance):
            drawn.set_title(f"energy distance {distance:.3f}; 95 % of its own halves below {limit:.3f}", loc="left")
        drawn.legend(markerscale=1 if few else 4, loc="best")
        name_axes(drawn, name_and_unit(result, names[0]), name_and_unit(result, names[1]))
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
            median, high = (float(_at(result[f"{side}_halves_{q}"], 0)) for q in ("median", "p95"))
            drawn.plot([median, high], [len(names)] * 2, "|-", color=color, linewidth=1.2, markersize=8)
            names.append(f"halves, {word if side == 'measured' else 'theory'}")
        if "draw_energy_distance" in result:
            draws = np.asarray(_at(result["draw_energy_distance"], 0))
            drawn.plot(draws, np.full(draws.shape, len(names)), ".", color=style.COLORS["muted"], markersize=3)
            names.append("drawn parameters")
        distance = float(_at(result["energy_distance_matched"], 0))
        drawn.plot([distance], [len(names)], "D", color=style.COLORS["second"], markersize=4)
        names.append(f"{word} to theory")
        drawn.set_yticks(range(len(names)), names)
        drawn.set_ylim(-0.6, len(names) - 0.4)
        drawn.set_xlim(left=0)
        drawn.set_xlabel("energy distance (scaled)")
    return drawn


def _at(array: xr.DataArray, phase: int) -> Any:
    return (array.isel(section_phase=phase) if "section_phase" in array.dims else array).values


def _one_phase(result: xr.Dataset, name: str, phase: int = 0) -> xr.DataArray:
    array = result[name]
    return array.isel(section_phase=phase) if "section_phase" in array.dims else array


def _band(result: xr.Dataset) -> str:
    from nonsmooth.results.provenance import read_provenance

    level = float(read_provenance(result)["options"].get("level", 0.95))
    return f"{100 * level:g} % band"


def _needs_orbits(result: xr.Dataset) -> None:
    if "theory_orbit" not in result or "measured_orbit" not in result:
        raise ValueError(
            "only section points were compared; this picture needs a motion, u(time, state) with phase(time)"
        )
