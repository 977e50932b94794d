"""A linear plant under a relay (Piiroinen and Kuznetsov 2008): a limit cycle with many sliding segments.

While the relay's input x1 is kept at zero, x2'' = 2 x2' - x2 for sigma = 1. From the published start this gives
x2 = -exp(t) (0.001 + 0.021 t), and sliding ends where |x2| = 1. The cycle is its own image under x -> -x.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main() -> Axes:
    """The cycle over x2 and x3, sliding segments apart; its first end of sliding and its symmetry as assertions."""
    relay = ns.models.relay_feedback()
    first = ns.simulate(relay, duration=10.0, start=[0.0, -0.001, -0.02])
    labels = [relay.transitions[i].label for i in first.crossing_transition.values]
    end = next(i for i, label in enumerate(labels) if label.startswith("sliding"))
    t = float(first.crossing_time[end])
    assert np.isclose(np.exp(t) * (0.001 + 0.021 * t), 1.0, rtol=1e-12)

    orbit = ns.find_orbit(relay, start=[0.0, -0.001, -0.02])
    assert np.allclose(orbit.maximum, -orbit.minimum, rtol=1e-9)
    assert orbit.signature.text(relay.traced).count("sliding") > 10

    run = ns.simulate(relay, duration=orbit.period, start=orbit.u, samples=4001)
    ax = ns.plot.phase_portrait(run, x="x2", y="x3")
    with ns.plot.journal():
        ax.legend(loc="center")
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "relay_sliding.pdf")
