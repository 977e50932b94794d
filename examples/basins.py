"""Basins at omega = 9.55 rad/s of Fig. 17 (Savi et al. 2007): a period-3 cycle beside a chaotic attractor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main(points: int = 160) -> Axes:
    """Two attractors, found from the initial conditions alone."""
    support = ns.models.discontinuous_support(rho=0.23, g=0.0036, omega=9.55)
    found = ns.basins(
        support, {"x": np.linspace(-0.02, 0.02, points), "v": np.linspace(-0.2, 0.2, points)}, progress=False
    )
    ax = ns.plot.basins(found)
    assert sorted(found.period_number.values.tolist()) == [0, 3]
    chaos = found.isel(attractor=int(np.argmin(found.period_number.values)))
    assert float(chaos.lyapunov) > 3 * float(chaos.lyapunov_error) > 0
    assert float(found.fraction.sum()) == 1.0
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "basins.pdf")
