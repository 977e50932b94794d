"""Floquet multipliers in the complex plane, with the unit circle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import name_and_unit, name_axes, variable_along

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["multipliers"]


def multipliers(result: xr.Dataset | Any, ax: Axes | None = None, *, limit: float | None = None) -> Axes:
    """Draw the Floquet multipliers of an orbit, or those along a branch coloured by its parameter.

    Parameters
    ----------
    result
        An ``Orbit``, its Dataset, or a ``continue_orbit``.
    ax
        Where to draw; a new one-column figure if None.
    limit
        Half width of the picture; by default what holds the unit circle and the multipliers, but no more than 4: near
        a rigid graze one multiplier goes to infinity. Those outside are counted in the title.
    """
    data = result.to_dataset() if hasattr(result, "to_dataset") and not hasattr(result, "data_vars") else result
    variable_along(data, "floquet_multipliers", "find_orbit or continue_orbit")
    values = data["floquet_multipliers"]
    along = "point" in values.dims
    mu = values.transpose("point", ...).values if along else values.values[None, :]
    finite = mu[np.isfinite(mu)]
    size = max([1.0, *np.abs(finite.real), *np.abs(finite.imag)]) * 1.12
    half = min(size, 4.0) if limit is None else float(limit)
    outside = int(((np.abs(mu.real) > half) | (np.abs(mu.imag) > half) | ~np.isfinite(mu)).any(axis=1).sum())
    with style.axes(ax, ratio=0.9) as drawn:
        angle = np.linspace(0, 2 * np.pi, 361)
        drawn.plot(np.cos(angle), np.sin(angle), color=style.COLORS["muted"], linewidth=0.6, zorder=1)
        for line in (drawn.axhline, drawn.axvline):
            line(0.0, color=style.COLORS["muted"], linewidth=0.3, zorder=0)
        if along:
            name = str(data.attrs["parameter"])
            shade = np.broadcast_to(data[name].values[:, None], mu.shape)
            dots = drawn.scatter(
                mu.real.ravel(), mu.imag.ravel(), c=shade.ravel(), s=4, cmap="viridis", linewidths=0, zorder=3
            )
            name_axes(drawn.figure.colorbar(dots, ax=drawn).ax, y=name_and_unit(data, name))
        else:
            drawn.plot(mu.real.ravel(), mu.imag.ravel(), "o", color=style.COLORS["first"], markersize=3.5, zorder=3)
        drawn.set(
            xlabel=r"Re $\mu$", ylabel=r"Im $\mu$", xlim=(-half, half), ylim=(-half, half), aspect="equal",
        )  # fmt: skip
        if outside:
            drawn.set_title(f"{outside} of {len(mu)} points reach outside" if along else "a multiplier lies outside")
    return drawn
