"""Force over displacement with its fitted lines: a spring's stiffness, and friction between pull and return."""

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

__all__ = ["force_displacement"]

SHOWN = 600
#: What the sign of ``pull`` means, and how its residuals look.
_WAYS: dict[int, tuple[str, dict[str, Any]]] = {
    1: ("displacement growing", {"color": style.COLORS["first"], "markersize": 2.4}),
    -1: ("displacement falling", {"color": style.COLORS["zone"], "markersize": 2.4}),
}


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
    data = data_of(finding, "displacement", "force", "slope", "intercept")
    x, force = data["displacement"].values, data["force"].values
    with style.axes(ax, ratio=0.85) as drawn:
        # Thinned for the eye only: half of the samples lie on top of each other.
        shown = np.linspace(0, len(x) - 1, min(SHOWN, len(x))).astype(int)
        drawn.plot(
            x[shown], force[shown], ".", color=MEASURED, markersize=2, markeredgewidth=0, zorder=3, rasterized=True,
            label=measured_label(data),
        )  # fmt: skip
        ends = np.array([np.nanmin(x), np.nanmax(x)])
        slopes, errors = np.atleast_1d(data["slope"].values), np.full(data["slope"].size, np.nan)
        if "slope_error" in data:
            errors = np.atleast_1d(data["slope_error"].values)
        intercepts = np.atleast_1d(data["intercept"].values)
        for i, (slope, intercept) in enumerate(zip(slopes, intercepts, strict=True)):
            drawn.plot(
                ends, intercept + slope * ends, color=style.COLORS["second"], linewidth=1.6, alpha=0.7,
                label=_lines_label(slopes, errors) if i == 0 else None,
            )  # fmt: skip
        left = (force - float(np.mean(slopes)) * x - float(np.mean(intercepts)))[shown]
        friction = number(data, "friction_force")
        if np.isfinite(friction):
            text = with_error(1e3 * friction, 1e3 * number(data, "friction_force_error"), "mN")
            drawn.annotate(
                f"friction {text}", (0.97, 0.36), xycoords="axes fraction", ha="right", fontsize=style.small(drawn)
            )
        drawn.margins(x=0.03)
        name_axes(drawn, ("displacement", "m"), ("force", "N"))
        series: list[tuple[Any, Any, Any]] = [(x[shown], left, {})]
        if "pull" in data:
            pulls = data["pull"].values[shown]
            series = [(x[shown][pulls * way > 0], left[pulls * way > 0], looks) for way, (_, looks) in _WAYS.items()]
            for words, looks in _WAYS.values():  # in the legend of the picture itself
                drawn.plot([], [], ".", label=f"residual, {words}", **looks)
        residual_strip(drawn, "N", *series)
        style.even_dots(drawn.legend(**ABOVE, ncols=2, handlelength=1.4, columnspacing=1.0))
    return drawn


def _lines_label(slopes: np.ndarray, errors: np.ndarray) -> str:
    if len(slopes) == 1:
        return f"slope {with_error(float(slopes[0]), float(errors[0]), 'N/m')}"
    if np.ptp(slopes) < 1e-9 * abs(slopes[0]):  # one slope was fitted to all
        return f"slope {with_error(float(slopes[0]), float(errors[0]), 'N/m')}"
    return f"{len(slopes)} lines, slopes {slopes.min():.4g} to {slopes.max():.4g} N/m"
