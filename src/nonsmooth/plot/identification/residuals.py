"""A strip of residuals at the foot of a picture: what is left of the data when the fit is taken away."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.plot import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["residual_strip"]

SHARE = 0.30  # of the height of the axes


def residual_strip(
    ax: Axes,
    x: NDArray[Any],
    residual: NDArray[np.float64],
    label: str,
    *,
    colors: Any = None,
    error: NDArray[np.float64] | None = None,
) -> Axes:
    """Make room below what is drawn, and draw the residuals there against an axis of their own on the right.

    Call it last: the limits of ``ax`` as they are become the upper part.
    """
    from matplotlib.ticker import FixedLocator, MaxNLocator

    low, high = ax.get_ylim()
    foot = low - SHARE / (1 - SHARE) * (high - low)
    ticks = [tick for tick in ax.get_yticks() if low <= tick <= high]
    ax.set_ylim(foot, high)
    ax.yaxis.set_major_locator(FixedLocator(ticks))
    ax.axhline(low, color=style.COLORS["section"], linewidth=0.5)
    strip = ax.twinx()
    far = np.abs(residual) + (0.0 if error is None else error)
    reach = 1.15 * float(np.nanmax(far)) or 1.0
    strip.set_ylim(-reach, -reach + 2 * reach / SHARE)
    if error is not None:
        strip.errorbar(x, residual, yerr=error, fmt="o", color=style.COLORS["section"], markersize=2, elinewidth=0.6)
    elif colors is None:
        strip.plot(x, residual, ".", color=style.COLORS["section"], markersize=1.6, markeredgewidth=0, rasterized=True)
    else:
        strip.scatter(x, residual, c=colors, s=1.2, linewidths=0, rasterized=True)
    strip.axhline(0, color=style.COLORS["muted"], linewidth=0.5)
    marks = [tick for tick in MaxNLocator(3, symmetric=True).tick_values(-reach, reach) if abs(tick) < reach]
    strip.yaxis.set_major_locator(FixedLocator(marks))
    strip.set_ylabel(label, y=SHARE / 2, ha="center")
    ax.tick_params(right=False)
    return strip
