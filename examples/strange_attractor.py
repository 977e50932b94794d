"""Fig. 15 of Savi et al. (2007): a strange attractor, seen at four phases of the forcing.

A section at one phase is the image of the section at another: each point at phase 0, followed for a quarter of a
period, must land on the point at phase 0.25 with the same number.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASES = (0.0, 0.25, 0.5, 0.75)


def main() -> Figure:
    """Four sections of the same trajectory, and one followed into the next."""
    oscillator = ns.models.discontinuous_support().with_parameters(rho=0.33, omega=11.15, g=0.0018)
    sections = [
        ns.poincare(oscillator, section=ns.Stroboscopic(phase), n=6000, transient=500 - (phase == 0.0))
        for phase in PHASES
    ]  # the first return at phase 0 is at t = T, at phase 0.25 already at T / 4: one less is passed over

    with ns.plot.journal():
        figure, axes = plt.subplots(2, 2, figsize=(ns.plot.style.PAGE, 0.7 * ns.plot.style.PAGE))
        for ax, phase, points in zip(axes.flat, PHASES, sections, strict=True):
            ns.plot.section(points, ax)
            ax.set_title(f"phase {phase:g} of the period")

    period = oscillator.period()
    for i in range(5):
        start = sections[0].section.values[i]
        end = ns.simulate(oscillator, periods=0.25, start=start, samples=2).u.values[-1]
        assert np.allclose(end, sections[1].section.values[i], rtol=0, atol=1e-11)
        assert np.isclose(sections[1].time.values[i] - sections[0].time.values[i], period / 4)
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "strange_attractor.pdf")
