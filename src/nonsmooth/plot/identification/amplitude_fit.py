"""Amplitude over frequency with the simulated ones: viscous damping alone, and with dry friction beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import ABOVE, MEASURED, measured_label
from nonsmooth.plot.identification.findings import data_of, number, with_error
from nonsmooth.plot.identification.residuals import residual_strip
from nonsmooth.plot.labels import name_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["amplitude_fit"]

_MARKERS = {"up": "^", "down": "v"}


def amplitude_fit(finding: Any, ax: Axes | None = None) -> Axes:
    """Draw measured amplitudes over frequency with the fits; below, what each fit leaves.

    The fit that knows no friction puts all losses into c; its bias is written beside it.

    Parameters
    ----------
    finding
        A viscous damping, or its data: ``amplitude`` over ``run`` with ``omega``; ``joint_amplitude`` and
        ``viscous_amplitude`` over ``omega_fine``.
    ax
        Where to draw; a new one-column figure if None.
    """
    data = data_of(finding, "amplitude", "omega", "omega_fine")
    omega, heights = data["omega"].values, data["amplitude"].values
    error = data["amplitude_error"].values if "amplitude_error" in data else None
    words = data["direction"].values.astype(str) if "direction" in data else np.full(len(omega), "")
    left: list[tuple[Any, Any, Any]] = []
    residuals: list[str] = []
    with style.axes(ax, ratio=0.85) as drawn:
        for i, word in enumerate(dict.fromkeys(words)):
            mine = words == word
            drawn.errorbar(
                omega[mine], heights[mine], yerr=None if error is None else error[mine], fmt=_MARKERS.get(word, "o"),
                color=MEASURED, markersize=3, markerfacecolor="white", markeredgewidth=0.7, elinewidth=0.6, zorder=4,
                label=measured_label(data) + (f", steps {word}" if word else "") if i < 2 else None,
            )  # fmt: skip
        for name, word, color, line in (
            ("joint", "$c$ beside dry friction", "first", "-"), ("viscous", "$c$ alone", "second", "--"),
        ):  # fmt: skip
            if f"{name}_amplitude" in data:
                label = word
                if np.isfinite(value := number(data, f"c_{name}")):
                    label += f": {with_error(value, number(data, f'c_{name}_error'), 'N s/m')}"
                curve = np.interp(omega, data["omega_fine"].values, data[f"{name}_amplitude"].values)
                looks = {"color": style.COLORS[color], "marker": "s" if name == "joint" else "D", "markersize": 2.4}
                left.append((omega, heights - curve, looks))
                residuals.append(f"residual, {word}")
                drawn.plot(
                    data["omega_fine"].values, data[f"{name}_amplitude"].values, line,
                    color=style.COLORS[color], label=label,
                )  # fmt: skip
        drawn.set_ylim(bottom=0)
        drawn.margins(x=0.02)
        name_axes(drawn, (r"$\omega$", "rad/s"), ("amplitude of $x$", "m"))
        if left:
            for (_, _, looks), name in zip(left, residuals, strict=True):
                drawn.plot([], [], linestyle="none", markeredgewidth=0, label=name, **looks)
            residual_strip(drawn, "m", *left, error=error)
        drawn.legend(**ABOVE, ncols=2, columnspacing=1.0, handlelength=1.6)
    return drawn
