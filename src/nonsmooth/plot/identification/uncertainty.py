"""Uncertainty of a parameter: the profile of its likelihood, and the coverage of intervals over many rigs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.identification.picture import data_of, number, picture
from nonsmooth.plot.labels import symbol_of

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
    unit = str(data["value"].attrs.get("units", data.attrs.get("units", "")))
    labels = (symbol_of(str(data.attrs.get("parameter", "value"))), unit), (r"$\chi^2$ above its least", "")
    with picture(data, ax, "", *labels, loc="upper center", margin=0) as one:
        value, cost = one.values("value", "cost")
        one.span(number(data, "low"), number(data, "high"), "95 % interval", ymax=0.74)
        one.line(value, cost, f"profile, {one.word}", marker="o", markersize=1.5)
        bound: dict[str, Any] = {"color": style.COLORS["muted"], "linestyle": "--", "linewidth": 0.7}
        one.ax.axhline(CHI_SQUARE_95, label="95 % bound, 3.84", **bound)
        if np.isfinite(best := number(data, "best")):
            one.ax.axvline(best, ymax=0.74, color=style.COLORS["second"], linewidth=0.9, label="best fit")
        one.ax.set_ylim(0, max(1.1 * CHI_SQUARE_95, min(float(np.nanmax(cost)), 5 * CHI_SQUARE_95)) * 1.35)
        if value.min() > 0 and value.max() > 20 * value.min():
            one.ax.set_xscale("log")
    return one.ax


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
            for mine, color in ((held[:, k], "section"), (~held[:, k], "second")):
                drawn.plot(k + spread[mine], off[mine, k], ".", color=style.COLORS[color], markersize=3)
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
