"""An oscillator and a rigid stop: its clearance below grazing, and the first impact.

Dankowicz and Schilder, *Recipes for Continuation* (2013), Ex. 15.2. The motion without impact just touches the stop
at A = d sqrt((k - omega^2)^2 + (c omega)^2), 0.368782 at omega = 0.8. Below it the clearance is d (1 - A / 0.368782).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GRAZING = np.hypot(1.0 - 0.8**2, 0.1 * 0.8)
STEP = 0.0005


def main() -> Axes:
    """Sweep the forcing upwards, and read the clearance and the first impact off the result."""
    oscillator = ns.models.impact_oscillator(omega=0.8)
    half = ns.Stroboscopic(0.5)  # at phase 0 the impact itself passes the section, and its points jump
    diagram = ns.sweep(oscillator, "A", np.arange(0.3, 0.6, STEP), section=half, keep=60, progress=False)
    ax = ns.plot.bifurcation(diagram, y="v", size=1.2)
    ax.axvline(GRAZING, color="0.5", linestyle=":", linewidth=0.8, zorder=0, label="grazing, closed form")
    ax.set(xlabel="amplitude of the forcing, $A$", ylabel="velocity at phase 0.5, $v$")
    with ns.plot.journal():
        ax.legend(loc="lower right", title="dimensionless")

    below = diagram.sel(A=diagram.A < GRAZING)
    clearance = below.clearance.sel(indicator="stop")
    assert np.allclose(clearance, 1.0 - below.A / GRAZING, rtol=0, atol=1e-9)
    first_impact = float(diagram.A[diagram.contacts_per_period > 0].min())
    assert GRAZING < first_impact < GRAZING + STEP
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "impact_grazing.pdf")
