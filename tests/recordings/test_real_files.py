"""Files that real instruments wrote, where this machine has them (environment variable NONSMOOTH_DATA)."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns

FOLDER = os.environ.get("NONSMOOTH_DATA", "")
pytestmark = [
    pytest.mark.skipif(not FOLDER, reason="files of others are not shipped: docs/gallery; set NONSMOOTH_DATA"),
    pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning"),
]


def test_labview() -> None:
    recording = ns.load_recording(Path(FOLDER) / "lvm_sample_1200lines.lvm")
    assert recording.runs == ("Segment 1",) and len(recording.channels) == 12
    voltage = recording.channel("Voltage")
    # The header says 1000; 1176 rows follow.
    assert voltage.size == 1176 and voltage.values[:2].tolist() == [1.211061, 1.20851]
    assert voltage.attrs["units"] == "Volts" and recording.rates["Segment 1/Voltage"] == pytest.approx(1000)
    # Channels written once per write: at 0 s and 1 s, the drive frequency among them.
    drive = recording.channel("Untitled 1")
    assert drive.values.tolist() == [42.05, 42.05] and drive["time"].values.tolist() == [0, 1]
    # The beam answers at that frequency, to the resolution of 1.176 s.
    strain = recording.channel("Strain_0").values
    spectrum = np.abs(np.fft.rfft(strain - strain.mean()))
    assert np.argmax(spectrum) / 1.176 == pytest.approx(42.05, abs=0.5 / 1.176 + 1e-9)


def test_matlab_response_curves() -> None:
    recording = ns.load_recording(Path(FOLDER) / "FrID_jointed_beam_ForcedFrequencyResponses.mat", axis="frequency")
    assert recording.runs == tuple(
        [f"FRdata.ForceControl({k})" for k in range(1, 5)] + [f"FRdata.ResponseControl({k})" for k in range(1, 9)]
    )
    assert recording.units == {"force": "N", "amplitude": "m/s^2", "phase": "rad"}
    curve = recording.channel("amplitude", "FRdata.ForceControl(1)")
    assert curve.size == 41 and curve["frequency"].values[:2].tolist() == [79.2, 79.25]
    assert curve["frequency"].attrs["units"] == "Hz"


def test_servos_with_time_stamps() -> None:
    """Four servos, ten rows a second, stamps of ISO 8601; what is expected is NumPy's reading of them."""
    recording = ns.load_recording(Path(FOLDER) / "servo_backlash_telemetry.csv")
    clock = recording.channel("target pos (1)")["time"].values
    assert clock[0] == 0.0 and (np.diff(clock) > 0).all()
    with open(Path(FOLDER) / "servo_backlash_telemetry.csv", encoding="utf-8") as file:
        stamps = [line.split(",")[0] for line in file][1:]
    first, last = (np.datetime64(stamps[k].rstrip("Z").partition("+")[0]) for k in (0, -1))
    assert clock[-1] == pytest.approx((last - first) / np.timedelta64(1, "us") * 1e-6, abs=1e-6)


def test_a_packed_table_without_time() -> None:
    recording = ns.load_recording(Path(FOLDER) / "silverbox_SNLS80mV.csv.gz", rate=610.35)
    assert {"V1", "V2"} <= set(recording.channels) and recording.channel("V1").size > 100_000


def test_cube_tosses() -> None:
    recording = ns.load_recording(
        Path(FOLDER) / "contactnets_cube_tosses_12.csv",
        columns={"run": "toss", "time": "t_s", "x": ("s0", "half-width"), "z": ("s2", "half-width")},
    )
    assert recording.runs == tuple(f"Run #{k}" for k in range(12))
    assert all(rate == pytest.approx(148, rel=1e-4) for rate in recording.rates.values())
    assert sum(recording.channel("z", run).size for run in recording.runs) == 1234
    assert recording.channel("x", "Run #0").values[0] == 4.00523
