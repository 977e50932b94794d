"""Free decays: heights of the peaks over time, straight where damping is viscous, bent where friction takes part."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["drop_decay", "free_decay"]


def free_decay(finding: Any, ax: Axes | None = None) -> Axes:
    r"""Draw the heights of a free decay's peaks on a logarithmic scale, with the fitted envelopes.

    Viscous damping alone gives a straight line. Dry friction takes a constant part from each half cycle and bends it
    down towards the end.

    Parameters
    ----------
    finding
        A damping found from free decays, or its data: ``peak_time``, ``peak_height`` over ``peak`` (and
        ``peak_run``); ``envelope_viscous``, ``envelope_both`` over ``fine_time``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "peak_time", "peak_height")
    time, height = data["peak_time"].values, 1e3 * data["peak_height"].values
    with style.axes(ax) as drawn:
        error = 1e3 * data["peak_height_error"].values if "peak_height_error" in data else None
        drawn.errorbar(
            time, height, yerr=error, fmt="o", color=MEASURED, markersize=2.6, elinewidth=0.6, zorder=4,
            label=f"peaks, {measured_label(data)}",
        )  # fmt: skip
        for name, word, color, line in (
            ("envelope_both", "viscous and dry", "first", "-"), ("envelope_viscous", "viscous alone", "second", "--"),
        ):  # fmt: skip
            if name in data:
                curve = 1e3 * data[name].values
                shown = curve > 0
                drawn.plot(data["fine_time"].values[shown], curve[shown], line, color=style.COLORS[color], label=word)
        drawn.set_yscale("log")
        drawn.set_ylim(0.5 * np.nanmin(height[height > 0]), 1.6 * np.nanmax(height))
        drawn.margins(x=0.02)
        parts = []
        if np.isfinite(c := number(data, "c")):
            parts.append(f"$c$ = {with_error(c, number(data, 'c_error'), 'N s/m')}")
        if np.isfinite(friction := number(data, "friction_force")):
            parts.append(f"friction {with_error(1e3 * friction, 1e3 * number(data, 'friction_force_error'), 'mN')}")
        if parts:
            drawn.annotate("\n".join(parts), (0.04, 0.06), xycoords="axes fraction", fontsize=style.small(drawn))
        drawn.legend(loc="upper right")
        drawn.set(xlabel="time (s)", ylabel="peak height (mm)")
    return drawn


def drop_decay(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the logarithm of the peaks' heights of the support's free decay with its regression line.

    Parameters
    ----------
    finding
        The support's damping, or its data: ``peak_time``, ``log_height`` (and ``log_height_error``, ``used``) over
        ``peak``; ``slope``, ``intercept``, ``damping_ratio``. Of several runs (``peak_run``) each has its own
        ``intercept``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "peak_time", "log_height", "slope", "intercept")
    time, height = data["peak_time"].values, data["log_height"].values
    used = data["used"].values.astype(bool) if "used" in data else np.ones(len(time), dtype=bool)
    runs = data["peak_run"].values if "peak_run" in data else np.zeros(len(time), dtype=int)
    error = data["log_height_error"].values if "log_height_error" in data else np.full(len(time), np.nan)
    with style.axes(ax) as drawn:
        for chosen, face, word in ((used, MEASURED, "used"), (~used, "white", "left out")):
            if chosen.any():
                drawn.errorbar(
                    time[chosen], height[chosen], yerr=error[chosen] if np.isfinite(error).any() else None, fmt="o",
                    color=MEASURED, markerfacecolor=face, markersize=2.4, markeredgewidth=0.6, elinewidth=0.5,
                    label=f"{measured_label(data)}, {word}" if (~used).any() else measured_label(data), zorder=3,
                )  # fmt: skip
        slope = number(data, "slope") if data["slope"].ndim == 0 else float(data["slope"].values.mean())
        intercepts = np.atleast_1d(data["intercept"].values)
        for k, run in enumerate(np.unique(runs[used])):
            mine = used & (runs == run)
            ends = np.array([time[mine].min(), time[mine].max()])
            zeta = with_error(number(data, "damping_ratio"), number(data, "damping_ratio_error"))
            drawn.plot(
                ends, intercepts[min(k, len(intercepts) - 1)] + slope * ends, color=style.COLORS["second"], zorder=4,
                label=rf"regression, $\xi_s$ = {zeta}" if k == 0 else None,
            )  # fmt: skip
        drawn.margins(x=0.02)
        drawn.legend(loc="upper right")
        drawn.set(xlabel="time (s)", ylabel="ln (peak height / m)")
    return drawn
