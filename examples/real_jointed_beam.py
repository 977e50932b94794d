"""A real beam with a friction joint: natural frequency and damping over amplitude, from twelve forced responses.

Four curves under (roughly) constant force, eight under constant acceleration, which would hold an unstable middle part
if there were one (measured by M. Cenedese, github.com/mattiacenedese/BRBtesting; distributed with T. Breunung and
B. Balachandran, J. Sound Vib. (2024) 118651, github.com/tbreunung/FrID, MIT licence). The environment variable
NONSMOOTH_DATA names the folder with ``FrID_jointed_beam_ForcedFrequencyResponses.mat``.
"""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import nonsmooth as ns
from nonsmooth.identification.amplitude_dependent import amplitude_dependent, response_curves
from nonsmooth.plot.identification import backbone, forced_responses, modal_damping

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS = "FrID_jointed_beam_ForcedFrequencyResponses.mat"


def measured() -> Path:
    """The file, or a sentence that says what is lacking."""
    file = Path(os.environ.get("NONSMOOTH_DATA", "")) / NEEDS
    if not file.is_file():
        raise SystemExit(f"this example reads {NEEDS}; set NONSMOOTH_DATA to a folder that holds it (source: above)")
    return file


def main() -> Figure:
    """Fit one mode to all points, along the curves, and look for points where more amplitude needs less force."""
    import matplotlib.pyplot as plt

    recording = ns.load_recording(measured(), axis="frequency")
    curves = response_curves(recording)
    finding, mode = amplitude_dependent(curves, knots=6, residual=True)
    print(finding)
    # Everywhere between the points too: at no frequency and amplitude does more amplitude need less force.
    a, f = np.meshgrid(np.linspace(mode.knots[0], mode.knots[-1], 301), np.linspace(79.0, 81.2, 221))
    slope = mode.slope(a, 2 * np.pi * f)
    print(f"least d ln F / d ln a of the mode: {slope.min():.2f} at {1e6 * a.flat[slope.argmin()]:.0f} micrometres")

    with ns.plot.journal():
        figure, (left, middle, right) = plt.subplots(
            1, 3, figsize=(ns.plot.PAGE, 0.36 * ns.plot.PAGE), width_ratios=(1.5, 1, 1)
        )
        forces = [float(np.median(c.force)) for c in curves if "ForceControl" in c.name and c.force is not None]
        forced_responses(finding, left, responses=[mode.response(force) for force in forces])
        backbone(finding, middle)
        modal_damping(finding, right)

    # Without any model: of two levels of amplitude at one frequency the higher one needs the greater force.
    levels = [c for c in curves if "ResponseControl" in c.name]
    for low, high in pairwise(levels):
        f, i, j = np.intersect1d(np.round(low.frequency, 4), np.round(high.frequency, 4), return_indices=True)
        assert low.force is not None and high.force is not None
        assert len(f) > 30 and np.all(high.force[j] > low.force[i])
    assert not finding.data.unstable.any() and float(finding.data.slope.min()) > 0.1
    # Read off the phase: -pi/2 at the natural frequency, whatever the damping.
    for c, expected in ((levels[0], finding.data.f_n[0]), (levels[-1], finding.data.f_n[-1])):
        assert abs(np.interp(np.pi / 2, -c.phase, c.frequency) - float(expected)) < 0.1
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "real_jointed_beam.pdf")
