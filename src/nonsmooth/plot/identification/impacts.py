"""Impacts of a tossed body: its height with the impacts found, and their restitution over the speed of approach."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["restitution", "toss"]


def toss(time: Any, centre: Any, lowest: Any, impacts: Any, ax: Axes | None = None, *, unit: str = "m") -> Axes:
    """Draw the height of the centre and of the lowest corner over time, with the impacts that were found.

    Parameters
    ----------
    time, centre, lowest : array_like, shape (N,)
        Seconds, and heights.
    impacts : Dataset
        As ``corner_restitution`` finds them.
    ax
        Where to draw; a new one-column figure if None.
    unit : str
        Unit of the heights.
    """
    t = np.asarray(time)
    with style.axes(ax) as drawn:
        drawn.plot(t, np.asarray(centre), ".", color=MEASURED, markersize=2.2, label="centre")
        drawn.plot(t, np.asarray(lowest), ".", color=style.COLORS["muted"], markersize=2.2, label="lowest corner")
        single = impacts["single"].values.astype(bool)
        for chosen, color, line, word in (
            (single, "second", "-", "impact of one corner"), (~single, "muted", ":", "other impact"),
        ):  # fmt: skip
            for k, at in enumerate(impacts["impact_time"].values[chosen]):
                drawn.axvline(
                    at, ymax=0.72, color=style.COLORS[color], linestyle=line, linewidth=0.8,
                    label=word if k == 0 else None,
                )  # fmt: skip
        drawn.set_ylim(top=1.45 * float(np.max(np.asarray(centre))))
        drawn.margins(x=0.02)
        drawn.legend(loc="upper right", markerscale=2, ncols=2, columnspacing=1.0)
        drawn.set(xlabel="time (s)", ylabel=f"height ({unit})")
    return drawn


def restitution(impacts: Any, ax: Axes | None = None, *, unit: str = "m/s") -> Axes:
    """Draw the restitution of single impacts over the speed of approach, with their median.

    The bars are what half a sample of doubt about the instant of the impact does.

    Parameters
    ----------
    impacts : Dataset
        As ``corner_restitution`` finds them, or several joined along ``impact``.
    ax
        Where to draw; a new one-column figure if None.
    unit : str
        Unit of the velocities.
    """
    single = impacts.isel(impact=impacts["single"].values.astype(bool))
    e, speed = single["restitution"].values, -single["v_before"].values
    with style.axes(ax) as drawn:
        drawn.errorbar(
            speed, e, yerr=single["half_sample"].values, fmt="o", color=MEASURED, markersize=3, elinewidth=0.7,
            label=f"{len(e)} impacts of one corner",
        )  # fmt: skip
        if len(e):
            drawn.axhline(np.median(e), color=style.COLORS["first"], label=f"median {np.median(e):.2f}")
            drawn.axhspan(
                *np.quantile(e, [0.25, 0.75]), color=style.COLORS["first"], alpha=0.15, linewidth=0,
                label="middle half", zorder=0,
            )  # fmt: skip
        drawn.set_ylim(0, 1.5 * float(np.max(e)) if len(e) else 1)
        drawn.margins(x=0.08)
        drawn.legend(loc="upper left", ncols=2, columnspacing=1.0)
        drawn.set(xlabel=f"speed of the corner before ({unit})", ylabel="restitution")
    return drawn
