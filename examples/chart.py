"""Period numbers over gap and forcing amplitude, omega = 11.15 rad/s (Savi et al. 2007, the plane of Fig. 13).

The system is piecewise linear, so it is scale-invariant: what happens depends on g / rho alone, and every boundary is
a straight line through g = 0, rho = 0: that of the flip of period 1 is drawn over the chart.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main(points: int = 240) -> Axes:
    """The chart from rest; equal g / rho gives equal periods."""
    support = ns.models.discontinuous_support(omega=11.15)
    chart = ns.chart(
        support,
        {"g": np.linspace(-0.0015, 0.002, points), "rho": np.linspace(0.2, 0.5, 3 * points // 4)},
        progress=False,
    )
    ax = ns.plot.chart(chart)
    orbit = ns.find_orbit(support.with_parameters(g=-0.0012, rho=0.33))
    flips = ns.special_points(ns.continue_orbit(orbit, "g", (-0.0015, 0.002)))
    flip = ns.continue_curve(flips.isel(special=0), {"g": (-0.0015, 0.002), "rho": (0.2, 0.5)})
    with ns.plot.journal():
        ns.plot.curve(flip, ax, special=False)
    ratio = flip.g / flip.rho
    assert np.allclose(ratio, ratio[0], rtol=1e-9)  # a straight line through zero
    rays = ns.chart(support, {"g": [0.0008, 0.0016], "rho": [0.2, 0.4]}, progress=False)
    assert int(rays.period_number[0, 0]) == int(rays.period_number[1, 1])
    assert np.allclose(2 * rays.maximum[0, 0], rays.maximum[1, 1], rtol=1e-6)
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "chart.pdf")
