"""The smoothed switch against the discontinuous model: the difference falls like the square of the band's width.

Four periods from the same state on the period-1 orbit of Fig. 11 (rho = 0.45 N), the smoothed model by
Runge-Kutta-Fehlberg at rtol 1e-11. The slope of the line of the logarithms is 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ETAS = np.array([3e-5, 1e-5, 3e-6, 1e-6])


def main() -> Axes:
    """Errors in the unit of a typical state (1 mm, 1 cm/s), for four widths."""
    oscillator = ns.models.discontinuous_support()  # rho = 0.45 N, omega = 3.69 rad/s, g = -4.5 mm
    start = ns.simulate(oscillator, periods=400, samples=2).u.values[-1]
    exact = ns.simulate(oscillator, periods=4, start=start, samples=2).u.values[-1]
    errors = []
    for eta in ETAS:
        smooth = oscillator.smoothed(eta=eta)
        end = ns.simulate(smooth, periods=4, start=start, samples=2, method="rkf45", rtol=1e-11).u.values[-1]
        errors.append(np.linalg.norm((end - exact) / oscillator.scale_vector()))
    order = np.polyfit(np.log(ETAS), np.log(errors), 1)[0]

    with ns.plot.journal():
        ax = plt.figure().add_subplot()
        widths = 1e6 * ETAS
        ax.loglog(widths, errors, "o", label=f"measured, slope {order:.2f}")
        ax.loglog(widths, errors[1] * (ETAS / ETAS[1]) ** 2, "-", color="0.5", zorder=1, label="slope 2")
        ax.xaxis.set_major_formatter("{x:g}")
        ax.set(
            xlabel="half width of the band, $\\eta$ (\N{MICRO SIGN}m)",
            ylabel="difference after 4 periods (in 1 mm and 10 mm/s)",
        )
        ax.legend()
    assert abs(order - 2) < 0.1
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "smoothed_switch.pdf")
