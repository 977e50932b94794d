"""Lines through readings: force over displacement of slow pulls, and calibrations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.identification.picture import Picture, number, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["calibration", "force_displacement"]

SHOWN = 600
#: What the sign of ``pull`` means, and the colour of its residuals.
_WAYS = {1: ("growing", "first"), -1: ("falling", "zone")}


def force_displacement(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the samples of slow pulls, the fitted lines and their slopes; below, what the mean line leaves.

    Where the data say which way the car was moved, the two ways have two colours: they differ by twice the friction.

    Parameters
    ----------
    finding
        A stiffness (``k`` or ``k_s``), or its data: ``displacement``, ``force`` over ``sample`` and ``slope``,
        ``intercept`` over ``line``.
    ax
        Where to draw; a new one-column figure if None.
    """
    needed, labels = "displacement force slope intercept", (("displacement", "m"), ("force", "N"))
    with picture(finding, ax, needed, *labels, margin=0.03, ratio=0.85) as one:
        x, force, slopes, intercepts = map(np.atleast_1d, one.values("displacement", "force", "slope", "intercept"))
        # Thinned for the eye only: half of the samples lie on top of each other.
        shown = np.linspace(0, len(x) - 1, min(SHOWN, len(x))).astype(int)
        one.cloud(x[shown], force[shown])
        ends = np.array([np.nanmin(x), np.nanmax(x)])
        alike = len(slopes) == 1 or np.ptp(slopes) < 1e-9 * abs(slopes[0])  # one slope was fitted to all
        many = f"{len(slopes)} lines, slopes {slopes.min():.4g} to {slopes.max():.4g} N/m"
        label = one.text("slope", "N/m", before="slope ") if alike else many
        for slope, intercept in zip(slopes, intercepts, strict=True):
            one.line(ends, intercept + slope * ends, label, "second", linewidth=1.6, alpha=0.7)
        one.note(0.97, 0.36, one.text("friction_force", "mN", 1e3, "friction "))
        at, left = x[shown], (force - float(np.mean(slopes)) * x - float(np.mean(intercepts)))[shown]
        if "pull" not in one.data:
            one.residual(at, left)
        else:
            for way, (words, color) in _WAYS.items():
                here = one.data["pull"].values[shown] * way > 0
                one.residual(at[here], left[here], f"residual, displacement {words}", color=style.COLORS[color])
    return one.ax


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
    with picture(finding, ax, "setting reading", "setting", "reading", columns=3, margin=0.03, ratio=0.85) as one:
        setting, reading = one.values("setting", "reading")
        if "fitted" in one.data:
            at, fitted = one.values("setting_fine", "fitted")
            # No further than to zero: what is measured here has one sign.
            there = fitted * np.sign(np.mean(reading)) >= 0
            one.line(at[there], fitted[there], "fitted")
            band = None
            if "fitted_low" in one.data:
                band = [at[there], *((one.data[f"fitted_{end}"].values - fitted)[there] for end in ("low", "high"))]
                looks: dict[str, Any] = {"color": style.COLORS["first"], "alpha": 0.25, "linewidth": 0}
                one.ax.fill_between([], [], label="its 95 % band (below)", **looks)
            error = one.data["reading_error"].values if "reading_error" in one.data else None
            one.residual(setting, reading - np.interp(setting, at, fitted), error=error, band=band, marker="o")
        one.points("setting", "reading")
        one.note(0.04, 0.96, _law(one))
    return one.ax


def _law(one: Picture) -> str:
    slope, intercept, error = (number(one.data, name) for name in ("slope", "intercept", "intercept_error"))
    units = [str(one.data[name].attrs.get("units", "")) for name in ("reading", "setting")]
    text = one.text("slope", ("/" if all(units) and "/" not in units[0] else " per ").join(units), before="slope ")
    # a line that does not pass through the origin: where it begins
    away = abs(intercept) > 5 * error and np.isfinite(intercept / slope)
    return f"{text},\nfrom {-intercept / slope:.4g} {units[1]} on" if away and text else text
