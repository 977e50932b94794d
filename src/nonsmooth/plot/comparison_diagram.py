"""Measured section points over a predicted bifurcation diagram, with the flips of both."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, THEORY, check_kind, measured_label, shade_reach
from nonsmooth.plot.labels import first_states, name_plane

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["comparison_diagram"]


def comparison_diagram(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, size: float = 1.6) -> Axes:
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
    (name,) = first_states(result, y)
    with style.axes(ax) as drawn:
        points = result["theory_section"].sel(state=name).transpose(..., parameter)
        at = np.broadcast_to(result[parameter].values, points.shape)
        style.cloud(drawn, (at, points.values), 0.9, THEORY, "theory")
        looks = {"color": THEORY, "alpha": 0.12, "zorder": 0, "label": "reach for drawn parameters"}
        shade_reach(drawn, result.sel(state=name), result[parameter].values, **looks)
        read = result[f"measured_{parameter}"], result["measured_section"].sel(state=name)
        style.cloud(drawn, read, size, MEASURED, measured_label(result))
        _flips(drawn, result)
        drawn.margins(x=0)
        style.even_dots(drawn.legend(**ABOVE, ncols=2, columnspacing=1.0))
        name_plane(drawn, result, parameter, name)
    return drawn


def _flips(ax: Axes, result: xr.Dataset) -> None:
    """Ticks at the top: where theory flips, where the record does, and where it would without its delay.

    A parameter that moves while it is recorded delays a flip; an arrow leads from the flip as read to the one with the
    delay taken out, whose bar is its uncertainty.
    """
    top = ax.get_xaxis_transform()
    count = result.sizes.get("flip", 0)
    found = {
        kind: result[kind].values if kind in result else np.full(count, np.nan)
        for kind in ("theory_flip", "measured_flip_read", "measured_flip", "measured_flip_error")
    }
    word = measured_label(result)
    tick: dict[str, Any] = {"transform": top, "zorder": 6, "solid_capstyle": "butt"}
    for expected, read, still, error in zip(*found.values(), strict=True):
        for place, color, width, words in ((expected, THEORY, 2.0, "theory"), (read, MEASURED, 1.2, word)):
            if np.isfinite(place):
                label = style.once(ax, f"flip, {words}")
                ax.plot([place] * 2, [0.93, 1.0], color=color, linewidth=width, label=label, **tick)
        if np.isfinite(read) and np.isfinite(still) and read != still:
            ax.annotate(
                "", (still, 0.965), (read, 0.965), xycoords=top, textcoords=top, zorder=5,
                arrowprops={"arrowstyle": "->", "color": MEASURED, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3},
            )  # fmt: skip
        if np.isfinite(still) and read != still:
            ax.errorbar(
                [still], [0.965], xerr=[error] if np.isfinite(error) else None, fmt="D", color=MEASURED, markersize=3.5,
                markerfacecolor="white", markeredgewidth=0.8, elinewidth=0.8, capsize=1.5, transform=top, zorder=6,
                label=style.once(ax, f"flip, {word}, delay taken out"),
            )  # fmt: skip
