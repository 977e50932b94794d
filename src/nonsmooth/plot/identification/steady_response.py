"""Amplitude and phase of a steady response over its record: nothing falls, so nothing tells the damping."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.plot import style
from nonsmooth.plot.comparison import MEASURED, measured_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["steady_amplitude", "steady_phase"]


def steady_amplitude(response: Any, ax: Axes | None = None) -> Axes:
    """Draw how far the amplitude of each block is from their mean, and the fastest decay that could hide there.

    Parameters
    ----------
    response : SteadyResponse
    ax
        Where to draw; a new one-column figure if None.
    """
    blocks = response.blocks
    t, a, error = (blocks[name].values for name in ("time", "amplitude", "amplitude_error"))
    middle = float(np.exp(np.log(a).mean()))
    with style.axes(ax) as drawn:
        drawn.errorbar(
            t, 1e3 * (a / middle - 1), yerr=1e3 * error / middle, fmt="o", color=MEASURED, markersize=2.6,
            elinewidth=0.6, label=f"blocks, {measured_label(blocks)}",
        )  # fmt: skip
        fine = np.linspace(t[0], t[-1], 50)
        drawn.plot(
            fine, -1e3 * response.rate * (fine - t.mean()), color=style.COLORS["first"],
            label=f"line: decay rate {1e3 * response.rate:.2f} ± {1e3 * response.rate_error:.2f} per 1000 s",
        )  # fmt: skip
        drawn.plot(
            fine, -1e3 * response.rate_bound * (fine - t.mean()), "--", color=style.COLORS["second"],
            label=f"fastest free decay at 95 %: {1e3 * response.rate_bound:.2f} per 1000 s",
        )  # fmt: skip
        reach = 1e3 * float(np.max(np.abs(a / middle - 1) + error / middle))
        drawn.set_ylim(-1.3 * reach, 2.4 * reach)
        drawn.margins(x=0.02)
        drawn.legend(loc="upper right")
        drawn.set(xlabel="time (s)", ylabel="amplitude, change (1/1000)")
    return drawn


def steady_phase(response: Any, ax: Axes | None = None) -> Axes:
    """Draw the phase of each block less that of the fitted frequency, with the line of each other method."""
    blocks = response.blocks
    t, phase, error = (blocks[name].values for name in ("time", "phase", "phase_error"))
    with style.axes(ax) as drawn:
        drawn.errorbar(
            t, 1e3 * phase, yerr=1e3 * error, fmt="o", color=MEASURED, markersize=2.6, elinewidth=0.6,
            label=f"blocks, {measured_label(blocks)}",
        )  # fmt: skip
        words = {"fit": ("fit", "first", "-"), "phase": ("line of the phases", "third", "-."),
                 "spectrum": ("peak of the spectrum", "second", "--")}  # fmt: skip
        for name, (value, own) in response.by_method.items():
            word, color, line = words[name]
            slope = -2 * np.pi * (value - response.frequency)
            drawn.plot(
                t, 1e3 * (phase.mean() + slope * (t - t.mean())), line, color=style.COLORS[color],
                label=f"{word}: {value:.5f} ± {own:.5f} Hz",
            )  # fmt: skip
        reach = 1e3 * float(np.max(np.abs(phase) + error))
        drawn.set_ylim(-1.3 * reach, 2.9 * reach)
        drawn.margins(x=0.02)
        drawn.legend(loc="upper right")
        drawn.set(xlabel="time (s)", ylabel="phase (mrad)")
    return drawn
