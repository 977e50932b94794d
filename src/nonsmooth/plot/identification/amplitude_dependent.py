"""A mode over its amplitude: natural frequency (the backbone), damping ratio, and the forced responses behind them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED
from nonsmooth.plot.identification.picture import picture

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
    needed = f"{name} {name}_error amplitude curve_{name}"
    with picture(finding, ax, needed, ("amplitude", "m"), (label, ""), loc="best", columns=1) as one:
        a, y, error = one.values("amplitude", name, f"{name}_error")
        low, high = (scale * (y + sign * 1.96 * error) for sign in (-1, 1))
        one.ax.fill_between(a, low, high, color=style.COLORS["first"], alpha=0.2, linewidth=0, label="95 %")
        one.line(a, scale * y, "mode")
        one.points("curve_amplitude", f"curve_{name}", "each curve by itself", scale=scale, face="white")
    return one.ax


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
    labels = ("frequency", "Hz"), ("amplitude", "m")
    with picture(finding, ax, "frequency response unstable f_n amplitude", *labels, loc="upper left") as one:
        frequency, height, unstable = one.values("frequency", "response", "unstable")
        for chosen, face, word in ((unstable == 0, MEASURED, one.word), (unstable != 0, "white", "unstable part")):
            if chosen.any():
                looks: dict[str, Any] = {"markersize": 3.0, "markerfacecolor": face, "markeredgewidth": 0.4}
                one.line(frequency[chosen], height[chosen], word, "section", ".", zorder=3, **looks)
        for curve in responses:
            f, a, stable = (curve[name].values for name in ("frequency", "amplitude", "stable"))
            one.line(f, np.where(stable, a, np.nan), "mode, constant force", "second", zorder=4)
            if not stable.all():
                wide = ~stable | np.roll(~stable, 1) | np.roll(~stable, -1)
                one.line(f, np.where(wide, a, np.nan), "", "second", "--", zorder=4)
            if len(a):
                top = int(np.argmax(a))
                one.ax.annotate(
                    f"{curve.attrs['force']:.2g} N", (f[top], a[top]), xytext=(3, 2), textcoords="offset points",
                    ha="left", va="bottom", fontsize=style.small(one.ax), color=style.COLORS["second"], zorder=6,
                    bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.4},
                )  # fmt: skip
        natural, a = one.values("f_n", "amplitude")
        one.line(natural, a, "backbone", linewidth=1.1, zorder=5)
        one.ax.set_ylim(bottom=0, top=1.32 * float(height.max()))
        reach = 0.03 * np.ptp(frequency)
        one.ax.set_xlim(frequency.min() - reach, frequency.max() + reach)
    return one.ax
