"""A real cube tossed onto a table twelve times: its impacts and their restitution.

Position and orientation by motion tracking at 148 Hz, lengths in half-widths of the cube, some 52 mm (S. Pfrommer,
M. Halm and M. Posa, ContactNets, 2020; github.com/DAIRLab/contact-nets, BSD-3-Clause). A cube keeps its spin in flight,
so that the velocity of the corner that hits is known on both sides. The environment variable NONSMOOTH_DATA names
the folder with ``contactnets_cube_tosses_12.csv``.
"""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

import nonsmooth as ns
from nonsmooth.plot.identification import restitution, toss
from nonsmooth.recordings.signals.restitution import flights
from nonsmooth.recordings.signals.rigid_body import corner_heights, corner_restitution, cube

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDS = "contactnets_cube_tosses_12.csv"
COLUMNS = {"run": "toss", "time": "t_s"} | {
    name: (f"s{k}", "half-width" if k < 3 else "1") for k, name in enumerate(("x", "y", "z", "qw", "qx", "qy", "qz"))
}


def measured() -> Path:
    """The file, or a sentence that says what is lacking."""
    file = Path(os.environ.get("NONSMOOTH_DATA", "")) / NEEDS
    if not file.is_file():
        raise SystemExit(f"this example reads {NEEDS}; set NONSMOOTH_DATA to a folder that holds it (source: above)")
    return file


def main() -> Figure:
    """Find the flights of each toss, and the restitution of the corner that hits between two of them."""
    import matplotlib.pyplot as plt

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ns.recordings.RecordingWarning)  # units that are no SI units
        recording = ns.load_recording(measured(), columns=COLUMNS)
    found, falls, longer, lows = [], [], 0, []
    for run in recording.runs:
        z = recording.channel("z", run)
        t = z["time"].values
        place = np.column_stack([recording.channel(name, run) for name in ("x", "y", "z")])
        turned = np.column_stack([recording.channel(name, run) for name in ("qw", "qx", "qy", "qz")])
        free = flights(t, z)
        found.append(corner_restitution(t, place, turned, cube(), free))
        falls.append(float(free.acceleration))
        longer += found[-1].attrs["left_out"]
        lows.append(corner_heights(place, turned, cube()).min(axis=1))
    impacts = xr.concat(found, "impact", combine_attrs="drop")
    single = impacts.isel(impact=impacts.single.values)
    e = single.restitution.values
    print(
        f"{longer + impacts.sizes['impact']} contacts between two flights: {longer} longer than 4 samples, "
        f"{impacts.sizes['impact'] - len(e)} of several corners or sliding, {len(e)} impacts of one corner\n"
        f"restitution: median {np.median(e):.3f}, from {e.min():.3f} to {e.max():.3f}, standard deviation "
        f"{e.std(ddof=1):.3f}\n"
        f"of each: fits {np.median(single.restitution_error):.3f}, half a sample {np.median(single.half_sample):.3f}\n"
        f"gravity {-np.median(falls):.1f} half-widths/s^2: 9.81 m/s^2 makes the half-width "
        f"{-9.81e3 / np.median(falls):.1f} mm"
    )

    with ns.plot.journal():
        figure, (left, right) = plt.subplots(1, 2, figsize=(ns.plot.PAGE, 0.36 * ns.plot.PAGE))
        z = recording.channel("z", "Run #7")
        toss(z["time"], z, lows[7], found[7], left, unit="half-widths")
        restitution(impacts, right, unit="half-widths/s")

    assert abs(9.81e3 / np.median(falls) / -52.4 - 1) < 0.03  # the half-width of the cube, as published
    assert len(e) >= 8 and np.all((0.15 < e) & (e < 0.45))
    return figure


if __name__ == "__main__":
    ns.plot.save_figure(main(), "real_cube_tosses.pdf")
