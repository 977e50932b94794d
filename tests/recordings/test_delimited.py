"""Tables of any origin."""

from __future__ import annotations

import gzip
import hashlib
import zlib
from pathlib import Path

import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import load_recording, parse_recording
from nonsmooth.recordings.reading import Options

TABLE = b"# a comment\n# another\nt_s, x [mm], force (N), note\n0.0, 1, 10, 7\n0.5, 2, , 7\n1.0, 3, 30, 8\n"


def test_header_with_units_and_comments() -> None:
    recording = parse_recording(TABLE, "x.csv")
    assert recording.units == {"x": "mm", "note": "", "force": "N"}
    assert recording.channel("x")["time"].values.tolist() == [0, 0.5, 1]
    assert recording.channel("force").values.tolist() == [10, 30]
    assert recording.channel("force")["time"].values.tolist() == [0, 1]
    assert recording.source["header"]["comments"] == ["# a comment", "# another"]
    assert any("'force': 1 blank fields dropped" in w for w in recording.warnings)


def test_bars_between_fields_and_exponents_of_fortran() -> None:
    """Also with a decimal comma, and with a frame of bars as databases print tables."""
    for text in (
        "t (s)|x (m)\n0|1.5D+00\n1|-2.5d-01\n2|3.0E+1\n",
        "| t (s) | x (m) |\n| 0 | 1,5D+00 |\n| 1 | -2,5d-01 |\n| 2 | 3,0E+1 |\n",
        "t (s)  x (m)\n0.D0  1.5D0\n1.D0  -.25D0\n2.D0  3.0D1\n".replace(" (", "("),
    ):
        x = parse_recording(text.encode(), "x.txt").channel("x")
        assert (x.values.tolist(), x["time"].values.tolist()) == ([1.5, -0.25, 30.0], [0, 1, 2])
    with pytest.raises(DataFileError, match="holds '1.5F\\+00', expected a number"):
        parse_recording(b"t (s)|x (m)\n0|1.5D+00\n1|1.5F+00\n", "x.txt")
    with pytest.raises(DataFileError, match="give header=2"):
        parse_recording(b"a session|of today\nt|x\n0|1\n1|2\n", "x.txt")


def test_a_number_that_marks_a_missing_value_is_missing() -> None:
    table = b"t (s), x (m)\n0, 1\n1, -999\n2, 3\n"
    for na in (("-999",), ["-999", "9999"]):
        x = parse_recording(table, "x.csv", Options(na=na)).channel("x")
        assert (x.values.tolist(), x["time"].values.tolist()) == ([1, 3], [0, 2])
    assert parse_recording(table, "x.csv").channel("x").values.tolist() == [1, -999, 3]


def test_a_packed_file_is_read_whole_or_not_at_all() -> None:
    """Files joined after they were packed are one, as gzip has it; no part of one that is cut short is read."""
    lines = [b"t (s), x (m)\n", *(b"%d, %d\n" % (i, i * i) for i in range(200))]
    plain, halves = b"".join(lines), [b"".join(lines[:90]), b"".join(lines[90:])]
    whole = gzip.compress(plain)
    for packed in whole, gzip.compress(halves[0]) + gzip.compress(halves[1]):
        recording = parse_recording(packed, "x.csv.gz")
        assert recording.channel("x").equals(parse_recording(plain, "x.csv").channel("x"))
        assert recording.channel("x").size == 200
        assert recording.source["sha256"] == hashlib.sha256(packed).hexdigest()
    flush = zlib.compressobj(wbits=31)
    begun = flush.compress(halves[0]) + flush.flush(zlib.Z_FULL_FLUSH)  # cut at the end of a line
    for damaged in (begun, whole[:-4], whole[:-8] + bytes(4) + whole[-4:], whole[:20] + bytes(20) + whole[40:]):
        with pytest.raises(DataFileError, match=r"x.csv.gz: cannot be unpacked, it is damaged or cut short"):
            parse_recording(damaged, "x.csv.gz")
    with pytest.raises(DataFileError, match=r"unpacks to more than 16777216 bytes"):
        parse_recording(gzip.compress(bytes(2**24 + 1)), "x.csv.gz")


def test_column_mapping_with_runs() -> None:
    options = Options(columns={"time": "t_s", "run": "note", "position": ("x [mm]", "m")})
    recording = parse_recording(TABLE, "x.csv", options)
    assert recording.runs == ("Run #7", "Run #8") and recording.units == {"position": "m"}
    assert recording.channel("position", "Run #7").values.tolist() == [1, 2]
    assert recording.channel("position", "Run #8")["time"].values.tolist() == [1.0]
    assert any("not asked for are left out: 'force (N)'" in w for w in recording.warnings)


def test_no_header_needs_places() -> None:
    data = b"0 1.5\n0.1 2.5\n0.2 3.5\n"
    with pytest.raises(DataFileError, match=r"line 1: the table has no header.*columns=\{'time': 0"):
        parse_recording(data, "x.txt")
    recording = parse_recording(data, "x.txt", Options(columns={"time": 0, "x": (1, "m")}))
    assert recording.channel("x").values.tolist() == [1.5, 2.5, 3.5]


def test_no_time_column() -> None:
    data = b"x;y\n1,5;2\n2,5;3\n"
    with pytest.raises(DataFileError, match=r"no time column among 'x', 'y'; name it, .* rate=\.\.\."):
        parse_recording(data, "x.csv")
    recording = parse_recording(data, "x.csv", Options(rate=100))
    assert recording.channel("x").values.tolist() == [1.5, 2.5]
    assert recording.channel("x")["time"].values.tolist() == [0, 0.01]


def test_another_axis_need_not_rise() -> None:
    """The unstable middle part of a response runs back in frequency."""
    data = b"frequency (Hz)\tamplitude (m)\n1\t1\n3\t2\n2\t3\n4\t1\n"
    recording = parse_recording(data, "x.tsv", Options(axis="frequency"))
    assert recording.channel("amplitude")["frequency"].values.tolist() == [1, 3, 2, 4]
    assert recording.channel("amplitude")["frequency"].attrs["units"] == "Hz"


@pytest.mark.parametrize(
    ("data", "options", "message"),
    [
        (TABLE, Options(columns={"time": "when", "x": 1}), r"no column 'when'; the columns are 't_s', 'x \[mm\]'"),
        (TABLE, Options(columns={"time": 9, "x": 1}), r"there is no column 9"),
        (TABLE, Options(columns={"x": 1}), r"no time column"),
        (TABLE, Options(units={"z": "m"}), r"units names 'z', which is no channel; there are: 'force'"),
        (b"t,x\n0,1\n1,2\n0,3\n", Options(), r"line 4: .* time goes back .* columns=\{'run': \.\.\.\}"),
        (b"t,x\n0,abc\n", Options(), r"line 2: column 2 \('x'\) holds 'abc'"),
        (b"# only\n", Options(), r"no table, only blank lines or comments"),
        (b"t,x,x\n0,1,2\n", Options(columns={"time": "t", "x": "x"}), r"2 columns are called 'x'"),
        (b"t,x\n0,1\n,5\n", Options(), r"line 3: .* has a value where there is no time"),
        ((",".join(["t"] + ["c"] * 5000) + "\n").encode(), Options(), r"holds 5001 columns; at most 4096"),
    ],
)
def test_bad_files_say_where(data: bytes, options: Options, message: str) -> None:
    with pytest.raises(DataFileError, match=message):
        parse_recording(data, "bad.csv", options)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"format": "xls"}, "format must be one of capstone-csv"),
        ({"rate": -1}, "rate = -1 must be positive"),
        ({"rate": 1.0, "columns": {"time": 0}}, "rate makes a time axis"),
        ({"decimal": ";"}, "decimal = ';'; allowed: '.', ','"),
        ({"decimal": ",", "delimiter": ","}, "cannot be the delimiter"),
        ({"delimiter": "ab"}, "delimiter must be one character"),
        ({"axis": "two words"}, "axis must be a name"),
    ],
)
def test_wrong_arguments_at_the_door(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        load_recording("absent.csv", **given)


def test_wrong_columns_at_the_door() -> None:
    with pytest.raises(TypeError, match="columns must be a mapping, .* maps our names"):
        load_recording("absent.csv", columns=["t"])
    with pytest.raises(TypeError, match=r"columns\['x'\] must be a header"):
        load_recording("absent.csv", columns={"x": 1.5})


@pytest.mark.parametrize(
    ("mark", "other", "cut"), [(".", ",", ";"), (",", ".", "\t"), (".", ",", ","), (" ", ",", ";"), (" ", ".", ",")]
)
@pytest.mark.parametrize("whole", [True, False])
def test_the_mark_between_thousands_is_no_decimal_mark(
    tmp_path: Path, mark: str, other: str, cut: str, whole: bool
) -> None:
    """Of whole numbers nothing else tells the decimal mark: 1.234 of a German program is a thousand."""
    file = tmp_path / "log.csv"
    part = "" if whole else f"{other}5"
    lines = [f'"t"{cut}"x"', *(f'"{k}"{cut}"{k}{mark}234{part}"' for k in range(1, 40))]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    found = load_recording(file, thousands=mark, delimiter=cut).channel("x")
    assert found.values.tolist() == [1000.0 * k + 234 + 0.5 * (not whole) for k in range(1, 40)]


def test_labels_with_digits(tmp_path: Path) -> None:
    file = tmp_path / "serial.txt"
    file.write_text("".join(f"a0:{k},a1: {-k}.5\n" for k in range(40)), encoding="utf-8")
    recording = load_recording(file, rate=10.0)
    assert recording.channels == ("a0", "a1")
    assert recording.channel("a1").values.tolist() == [float(f"{-k}.5") for k in range(40)]
