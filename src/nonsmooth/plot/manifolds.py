"""Stable and unstable manifolds of a saddle orbit in the section."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import name_plane, only_states, variable_along, words_of_flags

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["manifolds"]


def manifolds(
    result: xr.Dataset, ax: Axes | None = None, *, x: str | None = None, y: str | None = None, linewidth: float = 0.6
) -> Axes:
    """Draw the manifolds of a saddle in the plane of two states, with the saddle's own section points.

    Parameters
    ----------
    result
        A result of ``manifolds``. Lines are broken where the section map jumps.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the two axes; by default the first two.
    linewidth
        In typographic points.
    """
    variable_along(result, "arc_length", "manifolds")
    names = only_states(result, x, y)
    kinds = words_of_flags(result["manifold"])
    columns = [result["section"].sel(state=name).values for name in names]
    saddle = [result["orbit_section"].sel(state=name).values for name in names]
    numbers, piece = result["arc_number"].values, result["piece"].values
    with style.axes(ax, ratio=0.85) as drawn:
        for number, code in enumerate(result["manifold"].values):
            chosen = np.flatnonzero(numbers == number)
            if not len(chosen):
                continue
            breaks = np.flatnonzero(np.diff(piece[chosen]) > 0) + 1
            kind = kinds[int(code)]
            color = "second" if kind == "unstable" else "first"
            # Each arc begins at the orbit itself.
            j = int(result["orbit_point"].values[number])
            xs, ys = (
                np.insert(np.insert(values[chosen], breaks, np.nan), 0, own[j])
                for values, own in zip(columns, saddle, strict=True)
            )
            drawn.plot(
                xs, ys, color=style.COLORS[color], linewidth=linewidth, zorder=3 if kind == "unstable" else 2,
                label=style.once(drawn, f"{kind} manifold"),
            )  # fmt: skip
        style.mark(drawn, saddle, "o", "saddle", zorder=5)
        name_plane(drawn, result, *names)
        style.clear_legend(drawn)
    return drawn
