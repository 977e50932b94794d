"""Files of real instruments: what they determine, and what not (environment variable NONSMOOTH_DATA)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.identification.amplitude_dependent import amplitude_dependent, response_curves
from nonsmooth.recordings.signals.checks import take
from nonsmooth.recordings.signals.restitution import flights
from nonsmooth.recordings.signals.rigid_body import corner_heights, corner_restitution, cube
from nonsmooth.recordings.signals.steady import steady_response

FOLDER = os.environ.get("NONSMOOTH_DATA", "")
pytestmark = [
    pytest.mark.skipif(not FOLDER, reason="files of others are not shipped: docs/gallery; set NONSMOOTH_DATA"),
    pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning"),
]


def file(name: str) -> Path:
    return Path(FOLDER) / name


@pytest.mark.parametrize(("channel", "error"), [("Strain_0", 3e-4), ("Strain_1", 3e-3)])
def test_the_frequency_of_the_steady_response(channel: str, error: float) -> None:
    recording = ns.load_recording(file("lvm_sample_1200lines.lvm"))
    x = take(recording, channel, "Segment 1")
    found = steady_response(x.time, x)
    # The frequency that was set stands in the file, in a channel of its own; clocks of 50 ppm would make 2 mHz.
    assert recording.channel("Untitled 1").values[0] == 42.05
    assert found.frequency == pytest.approx(42.05, abs=1e-3)
    assert found.frequency_error < error
    assert abs(found.frequency - 42.05) < 3 * found.frequency_error
    assert set(found.by_method) == {"fit", "phase", "spectrum"}


def test_the_steady_response_tells_no_decay() -> None:
    recording = ns.load_recording(file("lvm_sample_1200lines.lvm"))
    x = take(recording, "Strain_0", "Segment 1")
    found = steady_response(x.time, x)
    assert not found.decays and abs(found.rate) < 3 * found.rate_error
    assert "run 'Segment 1', channel 'Strain_0'" in found.statement
    assert "cannot be identified" in found.statement and "switched off" in found.statement
    # The amplitude is the same at both ends to a tenth of a percent: a decay would take minutes.
    assert found.rate_bound < 1e-3 * np.log(10)
    # The same record, let decay: found, and the statement is another.
    decaying = x * np.exp(-0.05 * (x.time - x.time[0]))
    known = steady_response(x.time, decaying.assign_attrs(x.attrs))
    assert known.decays and known.rate == pytest.approx(0.05, abs=4 * known.rate_error)


def test_the_jointed_beam() -> None:
    recording = ns.load_recording(file("FrID_jointed_beam_ForcedFrequencyResponses.mat"), axis="frequency")
    curves = response_curves(recording)
    finding, mode = amplitude_dependent(curves, knots=6, residual=True)
    data = finding.data
    assert finding.samples_used == 12 * 41 and len(finding.runs) == 12
    # Where a phase passes -pi/2 the mode resonates: read off each curve without a fit.
    for c in curves:
        f = float(np.interp(np.pi / 2, -c.phase, c.frequency))
        a = float(np.interp(f, c.frequency, c.amplitude))
        there = float(mode.natural_frequency(a))
        assert f == pytest.approx(there, abs=0.1)  # curves differ by 0.03 Hz (one standard deviation)
        needed = float(np.interp(f, c.frequency, c.force)) / (mode.mass * a * (2 * np.pi * there) ** 2)
        assert needed / 2 == pytest.approx(float(mode.damping_ratio(a)), rel=0.12)
    # The joint dissipates more with amplitude: monotonically, five times as much at the end.
    zeta = data.zeta.values
    assert np.all(np.diff(zeta) > 0) and 4 < zeta[-1] / zeta[0] < 6
    # Softer first, stiffer then: the turn stands out of the errors.
    low = int(np.argmin(data.f_n.values))
    assert 100e-6 < float(data.amplitude[low]) < 200e-6
    for end in (0, -1):
        assert data.f_n[end] - data.f_n[low] > 5 * np.hypot(data.f_n_error[end], data.f_n_error[low])
    assert not data.unstable.any()


def test_the_cube() -> None:
    columns = {"run": "toss", "time": "t_s"} | {
        n: (f"s{k}", "1") for k, n in enumerate(("x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz"))
    }
    recording = ns.load_recording(file("contactnets_cube_tosses_12.csv"), columns=columns)
    e, falls = [], []
    for run in recording.runs:
        z = recording.channel("z", run)
        t = z.time.values
        place = np.column_stack([recording.channel(n, run) for n in ("x", "y", "z")])
        turned = np.column_stack([recording.channel(n, run) for n in ("qw", "qx", "qy", "qz")])
        # In the end it lies on a face: centre one half-width high, four corners on the table (w first, then).
        heights = np.sort(corner_heights(place, turned, cube())[-1])
        np.testing.assert_allclose(heights, [0] * 4 + [2] * 4, atol=0.1)
        free = flights(t, z)
        falls.append(float(free.acceleration))
        found = corner_restitution(t, place, turned, cube(), free)
        e += found.restitution.values[found.single.values].tolist()
        # Vertical speed of the centre, stored beside: of the flight before each impact, by our lines.
        assert np.all(found.duration < 4.6 / 148)
    assert np.median(falls) == pytest.approx(-9.81 / 0.0524, rel=0.03)  # a cube of 104.8 mm
    assert len(e) == 10 and 0.15 < min(e) and max(e) < 0.45
    assert np.median(e) == pytest.approx(0.27, abs=0.03)
