"""Half-power bandwidth: a response curve with the two frequencies at which its square is half of the largest."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["half_power"]


def half_power(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw amplitudes over frequency, the half-power level and the bandwidth.

    Parameters
    ----------
    finding
        A damping by half power, or its data: ``omega``, ``amplitude`` over ``run``; ``omega_low``, ``omega_high``,
        ``largest``, ``damping_ratio``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "omega", "amplitude", "omega_low", "omega_high", "largest")
    omega, heights = data["omega"].values, data["amplitude"].values
    low, high, top = (number(data, name) for name in ("omega_low", "omega_high", "largest"))
    with style.axes(ax) as drawn:
        drawn.axvspan(
            low, high, color=style.COLORS["zone"], alpha=0.25, linewidth=0, zorder=0,
            label=f"bandwidth, {low:.3f} to {high:.3f} rad/s",
        )  # fmt: skip
        drawn.axhline(
            top / np.sqrt(2), color=style.COLORS["second"], linestyle="--", linewidth=0.9,
            label=r"largest amplitude$/\sqrt{2}$",
        )  # fmt: skip
        drawn.plot(
            omega, heights, "o", color=MEASURED, markersize=3, markerfacecolor="white", markeredgewidth=0.7,
            label=measured_label(data),
        )  # fmt: skip
        ratio = with_error(number(data, "damping_ratio"), number(data, "damping_ratio_error"))
        drawn.annotate(
            rf"$\xi$ = {ratio}" + "\n" + rf"$c$ = {with_error(number(data, 'c'), number(data, 'c_error'), 'N s/m')}",
            (0.97, 0.95), xycoords="axes fraction", ha="right", va="top", fontsize=style.small(drawn),
        )  # fmt: skip
        drawn.set_ylim(bottom=0)
        drawn.margins(x=0.02)
        drawn.legend(**ABOVE, ncols=2, columnspacing=1.0, handlelength=1.6)
        name_axes(drawn, (r"$\omega$", "rad/s"), ("amplitude of $x$", "m"))
    return drawn
