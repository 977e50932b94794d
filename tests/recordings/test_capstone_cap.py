"""Capstone experiments, packed here from records and XML written down by hand."""

from __future__ import annotations

import io
import struct
import zipfile

import numpy as np
import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

VALUES = [0.1, -2.5, 1e-300, 3.0]


def records(values: list[float], padding: int = 3, flag: int = 1) -> bytes:
    return b"".join(struct.pack("<Id", flag, v) for v in values) + b"\0" * 12 * padding


def main_xml(
    *, size: int = 4, start: str = "0.5", step: str = "0.01", decimal: str = ".", clock: str = "", extra: str = ""
) -> str:
    clock = clock or f'IntervalCacheStartValue="{start}" IntervalCacheInterval="{step}"'
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n'
        f'<DSProExperiment><Header Version="1.13" DecimalSeparator="{decimal}"/>\n'
        '<Sensor Name="Rotary Motion Sensor" DistanceForFullRotation="0.0789" SamplePeriod="0.04"/>\n'
        '<DataRepository><DataSource MeasurementName="Position" BaseUnit="m">\n'
        '<DataSet DataGroupNumber="2"><DataSegmentElement>\n'
        f'<DependentStorageElement FileName="data\\a.tmp" DataCacheDataSize="{size}"/>\n'
        f"<IndependentStorageElement {clock}/>\n"
        f"</DataSegmentElement></DataSet></DataSource>{extra}</DataRepository></DSProExperiment>"
    )


def pack(xml: str | bytes, members: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("main.xml", xml)
        for name, content in members.items():
            archive.writestr(name, content)
    return packed.getvalue()


def test_one_run() -> None:
    recording = parse_recording(pack(main_xml(), {"data/a.tmp": records(VALUES)}), "x.cap")
    assert recording.runs == ("Run #2",)
    position = recording.channel("Position")
    assert position.values.tolist() == VALUES
    assert position["time"].values.tolist() == [0.5 + 0.01 * k for k in range(4)]
    assert position.attrs["units"] == "m" and position.attrs["origin"] == "data/a.tmp"
    assert recording.source["header"]["sensors"][0]["DistanceForFullRotation"] == "0.0789"
    assert recording.source["header"]["Version"] == "1.13"


def test_decimal_comma() -> None:
    xml = main_xml(start="0,5", step="0,01", decimal=",")
    recording = parse_recording(pack(xml, {"data/a.tmp": records(VALUES)}), "x.cap")
    assert recording.rates == {"Run #2/Position": pytest.approx(100)}


def test_times_in_a_member_of_their_own() -> None:
    times = [0.0, 0.1, 0.35, 0.4]
    members = {"data/a.tmp": records(VALUES), "data/t.tmp": records(times)}
    recording = parse_recording(pack(main_xml(clock='FileName="data/t.tmp"'), members), "x.cap")
    assert recording.channel("Position")["time"].values.tolist() == times


def test_members_longer_than_one_piece() -> None:
    values = np.random.default_rng(1).normal(size=20_000).tolist()
    recording = parse_recording(pack(main_xml(size=20_000), {"data/a.tmp": records(values, 4000)}), "x.cap")
    assert recording.channel("Position").values.tolist() == values


def test_an_invalid_record_between_valid_ones_is_nan() -> None:
    content = records(VALUES[:2], 0) + records([9.9], 0, flag=0) + records(VALUES[2:])
    recording = parse_recording(pack(main_xml(), {"data/a.tmp": content}), "x.cap")
    values = recording.channel("Position").values
    assert values[[0, 1, 3, 4]].tolist() == VALUES and np.isnan(values[2])
    assert any("run 'Run #2', channel 'Position': 1 records between valid ones" in w for w in recording.warnings)


def test_several_sources_runs_and_stretches() -> None:
    def source(name: str, port: str, sets: str) -> str:
        return f'<DataSource MeasurementName="{name}" ChannelIDName="{port}">{sets}</DataSource>'

    def stretch(member: str, start: float) -> str:
        return (
            f'<DataSegmentElement><DependentStorageElement FileName="data/{member}.tmp" DataCacheDataSize="2"/>'
            f'<IndependentStorageElement IntervalCacheStartValue="{start}" IntervalCacheInterval="0.5"/>'
            "</DataSegmentElement>"
        )

    extra = (
        source("Force", "P1", f'<DataSet DataGroupNumber="10">{stretch("b", 0)}{stretch("c", 5)}</DataSet>')
        + source("Force", "P2", f'<DataSet DataGroupNumber="10">{stretch("d", 0)}</DataSet>')
        + source("Force", "P3", f'<DataSet DataGroupNumber="1" DataHasBeenDeleted="TRUE">{stretch("e", 0)}</DataSet>')
        + source("Power", "", '<DataSet DataGroupNumber="1"><DataSegmentElement/></DataSet>')
        + source("Mass", "", f'<DataSet DataGroupNumber="1">{stretch("f", 0)}</DataSet>')
    )
    members = {f"data/{m}.tmp": records([float(k), k + 0.5]) for k, m in enumerate("bcd")}
    members |= {"data/a.tmp": records(VALUES), "data/f.tmp": struct.pack("<II8s", 2, 8, "0.07".encode("utf-16-le"))}
    recording = parse_recording(pack(main_xml(extra=extra), members), "x.cap")
    assert recording.runs == ("Run #2", "Run #10")  # in order of their numbers
    assert recording.channel("Force, Ch P1", "Run #10").values.tolist() == [0, 0.5, 1, 1.5]
    assert recording.channel("Force, Ch P1", "Run #10")["time"].values.tolist() == [0, 0.5, 5, 5.5]
    assert recording.channel("Force, Ch P2", "Run #10").values.tolist() == [2, 2.5]
    said = "\n".join(recording.warnings)
    assert "run 'Run #1', channel 'Force': deleted by the user" in said
    assert "run 'Run #1', channel 'Power': has no stored values" in said
    assert "run 'Run #1', channel 'Mass': data/f.tmp holds text that a user typed" in said


BOMB = "<!DOCTYPE x [<!ENTITY a 'aaaaaaaaaa'><!ENTITY b '&a;&a;&a;&a;&a;'>]>"
FILE = "<!DOCTYPE x [<!ENTITY a SYSTEM 'file:///etc/hostname'>]>"


@pytest.mark.parametrize(
    ("xml", "members", "message"),
    [
        (main_xml(size=5), {"data/a.tmp": records(VALUES)}, r"data/a\.tmp, record 7: 4 of 7 records are valid, .* 5"),
        (main_xml(size=3), {"data/a.tmp": records(VALUES)}, r"data/a\.tmp, record 7: has more valid .* the 3"),
        (main_xml(), {"data/a.tmp": records(VALUES)[:-5]}, r"data/a\.tmp, record 7: is cut short: 7 of 12 bytes"),
        (main_xml(), {"data/a.tmp": records(VALUES, flag=77)}, r"record 1: its valid flag is 77, expected 0 or 1"),
        (main_xml(), {}, r"data/a\.tmp: is not in the archive"),
        (main_xml(step="0"), {"data/a.tmp": records(VALUES)}, r"main\.xml, line 5: the clock .* step > 0"),
        (main_xml(step="inf"), {"data/a.tmp": records(VALUES)}, r"expected a time and a step > 0"),
        (main_xml(size=10**12), {"data/a.tmp": records(VALUES)}, r"4 of 7 records are valid"),
        (main_xml().replace('"2"', '"two"'), {}, r"DataGroupNumber is 'two'"),
        (main_xml()[:300], {}, r"main\.xml, line \d: is not well-formed"),
        (BOMB + main_xml().split("?>")[1], {}, r"main\.xml, line 1: declares a document type"),
        (FILE + main_xml().split("?>")[1], {}, r"declares a document type"),
        ("<other/>", {}, r"the root is 'other', expected DSProExperiment"),
        ("<DSProExperiment>" + "<a>" * 300, {}, r"nested deeper than 256"),
        ("<DSProExperiment/>", {}, r"holds no samples"),
        ("", {}, r"not well-formed"),
    ],
)
def test_bad_files_say_where(xml: str, members: dict[str, bytes], message: str) -> None:
    with pytest.raises(DataFileError, match=message):
        parse_recording(pack(xml, members), "bad.cap")


def test_a_bomb_is_refused_before_it_unfolds() -> None:
    """64 MiB of zeros in 64 KiB: the budget of a small file is 16 MiB."""
    packed = pack(main_xml(), {"data/a.tmp": b"\0" * (12 * 5_600_000)})
    assert len(packed) < 100_000
    with pytest.raises(DataFileError, match=r"data/a\.tmp: unpacks to more than 16777216 bytes"):
        parse_recording(packed, "bomb.cap")


def test_sizes_in_the_directory_are_not_believed() -> None:
    packed = bytearray(pack(main_xml(), {"data/a.tmp": records(VALUES)}, zipfile.ZIP_STORED))
    entry = packed.rindex(b"PK\x01\x02")
    packed[entry + 24 : entry + 28] = struct.pack("<I", 0xFFFFFFF0)
    assert parse_recording(bytes(packed), "x.cap").channel("Position").values.tolist() == VALUES
    packed[entry + 24 : entry + 28] = struct.pack("<I", 12)
    with pytest.raises(DataFileError, match=r"data/a\.tmp"):
        parse_recording(bytes(packed), "x.cap")


def test_cut_archive_and_foreign_archive() -> None:
    packed = pack(main_xml(), {"data/a.tmp": records(VALUES)})
    with pytest.raises(DataFileError, match="not a whole ZIP archive"):
        parse_recording(packed[:-30], "x.cap")
    other = io.BytesIO()
    with zipfile.ZipFile(other, "w") as archive:
        archive.writestr("word/document.xml", "<a/>")
    with pytest.raises(DataFileError, match=r"without main\.xml; expected a PASCO Capstone"):
        parse_recording(other.getvalue(), "x.docx")


@pytest.mark.parametrize("key", ["Angle", "Angle, Ch P2"])
def test_a_unit_that_is_a_number_is_no_unit(key: str) -> None:
    """BaseUnit="2560": unknown without a table, said so, and given by the channel's name or its quantity."""
    named = main_xml().replace('"Position" BaseUnit="m"', '"Angle" ChannelIDName="Ch P2" BaseUnit="2560"')
    packed = pack(named, {"data/a.tmp": records(VALUES)})
    recording = parse_recording(packed, "x.cap")
    assert recording.units == {"Angle, Ch P2": ""}
    said = [w for w in recording.warnings if "unit" in w]
    assert "its unit is number 2560 of a table" in said[0] and "units={'Angle, Ch P2': ...}" in said[0]
    given = parse_recording(packed, "x.cap", Options(units={key: "rad"}))
    assert given.units == {"Angle, Ch P2": "rad"}
    assert given.channel("Angle").attrs["measurement"] == "Angle" and not [w for w in given.warnings if "no unit" in w]


def test_the_number_of_a_unit_is_looked_up_in_the_files_own_table() -> None:
    table = '<Units><UnitDefinition UnitID="2559" Symbol="N"/><UnitDefinition UnitID="2560" Symbol="rad"/></Units>'
    xml = main_xml(extra=table).replace('BaseUnit="m"', 'BaseUnit="2560"')
    recording = parse_recording(pack(xml, {"data/a.tmp": records(VALUES)}), "x.cap")
    assert recording.units == {"Position": "rad"} and not [w for w in recording.warnings if "unit" in w]
