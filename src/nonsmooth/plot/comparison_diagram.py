"""Measured section points over a predicted bifurcation diagram, with the flips of both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, THEORY, check_kind, measured_label
from nonsmooth.plot.labels import first_states, name_and_unit, name_axes

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
        drawn.plot(
            at.ravel(), points.values.ravel(), ".", color=THEORY, markersize=0.9, markeredgewidth=0, rasterized=True,
            label="theory",
        )  # fmt: skip
        if "theory_low" in result:
            low, high = (result[f"theory_{edge}"].sel(state=name).values for edge in ("low", "high"))
            drawn.fill_between(
                result[parameter].values, low, high, color=THEORY, alpha=0.12, linewidth=0, zorder=0,
                label="reach for drawn parameters",
            )  # fmt: skip
        drawn.plot(
            result[f"measured_{parameter}"].values, result["measured_section"].sel(state=name).values, ".",
            color=MEASURED, markersize=size, markeredgewidth=0, rasterized=True, label=measured_label(result),
        )  # fmt: skip
        _flips(drawn, result)
        drawn.margins(x=0)
        style.even_dots(drawn.legend(**ABOVE, ncols=2, columnspacing=1.0))
        name_axes(drawn, name_and_unit(result, parameter), name_and_unit(result, name))
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

    def once(words: str) -> str | None:
        return None if words in ax.get_legend_handles_labels()[1] else words

    for expected, read, still, error in zip(*found.values(), strict=True):
        if np.isfinite(expected):
            ax.plot([expected] * 2, [0.93, 1.0], color=THEORY, linewidth=2.0, transform=top, zorder=6,
                    solid_capstyle="butt", label=once("flip, theory"))  # fmt: skip
        moved = np.isfinite(read) and np.isfinite(still) and read != still
        if np.isfinite(read):
            ax.plot([read] * 2, [0.93, 1.0], color=MEASURED, linewidth=1.2, transform=top, zorder=6,
                    solid_capstyle="butt", label=once(f"flip, {word}"))  # fmt: skip
        if moved:
            ax.annotate(
                "", (still, 0.965), (read, 0.965), xycoords=top, textcoords=top, zorder=5,
                arrowprops={"arrowstyle": "->", "color": MEASURED, "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3},
            )  # fmt: skip
        if np.isfinite(still) and (moved or not np.isfinite(read)):
            ax.errorbar(
                [still], [0.965], xerr=[error] if np.isfinite(error) else None, fmt="D", color=MEASURED, markersize=3.5,
                markerfacecolor="white", markeredgewidth=0.8, elinewidth=0.8, capsize=1.5, transform=top, zorder=6,
                label=once(f"flip, {word}, delay taken out"),
            )  # fmt: skip
