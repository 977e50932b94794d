"""A state or an output over time, with the time spent outside the first mode shaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nonsmooth.plot import style
from nonsmooth.plot.labels import column, first_states, name_plane, variable_along
from nonsmooth.plot.segments import with_gaps

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["time_history"]


def time_history(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None, shade: bool = True) -> Axes:
    """Draw ``y`` (a state, by default the first, or an output) of a ``simulate`` result over time.

    The curve is cut where a reset makes the state jump. ``shade`` marks the time spent in any mode but the first.
    """
    variable_along(result, "u", "simulate")
    (name,) = first_states(result, y)
    with style.axes(ax) as drawn:
        time = result["time"].values
        drawn.plot(*with_gaps(result, time, column(result, "u", name).values), color=style.COLORS["first"])
        if shade:
            away = result["mode"].values > 0
            drawn.fill_between(
                time, 0, 1, where=away, transform=drawn.get_xaxis_transform(),
                color=style.COLORS["zone"], alpha=0.25, linewidth=0,
            )  # fmt: skip
        drawn.margins(x=0)
        name_plane(drawn, result, "time", name)
    return drawn
