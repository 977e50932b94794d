"""LabVIEW measurement files, written down line by line."""

from __future__ import annotations

import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

TOP = (
    "LabVIEW Measurement\t\r\nSeparator\tTab\r\nDecimal_Separator\t{d}\r\nX_Columns\t{x}\r\n"
    "***End_of_Header***\t\r\n\t\r\n"
)
SEGMENT = (
    "Channels\t2\t\r\nSamples\t3\t1\t\r\nDate\t2023/08/29\t2023/08/29\t\r\nTime\t11:16:09.5\t11:16:09.5\t\r\n"
    "Y_Unit_Label\tVolts\t\t\r\nX_Dimension\tTime\tTime\t\r\nX0\t0.0E+0\t0.0E+0\t\r\nDelta_X\t0.001\t1.0\t\r\n"
    "***End_of_Header***\t\t\t\r\nX_Value\tVoltage\tSet\tComment\r\n"
)
ROWS = "0.000\t1.5\t42.0\tbegun by hand\r\n0.001\t-2E-3\t\t\r\n0.002\t3\t\t\r\n1.000\t4\t43.0\t\r\n"
FILE = (TOP.format(d=".", x="One") + SEGMENT + ROWS).encode()


def test_unequal_samples_and_later_writes() -> None:
    recording = parse_recording(FILE, "x.lvm")
    voltage, setting = recording.channel("Voltage"), recording.channel("Set")
    assert voltage.values.tolist() == [1.5, -0.002, 3, 4]
    assert voltage["time"].values.tolist() == [0, 0.001, 0.002, 1.0]
    assert setting.values.tolist() == [42, 43] and setting["time"].values.tolist() == [0, 1]
    assert voltage.attrs["units"] == "Volts" and voltage.attrs["started"] == "2023/08/29 11:16:09.5"
    assert recording.tree["Segment 1"].attrs["comments"] == "line 17: begun by hand"
    assert any("'Voltage': Samples says 3 (its first write), 4 were read" in w for w in recording.warnings)
    assert any("'Voltage': gap of 997 samples after t = 0.002 s (line 19)" in w for w in recording.warnings)


def test_segments_are_runs() -> None:
    recording = parse_recording(FILE + b"\t\r\n" + (SEGMENT + "5.0\t9\t8\t\r\n").encode(), "x.lvm")
    assert recording.runs == ("Segment 1", "Segment 2")
    assert recording.channel("Voltage", "Segment 2").values.tolist() == [9]


def test_decimal_comma_and_no_x_column() -> None:
    text = TOP.format(d=",", x="No") + SEGMENT.replace(".", ",") + "\t1,5\t42,0\r\n\t2,5\t\r\n\t3,5\t\r\n"
    recording = parse_recording(text.encode(), "x.lvm")
    assert recording.channel("Voltage").values.tolist() == [1.5, 2.5, 3.5]
    assert recording.channel("Voltage")["time"].values.tolist() == [0, 0.001, 0.002]


def test_one_x_column_per_channel() -> None:
    segment = SEGMENT.replace("X_Value\tVoltage\tSet\t", "X_Value\tVoltage\tX_Value\tSet\t")
    text = TOP.format(d=".", x="Multi") + segment + "0\t1\t0\t7\t\r\n0.5\t2\t0.25\t8\t\r\n"
    recording = parse_recording(text.encode(), "x.lvm")
    assert recording.channel("Voltage")["time"].values.tolist() == [0, 0.5]
    assert recording.channel("Set")["time"].values.tolist() == [0, 0.25]


def test_a_later_start_is_kept() -> None:
    text = FILE.replace(b"X0\t0.0E+0\t0.0E+0", b"X0\t0.0E+0\t6.0E+1").replace(b"0.001\t1.0", b"0.001\t0.001")
    recording = parse_recording(text, "x.lvm")
    assert recording.channel("Set")["time"].values.tolist() == [60.0, 61.0]
    assert any("'Set': its clock begins at X0 = 60" in w for w in recording.warnings)


def test_special_blocks_are_passed_over() -> None:
    special = b"***Start_Special***\t\r\nanything\t1\r\n***End_Special***\t\r\n"
    recording = parse_recording(FILE.replace(b"Channels\t2", special + b"Channels\t2"), "x.lvm")
    assert recording.channel("Voltage").size == 4


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"-2E-3", b"-2E-", r"line 18: column 2 \('Voltage'\) holds '-2E-', expected a number"),
        (b"Channels\t2", b"Channels\t99999", r"line 7: Channels is '99999'"),
        (b"Channels\t2", b"Channels\ttwo", r"line 7: Channels is 'two'"),
        (b"Channels\t2", b"Channels\t7", r"line 16: names 3 columns, the segment has 7"),
        (b"X_Value\tVoltage", b"Y_Value\tVoltage", r"line 16: expected the names of the columns"),
        (b"Decimal_Separator\t.", b"Decimal_Separator\t;", r"Decimal_Separator is ';'"),
        (b"X_Columns\tOne", b"X_Columns\tSome", r"X_Columns is 'Some'"),
        (b"Delta_X\t0.001", b"Delta_X\tfast", r"line 7: Delta_X of channel 1 is 'fast'"),
        (b"X_Dimension\tTime", b"X_Dimension\tFrequency", r"over 'Frequency'; read it with axis='frequency'"),
        (b"***End_of_Header***\t\t\t", b"", r"header .* has no end"),
    ],
)
def test_bad_files_say_where(old: bytes, new: bytes, message: str) -> None:
    assert old in FILE
    with pytest.raises(DataFileError, match=message):
        parse_recording(FILE.replace(old, new), "bad.lvm")


def test_cut_short() -> None:
    with pytest.raises(DataFileError, match=r"line 20: ends in the middle of a row"):
        parse_recording(FILE[: FILE.rindex(b"\t4\t")], "bad.lvm")
    with pytest.raises(DataFileError, match="holds no segment"):
        parse_recording(TOP.format(d=".", x="One").encode(), "bad.lvm")


def test_frequency_axis() -> None:
    text = FILE.replace(b"X_Dimension\tTime\tTime", b"X_Dimension\tFrequency\tFrequency")
    recording = parse_recording(text, "x.lvm", Options(axis="frequency"))
    assert recording.channel("Voltage").dims == ("frequency",)
