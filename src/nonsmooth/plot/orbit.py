"""A periodic orbit in the plane of two states: its modes, crossings, section points, nearest approach to a graze."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import first_states
from nonsmooth.plot.phase_portrait import phase_portrait

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["orbit"]


def orbit(result: Any, ax: Axes | None = None, *, x: str | None = None, y: str | None = None) -> Axes:
    """Draw an orbit once round, each mode in its own colour.

    Open circles are the states just before and after each transition, black dots the section points, and a cross is the
    place where the orbit comes nearest to a transition that does not happen.

    Parameters
    ----------
    result
        An ``Orbit``, or its Dataset.
    ax
        Where to draw; a new one-column figure if None.
    x, y
        The states of the two axes; by default the first two.
    """
    from nonsmooth.continuation.branches.orbit import Orbit

    if not isinstance(result, Orbit):
        result = Orbit.from_dataset(result)
    run = result.trajectory()
    names = first_states(run, x, y)
    with style.axes(ax, ratio=0.85) as drawn:
        phase_portrait(run, drawn, x=names[0], y=names[1])
        _dots(drawn, [_sides(run, name) for name in names], "o", "white", "crossing")
        _dots(drawn, [_section(result, run, name) for name in names], "o", style.COLORS["section"], "section")
        near = _nearest(run)
        if near is not None:
            words = f"least clearance {near[1]:.2g}"
            at = [run["touch_u"].sel(state=name).values[near[0]] for name in names]
            drawn.plot(*at, "x", color=style.COLORS["fourth"], markersize=5, markeredgewidth=1.1, zorder=6, label=words)
        style.clear_legend(drawn)
    return drawn


def _sides(run: xr.Dataset, name: str) -> Any:
    return np.concatenate([run[side].sel(state=name).values for side in ("u_before", "u_after")])


def _section(found: Any, run: xr.Dataset, name: str) -> Any:
    """The states at phase 0 of each forcing period; of an autonomous orbit the one state it is held by."""
    returns = max(found.period_number, 1)
    along = run["time"].values
    at = np.arange(returns) * found.period / returns
    return np.array([run["u"].sel(state=name).values[int(np.abs(along - t).argmin())] for t in at])


def _dots(ax: Axes, points: list[Any], marker: str, face: str, words: str) -> None:
    if len(points[0]):
        ax.plot(
            *points, marker, linestyle="none", markersize=3.4, markerfacecolor=face, zorder=5,
            markeredgecolor=style.COLORS["section"], markeredgewidth=0.7, label=words,
        )  # fmt: skip


def _nearest(run: xr.Dataset) -> tuple[int, float] | None:
    """Touch that leaves the least distance, and this distance; None where the orbit comes near no other transition."""
    clearance = run["touch_clearance"].values
    if not np.isfinite(clearance).any():
        return None
    at = int(np.nanargmin(clearance))
    return at, float(clearance[at])
