"""Multistability over the forcing amplitude: every attractor, with its share of random starts.

The oscillator of Savi et al. (2007) at the gap of their Fig. 14(c), where they show a motion of period 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main(points: int = 101, starts: int = 150) -> Axes:
    """At rho = 0.33 N a motion of period 4 coexists with that of period 3 which the paper shows."""
    from matplotlib.figure import Figure

    support = ns.models.discontinuous_support(omega=11.15, g=0.0014)
    shares = ns.basin_fractions(
        support,
        "rho",
        np.linspace(0.25, 0.5, points),
        n_starts=starts,
        box={"x": (-0.02, 0.02), "v": (-0.2, 0.2)},
        seed=1,
        progress=False,
    )
    there = shares.sel(rho=0.33, method="nearest")
    periods = there.period_number.values[there.fraction.values > 0]
    assert sorted(periods.tolist()) == [3, 4]
    with ns.plot.journal():
        figure = Figure(figsize=(ns.plot.COLUMN, 1.25 * ns.plot.COLUMN))
        above, below = figure.subplots(2, 1, sharex=True)
        ns.plot.basin_fractions(shares, above, y="x")
        above.set_xlabel("")
        above.get_legend().remove()
        ns.plot.basin_fractions(shares, below)
        below.get_legend().remove()
        figure.legend(*below.get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return below


if __name__ == "__main__":
    ns.plot.save_figure(main(), "basin_fractions.pdf")
