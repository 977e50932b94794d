"""Multistability over the gap (Savi et al. 2007, Fig. 13): every attractor with its share of random starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main() -> Axes:
    """At g = 0.0014 m, where the paper shows period 3, a period-4 motion coexists with it."""
    support = ns.models.discontinuous_support(omega=11.15, rho=0.33)
    shares = ns.basin_fractions(
        support, "g", np.linspace(0.0005, 0.002, 61), n_starts=150, box={"x": (-0.02, 0.02), "v": (-0.2, 0.2)}, seed=1,
        progress=False,
    )  # fmt: skip
    ax = ns.plot.basin_fractions(shares)
    there = shares.sel(g=0.0014, method="nearest")
    periods = there.period_number.values[there.fraction.values > 0]
    assert sorted(periods.tolist()) == [3, 4]
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "basin_fractions.pdf")
