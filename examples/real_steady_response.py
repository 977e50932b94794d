"""A real record of a steady response: its frequency to a millihertz, and nothing on its damping.

A magneto-mechanical oscillator driven at 42.05 Hz, 12 channels at 1 kHz in a LabVIEW file, 1.2 s (T. Breunung and
B. Balachandran, J. Sound Vib. (2024) 118651; github.com/tbreunung/FrID, MIT licence). One step of its Fourier
transform is 0.85 Hz. The environment variable NONSMOOTH_DATA names the folder with ``lvm_sample_1200lines.lvm``.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import nonsmooth as ns
from nonsmooth.plot.identification import steady_amplitude, steady_phase
from nonsmooth.recordings.signals.checks import take
from nonsmooth.recordings.signals.steady import steady_response

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS = "lvm_sample_1200lines.lvm"


def measured() -> Path:
    """The file, or a sentence that says what is lacking."""
    file = Path(os.environ.get("NONSMOOTH_DATA", "")) / NEEDS
    if not file.is_file():
        raise SystemExit(f"this example reads {NEEDS}; set NONSMOOTH_DATA to a folder that holds it (source: above)")
    return file


def main() -> Figure:
    """Read the strain, find its frequency by three methods, and ask whether it decays."""
    import matplotlib.pyplot as plt

    with warnings.catch_warnings():  # the file's oddities: its header counts 1000 samples, 1176 follow, ...
        warnings.simplefilter("ignore", ns.recordings.RecordingWarning)
        recording = ns.load_recording(measured())
    strain = take(recording, "Strain_0", "Segment 1", units=("Strain",))
    found = steady_response(strain.time, strain)
    print(found)

    with ns.plot.journal():
        figure, (left, right) = plt.subplots(1, 2, figsize=(ns.plot.PAGE, 0.36 * ns.plot.PAGE))
        steady_phase(found, left)
        steady_amplitude(found, right)

    assert abs(found.frequency - 42.05) < 1e-3 and found.frequency_error < 1e-3  # 42.05 Hz stands in the file
    assert all(abs(value - 42.05) < 1e-3 for value, _ in found.by_method.values())
    assert not found.decays and "cannot be identified" in found.statement
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "real_steady_response.pdf")
