"""Fig. 9 of Savi et al. (2007): resonance curves up and down, with their jumps as numbers.

When the frequency falls, the motion without contact ends where it grazes the support, and the amplitude jumps there.
The grazing frequency has a closed form, the larger root of (rho / g)^2 = (2 k - m omega^2)^2 + (c omega)^2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP = 0.01


def main() -> Axes:
    """Sweep omega both ways and compare the jump of the falling sweep with the closed form."""
    oscillator = ns.models.discontinuous_support().with_parameters(rho=0.14, g=0.02)
    values = np.arange(3.8, 6.6, STEP)
    response = ns.frequency_response(oscillator, values, direction="both", progress=False)
    ax = ns.plot.frequency_response(response)

    p = oscillator.values
    squares = np.roots([p["m"] ** 2, p["c"] ** 2 - 4 * p["k"] * p["m"], 4 * p["k"] ** 2 - (p["rho"] / p["g"]) ** 2])
    grazing = np.sqrt(squares.max())  # 5.159861 rad/s
    falling = response.jump_value.values[response.jump_direction.values == "down"]
    assert abs(falling - grazing).min() <= STEP
    return ax


if __name__ == "__main__":
    ns.plot.save_figure(main(), "frequency_response.pdf")
