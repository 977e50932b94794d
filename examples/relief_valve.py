"""A pressure relief valve (Hos and Champneys 2012): a nonlinear system without forcing, that hits its seat.

The section is the maxima of the lift. At an inflow of 8 the valve moves on a cycle that does not reach its seat: lift
from 0.668282564 to 6.009885866, period 2.392389442 (computed once by an independent program). Below about 7.56 it
hits the seat.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAXIMA = ns.Poincare("lift_velocity", rising=False)
START = {"y1": 0.2, "y2": 0.0, "y3": 10.0}


def main(points: int = 441) -> Axes:
    """Maxima of the lift over the inflow; the cycle at an inflow of 8 against the published numbers."""
    valve = ns.models.relief_valve()
    q = np.linspace(4.0, 8.4, points)
    diagram = ns.sweep(valve, "q", q, direction="down", start=START, section=MAXIMA, keep=50, progress=False)
    ax = ns.plot.bifurcation(diagram, y="y1", size=1.2)
    ax.set(xlabel="inflow, $q$ (dimensionless)", ylabel="maxima of the lift, $y_1$ (dimensionless)")

    cycle = ns.sweep(valve, "q", [8.0], start=START, section=MAXIMA, progress=False).isel(q=0)
    returns = ns.poincare(valve.with_parameters(q=8.0), section=MAXIMA, n=3, transient=600, start=START)
    assert int(cycle.period_number) == 1
    assert np.isclose(cycle.maximum.sel(state="y1"), 6.009885866, rtol=1e-7)
    assert np.isclose(cycle.minimum.sel(state="y1"), 0.668282564, rtol=1e-7)
    assert np.isclose(np.diff(returns.time.values)[0], 2.392389442, rtol=1e-7)
    hits = diagram.contacts_per_period.values > 0
    assert 7.5 < diagram.q.values[hits].max() < 7.6
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "relief_valve.pdf")
