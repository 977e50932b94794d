"""A complex frequency response in its plane: a circle, but for what dry friction takes from it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["nyquist"]

_COLORS = ("first", "second", "third", "fourth")
_MARKERS = ("o", "s", "^", "D")


def nyquist(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw the response over the crank's length, X/a, in the complex plane, each crank with its fitted curve.

    Without friction all lengths lie on one curve. The natural frequency is where the car lags by a quarter of a turn.

    Parameters
    ----------
    finding
        A damping by the complex response, or its data: ``real``, ``imaginary``, ``crank`` over ``run``;
        ``fitted_real``, ``fitted_imaginary`` over ``crank_length`` and ``omega_fine``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "real", "imaginary", "crank", "fitted_real", "fitted_imaginary", "crank_length")
    lengths, crank = data["crank_length"].values, data["crank"].values
    with style.axes(ax, ratio=0.95) as drawn:
        for k, length in enumerate(lengths):
            mine, color = np.isclose(crank, length), style.COLORS[_COLORS[k % len(_COLORS)]]
            drawn.plot(
                data["fitted_real"].values[k], data["fitted_imaginary"].values[k], color=color, linewidth=0.9,
                label=f"fitted, crank {1e3 * length:.4g} mm",
            )  # fmt: skip
            drawn.plot(
                data["real"].values[mine], data["imaginary"].values[mine], _MARKERS[k % len(_MARKERS)], color=MEASURED,
                markerfacecolor="white", markersize=2.8, markeredgewidth=0.6, zorder=4,
                label=f"{measured_label(data)}, {1e3 * length:.4g} mm",
            )  # fmt: skip
        drawn.axhline(0, color=style.COLORS["muted"], linewidth=0.5)
        drawn.axvline(0, color=style.COLORS["muted"], linewidth=0.5)
        natural = with_error(number(data, "omega_0"), number(data, "omega_0_error"), "rad/s")
        text = rf"$\omega_0$ = {natural}" + "\n"
        text += rf"$c$ = {with_error(number(data, 'c'), number(data, 'c_error'), 'N s/m')}"
        size = style.small(drawn)
        drawn.annotate(text, (0.5, 0.5), xycoords="axes fraction", ha="center", va="center", fontsize=size)
        drawn.set_aspect("equal", adjustable="datalim")
        drawn.legend(**ABOVE, ncols=2, columnspacing=1.0, handlelength=1.4)
        drawn.set(xlabel=r"Re $X/a$", ylabel=r"Im $X/a$")
    return drawn
