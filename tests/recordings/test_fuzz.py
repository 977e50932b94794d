"""Damaged files: whatever is done to one, reading it gives a recording or a DataFileError, soon and in little memory.

``make fuzz`` reads 100 000 of them; the suite 60 per reader.
"""

from __future__ import annotations

import io
import resource
import struct
import sys
import time
import tracemalloc
import wave
import zipfile
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from nonsmooth.errors import DataFileError
from nonsmooth.recordings import Recording
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.reading import Options

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

TOTAL = 100_000
LONGEST = 5.0  # seconds for one file of a few kilobytes
PEAK = 64 << 20  # bytes allocated while one is read


class Seed(NamedTuple):
    content: bytes
    format: str | None
    options: Options = Options()
    wrap: Callable[[bytes], bytes] = bytes


def _capstone(delimiter: str, mark: str) -> bytes:
    header = ["Time (s) Run #1", '"Angle, Ch P1 (rad) Run #1"', "F (N) Run #1", "Time (s) slow", "Angle (rad) slow"]
    rows = [[f"{k / 10}", f"{k % 3}.5", "" if k % 2 else f"{k}e-3", f"{k}.0", "-1"] for k in range(20)]
    rows[-1][3:] = ["", ""]
    lines = [delimiter.join(header)] + [delimiter.join(f.replace(".", mark) for f in row) for row in rows]
    return ("\ufeff" + "\r\n".join(lines) + "\r\n").encode()


RECORDS = b"".join(struct.pack("<Id", 1, k / 3) for k in range(30)) + b"\0" * 120
XML = (
    b'<?xml version="1.0"?><DSProExperiment><Header Version="1" DecimalSeparator="."/>'
    b'<Sensor Name="R" SamplePeriod="1"/>'
    b'<DataRepository><DataSource MeasurementName="Angle" ChannelIDName="P1" BaseUnit="rad">'
    b'<DataSet DataGroupNumber="1">'
    b'<DataSegmentElement><DependentStorageElement FileName="data/a.tmp" DataCacheDataSize="30"/>'
    b'<IndependentStorageElement IntervalCacheStartValue="0" IntervalCacheInterval="0.01"/></DataSegmentElement>'
    b'</DataSet><DataSet DataGroupNumber="2"><DataSegmentElement><DependentStorageElement FileName="data/a.tmp" '
    b'DataCacheDataSize="30"/><IndependentStorageElement FileName="data/a.tmp"/></DataSegmentElement></DataSet>'
    b"</DataSource></DataRepository></DSProExperiment>"
)
LVM = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\n***End_of_Header***\t\n\t\n"
    + "Channels\t2\t\nSamples\t3\t1\t\nY_Unit_Label\tV\tm\t\nX_Dimension\tTime\tTime\t\nX0\t0.0\t0.5\t\n"
    "Delta_X\t0.1\t1.0\t\n***End_of_Header***\t\nX_Value\tVoltage\tSet\tComment\n0.0\t1\t2\tword\n0.1\t3\t\t\n0.2\t4\t\t\n"
    * 2
).encode()


def _zip(xml: bytes, records: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("data/a.tmp", records)
    return packed.getvalue()


def _mat(compress: bool) -> bytes:
    from scipy.io import savemat

    packed = io.BytesIO()
    cell = np.empty(2, dtype=object)
    cell[:] = [np.arange(3.0), "word"]
    inner = {"time": np.arange(9) / 8, "x": np.arange(9.0), "units": "s, m", "note": "word", "c": cell}
    variables = {"s": inner, "t": np.arange(9.0), "M": np.ones((9, 2)), "k": np.arange(9, dtype=np.int16)}
    savemat(packed, variables, do_compression=compress)
    return packed.getvalue()


def _hdf5() -> bytes:
    import h5py

    packed = io.BytesIO()
    with h5py.File(packed, "w") as file:
        group = file.create_group("s")
        group["time"] = np.arange(9.0)[None] / 8
        group.create_dataset("x", data=np.arange(9.0)[None], compression="gzip")
        word = group.create_dataset("units", data=np.array([[115], [109]], dtype="u2"))
        word.attrs["MATLAB_class"] = np.bytes_("char")
        refs = file.create_group("#refs#")
        refs["a"] = np.arange(5.0)
        cell = file.create_dataset("c", (1, 1), dtype=h5py.ref_dtype)
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        cell[0, 0] = refs["a"].ref
    return packed.getvalue()


def _tdms() -> bytes:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed (extra `experiment`)")
    packed = io.BytesIO()
    with nptdms.TdmsWriter(packed) as writer:
        wave = {"wf_increment": 0.01, "unit_string": "m"}
        x = nptdms.ChannelObject("g", "x", np.arange(9.0), properties=wave)
        y = nptdms.ChannelObject("g", "y", np.arange(9, dtype=np.int16), properties=wave)
        writer.write_segment([x, y])
        clock = nptdms.ChannelObject("h", "time", np.arange(4.0))
        writer.write_segment([clock, nptdms.ChannelObject("h", "z", [1.0] * 4)])
    return packed.getvalue()


def _npz() -> bytes:
    packed = io.BytesIO()
    np.savez_compressed(packed, t=np.arange(9.0), x=np.arange(9.0), M=np.ones((9, 2)))
    return packed.getvalue()


def _npy() -> bytes:
    packed = io.BytesIO()
    np.save(packed, np.ones((9, 2)))
    return packed.getvalue()


def _wav() -> bytes:
    packed = io.BytesIO()
    with wave.open(packed, "wb") as file:
        file.setparams((2, 2, 100, 0, "NONE", ""))
        file.writeframes(bytes(range(200)))
    return packed.getvalue()


def _sheet() -> bytes:
    openpyxl = pytest.importorskip("openpyxl", reason="openpyxl is not installed (extra `experiment`)")
    book = openpyxl.Workbook()
    for row in (("t", "x"), *((float(k), k * 0.5) for k in range(9))):
        book.active.append(row)
    packed = io.BytesIO()
    book.save(packed)
    return packed.getvalue()


def _parquet(feather: bool) -> bytes:
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra `experiment`)")
    from pyarrow import feather as feathers
    from pyarrow import parquet

    packed = io.BytesIO()
    table = pyarrow.table({"t": np.arange(9.0), "x": np.arange(9.0)})
    feathers.write_feather(table, packed) if feather else parquet.write_table(table, packed)
    return packed.getvalue()


def _uff() -> bytes:
    pytest.importorskip("pyuff", reason="pyuff is not installed (extra `experiment`)")
    head = [
        "    -1",
        "    58",
        *["NONE"] * 5,
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'N':10s}{1:10d}{1:4d} {'N':10s}{1:10d}{1:4d}",
        f"{4:10d}{4:10d}{1:10d}{0.0:13.5e}{0.01:13.5e}{0.0:13.5e}",
        *[f"{kind:10d}{0:5d}{0:5d}{0:5d} {'x':20s} {'s':20s}" for kind in (17, 8, 0, 0)],
    ]
    return ("\n".join([*head, "".join(f"{v:20.12e}" for v in range(4)), "    -1"]) + "\n").encode()


TABLE = b"# note\nt_s\tx [m]\trun\n" + b"".join(b"%d\t%d.5\t%d\n" % (k % 9, k, k // 9) for k in range(27))
NAMED = Options(columns={"time": "t_s", "x": "x [m]", "run": "run"})

SEEDS: dict[str, Callable[[], Seed]] = {
    "capstone csv": lambda: Seed(_capstone(",", "."), None),
    "capstone csv, decimal comma": lambda: Seed(_capstone(";", ","), "capstone-csv"),
    "table": lambda: Seed(TABLE, "csv", NAMED),
    "table, guessed": lambda: Seed(b"t,x (m),y\n0,1,2\n1,,4\n2,5,6\n", None),
    "lvm": lambda: Seed(LVM, "lvm"),
    "cap": lambda: Seed(_zip(XML, RECORDS), "capstone-cap"),
    "cap, main.xml": lambda: Seed(XML, "capstone-cap", wrap=lambda xml: _zip(xml, RECORDS, zipfile.ZIP_STORED)),
    "cap, records": lambda: Seed(RECORDS, "capstone-cap", wrap=lambda b: _zip(XML, b, zipfile.ZIP_STORED)),
    "tdms": lambda: Seed(_tdms(), "tdms"),
    "mat v5": lambda: Seed(_mat(False), "mat"),
    "mat v5, packed": lambda: Seed(_mat(True), "mat"),
    "mat v7.3": lambda: Seed(_hdf5(), "mat"),
    "hdf5": lambda: Seed(_hdf5(), "hdf5"),
    "npy": lambda: Seed(_npy(), "npy", Options(rate=1.0)),
    "npz": lambda: Seed(_npz(), "npy"),
    "wav": lambda: Seed(_wav(), "wav"),
    "xlsx": lambda: Seed(_sheet(), "xlsx"),
    "parquet": lambda: Seed(_parquet(False), "arrow"),
    "feather": lambda: Seed(_parquet(True), "arrow"),
    "uff": lambda: Seed(_uff(), "uff"),
    "stamps": lambda: Seed(b"time,x\n" + b"".join(b"2026-05-31T12:00:%02d.5,%d\n" % (k, k) for k in range(20)), None),
    "table, options": lambda: Seed(
        b"Bench\nt;x\ns;mm\n" + b"".join(b"%d;1.00%d,5\n" % (k, k) for k in range(9)),
        "csv",
        Options(header=2, units_row=3, decimal=",", thousands=".", na=("n",), skip=("S",), wraps={"x": 64.0}),
    ),
}

PIECES = [
    b"",
    b"\0",
    b"\0" * 4,
    b"\xff" * 4,
    b"\xff" * 8,
    b"\xff\xff\xff\x7f",
    b"\0\0\0\x40",
    b"\x80",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\n",
    b"\r",
    b"\t",
    b",",
    b";",
    b'"',
    b"'",
    b" ",
    b".",
    b"-",
    b"/",
    b"\\",
    b"(",
    b")",
    b"<",
    b">",
    b"&a;",
    b"<!DOCTYPE a>",
    b"nan",
    b"inf",
    b"1e999",
    b"99999999999",
    b"0",
    b"1",
    b"-1",
    b"Run #1",
    b"Time (s) ",
    b"***End_of_Header***",
    b"X_Value",
    b"Samples",
    b"Channels",
    b"DataSet",
    b"TDSm",
    b"PK\x03\x04",
]
MUTATION = st.tuples(
    st.sampled_from(["set", "set", "put", "cut", "double", "end", "swap"]),
    st.integers(0, 1 << 20),
    st.integers(0, 64),
    st.sampled_from(PIECES) | st.binary(min_size=1, max_size=4),
)


def damaged(content: bytes, mutations: list[tuple[str, int, int, bytes]]) -> bytes:
    data = bytearray(content)
    for what, where, length, piece in mutations:
        at = where % (len(data) + 1)
        if what == "set":
            data[at : at + len(piece)] = piece
        elif what == "put":
            data[at:at] = piece
        elif what == "cut":
            del data[at : at + length]
        elif what == "double":
            data[at:at] = data[at : at + length]
        elif what == "swap":
            other = (at * 31 + length) % (len(data) + 1)
            data[at : at + length], data[other : other + length] = data[other : other + length], data[at : at + length]
        elif where % 7 == 0:
            del data[at:]
    return bytes(data)


def outcome(data: bytes, seed: Seed) -> str:
    """Read it; anything but a sound recording or a DataFileError that names the file fails."""
    try:
        recording = parse_recording(data, "damaged", seed.options, format=seed.format)
    except DataFileError as error:
        return "refused" if str(error).startswith("damaged: ") else f"refused without its name: {error}"
    sound(recording, len(data))
    return "read"


def sound(recording: Recording, size: int) -> None:
    held = 0
    for path in recording.rates:
        dataset = recording.tree[path].to_dataset()
        (axis,) = dataset.dims
        assert np.isfinite(dataset[axis].values).all()
        if axis == "time":
            assert (np.diff(dataset[axis].values) >= 0).all()
        held += dataset.nbytes
    assert recording.runs and held <= max(16 << 20, 100 * size)


def fuzz(name: str, examples: int, *, deep: bool) -> dict[str, Any]:
    seed = SEEDS[name]()
    assert outcome(seed.wrap(seed.content), seed) == "read", "the undamaged file must be readable"
    found: Counter[str] = Counter()
    worst = peak = 0.0

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=not deep,
        phases=[Phase.generate] if deep else [Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.lists(MUTATION, min_size=1, max_size=6))
    def run(mutations: list[tuple[str, int, int, bytes]]) -> None:
        nonlocal worst, peak
        data = seed.wrap(damaged(seed.content, mutations))
        traced = sum(found.values()) % 50 == 0
        if traced:
            tracemalloc.start()
        begin = time.process_time()  # other jobs do not lengthen it
        try:
            result = outcome(data, seed)
            found[result] += 1
        finally:
            took = time.process_time() - begin
            if traced:
                peak = max(peak, tracemalloc.get_traced_memory()[1])
                tracemalloc.stop()
        worst = max(worst, took)
        assert result in ("read", "refused")
        assert took < LONGEST, f"took {took:.1f} s"
        assert peak < PEAK, f"took {peak / 1e6:.0f} MB"

    run()
    return {**found, "worst": worst, "peak": peak}


@pytest.mark.parametrize("name", SEEDS)
def test_damaged_files(name: str) -> None:
    fuzz(name, 60, deep=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDS)
def test_very_many_damaged_files(name: str) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begin = time.perf_counter()
    figures = fuzz(name, -(-TOTAL // len(SEEDS)), deep=True)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(
        f"\n{name}: {figures.get('read', 0)} read, {figures.get('refused', 0)} refused, slowest "
        f"{1e3 * figures['worst']:.0f} ms of CPU, peak {figures['peak'] / 1e6:.1f} MB, process +{grown:.0f} MB, "
        f"{time.perf_counter() - begin:.0f} s",
        file=sys.stderr,
    )
    assert grown < 256
