"""Capstone's CSV export, from files written down byte by byte."""

from __future__ import annotations

import numpy as np
import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.readers.fields import split_unit

ENGLISH = (
    b'\xef\xbb\xbf"Time (s) Run #1","Position (m) Run #1","Temperature, Ch P3 (\xc2\xb0C) Run #1",'
    b'"Time (s) slow, by hand","Position (m) slow, by hand"\r\n'
    b"0.000,0.1,20.5,0.0,5\r\n"
    b"0.010,0.2,,0.5,6\r\n"
    b"0.020,-0.3,20.75,,\r\n"
    b"0.030,4e-3,,,\r\n"
)
OTHER_LOCALE = (
    b"\xef\xbb\xbfTime (s) Run #1;Angle (rad) Run #1;Time (s) Run #2;Angle (rad) Run #2\r\n"
    b"0,00000000;0,02944946;0,00000000;-1,50000000\r\n"
    b"0,05000000;0,03141593;0,05000000;2,00000000\r\n"
    b"0,10000000;0,00000001;;\r\n"
)


def test_runs_sensors_and_rates() -> None:
    recording = parse_recording(ENGLISH, "pulls.csv")
    assert recording.runs == ("Run #1", "slow, by hand")
    assert recording.channels == ("Position", "Temperature, Ch P3")
    assert recording.units == {"Position": "m", "Temperature, Ch P3": "°C"}
    assert recording.rates["Run #1/Position"] == pytest.approx(100, rel=1e-12)
    assert recording.rates["Run #1/Temperature, Ch P3"] == pytest.approx(50, rel=1e-12)
    position = recording.channel("Position", "Run #1")
    assert position.values.tolist() == [0.1, 0.2, -0.3, 0.004]
    temperature = recording.channel("Temperature", "Run #1")
    assert temperature.values.tolist() == [20.5, 20.75]
    assert temperature["time"].values.tolist() == [0.0, 0.02]
    assert temperature.attrs["port"] == "P3" and temperature.attrs["origin"] == "column 3"
    assert recording.channel("Position", "slow, by hand").values.tolist() == [5, 6]
    assert not recording.synthetic


def test_blanks_are_dropped_per_column_and_said() -> None:
    recording = parse_recording(ENGLISH, "pulls.csv")
    said = "\n".join(recording.warnings)
    assert "run 'Run #1', channel 'Temperature, Ch P3': 2 blank fields dropped" in said


def test_decimal_comma_with_ragged_runs() -> None:
    recording = parse_recording(OTHER_LOCALE, "x.csv")
    assert recording.channel("Angle", "Run #1").values.tolist() == [0.02944946, 0.03141593, 1e-8]
    assert recording.channel("Angle", "Run #2").values.tolist() == [-1.5, 2.0]
    assert recording.channel("Angle", "Run #2")["time"].values.tolist() == [0.0, 0.05]


def test_unit_may_be_missing_and_names_hold_brackets() -> None:
    text = "Time (s) Run #1,Force (push) (N) Run #1,Count Run #1,Rate (N/(m/s)) Run #1\n0,1,2,3\n1,4,5,6\n"
    recording = parse_recording(text.encode(), "x.csv")
    assert recording.units == {"Force (push)": "N", "Count": "", "Rate": "N/(m/s)"}
    assert any("'Count'" in w and "no unit" in w for w in recording.warnings)


def test_a_run_name_that_ends_another() -> None:
    """'Run #1' is a suffix of 'second Run #1': the longest name that fits is meant."""
    text = "Time (s) Run #1,x (m) Run #1,Time (s) second Run #1,x (m) second Run #1\n0,1,0,2\n1,3,1,4\n"
    recording = parse_recording(text.encode(), "x.csv")
    assert recording.channel("x", "second Run #1").values.tolist() == [2, 4]


def test_two_time_columns_in_one_run() -> None:
    text = "Time (s) Run #1,x (m) Run #1,Time (s) Run #1,F (N) Run #1\n0,1,0,7\n0.5,2,0.25,8\n1,3,0.5,9\n"
    recording = parse_recording(text.encode(), "x.csv")
    assert recording.channel("x")["time"].values.tolist() == [0, 0.5, 1]
    assert recording.channel("F")["time"].values.tolist() == [0, 0.25, 0.5]


def test_milliseconds_become_seconds_and_utf16_is_read() -> None:
    text = "Time (ms) Run #1\tx (m) Run #1\r\n0\t1\r\n250\t2\r\n"
    recording = parse_recording(b"\xff\xfe" + text.encode("utf-16-le"), "x.txt")
    assert recording.channel("x")["time"].values.tolist() == [0, 0.25]


def test_windows_1252_is_remarked() -> None:
    recording = parse_recording("Time (s) Run #1,T (°C) Run #1\n0,1\n1,2\n".encode("cp1252"), "x.csv")
    assert recording.units == {"T": "°C"} and any("Windows-1252" in w for w in recording.warnings)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"Time (s) Run #1,x (m) Run #1,x (m) Run #2\n0,1,2\n", r"line 1: column 3 .*Run #2.* no run .* time column"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n1,2.3.4\n", r"line 3: column 2 .* '2\.3\.4', expected a number"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n,2\n", r"line 3: run 'Run #1', channel 'x' has a value where .* no time"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n1,1_0\n", r"line 3"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n1", r"line 3: ends after fewer than 2 fields: the file is cut short"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n1,2,3\n", r"line 3: has 3 fields, the header has 2"),
        (b'Time (s) Run #1,x (m) Run #1\n0,1\n1,"2\n3,4\n', r"line 3: cannot be split into fields"),
        (b"Time (s) Run #1,x (m) Run #1\n1,1\n0.5,2\n", r"line 3: run 'Run #1', channel 'x': time goes back"),
        (b"Time (furlongs) Run #1,x (m) Run #1\n1,1\n", r"'furlongs', which is no unit of time"),
        (b"Time (s) Run #1,x (m) Run #1\nnan,1\n", r"line 2: .* not a finite number"),
        (b"Time (s) Run #1,x (m) Run #1\n", r"holds no samples"),
        (b"Time (s) Run #1,x (m) Run #1\n0,1\n\x00,2\n", r"is none of the formats known"),
    ],
)
def test_bad_files_say_where(text: bytes, message: str) -> None:
    with pytest.raises(DataFileError, match=message) as caught:
        parse_recording(text, "bad.csv")
    assert str(caught.value).startswith("bad.csv: ")


def test_mixed_units_name_the_runs() -> None:
    text = b"Time (s) Run #1,x (m) Run #1,Time (s) Run #2,x (mm) Run #2\n0,1,0,2\n1,3,1,4\n"
    recording = parse_recording(text, "x.csv")
    assert recording.units == {"x": "mixed: m (Run #1), mm (Run #2)"}
    assert recording.channel("x", "Run #2").attrs["units"] == "mm"
    assert any("m (Run #1), mm (Run #2)" in w and "nothing was converted" in w for w in recording.warnings)


def test_empty_channel_is_left_out_with_a_remark() -> None:
    recording = parse_recording(b"Time (s) Run #1,x (m) Run #1,y (m) Run #1\n0,1,\n1,2,\n", "x.csv")
    assert recording.channels == ("x",)
    assert any("channel 'y': holds no value; left out" in w for w in recording.warnings)


def test_nan_runs_are_kept_and_said() -> None:
    rows = "".join(f"{k / 100},{'NaN' if 40 <= k < 47 else k}\n" for k in range(100))
    recording = parse_recording(f"Time (s) Run #1,x (m) Run #1\n{rows}".encode(), "x.csv")
    assert np.isnan(recording.channel("x").values[40:47]).all()
    (said,) = recording.warnings
    assert "run 'Run #1', channel 'x': 7 of 100 values" in said and "7 from time = 0.4 s on" in said


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("Position (m)", "Position", "m"),
        ("Velocity (m/s²)", "Velocity", "m/s²"),
        ("a (b) (c(d))", "a (b)", "c(d)"),
        ("(m)", "(m)", ""),
        ("a b)", "a b)", ""),
        ("Count", "Count", ""),
    ],
)
def test_split_unit(text: str, name: str, unit: str) -> None:
    assert split_unit(text) == (name, unit)
