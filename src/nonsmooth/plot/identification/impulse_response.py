"""A free decay and its spectrum, with the grid of the transform: why a peak read off the grid is not the frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["impulse_history", "impulse_response"]

BINS = 9  # shown on either side of the peak


def impulse_response(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the spectrum of an impulse response about its peak.

    Stems are the lines of the transform. The largest of them can be half a step away from the frequency; the
    interpolated peak and the decay fit are not bound to the grid.

    Parameters
    ----------
    finding
        A natural frequency, or its data: ``magnitude`` over ``frequency``, ``peak_frequency``, ``grid_peak``,
        ``grid_step``, ``decay_frequency``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "magnitude", "frequency", "peak_frequency")
    frequency, magnitude = data["frequency"].values, data["magnitude"].values
    top = (
        int(np.argmin(np.abs(frequency - number(data, "grid_peak"))))
        if "grid_peak" in data
        else int(np.nanargmax(magnitude))
    )
    first, last = max(top - BINS, 0), min(top + BINS + 1, len(frequency))
    at, heights = frequency[first:last], magnitude[first:last]
    with style.axes(ax) as drawn:
        drawn.vlines(at, 0, heights, color=MEASURED, linewidth=0.7)
        drawn.plot(at, heights, "o", color=MEASURED, markersize=2.6, label=f"DFT, {measured_label(data)}")
        if "fine_magnitude" in data:
            fine = data["fine_frequency"].values
            inside = (fine >= at[0]) & (fine <= at[-1])
            drawn.plot(
                fine[inside], data["fine_magnitude"].values[inside], color=style.COLORS["muted"], linewidth=0.7,
                label="transform between its lines",
            )  # fmt: skip
        step = number(data, "grid_step")
        if np.isfinite(step):
            drawn.axvspan(
                frequency[top] - step / 2, frequency[top] + step / 2, color=style.COLORS["zone"], alpha=0.25,
                linewidth=0, zorder=0, label=f"largest line {frequency[top]:.4f} Hz, half a step to each side",
            )  # fmt: skip
        places = (
            ("peak_frequency", "interpolated peak", "first", "-"), ("decay_frequency", "decay fit", "second", "--"),
        )  # fmt: skip
        for name, word, color, line in places:
            value = number(data, name)
            if np.isfinite(value):
                drawn.axvline(
                    value, color=style.COLORS[color], linestyle=line, linewidth=1.0, label=f"{word} {value:.4f} Hz"
                )
        drawn.set_ylim(0, 1.06 * heights.max())
        drawn.margins(x=0.02)
        drawn.legend(**ABOVE, ncols=2, handlelength=1.6, columnspacing=1.0)
        name_axes(drawn, ("frequency", "Hz"), ("magnitude", str(data["magnitude"].attrs.get("units", "m"))))
    return drawn


def impulse_history(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the impulse response over time, with the decay that was fitted to it."""
    data = data_of(finding, "x", "time")
    with style.axes(ax) as drawn:
        # Joined: a few unjoined samples per oscillation make patterns that are not there.
        drawn.plot(data["time"].values, data["x"].values, color=MEASURED, linewidth=0.5, label=measured_label(data))
        if "fitted" in data:
            drawn.plot(
                data["time"].values, data["fitted"].values, "--", color=style.COLORS["second"], linewidth=1.0,
                label="fitted decay",
            )  # fmt: skip
        drawn.margins(x=0)
        drawn.legend(loc="upper right")
        name_axes(drawn, ("time", "s"), ("displacement", "m"))
    return drawn
