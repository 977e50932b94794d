"""Bad recordings: what is said of them while they are read, and at the door of every signal function.

Each error or warning names the run and the channel and says what to do; nothing is dropped without a word.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from motions import COUNT

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.recordings import RecordingWarning
from nonsmooth.recordings.signals.checks import take
from nonsmooth.recordings.signals.contacts import contacts, impacts
from nonsmooth.recordings.signals.displacement import position
from nonsmooth.recordings.signals.harmonics import fit
from nonsmooth.recordings.signals.phase import drive_phase
from nonsmooth.recordings.signals.sections import poincare
from nonsmooth.recordings.signals.smoothing import savitzky_golay, smooth
from nonsmooth.recordings.signals.spectrum import spectrum

WHO = "run 'Run #2', channel 'Angle'"


def written(folder: Path, time: np.ndarray, angle: np.ndarray, unit: str = "rad") -> Path:
    """Two runs as Capstone exports them; the second one is the odd one. NaN is written as an instrument does."""
    good = np.arange(200) / 100
    lines = [f"Time (s) Run #1,Angle (rad) Run #1,Time (s) Run #2,Angle ({unit}) Run #2"]
    for i in range(max(len(good), len(time))):
        first = f"{good[i]:.4f},{np.cos(4 * good[i]):.6f}" if i < len(good) else ","
        lines.append(first + (f",{time[i]:.4f},{angle[i]:.6f}" if i < len(time) else ",,"))
    file = folder / "session.csv"
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return file


def quietly(file: Path, rate: float | None = None) -> ns.Recording:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RecordingWarning)
        return ns.load_recording(file, rate=rate)


Use = Callable[[Any], object]
USES: dict[str, Use] = {
    "smooth": lambda x: smooth(x.time, x, resolution=COUNT),
    "savitzky_golay": lambda x: savitzky_golay(x.time, x, resolution=COUNT),
    "contacts": lambda x: contacts(x.time, x, resolution=COUNT),
    "impacts": lambda x: impacts(x.time, x, resolution=COUNT),
    "drive_phase": lambda x: drive_phase(x.time, x),
    "fit": lambda x: fit(x.time, x, 4.0),
    "spectrum": lambda x: spectrum(x),
    "poincare": lambda x: poincare(x.time, x, np.gradient(x.values)),
}


# ---------------------------------------------------------------------------------------------------------- no time


def test_no_time_column(tmp_path: Path) -> None:
    file = tmp_path / "session.csv"
    file.write_text("Angle (rad) Run #1,Force (N) Run #1\n" + "0.1,2\n0.2,3\n" * 40, encoding="utf-8")
    with pytest.raises(DataFileError, match=r"session\.csv.*(time|Time)") as error:
        ns.load_recording(file)
    assert "rate=" in str(error.value)
    # What to do, done: time then begins at 0.
    recording = quietly(file, rate=100.0)
    x = recording.channel(recording.channels[0])
    assert x.time.values[-1] == pytest.approx(0.79) and x.values[1] == 0.2


def test_an_array_without_time_has_no_spectrum() -> None:
    with pytest.raises(ValueError, match="rate is needed: the sample rate in Hz, or a DataArray with its time"):
        spectrum(np.arange(100.0))


# ------------------------------------------------------------------------------------------------------------- units


def test_mixed_units(tmp_path: Path) -> None:
    t = np.arange(200) / 100
    file = written(tmp_path, t, np.degrees(np.cos(4 * t)), unit="°")
    with pytest.warns(RecordingWarning, match=r"channel 'Angle': has units mixed: rad \(Run #1\), ° \(Run #2\)"):
        recording = ns.load_recording(file)
    assert recording.units["Angle"] == "mixed: rad (Run #1), ° (Run #2)"
    # Each run is converted from its own unit: the same motion, twice.
    first, second = (
        position(take(recording, "Angle", run, units=("rad", "°")), distance_per_turn=0.0789) for run in recording.runs
    )
    np.testing.assert_allclose(first, second, atol=1e-7)
    with pytest.raises(ValueError, match=rf"{WHO}: its unit is '°', needed is rad; say it with"):
        take(recording, "Angle", "Run #2", units=("rad",))


def test_a_unit_that_is_no_angle(tmp_path: Path) -> None:
    t = np.arange(200) / 100
    recording = quietly(written(tmp_path, t, np.cos(4 * t), unit="N"))
    with pytest.raises(ValueError, match=rf"{WHO}: its unit is 'N'; an angle in rad, deg or rev is needed"):
        position(take(recording, "Angle", "Run #2"), distance_per_turn=0.0789)


# -------------------------------------------------------------------------------------------------------------- rates


def change_of_rate(folder: Path) -> Path:
    t = np.concatenate([np.arange(200) / 100, 2 + np.arange(200) / 50])
    return written(folder, t, np.cos(4 * t))


def test_a_change_of_rate_is_said_while_reading(tmp_path: Path) -> None:
    with pytest.warns(RecordingWarning, match=rf"{WHO}: the sample rate changes from 100 Hz to 50 Hz near t = 2 s"):
        ns.load_recording(change_of_rate(tmp_path))


@pytest.mark.parametrize("name", ["savitzky_golay", "spectrum"])
def test_what_needs_one_rate_says_where_it_changes(tmp_path: Path, name: str) -> None:
    x = take(quietly(change_of_rate(tmp_path)), "Angle", "Run #2")
    expected = rf"{WHO}: the sample rate changes from 100 Hz to 50 Hz near t = 2 s; .* split the record there"
    with pytest.raises(ValueError, match=expected):
        USES[name](x)


def test_what_does_not_need_one_rate_goes_on(tmp_path: Path) -> None:
    x = take(quietly(change_of_rate(tmp_path)), "Angle", "Run #2")
    result = smooth(x.time, x, resolution=1e-6)
    assert np.max(np.abs(result.v + 4 * np.sin(4 * result.time))) < 0.02
    assert fit(x.time, x, 4.0, 1).amplitudes[0] == pytest.approx(1.0, abs=1e-6)


# ---------------------------------------------------------------------------------------------------------------- NaN


def gap_of_nan(folder: Path) -> Path:
    t = np.arange(400) / 100
    angle = np.cos(4 * t)
    angle[100:130] = np.nan
    return written(folder, t, angle)


def test_runs_of_nan_are_said_while_reading(tmp_path: Path) -> None:
    with pytest.warns(RecordingWarning, match=rf"{WHO}: 30 of 400 values are not finite numbers") as said:
        recording = ns.load_recording(gap_of_nan(tmp_path))
    assert any("longest run of them 30 from time = 1 s on; they are kept as they are" in str(w.message) for w in said)
    assert int(np.isnan(recording.channel("Angle", "Run #2")).sum()) == 30


@pytest.mark.parametrize("name", [name for name in USES if name not in ("smooth", "contacts", "impacts")])
def test_runs_of_nan_are_refused_where_they_cannot_be_bridged(tmp_path: Path, name: str) -> None:
    x = take(quietly(gap_of_nan(tmp_path)), "Angle", "Run #2", missing="keep")
    expected = rf"{WHO}: 30 of 400 values .* longest run of them 30 from t = 1 s on; .*cut the record there, or smooth"
    with pytest.raises(ValueError, match=expected):
        USES[name](x)


@pytest.mark.parametrize("name", ["contacts", "impacts"])
def test_runs_of_nan_hide_contacts(tmp_path: Path, name: str) -> None:
    x = take(quietly(gap_of_nan(tmp_path)), "Angle", "Run #2", missing="keep")
    with pytest.raises(ValueError, match=rf"{WHO}: 30 of 400 values are not finite"):
        USES[name](x)


def test_the_smoother_bridges_nan_and_says_so(tmp_path: Path) -> None:
    x = take(quietly(gap_of_nan(tmp_path)), "Angle", "Run #2", missing="keep")
    with pytest.warns(RecordingWarning, match=rf"{WHO}: 30 of 400 .*; they are bridged, with errors that say so"):
        result = smooth(x.time, x, resolution=1e-6)
    z = (result.x - np.cos(4 * result.time)) / result.x_error
    assert result.sizes["time"] == 400 and float(np.abs(z[100:130]).max()) < 4
    assert float(result.x_error[115]) > 20 * float(result.x_error[50])


def test_runs_of_nan_are_refused_where_a_channel_is_taken(tmp_path: Path) -> None:
    expected = rf"{WHO}: 30 of 400 values are not finite .* from time = 1 on; cut the record there, leave this run out"
    with pytest.raises(ValueError, match=expected):
        take(quietly(gap_of_nan(tmp_path)), "Angle", "Run #2")


# -------------------------------------------------------------------------------------------------------------- short


def test_too_short_is_said_while_reading(tmp_path: Path) -> None:
    t = np.arange(6) / 100
    with pytest.warns(RecordingWarning, match=rf"{WHO}: only 6 samples; too short to identify anything from"):
        recording = ns.load_recording(written(tmp_path, t, t))
    with pytest.raises(ValueError, match=rf"{WHO}: 6 samples are too short .* 32 are needed"):
        take(recording, "Angle", "Run #2")


def test_too_short_in_time(tmp_path: Path) -> None:
    t = np.arange(150) / 100
    recording = quietly(written(tmp_path, t, np.cos(t)))
    with pytest.raises(ValueError, match=rf"{WHO}: lasts 1.49 s, needed are 10 s: record longer"):
        take(recording, "Angle", "Run #2", duration=10.0)


@pytest.mark.parametrize("name", [name for name in USES if name != "poincare"])
def test_too_short_at_the_door(tmp_path: Path, name: str) -> None:
    t = np.arange(5) / 100
    x = quietly(written(tmp_path, t, t)).channel("Angle", "Run #2").assign_attrs(run="Run #2")
    with pytest.raises(ValueError, match=rf"{WHO}: too short: 5 usable samples, and .* needs \d+; record longer"):
        USES[name](x)


# ------------------------------------------------------------------------------------------------------- missing, odd


def test_a_channel_or_run_that_is_not_there(tmp_path: Path) -> None:
    t = np.arange(200) / 100
    recording = quietly(written(tmp_path, t, t))
    with pytest.raises(ValueError, match="run 'Run #2' has no channel 'Force'; it has: Angle"):
        take(recording, "Force", "Run #2")
    with pytest.raises(ValueError, match="no run 'Run #3'; there are: Run #1, Run #2"):
        take(recording, "Angle", "Run #3")


def test_times_that_stand_twice_or_go_back() -> None:
    t = np.arange(100) / 100
    t[50] = t[49]
    with pytest.raises(ValueError, match=r"time 0.49 s stands twice \(sample 50\); export more digits"):
        smooth(t, t, resolution=COUNT)
    t[50] = 0.3
    with pytest.raises(ValueError, match=r"time 0.49 s goes back to 0.3 s"):
        fit(t, t, 4.0)
    with pytest.raises(ValueError, match="1 of its times are not finite numbers"):
        fit(np.append(t, np.nan), np.append(t, 0.0), 4.0)
    with pytest.raises(ValueError, match=r"arrays of one length, got \(100,\) and \(99,\)"):
        fit(t, t[1:], 4.0)


def test_dropped_samples_are_a_gap_not_an_even_rate() -> None:
    t = np.delete(np.arange(200) / 100, [90, 91, 92])
    with pytest.raises(ValueError, match="3 samples are missing after t = 0.89 s; .*take smooth"):
        savitzky_golay(t, np.cos(t), resolution=COUNT)
    uneven = np.arange(200) / 100 + np.where(np.arange(200) % 7 < 2, 0.008, 0.0)
    with pytest.raises(ValueError, match="not evenly spaced; .*take smooth"):
        savitzky_golay(uneven, uneven, resolution=COUNT)


def test_a_masked_value_is_a_missing_one() -> None:
    t = np.arange(64) / 100.0
    x = np.ma.masked_greater(np.where(np.arange(64) == 20, 99.0, np.sin(9.0 * t)), 2.0)
    with pytest.raises(ValueError, match="1 of 64 values are not finite numbers"):
        spectrum(x, 100.0)
    assert x.data[20] == 99.0
