"""The whole resonance curve of Fig. 9 of Savi et al. (2007), unstable orbits included.

A sweep shows attractors, and jumps where one ends. Continuation shows the rest: beyond the fold at 5.81 rad/s the
branch turns back, unstable, to the orbit that grazes the support, and at the flip a branch of period 2 begins. The
orbit without contact has a closed form, and with it the two frequencies at which it grazes: the roots of
(rho / g)^2 = (2 k - m omega^2)^2 + (c omega)^2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def main() -> Axes:
    """Follow period 1, switch to period 2 at a flip, and draw both over the sweeps."""
    oscillator = ns.models.discontinuous_support(rho=0.14, g=0.02)
    single = ns.continue_orbit(ns.find_orbit(oscillator.with_parameters(omega=4.5)), "omega", (3.0, 7.0))
    points = ns.special_points(single)
    flips = points.isel(special=np.flatnonzero(points.kind.values == "flip"))
    double = ns.continue_orbit(flips.isel(special=0))

    response = ns.frequency_response(oscillator, np.arange(3.0, 7.0, 0.01), direction="both", progress=False)
    ax = ns.plot.frequency_response(response, single, double)

    p = oscillator.values
    squares = np.roots([p["m"] ** 2, p["c"] ** 2 - 4 * p["k"] * p["m"], 4 * p["k"] ** 2 - (p["rho"] / p["g"]) ** 2])
    grazing = np.sqrt(np.sort(squares))  # 3.567576 and 5.159861 rad/s
    found = np.sort(points.omega.values[points.kind.values == "grazing"])
    assert np.allclose([found[0], found[-1]], grazing, rtol=0, atol=1e-8)
    assert int(double.period_number) == 2
    # Between the jumps of the sweeps there is an unstable orbit.
    up, down = (response.jump_value.values[response.jump_direction.values == way].max() for way in ("up", "down"))
    between = (single.omega.values > down + 0.02) & (single.omega.values < up - 0.02)
    assert not single.stable.values[between].all()
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "branch.pdf")
