"""The gap: where contact begins as the forcing is stepped, and records with contact fitted segment by segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error
from nonsmooth.plot.identification.residuals import residual_strip
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["grazing", "multiple_shooting"]


def grazing(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the largest displacement over the stepped setting, free runs and runs with contact told apart.

    Parameters
    ----------
    finding
        A gap from grazing, or its data: ``setting``, ``amplitude``, ``contact`` over ``run``; ``grazing_setting``,
        ``grazing_low``, ``grazing_high``, ``gap``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "setting", "amplitude")
    setting, height = data["setting"].values, data["amplitude"].values
    contact = data["contact"].values.astype(bool) if "contact" in data else np.zeros(len(setting), dtype=bool)
    error = data["amplitude_error"].values if "amplitude_error" in data else np.full(len(setting), np.nan)
    with style.axes(ax) as drawn:
        for chosen, face, word in ((~contact, "white", "free"), (contact, MEASURED, "contact")):
            if chosen.any():
                drawn.errorbar(
                    setting[chosen], height[chosen], yerr=error[chosen] if np.isfinite(error).any() else None, fmt="o",
                    color=MEASURED, markerfacecolor=face, markersize=3, markeredgewidth=0.7, elinewidth=0.6,
                    label=f"{measured_label(data)}, {word}",
                )  # fmt: skip
        low, high = number(data, "grazing_low"), number(data, "grazing_high")
        if np.isfinite(low) and np.isfinite(high):
            drawn.axvspan(
                low, high, color=style.COLORS["zone"], alpha=0.3, linewidth=0, zorder=0, label="first contact"
            )
        if np.isfinite(gap := number(data, "gap")):
            text = with_error(1e3 * gap, 1e3 * number(data, "gap_error"), "mm")
            drawn.axhline(gap, color=style.COLORS["second"], linestyle="--", linewidth=0.9, label=f"$g$ = {text}")
        drawn.legend(**ABOVE, ncols=2, columnspacing=1.0)
        attrs = data["setting"].attrs
        setting_named = str(attrs.get("long_name", "setting")), str(attrs.get("units", ""))
        name_axes(drawn, setting_named, ("largest displacement", "m"))
    return drawn


def multiple_shooting(finding: Any, ax: Axes | None = None, *, seconds: float = 6.0) -> Axes:
    """Draw a record with contact, the segments fitted to it, and their residuals.

    Parameters
    ----------
    finding
        Contact parameters from multiple shooting, or their data: ``x``, ``fitted``, ``residual``, ``segment``,
        ``in_contact`` over ``time``; ``gap``.
    ax
        Where to draw; a new one-column figure if None.
    seconds
        Length shown, from the first fitted sample on.
    """
    data = data_of(finding, "x", "fitted", "time")
    time, x, fitted = data["time"].values, data["x"].values, data["fitted"].values
    residual = data["residual"].values if "residual" in data else x - fitted
    used = np.flatnonzero(np.isfinite(fitted))
    if not len(used):
        raise ValueError("no sample of this record was fitted")
    shown = (time >= time[used[0]]) & (time <= time[used[0]] + seconds)
    with style.axes(ax, ratio=0.9) as drawn:
        drawn.plot(time[shown], x[shown], ".", color=MEASURED, markersize=2, label=measured_label(data))
        segment = data["segment"].values[shown] if "segment" in data else np.zeros(np.count_nonzero(shown))
        cut = np.flatnonzero(np.diff(segment) != 0) + 1
        curve = np.insert(np.where(segment >= 0, fitted[shown], np.nan), cut, np.nan)
        drawn.plot(
            np.insert(time[shown], cut, np.nan), curve, color=style.COLORS["first"], linewidth=0.9,
            label="fitted, segment by segment",
        )  # fmt: skip
        if "in_contact" in data:
            drawn.fill_between(
                time[shown], 0, 1, where=data["in_contact"].values[shown].astype(bool), color=style.COLORS["zone"],
                transform=drawn.get_xaxis_transform(), alpha=0.3, linewidth=0, zorder=0, label="contact",
            )  # fmt: skip
        if np.isfinite(gap := number(data, "gap")):
            text = with_error(1e3 * gap, 1e3 * number(data, "gap_error"), "mm")
            drawn.axhline(gap, color=style.COLORS["second"], linestyle="--", linewidth=0.8, label=f"$g$ = {text}")
        drawn.margins(x=0)
        drawn.legend(**ABOVE, ncols=2, columnspacing=1.0, markerscale=2)
        name_axes(drawn, ("time", "s"), ("displacement", "m"))
        residual_strip(drawn, "m", (time[shown], residual[shown], {}))
    return drawn
