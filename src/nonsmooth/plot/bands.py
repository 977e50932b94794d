"""Bands of the results of ``propagate``, which has for a variable ``x`` its ``x_quantiles``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.plot import style

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

_QUANTILES = "_quantiles"


def ends_of(result: xr.Dataset) -> list[xr.Dataset]:
    """A result with its lowest, and with its highest quantiles in place of the values; none where it has no bands."""
    names = [str(name) for name in result.data_vars if str(name).endswith(_QUANTILES)]
    if not names:
        return []
    ends = (result[names].isel(quantile=at, drop=True) for at in (0, -1))
    return [result.assign({name.removesuffix(_QUANTILES): end[name] for name in names}) for end in ends]


def fill(ax: Axes, result: xr.Dataset, x: Any, low: FloatArray, high: FloatArray, *, color: str) -> None:
    """Fill the band between two curves, named in the legend once; none where what is drawn has no quantiles."""
    if np.array_equal(low, high, equal_nan=True):
        return
    share = 100.0 * float(result["quantile"][-1] - result["quantile"][0])
    label = style.once(ax, f"{share:.4g} % band")
    ax.fill_between(x, low, high, color=color, alpha=0.25, linewidth=0, zorder=0.7, label=label)


def bars(ax: Axes, ends: list[xr.Dataset], heights: FloatArray) -> None:
    """Bars over the quantiles of special points, at their heights (lines, special); none without ``ends``."""
    for row in heights if ends else ():
        low, high = (one["special_value"].values for one in ends)
        ax.hlines(row, low, high, color=style.COLORS["section"], linewidth=0.8, zorder=6)
