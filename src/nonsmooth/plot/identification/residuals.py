"""A strip of residuals at the foot of a picture: what is left of the data when the fit is taken away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["residual_strip"]

SHARE = 0.30  # of the height of the axes
_CLOUD: Mapping[str, Any] = {
    "marker": ".", "linestyle": "none", "color": MEASURED, "markersize": 1.6, "markeredgewidth": 0, "rasterized": True,
}  # fmt: skip


def residual_strip(
    ax: Axes,
    unit: str,
    *series: tuple[NDArray[Any], NDArray[np.float64], Mapping[str, Any]],
    error: NDArray[np.float64] | None = None,
    band: tuple[NDArray[Any], NDArray[np.float64], NDArray[np.float64]] | None = None,
) -> Axes:
    """Make room below what is drawn, and draw residuals there against an axis of their own on the right.

    Call it last: the limits of ``ax`` as they are become the upper part.

    Parameters
    ----------
    ax
        The axes of the picture.
    unit
        Of the residuals.
    *series
        Abscissae, residuals, and what looks different from small black dots.
    error
        Of the residuals of the first series, as bars.
    band
        Abscissae, lower and upper bound of a band about the fit, less the fit.
    """
    from matplotlib.ticker import FixedLocator, MaxNLocator

    from nonsmooth.plot.units import name_axis

    low, high = ax.get_ylim()
    foot = low - SHARE / (1 - SHARE) * (high - low)
    ticks = [tick for tick in ax.get_yticks() if low <= tick <= high]
    ax.set_ylim(foot, high)
    ax.yaxis.set_major_locator(FixedLocator(ticks))
    ax.axhline(low, color=style.COLORS["section"], linewidth=0.5)
    strip = ax.twinx()
    wide = 0.0 if error is None else error
    far = [np.abs(left) + (wide if k == 0 else 0.0) for k, (_, left, _) in enumerate(series)]
    far += [] if band is None else [np.abs(np.concatenate(band[1:]))]
    reach = 1.15 * max(float(np.nanmax(one)) for one in far) or 1.0
    strip.set_ylim(-reach, -reach + 2 * reach / SHARE)
    if band is not None:
        strip.fill_between(*band, color=style.COLORS["first"], alpha=0.25, linewidth=0)
    for k, (x, left, looks) in enumerate(series):
        strip.plot(x, left, **{**_CLOUD, **looks})
        if k == 0 and error is not None:
            strip.errorbar(x, left, yerr=error, fmt="none", ecolor=looks.get("color", MEASURED), elinewidth=0.6)
    strip.axhline(0, color=style.COLORS["muted"], linewidth=0.5)
    marks: Sequence[float] = [
        tick for tick in MaxNLocator(3, symmetric=True).tick_values(-reach, reach) if abs(tick) < reach
    ]
    strip.yaxis.set_major_locator(FixedLocator(marks))
    name_axis(strip.yaxis, "residual", unit, max(marks))
    strip.yaxis.label.set(y=SHARE / 2, horizontalalignment="center")
    ax.tick_params(right=False)
    return strip
