"""Uncertainty of a parameter: the profile of its likelihood, and the coverage of intervals over many rigs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import measured_label
from nonsmooth.plot.identification.findings import data_of, number
from nonsmooth.plot.labels import name_axes, symbol_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["coverage", "profile"]

CHI_SQUARE_95 = 3.841  # of one degree of freedom


def profile(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the profile of chi square over one parameter, with the interval that it gives.

    A flat profile is a parameter that the data do not see.

    Parameters
    ----------
    finding
        A profile, or its data: ``cost`` (chi square above its least) over ``value``; ``best``, ``low``, ``high``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "value", "cost")
    value, cost = data["value"].values, data["cost"].values
    unit = str(data["value"].attrs.get("units", data.attrs.get("units", "")))
    with style.axes(ax) as drawn:
        low, high = number(data, "low"), number(data, "high")
        if np.isfinite(low) and np.isfinite(high):
            drawn.axvspan(
                low, high, ymax=0.74, color=style.COLORS["zone"], alpha=0.25, linewidth=0, label="95 % interval"
            )
        drawn.plot(
            value, cost, color=style.COLORS["first"], marker=".", markersize=3,
            label=f"profile, {measured_label(data)}",
        )  # fmt: skip
        drawn.axhline(
            CHI_SQUARE_95, color=style.COLORS["muted"], linestyle="--", linewidth=0.7, label="95 % bound, 3.84"
        )
        if np.isfinite(best := number(data, "best")):
            drawn.axvline(best, ymax=0.74, color=style.COLORS["second"], linewidth=0.9, label="best fit")
        drawn.set_ylim(0, max(1.1 * CHI_SQUARE_95, min(float(np.nanmax(cost)), 5 * CHI_SQUARE_95)) * 1.35)
        if value.min() > 0 and value.max() > 20 * value.min():
            drawn.set_xscale("log")
        drawn.margins(x=0)
        drawn.legend(loc="upper center", ncols=2, columnspacing=1.0)
        name = str(data.attrs.get("parameter", "value"))
        drawn.set_ylabel(r"$\chi^2$ above its least")
        name_axes(drawn, (symbol_of(name), unit))
    return drawn


def coverage(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the normalised errors of the identified parameters over many virtual rigs.

    Each point is (estimate - truth) / standard uncertainty of one rig; in a fair statement they spread like a unit
    normal law. The numbers above say how many of the 95 % intervals hold the truth.

    Parameters
    ----------
    finding
        Data over ``rig`` and ``parameter``: ``truth``, ``estimate``, ``uncertainty``, and ``low``, ``high`` (95 %).
    ax
        Where to draw; a new figure of page width if None.
    """
    data = data_of(finding, "truth", "estimate", "uncertainty", "parameter")
    truth, estimate, error = (
        data[name].transpose("rig", "parameter").values for name in ("truth", "estimate", "uncertainty")
    )
    names = data["parameter"].values.astype(str)
    if "low" in data and "high" in data:
        low, high = (data[name].transpose("rig", "parameter").values for name in ("low", "high"))
        held = (low <= truth) & (truth <= high)
    else:
        held = np.abs(estimate - truth) <= 1.96 * error
    off = (estimate - truth) / error
    rigs = len(truth)
    spread = (np.arange(rigs) / max(rigs - 1, 1) - 0.5) * 0.6
    with style.axes(ax, width=style.PAGE, ratio=0.42) as drawn:
        drawn.axhspan(-1.96, 1.96, color=style.COLORS["first"], alpha=0.10, linewidth=0)
        drawn.axhline(0, color=style.COLORS["muted"], linewidth=0.6)
        for k in range(len(names)):
            for inside, color in ((True, style.COLORS["section"]), (False, style.COLORS["second"])):
                mine = held[:, k] == inside
                drawn.plot(k + spread[mine], off[mine, k], ".", color=color, markersize=3)
            rms = float(np.sqrt(np.nanmean(off[:, k] ** 2)))
            drawn.annotate(
                f"{np.count_nonzero(held[:, k])}/{rigs}\nrms {rms:.2f}", (k, 1.02), xycoords=("data", "axes fraction"),
                ha="center", va="bottom", fontsize=style.small(drawn),
            )  # fmt: skip
        reach = max(3.0, 1.08 * float(np.nanmax(np.abs(off[np.isfinite(off)]), initial=0.0)))
        drawn.set_ylim(-reach, reach)
        drawn.set_xticks(range(len(names)), [symbol_of(name) for name in names])
        drawn.tick_params(axis="x", top=False, length=0)
        drawn.set_ylabel("(estimate − truth) / uncertainty")
        drawn.set_xlabel(f"{rigs} virtual rigs (synthetic), by seed from left to right")
    return drawn
