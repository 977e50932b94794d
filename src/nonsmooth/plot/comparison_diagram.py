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
    """Draw a comparison of a diagram: theory as a pale cloud, measured points in black, flips as ticks at the top.

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
        top = drawn.get_xaxis_transform()
        for row in range(result.sizes.get("flip", 0)):
            seen, expected = (float(result[key].values[row]) for key in ("measured_flip", "theory_flip"))
            for place, color in ((expected, THEORY), (seen, MEASURED)):
                if np.isfinite(place):
                    drawn.plot([place, place], [0.94, 1.0], color=color, linewidth=1.2, transform=top, zorder=6)
        drawn.margins(x=0)
        drawn.legend(**ABOVE, ncols=2, markerscale=4, columnspacing=1.0, handletextpad=0.4)
        name_axes(drawn, name_and_unit(result, parameter), name_and_unit(result, name))
    return drawn
