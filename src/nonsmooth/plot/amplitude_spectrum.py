"""Amplitudes of a motion over frequency: lines where it is periodic, a curve where it is not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import column, first_states, name_and_unit, name_axes, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["amplitude_spectrum"]

FLOOR = 1e-7  # of the largest line: below it rounding and the tolerance rule


def amplitude_spectrum(
    result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, highest: float = 20.0
) -> Axes:  # fmt: skip
    """Draw an ``amplitude_spectrum`` of the state ``y`` (by default the first) over multiples of the base frequency.

    ``highest``: the largest multiple drawn. Lines below 1e-7 of the largest are left out, and so is the mean.
    """
    variable_along(result, "amplitude", "amplitude_spectrum")
    (name,) = first_states(result, y)
    order, values = result["order"].values, column(result, "amplitude", name).values
    some = (order > 1e-9) & (order <= highest)
    order, values = order[some], values[some]
    floor = FLOOR * (float(values.max(initial=0.0)) or 1.0)
    some = values > floor
    with style.axes(ax) as drawn:
        drawn.set_yscale("log")
        bottom = max(floor, 0.3 * float(values[some].min(initial=np.inf))) if some.any() else floor
        symbol, unit = name_and_unit(result, name)
        if int(result["period_number"]):
            drawn.vlines(order[some], bottom, values[some], color=style.COLORS["first"], linewidth=1.0)
            drawn.plot(order[some], values[some], "o", color=style.COLORS["first"], markersize=3.0)
        else:
            drawn.plot(order, np.maximum(values, bottom), color=style.COLORS["first"], linewidth=0.8)
        drawn.set_ylim(bottom=bottom)
        drawn.set_xlim(0.0, 1.02 * float(order[some].max(initial=1.0)))
        base = float(result["base_frequency"])
        per = result["base_frequency"].attrs["units"]
        of = "frequency per iterate" if per == "per iterate" else f"frequency / {base:.4g} {per}"
        name_axes(drawn, None, (f"amplitude of {symbol}", unit))
        drawn.set_xlabel(of)
    return drawn
