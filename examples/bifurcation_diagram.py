"""Fig. 11 of Savi et al. (2007): the oscillator with discontinuous support over the amplitude of its forcing.

The end is checked against the first period doubling of the falling cascade, found by a program that shares nothing
with this package (shooting on heyoka, tolerance 1e-14): rho = 0.401470 N.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIRST_FLIP = 0.401469575


def main() -> Axes:
    """Sweep up and down, draw both, and check where period 1 becomes period 2."""
    oscillator = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)
    diagram = ns.sweep(oscillator, "rho", np.linspace(0.2, 0.5, 601), direction="both", progress=False)
    ax = ns.plot.bifurcation(diagram, y="v")

    falling = diagram.sel(direction="down")
    lowest_of_period_1 = float(falling.rho[falling.period_number == 1].min())
    highest_of_period_2 = float(falling.rho[falling.period_number == 2].max())
    # Near a flip a motion settles too slowly to be given a number: those points have the status `slow`.
    assert 0.99 * FIRST_FLIP < highest_of_period_2 < FIRST_FLIP < lowest_of_period_1 < 1.01 * FIRST_FLIP
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "bifurcation_diagram.pdf")
