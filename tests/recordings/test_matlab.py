"""MATLAB files: version 5 put together byte by byte, 7.3 by h5py (HDF5 is beyond writing by hand)."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
import pytest

from nonsmooth.errors import DataFileError
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

INT8, INT32, UINT32, DOUBLE, UINT16, MATRIX, PACKED = 1, 5, 6, 9, 4, 14, 15
HEADER = b"MATLAB 5.0 MAT-file, written by hand".ljust(116) + b"\0" * 8 + struct.pack("<H", 0x0100) + b"IM"


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + b"\0" * (-len(content) % 8)


def matrix(name: str, cls: int, dims: tuple[int, ...], *parts: bytes) -> bytes:
    return element(
        MATRIX,
        element(UINT32, struct.pack("<II", cls, 0))
        + element(INT32, struct.pack(f"<{len(dims)}i", *dims))
        + element(INT8, name.encode())
        + b"".join(parts),
    )


def doubles(name: str, *values: float, dims: tuple[int, ...] | None = None) -> bytes:
    return matrix(name, 6, dims or (1, len(values)), element(DOUBLE, struct.pack(f"<{len(values)}d", *values)))


def struct_(name: str, **fields: bytes) -> bytes:
    names = b"".join(field.encode().ljust(32, b"\0") for field in fields)
    return matrix(name, 2, (1, 1), element(INT32, struct.pack("<i", 32)), element(INT8, names), *fields.values())


def chars(name: str, word: str) -> bytes:
    return matrix(name, 4, (1, len(word)), element(UINT16, word.encode("utf-16-le")))


VARIABLES = doubles("t", 0, 0.5, 1) + doubles("x", 4, 5, 6) + doubles("M", 1, 2, 3, 7, 8, 9, dims=(3, 2))


def test_vectors_beside_a_time_vector() -> None:
    recording = parse_recording(HEADER + VARIABLES, "x.mat")
    assert recording.channels == ("x", "M(1)", "M(2)")
    assert recording.channel("x")["time"].values.tolist() == [0, 0.5, 1]
    assert recording.channel("M(2)").values.tolist() == [7, 8, 9]


def test_packed_variables() -> None:
    packed = zlib.compress(VARIABLES[: 8 + struct.unpack_from("<I", VARIABLES, 4)[0]])
    rest = VARIABLES[8 + struct.unpack_from("<I", VARIABLES, 4)[0] :]
    data = HEADER + struct.pack("<II", PACKED, len(packed)) + packed + rest
    assert parse_recording(data, "x.mat").channel("x").values.tolist() == [4, 5, 6]


def test_structs_are_runs_with_units_and_notes() -> None:
    one = struct_(
        "test",
        frequency=doubles("", 1, 3, 2),
        amplitude=doubles("", 4, 5, 6),
        units=chars("", "Hz, mm"),
        level=doubles("", 0.25),
    )
    recording = parse_recording(HEADER + one, "x.mat", Options(axis="frequency"))
    assert recording.runs == ("test",) and recording.units == {"amplitude": "mm"}
    assert recording.channel("amplitude")["frequency"].values.tolist() == [1, 3, 2]
    assert recording.tree["test"].attrs["note_level"] == "0.25"


def test_cells_and_mapping() -> None:
    second = struct_("", a=doubles("", 3, 4), b=doubles("", 5, 6))
    cell = matrix("c", 1, (1, 2), struct_("", a=doubles("", 1, 2)), second)
    options = Options(columns={"time": "c(2).a", "y": ("c(2).b", "m")})
    recording = parse_recording(HEADER + cell, "x.mat", options)
    assert recording.channel("y").values.tolist() == [5, 6] and recording.units == {"y": "m"}
    column = Options(columns={"x": "M(:,2)"}, rate=2)
    assert parse_recording(HEADER + VARIABLES, "x.mat", column).channel("x").values.tolist() == [7, 8, 9]


def test_what_is_no_data_is_left_out_with_a_remark() -> None:
    sparse = matrix("s", 5, (3, 3))
    recording = parse_recording(HEADER + VARIABLES + sparse, "x.mat")
    assert any("class 5 (sparse, object or function); left out" in w for w in recording.warnings)


BOMB = zlib.compress(struct.pack("<II", MATRIX, 40 << 20) + b"\0" * (40 << 20))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (VARIABLES[:-4], r"variable at byte \d+: is \d+ bytes long, only \d+ follow: the file is cut short"),
        (doubles("t", 1, 2, dims=(1, 2**30)), r"variable at byte 128: says it has 1073741824 elements, which are not"),
        (doubles("t", 1, 2, dims=(1, -2)), r"expected the flags and the dimensions of a matrix, got \(1, -2\)"),
        (doubles("t", 1, 2, dims=(1, 5)), r"cannot be read as a MATLAB file"),
        (struct_("s", x=matrix("", 1, (1, 2**30))), r"says it has 1073741824 elements, which are not"),
        (
            struct_("s", x=doubles("", 1, 2)).replace(struct.pack("<2i", 1, 1), struct.pack("<2i", 1, 9), 1),
            r"says it has 9 elements, which are not",
        ),
        (matrix("c", 1, (1000, 1000)), r"says it has 1000000 elements, which are not"),
        (chars("c", "abc").replace(struct.pack("<2i", 1, 3), struct.pack("<2i", 999, 999)), r"it has 998001 elements"),
        (struct.pack("<II", PACKED, len(BOMB)) + BOMB, r"unpacks to more than 16777216 bytes"),
        (struct.pack("<II", PACKED, 20) + BOMB[:20], r"variable at byte 128: cannot be unpacked"),
        (struct.pack("<II", PACKED, 8) + b"notzlib!", r"cannot be unpacked, it is damaged"),
        (element(INT8, b"12345678"), r"is of type 1, expected a matrix"),
        (doubles("x", 1, 2), r"no vector 'time' beside others; there are 'x'\. Name them"),
        (b"", r"there are no vectors at all"),
    ],
)
def test_bad_files_say_where(content: bytes, message: str) -> None:
    with pytest.raises(DataFileError, match=message):
        parse_recording(HEADER + content, "bad.mat")


def test_deep_nesting_is_refused() -> None:
    cell = doubles("", 1, 2)
    for _ in range(60):
        cell = matrix("c", 1, (1, 1), cell)
    with pytest.raises(DataFileError, match="nested deeper than 32"):
        parse_recording(HEADER + cell, "bad.mat")


def hdf5(fill: Any) -> bytes:
    import h5py

    packed = io.BytesIO()
    with h5py.File(packed, "w") as opened:
        fill(opened, h5py)
    return packed.getvalue()


def test_version_73_structs_cells_and_text() -> None:
    def fill(file: Any, h5py: Any) -> None:
        refs = file.create_group("#refs#")
        for k in range(2):
            refs[f"t{k}"] = np.array([[0.0], [0.5 + k]]).T
            refs[f"x{k}"] = np.array([[1.0], [2.0 + k]]).T
        runs = file.create_group("runs")  # an array of two structs is stored by field
        for field in ("time", "x"):
            column = runs.create_dataset(field, (2, 1), dtype=h5py.ref_dtype)
            for k in range(2):
                column[k, 0] = refs[f"{field[0]}{k}"].ref
        word = file.create_dataset("operator", data=np.array([[77], [83]], dtype="u2"))
        word.attrs["MATLAB_class"] = np.bytes_("char")
        file["M"] = np.array([[1.0, 2.0, 3.0], [7.0, 8.0, 9.0]])  # 3 x 2 in MATLAB

    data = hdf5(fill)
    recording = parse_recording(data, "x.mat")
    assert recording.runs == ("runs(1)", "runs(2)")
    assert recording.channel("x", "runs(2)").values.tolist() == [1, 3]
    assert recording.channel("x", "runs(2)")["time"].values.tolist() == [0, 1.5]
    column = parse_recording(data, "x.mat", Options(columns={"x": "M(:,2)"}, rate=1))
    assert column.channel("x").values.tolist() == [7, 8, 9]


def test_version_73_claims_and_links() -> None:
    def bomb(file: Any, h5py: Any) -> None:
        file.create_dataset("time", (10**12,), dtype="f8", chunks=(1024,), compression="gzip")

    with pytest.raises(DataFileError, match=r"/time: says it holds \(1000000000000,\) values, more than"):
        parse_recording(hdf5(bomb), "bad.mat")

    def linked(file: Any, h5py: Any) -> None:
        file["time"] = np.arange(3.0)
        file["x"] = np.arange(3.0)
        file["secret"] = h5py.ExternalLink("/etc/hostname", "/")

    recording = parse_recording(hdf5(linked), "x.mat")
    assert any("/secret: is a link; left out" in w for w in recording.warnings)
    good = hdf5(linked)
    with pytest.raises(DataFileError, match="cannot be read as a MATLAB file, it is damaged or cut short"):
        parse_recording(good[: len(good) // 2], "bad.mat")


def test_an_empty_variable_takes_nothing_from_the_others() -> None:
    """`note = []`, `c = {}`, `s = struct([])` and `w = ''` beside a recording."""
    width = element(INT32, struct.pack("<i", 32))
    empty = [doubles("note", dims=(0, 0)), matrix("c", 1, (0, 0)), chars("w", "")]
    empty.append(matrix("s", 2, (0, 0), width, element(INT8, b"a".ljust(32, b"\0"))))
    for one in (*empty, b"".join(empty)):
        recording = parse_recording(HEADER + VARIABLES + one, "x.mat")
        assert recording.channels == ("x", "M(1)", "M(2)")
        assert recording.channel("x").values.tolist() == [4, 5, 6]


def test_version_73_leaves_out_what_is_no_vector_of_numbers() -> None:
    """Empty variables, complex and compound values, a named type, values in other files: the rest is read."""

    def fill(file: Any, h5py: Any) -> None:
        file["time"] = np.array([[0.0, 0.5]])
        file["x"] = np.array([[4.0, 5.0]])
        for name, kind in (("note", "char"), ("none", "double")):  # MATLAB keeps the size of what is empty
            file[name] = np.array([0, 0], dtype="u8")
            file[name].attrs["MATLAB_empty"], file[name].attrs["MATLAB_class"] = np.uint8(1), np.bytes_(kind)
        file["nil"] = h5py.Empty("f8")
        file["type"] = np.dtype("f8")
        file["pairs"] = np.zeros(2, dtype=[("a", "f8"), ("b", "f8")])
        file["words"] = np.array([b"ab", b"cd"])
        layout = h5py.VirtualLayout((2,), "f8")
        layout[:] = h5py.VirtualSource("elsewhere.h5", "x", (2,))
        file.create_virtual_dataset("far", layout)

    recording = parse_recording(hdf5(fill), "x.mat")
    assert recording.channels == ("x",) and recording.channel("x").values.tolist() == [4, 5]
    said = "\n".join(recording.warnings)
    for what in (
        "/type: is neither a group nor an array; left out",
        "/far: its values are in other files; left out",
        "/pairs: holds compound values; left out",
        "/words: holds |S2 values, no numbers; left out",
    ):
        assert what in said
    assert "note" not in said and "none" not in said and "nil" not in said


def test_version_73_complex_numbers_are_named_as_such() -> None:
    def fill(file: Any, h5py: Any) -> None:
        file["time"] = np.array([[0.0, 0.5]])
        file["z"] = np.array([[(1.0, 2.0), (3.0, 4.0)]], dtype=[("real", "f8"), ("imag", "f8")])

    with pytest.raises(DataFileError, match=r"z.*holds complex numbers; save its parts as two real vectors"):
        parse_recording(hdf5(fill), "x.mat")
