"""A mode over its amplitude: natural frequency (the backbone), damping ratio, and the forced responses behind them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["backbone", "forced_responses", "modal_damping"]


def backbone(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the natural frequency over the amplitude with its 95 % band, and each curve's own beside it.

    Parameters
    ----------
    finding
        What ``amplitude_dependent`` found, or its data.
    ax
        Where to draw; a new one-column figure if None.
    """
    return _over_amplitude(finding, ax, "f_n", 1.0, "natural frequency (Hz)")


def modal_damping(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the damping ratio over the amplitude, as :func:`backbone` does the frequency."""
    return _over_amplitude(finding, ax, "zeta", 100.0, "damping ratio (%)")


def _over_amplitude(finding: Any, ax: Axes | None, name: str, scale: float, label: str) -> Axes:
    data = data_of(finding, name, f"{name}_error", "amplitude", f"curve_{name}")
    a, y, error = data["amplitude"].values, scale * data[name].values, scale * data[f"{name}_error"].values
    with style.axes(ax) as drawn:
        drawn.fill_between(
            a, y - 1.96 * error, y + 1.96 * error, color=style.COLORS["first"], alpha=0.2, linewidth=0, label="95 %"
        )
        drawn.plot(a, y, color=style.COLORS["first"], label="mode")
        drawn.plot(
            data["curve_amplitude"].values, scale * data[f"curve_{name}"].values, "o", color=MEASURED,
            markersize=2.6, markerfacecolor="white", markeredgewidth=0.7, label="each curve by itself", zorder=4,
        )  # fmt: skip
        drawn.margins(x=0.02)
        drawn.legend(loc="best")
        drawn.set_ylabel(label)
        name_axes(drawn, ("amplitude", "m"))
    return drawn


def forced_responses(finding: Any, ax: Axes | None = None, *, responses: Sequence[Any] = ()) -> Axes:
    """Draw the measured points over frequency, the backbone, and computed responses along their curves.

    Parameters
    ----------
    finding
        What ``amplitude_dependent`` found, or its data.
    ax
        Where to draw; a new one-column figure if None.
    responses : sequence of Dataset
        Curves for constant forces, from ``NonlinearMode.response``; their unstable parts are dashed.
    """
    data = data_of(finding, "frequency", "response", "unstable", "f_n", "amplitude")
    with style.axes(ax) as drawn:
        unstable = data["unstable"].values.astype(bool)
        for chosen, face, word in ((~unstable, MEASURED, measured_label(data)), (unstable, "white", "unstable part")):
            if chosen.any():
                drawn.plot(
                    data["frequency"].values[chosen], data["response"].values[chosen], "o", color=MEASURED,
                    markersize=1.5, markerfacecolor=face, markeredgewidth=0.4, zorder=3, label=word,
                )  # fmt: skip
        for k, curve in enumerate(responses):
            f, a, stable = curve["frequency"].values, curve["amplitude"].values, curve["stable"].values
            drawn.plot(
                f, np.where(stable, a, np.nan), color=style.COLORS["second"], zorder=4,
                label="mode, constant force" if k == 0 else None,
            )  # fmt: skip
            if not stable.all():
                middle = ~stable
                wide = middle | np.roll(middle, 1) | np.roll(middle, -1)
                drawn.plot(f, np.where(wide, a, np.nan), "--", color=style.COLORS["second"], zorder=4)
            if len(a):
                top = int(np.argmax(a))
                drawn.annotate(
                    f"{curve.attrs['force']:.2g} N", (f[top], a[top]), xytext=(3, 2), textcoords="offset points",
                    ha="left", va="bottom", fontsize=style.small(drawn), color=style.COLORS["second"], zorder=6,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.4},
                )  # fmt: skip
        drawn.plot(
            data["f_n"].values, data["amplitude"].values, color=style.COLORS["first"], linewidth=1.1, zorder=5,
            label="backbone",
        )  # fmt: skip
        drawn.set_ylim(bottom=0, top=1.32 * float(data["response"].max()))
        low, high = float(data["frequency"].min()), float(data["frequency"].max())
        drawn.set_xlim(low - 0.03 * (high - low), high + 0.03 * (high - low))
        drawn.legend(loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.6, markerscale=2)
        name_axes(drawn, ("frequency", "Hz"), ("amplitude", "m"))
    return drawn
