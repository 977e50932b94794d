"""Files as laboratories send them: each read right with at most three options, or refused with the option to give.

Every file holds the same motion, 40 readings at 100 Hz: x = k^2 / 8 in mm, force = 1000.5 + k in N. What is expected
follows from these formulas, not from what any reader returned.
"""

from __future__ import annotations

import datetime
import io
import wave
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import nonsmooth as ns

pytestmark = [pytest.mark.physics, pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")]

N = 40
K = np.arange(N)
T, X, F = K / 100, K**2 / 8, 1000.5 + K
UNITS = {"x": "mm", "force": "N"}


def table(
    head: str, row: Callable[[int], str], *, encoding: str = "utf-8", every: dict[int, str] | None = None
) -> bytes:
    lines = [head] if head else []
    for k in range(N):
        lines += [every[k]] if every and k in every else []
        lines.append(row(k))
    return ("\n".join(lines) + "\n").encode(encoding)


def german(value: float, places: int = 3) -> str:
    return f"{value:,.{places}f}".translate(str.maketrans(",.", ".,"))


def comma(value: float) -> str:
    return str(value).replace(".", ",")


def stamp(k: int, form: str, hour: int = 23) -> str:
    begin = datetime.datetime(2026, 5, 31, hour, 59, 59, 800_000)
    return (begin + datetime.timedelta(milliseconds=10 * k)).strftime(form)


def hdf5(fill: Callable[[Any], None]) -> bytes:
    import h5py

    packed = io.BytesIO()
    with h5py.File(packed, "w") as file:
        fill(file)
    return packed.getvalue()


def hdf5_units() -> bytes:
    def fill(file: Any) -> None:
        run = file.create_group("trial")
        for name, values, unit in (("time", T * 1e3, "ms"), ("x", X, "mm"), ("force", F, np.bytes_("N"))):
            run[name] = values
            run[name].attrs["units"] = unit

    return hdf5(fill)


def hdf5_matrix() -> bytes:
    def fill(file: Any) -> None:
        file["data"] = np.stack([X, F], axis=1)
        file["data"].attrs["sample_rate"] = 100.0

    return hdf5(fill)


def hdf5_rows() -> bytes:
    def fill(file: Any) -> None:
        rows = np.zeros(N, dtype=[("t", "f8"), ("x", "f4"), ("force", "f8")])
        rows["t"], rows["x"], rows["force"] = T, X, F
        file["log"] = rows

    return hdf5(fill)


def npz(**arrays: Any) -> bytes:
    packed = io.BytesIO()
    np.savez_compressed(packed, **arrays)
    return packed.getvalue()


def npy(values: Any) -> bytes:
    packed = io.BytesIO()
    np.save(packed, values)
    return packed.getvalue()


def workbook(dates: bool) -> bytes:
    openpyxl = pytest.importorskip("openpyxl", reason="openpyxl is not installed (extra `experiment`)")
    book = openpyxl.Workbook()
    sheet = book.active
    book.create_sheet("notes").append(["operator", "M. S."])
    if not dates:
        sheet.append(["Bench 3, stop at 2 mm"])
        sheet.append(["t", "x", "force"])
        sheet.append(["ms", "mm", "N"])
    else:
        sheet.append(["time", "x (mm)", "force (N)"])
    begin = datetime.datetime(2026, 5, 31, 12)
    for k in range(N):
        when: Any = begin + datetime.timedelta(milliseconds=10 * k) if dates else 10.0 * k
        sheet.append([when, float(X[k]), float(F[k])])
    packed = io.BytesIO()
    book.save(packed)
    return packed.getvalue()


def arrow(kind: str) -> bytes:
    pyarrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed (extra `experiment`)")
    from pyarrow import feather, parquet

    fields = [
        pyarrow.field("time", "f8", metadata={"unit": "s"}),
        pyarrow.field("x (mm)", "f8"),
        pyarrow.field("force", "f8", metadata={"units": "N"}),
    ]
    held = pyarrow.table([T, X, F], schema=pyarrow.schema(fields))
    if kind == "stamps":
        dates = np.datetime64("2026-05-31T23:59:59.9") + (K * 10).astype("timedelta64[ms]")
        held = pyarrow.table({"Time": dates, "x [mm]": X, "force [N]": F})
    packed = io.BytesIO()
    if kind == "feather":
        feather.write_feather(held, packed)
    else:
        parquet.write_table(held, packed)
    return packed.getvalue()


def sound() -> bytes:
    packed = io.BytesIO()
    with wave.open(packed, "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(100)
        file.writeframes(np.stack([K * 8, -K * 8], axis=1).astype("<i2").tobytes())
    return packed.getvalue()


def universal() -> bytes:
    """Two data sets 58, written by the format's description: double precision, an even abscissa in steps of 10 ms."""
    pytest.importorskip("pyuff", reason="pyuff is not installed (extra `experiment`)")
    text = []
    for node, values, unit in ((1, X, "mm"), (2, F, "N")):
        text += ["    -1", "    58", *["NONE"] * 5]
        text.append(f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{node:10d}{1:4d} {'NONE':10s}{1:10d}{1:4d}")
        text.append(f"{4:10d}{N:10d}{1:10d}{0.0:13.5e}{0.01:13.5e}{0.0:13.5e}")
        for kind, name, label in ((17, "Time", "s"), (8, "Channel", unit), (0, "NONE", "NONE"), (0, "NONE", "NONE")):
            text.append(f"{kind:10d}{0:5d}{0:5d}{0:5d} {name:20s} {label:20s}")
        text += ["".join(f"{v:20.12e}" for v in values[k : k + 4]) for k in range(0, N, 4)] + ["    -1"]
    return ("\n".join(text) + "\n").encode()


def measurement(tmp_path: Path) -> bytes:
    asammdf = pytest.importorskip("asammdf", reason="asammdf is not installed (extra `mdf`)")
    path = tmp_path / "written.mf4"
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(X, T, unit="mm", name="x"), asammdf.Signal(F, T, unit="N", name="force")])
        file.append([asammdf.Signal(K[:9].astype("u2"), T[:9] * 5, unit="V", name="slow")])
        file.save(path, overwrite=True)
    return path.read_bytes()


class File(NamedTuple):
    content: bytes | Callable[..., bytes]
    options: dict[str, Any] = {}
    refused: str = ""  # without the options, the message must hold this
    names: dict[str, str] = {"x": "x", "force": "force"}
    units: dict[str, str] = UNITS
    name: str = "file.dat"


ROW = "{:.2f},{},{}".format
PLAIN = {"x": "mm", "force": "N"}

FILES: dict[str, File] = {
    "units in the second row": File(
        table("t,x,force\ns,mm,N", lambda k: ROW(T[k], X[k], F[k])), {"units_row": 2}, "units_row=2"
    ),
    "title lines above": File(
        table("Bench 3; stop\nOperator M. S.\n\nt (s),x (mm),force (N)", lambda k: ROW(T[k], X[k], F[k])),
        {"header": 4},
        "give header=4",
    ),
    "title lines, units in a row": File(
        table("Bench 3\nOperator\nt;x;force\n[s];[mm];[N]", lambda k: ROW(T[k], X[k], F[k]).replace(",", ";")),
        {"header": 3, "units_row": 4},
        "header=3, units_row=4",
    ),
    "sep= of a spreadsheet": File(
        table("sep=;\nt (s);x (mm);force (N)", lambda k: f"{german(T[k])};{german(X[k])};{comma(F[k])}")
    ),
    "decimal comma, thousands with points": File(
        table("t (s);x (mm);force (N)", lambda k: f"{german(T[k])};{german(X[k])};{german(F[k])}"),
        {"decimal": ",", "thousands": "."},
        "decimal=',', thousands='.'",
    ),
    "thousands with commas": File(
        table("t (s)\tx (mm)\tforce (N)", lambda k: f"{T[k]}\t{X[k]}\t{F[k]:,.2f}"),
        {"thousands": ","},
        "decimal='.', thousands=','",
    ),
    "missing values marked": File(
        table("t (s),x (mm),force (N)", lambda k: ROW(T[k], X[k], F[k]), every={7: ".065,#N/A,#N/A", 9: ".085,-,#N/A"}),
        {"na": ("#N/A", "-")},
        "na='#N/A'",
    ),
    "stamps of ISO 8601": File(
        table("time,x (mm),force (N)", lambda k: f"{stamp(k, '%Y-%m-%dT%H:%M:%S.%f')},{X[k]},{F[k]}")
    ),
    "stamps with zones": File(
        table("time,x (mm),force (N)", lambda k: f"{stamp(k, '%Y-%m-%d %H:%M:%S.%f')}+02:00,{X[k]},{F[k]}")
    ),
    "stamps of a country": File(
        table("Zeit;x (mm);force (N)", lambda k: f"{stamp(k, '%d.%m.%Y %H:%M:%S,%f')};{german(X[k])};{comma(F[k])}"),
        {"units": {"time": "%d.%m.%Y %H:%M:%S,%f"}},
        "units={'time': '%d.%m.%Y",
    ),
    "a clock that passes midnight": File(
        table("time,x (mm),force (N)", lambda k: f"{stamp(k, '%H:%M:%S.%f')},{X[k]},{F[k]}"),
        {"wraps": {"time": 86400}},
        "wraps={'time'",
    ),
    "milliseconds since 1970": File(
        table("t_ms,x (mm),force (N)", lambda k: f"{1_780_000_000_000 + 10 * k},{X[k]},{F[k]}")
    ),
    "a clock in microseconds that wraps": File(
        table("time (us),x (mm),force (N)", lambda k: f"{(2**32 - 100_000 + 10_000 * k) % 2**32},{X[k]},{F[k]}"),
        {"wraps": {"time": 2**32}},
        "wraps={'time'",
    ),
    "an encoder that wraps": File(
        table("t (s),x (mm),force (N)", lambda k: ROW(T[k], (X[k] + 65000) % 65536 - 65000, F[k])),
        {"wraps": {"x": 65536}},
    ),
    "a log of the serial port, words in between": File(
        table("Sensor ready\nt (s),x (mm),force (N)", lambda k: ROW(T[k], X[k], F[k]), every={9: "Sensor lost"}),
        {"header": 2, "skip": "Sensor"},
        "header=2",
    ),
    "words between the rows": File(
        table("t (s),x (mm),force (N)", lambda k: ROW(T[k], X[k], F[k]), every={9: "Calibrating ..."}),
        {"skip": "Calib"},
        "skip='Calibrating",
    ),
    "each number with its label": File(table("", lambda k: f"t:{T[k]},x:{X[k]},force:{F[k]}"), {"units": UNITS}),
    "the clock of the serial monitor": File(
        table("", lambda k: f"{stamp(k, '%H:%M:%S.%f', 12)[:-3]} -> {X[k]},{F[k]}"),
        {"columns": {"time": 0, "x": (1, "mm"), "force": (2, "N")}},
        "columns={'time': 0",
    ),
    "no time at all": File(table("x (mm),force (N)", lambda k: f"{X[k]},{F[k]}"), {"rate": 100}, "rate="),
    "a time written with too few digits": File(
        table("t (s),x (mm),force (N)", lambda k: f"{T[k]:.1f},{X[k]},{F[k]}"), {"rate": 100}
    ),
    "UTF-16 with tabs": File(
        table("t (s)\tx (mm)\tforce (N)", lambda k: ROW(T[k], X[k], F[k]).replace(",", "\t"), encoding="utf-16")
    ),
    "a workbook with titles and units": File(
        lambda: workbook(False), {"header": 2, "units_row": 3}, "header=2, units_row=3"
    ),
    "a workbook with dates": File(lambda: workbook(True)),
    "HDF5 with units": File(hdf5_units),
    "HDF5, a matrix with its rate": File(
        hdf5_matrix, {"units": {"data(1)": "mm", "data(2)": "N"}}, names={"x": "data(1)", "force": "data(2)"}
    ),
    "HDF5, rows of a table": File(hdf5_rows, {"units": UNITS}),
    "npz": File(lambda: npz(t=T, x=X, force=F), {"units": UNITS}),
    "npz with a rate beside": File(lambda: npz(fs=100.0, x=X, force=F), {"rate": 100, "units": UNITS}, "rate="),
    "npy, a matrix": File(
        lambda: npy(np.stack([T, X, F], axis=1)),
        {"columns": {"time": "values(:,1)", "x": ("values(:,2)", "mm"), "force": ("values(:,3)", "N")}},
        "columns={'time'",
    ),
    "npy of rows": File(lambda: npy(np.rec.fromarrays([T, X, F], names="t,x,force")), {"units": UNITS}),
    "Parquet": File(lambda: arrow("parquet")),
    "Parquet with dates": File(lambda: arrow("stamps")),
    "Feather": File(lambda: arrow("feather")),
    "universal file": File(universal, names={"x": "1+X", "force": "2+X"}),
    "ASAM MDF": File(measurement),
}


def content(file: File, tmp_path: Path) -> bytes:
    if isinstance(file.content, bytes):
        return file.content
    return file.content(*([tmp_path] if file.content is measurement else []))


@pytest.mark.parametrize("name", FILES)
def test_each_is_read_right_or_refused_with_the_option_to_give(name: str, tmp_path: Path) -> None:
    file = FILES[name]
    path = tmp_path / file.name
    path.write_bytes(content(file, tmp_path))
    if file.refused:
        with pytest.raises(ns.DataFileError) as refusal:
            ns.load_recording(path)
        assert file.refused in str(refusal.value)
    assert len(file.options) <= 3
    recording = ns.load_recording(path, **file.options)
    (run,) = recording.runs
    for ours, expected in (("x", X), ("force", F)):
        found = recording.channel(file.names[ours], run)
        assert found.attrs["units"] == file.units[ours]
        np.testing.assert_allclose(found.values, expected, rtol=1e-12)
        time = found["time"].values
        np.testing.assert_allclose(time - time[0], T, atol=2e-7)


def test_sound_is_read_as_parts_of_full_scale(tmp_path: Path) -> None:
    path = tmp_path / "hammer.wav"
    path.write_bytes(sound())
    recording = ns.load_recording(path)
    assert recording.rates["Run #1/channel 1"] == 100.0
    np.testing.assert_array_equal(recording.channel("channel 1").values, K * 8 / 32768)
    np.testing.assert_array_equal(recording.channel("channel 2").values, -K * 8 / 32768)


def test_the_day_of_the_first_stamp_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(FILES["stamps of ISO 8601"].content)
    recording = ns.load_recording(path)
    assert recording.tree["Run #1"].attrs["started"].startswith("2026-05-31T23:59:59.8")


def test_a_mdf_group_of_another_rate_is_a_sensor_of_the_same_run(tmp_path: Path) -> None:
    path = tmp_path / "car.mf4"
    path.write_bytes(measurement(tmp_path))
    slow = ns.load_recording(path).channel("slow")
    np.testing.assert_array_equal(slow.values, K[:9])
    np.testing.assert_allclose(slow["time"].values, T[:9] * 5, atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"thousands": "x"}, "thousands = 'x'; allowed: '.', ','"),
        ({"thousands": ",", "decimal": ","}, "cannot be the delimiter or the mark between thousands"),
        ({"header": 0}, "header = 0 must be a whole number, at least 1"),
        ({"units_row": True}, "units_row must be a whole number, not True"),
        ({"skip": -1}, "skip = -1 must be a whole number"),
        ({"wraps": {"x": 0}}, r"wraps\['x'\] = 0 must be positive; counts at which"),
        ({"skips": 2}, "`skips` is not an option"),
    ],
)
def test_options_are_refused_before_anything_is_read(options: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        ns.load_recording("absent.csv", **options)


@pytest.mark.parametrize(
    ("data", "options", "message"),
    [
        (b"t,x\n0,1\n1,2\n", {"wraps": {"y": 8}}, "wraps names 'y', which is no channel; there are: 'x'"),
        (b"t,x\n0,1\n1,2\n", {"units_row": 9}, "line 9: is no row of units below the header"),
        (b"t;x\n0;1,234.5\n1;2,000.25\n", {}, r"decimal='\.', thousands=','"),
        (b"time,x\n31.05.2026 12:00,1\n", {}, r"line 2: the time '31\.05\.2026 12:00' is neither .* units=\{'time'"),
        (b"time,x\n12:00:00,1\nnoon,2\n", {}, "line 3: the time 'noon'"),
        (b"time (furlong),x\n0,1\n1,2\n", {}, r"no unit of time; say its unit, units=\{'time': 'ms'\}"),
        (npy(np.array([{}, 1], dtype=object)), {}, "object values"),
        (npy(np.arange(9.0)).replace(b"(9,), }      ", b"(999999,), } "), {}, "numbers that fit it"),
    ],
)
def test_a_refusal_says_what_to_do(data: bytes, options: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.dat"
    path.write_bytes(data)
    with pytest.raises(ns.DataFileError, match=message):
        ns.load_recording(path, **options)


def test_arrays_of_hdf5_with_rates_of_their_own(tmp_path: Path) -> None:
    """x at .1 s, force every .2 s, and an array of another length that has no rate."""

    def fill(file: Any) -> None:
        run = file.create_group("trial")
        for name, values, said in (("force", [0, 1, 2], {"fs": 5.0}), ("x", range(6), {"dt": 0.1}), ("y", [7] * 4, {})):
            run[name] = np.array(values, float)
            run[name].attrs.update({"units": "m", **said})

    path = tmp_path / "a.h5"
    path.write_bytes(hdf5(fill))
    with pytest.warns(ns.recordings.RecordingWarning, match=r"'y': has no rate, and none of the others has its length"):
        recording = ns.load_recording(path)
    assert recording.channel("x")["time"].values == pytest.approx(0.1 * np.arange(6))
    assert recording.channel("force")["time"].values == pytest.approx([0, 0.2, 0.4])
    for one, step in (("x", 0.1), ("force", 0.2)):
        alone = ns.load_recording(path, columns={"q": f"trial.{one}"})
        assert np.diff(alone.channel("q")["time"].values) == pytest.approx(step)
    with pytest.raises(
        ns.errors.DataFileError, match=r"several rates, 'trial\.x' at 10 Hz, 'trial\.force' at 5 Hz; choose"
    ):
        ns.load_recording(path, columns={"x": "trial.x", "f": "trial.force"})


def test_an_array_that_is_chosen_by_its_place_or_by_column_has_the_files_unit(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"

    def fill(file: Any) -> None:
        for name, values in (("t", np.arange(50.0)), ("table", np.ones((50, 2)))):
            file[name] = values
            file[name].attrs["units"] = {"t": "ms", "table": "mm"}[name]

    path.write_bytes(hdf5(fill))
    recording = ns.load_recording(path, columns={"time": 0, "x": "table(:,2)", "y": ("table(:,1)", "m")})
    assert recording.units == {"x": "mm", "y": "m"}
    assert recording.channel("x")["time"].values[-1] == pytest.approx(0.049)


def test_pictures_beside_readings_are_left_out_and_told(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"

    def fill(file: Any) -> None:
        file["sensor/x"], file["camera/images"] = np.arange(50.0), np.zeros((50, 4, 3))

    path.write_bytes(hdf5(fill))
    with pytest.warns(ns.recordings.RecordingWarning, match=r"'images': has the shape \(50, 4, 3\), which .* left out"):
        recording = ns.load_recording(path, rate=100.0, units={"x": "m"})
    assert recording.runs == ("sensor",) and recording.channel("x").values == pytest.approx(np.arange(50.0))


def test_a_file_as_large_as_allowed_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(npz(time=T, x=X))
    size = path.stat().st_size
    for limit in (size, size - 1):
        monkeypatch.setattr("nonsmooth.recordings.load.MAX_FILE_BYTES", limit)
        if limit == size:
            assert ns.load_recording(path, units={"time": "s", "x": "m"}).channel("x").values == pytest.approx(X)
        else:
            with pytest.raises(ns.DataFileError, match=f"has {size} bytes; at most {limit} are read"):
                ns.load_recording(path)


@pytest.mark.parametrize(
    ("head", "axis"),
    [("Frequency (Hz),x (m)", "frequency"), ("x (m),ANGLE (rad)", "Angle"), ("TIME (s),x (m)", "time")],
)
def test_the_axis_is_found_whatever_its_letters(head: str, axis: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\n".join([head, *(f"{k},{k}.25" for k in range(1, 21))]))
    x = ns.load_recording(path, axis=axis).channel("x")
    assert x.dims == (axis,) and x.attrs["units"] == "m"
    assert np.abs(x.values - x[axis].values) == pytest.approx(0.25)
