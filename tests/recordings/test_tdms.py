"""LabVIEW's binary files, put together byte by byte from National Instruments' description of the format."""

from __future__ import annotations

import struct

import pytest

pytest.importorskip("nptdms", reason="npTDMS is not installed (extra `experiment`)")

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

F64, TEXT = 10, 0x20


def text(word: str) -> bytes:
    return struct.pack("<I", len(word.encode())) + word.encode()


def numbers(path: str, n: int, **properties: float | str) -> bytes:
    """An object with n doubles and its properties."""
    content = text(path) + struct.pack("<IIIQ", 20, F64, 1, n) + struct.pack("<I", len(properties))
    for name, value in properties.items():
        if isinstance(value, str):
            content += text(name) + struct.pack("<I", TEXT) + text(value)
        else:
            content += text(name) + struct.pack("<Id", F64, value)
    return content


def segment(objects: list[bytes], values: list[float]) -> bytes:
    meta = struct.pack("<I", len(objects)) + b"".join(objects)
    raw = struct.pack(f"<{len(values)}d", *values)
    return b"TDSm" + struct.pack("<IIQQ", 0b1110, 4713, len(meta) + len(raw), len(meta)) + meta + raw


WAVE = segment(
    [
        numbers("/'pull'/'x'", 3, wf_increment=0.25, wf_start_offset=1.0, unit_string="mm", sensor="laser"),
        numbers("/'pull'/'F'", 2, wf_increment=0.5),
    ],
    [1.0, 2.0, 3.0, 10.0, 20.0],
)


def test_waveforms() -> None:
    recording = parse_recording(WAVE, "x.tdms")
    assert recording.runs == ("pull",) and recording.units == {"x": "mm", "F": ""}
    assert recording.channel("x").values.tolist() == [1, 2, 3]
    assert recording.channel("x").attrs["property_sensor"] == "laser"
    assert recording.channel("x")["time"].values.tolist() == [1.0, 1.25, 1.5]
    assert recording.channel("F")["time"].values.tolist() == [0, 0.5]


def test_time_channel_or_rate() -> None:
    data = segment([numbers("/'g'/'Time'", 2, unit_string="ms"), numbers("/'g'/'x'", 2)], [0.0, 5.0, 1.0, 2.0])
    assert parse_recording(data, "x.tdms").channel("x")["time"].values.tolist() == [0, 0.005]
    bare = segment([numbers("/'g'/'x'", 2)], [1.0, 2.0])
    with pytest.raises(DataFileError, match=r"no vector 'time' beside others; there are 'g\.x'.*rate="):
        parse_recording(bare, "x.tdms")
    assert parse_recording(bare, "x.tdms", Options(rate=4)).channel("x")["time"].values.tolist() == [0, 0.25]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (WAVE[:-1], r"segment 1, byte 0: says it is \d+ bytes long .* cut short"),
        (WAVE + WAVE[:20], r"segment 2, byte \d+: its lead-in of 28 bytes is cut short"),
        (WAVE + b"NOPE" + WAVE[4:], r"segment 2, byte \d+: begins with b'NOPE'"),
        (segment([numbers("/'g'/'x'", 2), numbers("/'g'/'time'", 1)], [1.0, 2.0, 3.0]), r"no vector 'time' beside"),
    ],
)
def test_bad_files_say_where(data: bytes, message: str) -> None:
    with pytest.raises(DataFileError, match=message):
        parse_recording(data, "bad.tdms")


def test_fewer_values_than_announced() -> None:
    """A line that the library would print is a remark; samples that are not there take no memory."""
    recording = parse_recording(segment([numbers("/'g'/'x'", 2**40, wf_increment=1.0)], [1.0, 2.0]), "x.tdms")
    assert recording.channel("x").values.tolist() == [1.0, 2.0]
    assert any("not a multiple of the chunk size" in w for w in recording.warnings)
