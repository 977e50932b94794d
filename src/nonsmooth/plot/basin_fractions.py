"""The multistability diagram: every attractor over a parameter, with its share of the starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import palette, style
from nonsmooth.plot.basins import told_apart
from nonsmooth.plot.labels import name_and_unit, name_axes, only_states, variable_along
from nonsmooth.results.labels import kind_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["basin_fractions"]

_LARGEST = 7.0  # diameter in points of an attractor that all starts reach


def basin_fractions(result: xr.Dataset, ax: Axes | None = None, *, y: str | None = None) -> Axes:
    """Draw the result of ``basin_fractions``.

    Parameters
    ----------
    result
        Of ``basin_fractions``.
    ax
        Where to draw; a new one-column figure if None.
    y
        A state: its maximum on each attractor is drawn, with the area of a point in proportion to the share. By
        default the shares themselves, one upon the other.

    Raises
    ------
    ValueError
        A result of another verb, a name that is no state.
    """
    variable_along(result, "n_starts_99", "basin_fractions")
    parameter = str(result["n_starts_99"].dims[0])
    if y is not None:
        only_states(result, y)
    result = result.sortby(parameter)
    with style.axes(ax, ratio=0.85) as drawn:
        values = result[parameter].values
        if y is None:
            _shares(result, drawn, values)
            drawn.set(ylabel="share of starts (%)", ylim=(0, 100))
        else:
            _maxima(result, drawn, values, y)
            text, unit = name_and_unit(result, y)
            name_axes(drawn, y=(f"max {text}", unit))
        drawn.margins(x=0)
        name_axes(drawn, name_and_unit(result, parameter))
        drawn.legend(  # above the axes, and above the power of ten of the ordinate
            loc="lower center", bbox_to_anchor=(0.5, 1.0 if y is None else 1.06), ncols=2, handlelength=1.0,
            handleheight=1.0, columnspacing=1.0,
        )  # fmt: skip
    return drawn


def _names(result: xr.Dataset, k: int) -> str:
    """Kinds of an attractor along the parameter, each once, in the order met."""
    there = np.flatnonzero(result["period_number"].values[:, k] >= 0)
    if "name" in result:
        kinds = [str(result["name"].values[i, k]) for i in there]
    else:
        periods, chaotic = (result[key].values[:, k] for key in ("period_number", "chaotic"))
        kinds = [kind_of(int(periods[i]), bool(chaotic[i])) for i in there]
    distinct = list(dict.fromkeys(kinds))
    numbers = [kind.removeprefix("period ") for kind in distinct if kind.startswith("period")]
    words = [f"period {', '.join(numbers)}"] if numbers else []
    return ", ".join(words + [kind for kind in distinct if not kind.startswith("period")])


def _all_names(result: xr.Dataset) -> list[str]:
    return told_apart([_names(result, k) for k in range(result.sizes["attractor"])])


def _shares(result: xr.Dataset, drawn: Axes, values: np.ndarray) -> None:
    shares = [100 * result["fraction"].values[:, k] for k in range(result.sizes["attractor"])]
    shares.append(100 * (result["not_converged"] + result["diverged"]).values)
    colors = [palette.attractor_color(k) for k in range(len(shares) - 1)] + [palette.UNKNOWN]
    names = [*_all_names(result), "none reached"]
    if not shares[-1].any():
        shares, colors, names = shares[:-1], colors[:-1], names[:-1]
    drawn.stackplot(values, *shares, colors=colors, labels=names, edgecolor="black", linewidth=0.3)


def _maxima(result: xr.Dataset, drawn: Axes, values: np.ndarray, y: str) -> None:
    for k, name in enumerate(_all_names(result)):
        heights = result["maximum"].sel(state=y).values[:, k]
        share = result["fraction"].values[:, k]
        good = np.isfinite(heights)
        drawn.plot(values[good], heights[good], ".", color=palette.attractor_color(k), markersize=1.5)
        drawn.scatter(
            values[good], heights[good], s=_LARGEST**2 * share[good], color=palette.attractor_color(k),
            edgecolors="black", linewidths=0.3,
        )  # fmt: skip
        drawn.scatter(  # of one size in the legend, whatever the share
            [], [], s=25, color=palette.attractor_color(k), edgecolors="black", linewidths=0.3, label=name
        )
