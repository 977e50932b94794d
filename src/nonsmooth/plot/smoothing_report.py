"""Differences between smoothed systems and the event-driven one, over the half width of the bands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["smoothing_report"]

_QUANTITIES = {
    "state": r"difference of the states, $d_u$", "multiplier": r"difference of the multipliers, $d_\mu$",
    "exponent": "difference of the exponents", "period": "relative difference of the period",
}  # fmt: skip
_MARKS = {"linear": ("first", "o"), "tanh": ("second", "s"), "arctan": ("third", "^")}
_LOST = 0.04  # height of the mark where there is no such orbit, in the axes


def smoothing_report(result: xr.Dataset, ax: Axes | None = None, *, y: str = "state") -> Axes:
    """Draw the result of ``smoothing_report``: one line for each band, with its order at the smallest widths.

    Parameters
    ----------
    result
        Of ``smoothing_report``.
    ax
        Where to draw; a new one-column figure if None.
    y
        ``"state"``, ``"multiplier"``, ``"exponent"`` or ``"period"``. An orbit that is unstable where the event-driven
        one is stable, or the other way round, is hollow; a cross at the lower edge is a width at which a band
        has no such orbit.

    Raises
    ------
    ValueError
        A result of another verb, or another quantity.
    """
    variable_along(result, "state_difference", "smoothing_report")
    if y not in _QUANTITIES:
        raise ValueError(f"y = {y!r} is one of {', '.join(_QUANTITIES)}")
    with style.axes(ax) as drawn:
        eta = result["eta"].values
        lost: set[float] = set()
        for band in result["band"].values:
            one = result.sel(band=band)
            color, mark = _MARKS[str(band)]
            values = one[f"{y}_difference"].values
            shown = np.isfinite(values) & (values > 0)
            orders = one[f"{y}_order"].values
            known = orders[np.isfinite(orders)]
            name = str(band) + (f", order {known[0]:.2f}" if len(known) else "")
            color = style.COLORS[color]
            drawn.plot(eta[shown], values[shown], "-", color=color, linewidth=0.8)
            drawn.plot([], [], mark, color=color, markersize=3.5, label=name)
            changed = one["stable"].values != bool(one["reference_stable"])
            for which, fill in ((shown & ~changed, color), (shown & changed, "none")):
                drawn.plot(eta[which], values[which], mark, color=color, markerfacecolor=fill, markersize=3.5)
            lost |= set(eta[one["status"].values != 0].tolist())
        if lost:
            drawn.plot(
                sorted(lost), [_LOST] * len(lost), "x", color=style.COLORS["section"], markersize=4,
                transform=drawn.get_xaxis_transform(), label="no such orbit",
            )  # fmt: skip
        drawn.set(xscale="log", yscale="log", xlabel=r"half width of the bands, $\eta$", ylabel=_QUANTITIES[y])
        drawn.legend()
    return drawn
