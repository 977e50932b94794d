"""Orbits in the plane of two states, with their section points and the contact zone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import column, first_states, name_plane, variable_along, words_of_flags
from nonsmooth.plot.segments import pieces_by_mode, with_gaps

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["phase_portrait", "shade_zone"]

ZONE = "contact zone"  # in legends
_MODE_COLORS = ("first", "second", "third", "fourth")


def phase_portrait(
    result: xr.Dataset,
    ax: Axes | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    section: xr.Dataset | None = None,
    zone: float | str | None = None,
) -> Axes:
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
    variable_along(result, "u", "simulate")
    names = first_states(result, x, y)
    with style.axes(ax, ratio=0.85) as drawn:
        mode = result["mode"].values.astype(float)
        curves = [column(result, "u", name).values for name in names]
        cut_mode, *cut = with_gaps(result, mode, *curves)
        modes = words_of_flags(result["mode"])
        pieces = pieces_by_mode(np.nan_to_num(cut_mode, nan=-1).astype(int), *cut)
        for k, (color, (xs, ys)) in enumerate(zip(_cycle(len(pieces)), pieces, strict=True)):
            if np.isfinite(xs).any():
                drawn.plot(xs, ys, color=style.COLORS[color], label=modes[k].replace("_", " "), zorder=2 + 0.1 * k)
        if section is not None:
            variable_along(section, "section", "poincare or sweep")
            points = [column(section, "section", name).values.ravel() for name in names]
            drawn.plot(
                *points, "o", markersize=2.6, color=style.COLORS["section"], zorder=4, label="section points",
                rasterized=points[0].size > 500,
            )  # fmt: skip
        if zone is not None:
            shade_zone(drawn, float(result[zone]) if isinstance(zone, str) else zone)
        name_plane(drawn, result, *names)
    return drawn


def _cycle(count: int) -> list[str]:
    return [_MODE_COLORS[k % len(_MODE_COLORS)] for k in range(count)]


def shade_zone(ax: Axes, edge: float) -> None:
    """Shade x > edge as far as the axes reach now, without moving them."""
    low, high = ax.get_xlim()
    ax.axvline(edge, color=style.COLORS["muted"], linewidth=0.6, linestyle="--", zorder=1)
    if edge < high:
        ax.axvspan(max(edge, low), high, color=style.COLORS["zone"], alpha=0.18, linewidth=0, zorder=0, label=ZONE)
    ax.set_xlim(low, high)
