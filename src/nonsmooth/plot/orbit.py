"""A periodic orbit in the plane of two states: its modes, crossings, section points, nearest approach to a graze."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.labels import first_states
from nonsmooth.plot.phase_portrait import phase_portrait

if TYPE_CHECKING:
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
        mark: dict[str, Any] = {"size": 3.4, "zorder": 5, "markeredgewidth": 0.7}
        if run.sizes["crossing"]:
            sides = (np.concatenate([run[key].sel(state=name) for key in ("u_before", "u_after")]) for name in names)
            style.mark(drawn, sides, "o", "crossing", **mark)
        # Phase 0 of each forcing period; of an autonomous orbit the one state it is held by.
        returns = max(result.period_number, 1)
        time = run["time"].values
        at = [int(np.abs(time - k * result.period / returns).argmin()) for k in range(returns)]
        points = (run["u"].sel(state=name).values[at] for name in names)
        style.mark(drawn, points, "o", "section", **mark, markerfacecolor=style.COLORS["section"])
        clearance = run["touch_clearance"].values
        if np.isfinite(clearance).any():
            near = int(np.nanargmin(clearance))
            words = f"least clearance {clearance[near]:.2g}"
            place = [run["touch_u"].sel(state=name).values[near] for name in names]
            cross: dict[str, Any] = {"color": style.COLORS["fourth"], "markersize": 5, "markeredgewidth": 1.1}
            drawn.plot(*place, "x", zorder=6, label=words, **cross)
        style.clear_legend(drawn)
    return drawn
