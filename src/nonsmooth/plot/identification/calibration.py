"""A calibration: readings over settings with the fitted line and its 95 % band, residuals below."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error
from nonsmooth.plot.identification.residuals import residual_strip
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["calibration"]


def calibration(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw a calibration: frequency over motor voltage, or the forcing's amplitude over the crank's length.

    Parameters
    ----------
    finding
        A calibration, or its data: ``setting``, ``reading``, ``reading_error`` over ``run``; ``setting_fine`` with
        ``fitted``, ``fitted_low``, ``fitted_high``; ``slope``, ``intercept``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "setting", "reading")
    error = data["reading_error"].values if "reading_error" in data else None
    with style.axes(ax, ratio=0.85) as drawn:
        setting, reading = data["setting"].values, data["reading"].values
        if "fitted" in data:
            at, fitted = data["setting_fine"].values, data["fitted"].values
            # No further than to zero: what is measured here has one sign.
            there = fitted * np.sign(np.mean(reading)) >= 0
            drawn.plot(at[there], fitted[there], color=style.COLORS["first"], label="fitted")
        drawn.errorbar(
            setting, reading, yerr=error, fmt="o", color=MEASURED, markersize=2.8,
            elinewidth=0.6, label=measured_label(data), zorder=4,
        )  # fmt: skip
        drawn.margins(x=0.03)
        size = style.small(drawn)
        drawn.annotate(_law(data), (0.04, 0.96), xycoords="axes fraction", va="top", fontsize=size)
        name_axes(drawn, _named(data, "setting"), _named(data, "reading"))
        if "fitted" in data:
            left = reading - np.interp(setting, at, fitted)
            band = None
            if "fitted_low" in data:
                low, high = (data[f"fitted_{end}"].values - fitted for end in ("low", "high"))
                band = at[there], low[there], high[there]
                drawn.fill_between(
                    [], [], color=style.COLORS["first"], alpha=0.25, linewidth=0, label="its 95 % band (below)"
                )
            unit, dots = str(data["reading"].attrs.get("units", "")), {"marker": "o", "markersize": 2}
            residual_strip(drawn, unit, (setting, left, dots), error=error, band=band)
        drawn.legend(**ABOVE, ncols=3, columnspacing=1.0)
    return drawn


def _named(data: xr.Dataset, name: str) -> tuple[str, str]:
    attrs = data[name].attrs
    return str(attrs.get("long_name", name)), str(attrs.get("units", ""))


def _law(data: xr.Dataset) -> str:
    slope = number(data, "slope")
    if not np.isfinite(slope):
        return ""
    slope_error, offset = number(data, "slope_error"), -number(data, "intercept") / slope
    units = [str(data[name].attrs.get("units", "")) for name in ("reading", "setting")]
    per = f"{units[0]}/{units[1]}" if all(units) and "/" not in units[0] else f"{units[0]} per {units[1]}"
    text = f"slope {with_error(slope, slope_error, per)}"
    # a line that does not pass through the origin: where it begins
    away = abs(number(data, "intercept")) > 5 * number(data, "intercept_error")
    return f"{text},\nfrom {offset:.4g} {units[1]} on" if away and np.isfinite(offset) else text
