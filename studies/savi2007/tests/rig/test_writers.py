"""Files of our writers are read back: ``.cap`` bit for bit, CSV to the digits written."""

from __future__ import annotations

import csv
import errno
import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from nonsmooth.recordings import Recording, load_recording
from nonsmooth_savi2007.rig import write_cap, write_capstone_csv

pytestmark = pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")


def sensor(time: np.ndarray, **channels: tuple[str, np.ndarray]) -> xr.Dataset:
    data = {name: ("time", values, {"units": unit, "long_name": name}) for name, (unit, values) in channels.items()}
    return xr.Dataset(data, {"time": ("time", time, {"units": "s"})})


def rig(seed: int = 0) -> Recording:
    """Two runs; a rotary sensor at 100 Hz with a jittered clock in the second, a slow force sensor."""
    rng = np.random.default_rng(seed)
    even, slow = 0.01 * np.arange(400), 0.04 * np.arange(60)
    jittered = even[:200] + rng.uniform(0, 1e-4, 200)
    return Recording.from_runs(
        {
            "drive at 4.2 V, up": {
                "Angle": sensor(even, Angle=("rad", rng.normal(size=400)), Velocity=("rad/s", rng.normal(size=400))),
                "Force": sensor(slow, **{"Force, Ch P2": ("N", 50 * rng.normal(size=60))}),
            },
            "down": {"Angle": sensor(jittered, Angle=("rad", 1e-5 * rng.normal(size=200)))},
        },
        synthetic=True,
    )


def same_values(one: Recording, other: Recording, decimals: int | None = None) -> None:
    for ours, theirs in zip(one.runs, other.runs, strict=True):
        for name in one.channels:
            if ours == "down" and name != "Angle":
                continue
            a, b = one.channel(name, ours), other.channel(name, theirs)
            assert a.attrs["units"] == b.attrs["units"]
            for x, y in ((a.values, b.values), (a["time"].values, b["time"].values)):
                expected = x if decimals is None else np.array([float(f"{v:.{decimals}f}") for v in x])
                np.testing.assert_array_equal(expected, y)


def test_cap_comes_back_bit_for_bit(tmp_path: Path) -> None:
    recording = rig()
    file = write_cap(recording, tmp_path / "rig.cap", sensors=[{"Name": 'Rotary "Motion" & Sensor'}])
    back = load_recording(file)
    same_values(recording, back)
    assert back.runs == ("Run #1", "Run #2")  # the format numbers runs
    assert back.source["header"]["sensors"] == [{"Name": 'Rotary "Motion" & Sensor'}]
    with zipfile.ZipFile(file) as archive:
        xml = archive.read("main.xml").decode()
    assert xml.count("IntervalCacheInterval") == 3 and xml.count("<IndependentStorageElement FileName") == 1


@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("mark", [True, False])
def test_csv_comes_back_to_the_digits(tmp_path: Path, decimal: str, mark: bool) -> None:
    recording = rig()
    file = write_capstone_csv(recording, tmp_path / "rig.csv", decimal=decimal, byte_order_mark=mark)
    assert file.read_bytes().startswith(b"\xef\xbb\xbf") == mark
    back = load_recording(file)
    assert back.runs == recording.runs  # free text, with a comma in it
    same_values(recording, back, decimals=8)


def test_everything_written_is_labelled_synthetic(tmp_path: Path) -> None:
    recording = Recording(rig().tree, {}, (), synthetic=False)
    for file in (write_cap(recording, tmp_path / "a.cap"), write_capstone_csv(recording, tmp_path / "a.csv")):
        back = load_recording(file)
        assert back.synthetic and back.tree.attrs["synthetic"] == "yes" and "synthetic" in repr(back)
    header = next(csv.reader(io.StringIO((tmp_path / "a.csv").read_text("utf-8-sig"))))
    assert all(name.endswith("[synthetic]") for name in header)


def test_equal_recordings_give_equal_files(tmp_path: Path) -> None:
    one, two = write_cap(rig(), tmp_path / "1.cap"), write_cap(rig(), tmp_path / "2.cap")
    assert one.read_bytes() == two.read_bytes()


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(allow_infinity=False, allow_nan=False, width=64), min_size=1, max_size=30),
    st.floats(-1e6, 1e6),
    st.floats(1e-6, 1e3),
)
def test_any_doubles_through_cap(values: list[float], start: float, step: float) -> None:
    import tempfile

    time = start + step * np.arange(len(values))
    recording = Recording.from_runs({"r": {"x": sensor(time, x=("m", np.array(values)))}}, synthetic=True)
    with tempfile.TemporaryDirectory() as folder:
        back = load_recording(write_cap(recording, Path(folder) / "x.cap"))
    got = back.channel("x")
    assert got.values.tobytes() == np.array(values).tobytes()
    assert got["time"].values.tobytes() == time.tobytes()


def test_what_cannot_be_written(tmp_path: Path) -> None:
    fast = Recording.from_runs({"r": {"x": sensor(1e-10 * np.arange(5), x=("m", np.ones(5)))}}, synthetic=True)
    with pytest.raises(ValueError, match="8 decimals are too few for its times"):
        write_capstone_csv(fast, tmp_path / "x.csv")
    with pytest.raises(ValueError, match="decimal must be"):
        write_capstone_csv(rig(), tmp_path / "x.csv", decimal=";")
    table = xr.Dataset({"a": ("frequency", [1.0], {"units": "m"})}, {"frequency": [2.0]})
    response = Recording.from_runs({"r": {"a": table}}, synthetic=False)
    with pytest.raises(ValueError, match="only time can be written"):
        write_cap(response, tmp_path / "x.cap")
    assert not list(tmp_path.iterdir())


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = tmp_path / "rig.cap"
    old.write_bytes(b"old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", full)
        with pytest.raises(OSError, match="No space left"):
            write_cap(rig(), old)
    assert old.read_bytes() == b"old"
    write_cap(rig(), old)
    assert [one.name for one in tmp_path.iterdir()] == ["rig.cap"]
