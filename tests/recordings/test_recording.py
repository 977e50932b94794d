"""The recording itself: access, remarks on its sampling, and its way through a file."""

from __future__ import annotations

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.errors import DataFileError
from nonsmooth.recordings import RecordingWarning
from nonsmooth.recordings.load import parse_recording
from nonsmooth.recordings.recording import examine
from nonsmooth.results.provenance import read_provenance


def table(time: np.ndarray, unit: str = "m") -> bytes:
    rows = "".join(f"{t!r},{k % 7}\n" for k, t in enumerate(time.tolist()))
    return f"Time (s) Run #1,x ({unit}) Run #1\n{rows}".encode()


TWO = b"Time (s) a,x (m) a,y (m) a,Time (s) b/c,x (m) b/c\n0,1,2,0,3\n1,4,,1,5\n"


def test_access_and_its_errors() -> None:
    recording = parse_recording(TWO, "x.csv")
    assert recording.runs == ("a", "b_c") and recording.channels == ("x", "y")
    assert recording.tree["b_c"].attrs["long_name"] == "b/c"
    with pytest.raises(ValueError, match="has 2 runs, say which: a, b_c"):
        recording.channel("x")
    with pytest.raises(ValueError, match="no run 'z'; there are: a, b_c"):
        recording.channel("x", "z")
    with pytest.raises(ValueError, match="run 'b_c' has no channel 'y'; it has: x"):
        recording.channel("y", "b_c")
    assert "a: 2 samples at 1 Hz: x [m]" in repr(recording)


def test_one_name_twice_is_numbered_and_said() -> None:
    text = b"Time (s) Run #1,x (m) Run #1,x (m) Run #1,y (m) Run #1\n0,1,2,3\n1,4,5,6\n"
    recording = parse_recording(text, "x.csv")
    assert recording.channels == ("x", "x (2)", "y")
    assert any("stands there twice" in w and "'x (2)'" in w for w in recording.warnings)


def test_a_quantity_that_two_ports_measure() -> None:
    text = b'Time (s) r,"T, Ch P1 (K) r","T, Ch P2 (K) r"\n0,1,2\n1,2,3\n'
    recording = parse_recording(text, "x.csv")
    assert recording.channel("T, Ch P2").values.tolist() == [2, 3]
    with pytest.raises(ValueError, match=r"'T' fits 2 channels of run 'r': T, Ch P1, T, Ch P2"):
        recording.channel("T")


def test_through_a_file_with_nothing_lost(tmp_path: Path) -> None:
    recording = parse_recording(TWO, "x.csv")
    for suffix in (".nc", ".zarr"):
        ns.save(recording.to_dataset(), tmp_path / f"r{suffix}")
        back = ns.Recording.from_dataset(ns.load(tmp_path / f"r{suffix}"))
        assert back.runs == recording.runs and back.warnings == recording.warnings and back.units == recording.units
        assert back.source == recording.source
        for path in recording.rates:
            xr.testing.assert_identical(recording.tree[path].to_dataset(), back.tree[path].to_dataset())
    with pytest.raises(ValueError, match=r"not made by Recording\.to_dataset"):
        ns.Recording.from_dataset(xr.Dataset())


def test_provenance_and_warnings(tmp_path: Path) -> None:
    import hashlib

    file = tmp_path / "pull.csv"
    file.write_bytes(TWO)
    with pytest.warns(RecordingWarning, match=r"pull\.csv: run 'a', channel 'y': 1 blank fields"):
        recording = ns.load_recording(file, units={"x": "mm"})
    record = read_provenance(recording.to_dataset())
    assert record["verb"] == "load_recording" and record["source"]["file"] == "pull.csv"
    assert record["source"]["sha256"] == hashlib.sha256(TWO).hexdigest()
    assert record["source"]["options"] == {"units": {"x": "mm"}} and recording.units["x"] == "mm"


def test_files_that_cannot_be_opened(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"absent\.csv: cannot be opened"):
        ns.load_recording(tmp_path / "absent.csv")
    (tmp_path / "empty.csv").touch()
    with pytest.raises(DataFileError, match="is empty"):
        ns.load_recording(tmp_path / "empty.csv")
    (tmp_path / "huge.csv").open("wb").truncate((1 << 30) + 1)
    with pytest.raises(DataFileError, match=r"has 1073741825 bytes; at most 1073741824 are read"):
        ns.load_recording(tmp_path / "huge.csv")
    (tmp_path / "old.mat").write_bytes(b"\0" * 100)
    with pytest.raises(DataFileError, match="save it again with -v7"):
        ns.load_recording(tmp_path / "old.mat")


def test_a_long_even_record_has_nothing_to_say() -> None:
    recording = parse_recording(table(np.arange(500) / 100), "x.csv")
    assert recording.warnings == () and recording.tree["Run #1/x"].attrs["sampling"] == "regular"


def test_too_short_names_run_and_channel() -> None:
    (said,) = parse_recording(table(np.arange(5) / 100), "x.csv").warnings
    assert said == "run 'Run #1', channel 'x': only 5 samples; too short to identify anything from"


def test_change_of_rate_is_found_and_placed() -> None:
    time = np.concatenate([np.arange(200) / 100, 2 + np.arange(200) / 50])
    recording = parse_recording(table(time), "x.csv")
    (said,) = recording.warnings
    assert "run 'Run #1', channel 'x': the sample rate changes from 100 Hz to 50 Hz near t = 2 s (line 202)" in said
    assert recording.tree["Run #1/x"].attrs["sampling"] == "irregular"


@pytest.mark.parametrize("digits", [2, 3, 8])
def test_rounded_and_jittered_times_are_no_change_of_rate(digits: int) -> None:
    rng = np.random.default_rng(3)
    time = np.round(np.arange(3000) / 60 + rng.uniform(-2e-4, 2e-4, 3000), digits)
    clock = examine(np.sort(time))
    assert clock.change is None and clock.gaps == ()
    assert clock.rate == pytest.approx(60, rel=1e-3)


def test_gaps_do_not_bend_the_rate() -> None:
    kept = np.r_[0:100, 105:300, 330:500]
    clock = examine(kept / 100)
    assert clock.gaps == ((99, 5), (294, 30)) and clock.change is None and not clock.regular
    assert clock.rate == pytest.approx(100, rel=1e-12)


def test_times_with_too_few_digits() -> None:
    recording = parse_recording(table(np.floor(np.arange(300) / 10) / 100), "x.csv")
    assert any("270 of 299 time steps are zero" in w for w in recording.warnings)
    assert recording.rates["Run #1/x"] == pytest.approx(299 / 0.29)


def test_datasets_that_are_no_sensor() -> None:
    with pytest.raises(ValueError, match="must have one dim with its coordinate"):
        ns.Recording.from_runs({"r": {"s": xr.Dataset({"x": ("time", [1.0])})}}, synthetic=False)
    with pytest.raises(ValueError, match="cannot be the name of a run"):
        ns.Recording.from_runs({"a/b": {}}, synthetic=False)


def test_a_missing_library_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(DataFileError, match=r"needs the package npTDMS.*pip install \"\.\[experiment\]\""):
        parse_recording(b"TDSm" + b"\0" * 24, "x.tdms")


def test_reading_text_loads_neither_scipy_nor_the_optional_libraries() -> None:
    code = (
        "import sys; sys.modules['dask'] = None;"  # xarray loads it where it is installed, and it SciPy
        "import nonsmooth.recordings.load as L;"
        "L.parse_recording(b'Time (s) r,x (m) r\\n0,1\\n1,2\\n', 'x.csv');"
        "print([m for m in ('scipy', 'h5py', 'nptdms', 'sympy', 'numba', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_only_so_many_warnings_are_shown(tmp_path: Path) -> None:
    header = ",".join(f"Time (s) r{k},x_{chr(97 + k % 26)}{chr(97 + k // 26)} (m) r{k}" for k in range(30))
    (tmp_path / "x.csv").write_text(header + "\n" + "0,1," * 29 + "0,1\n")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        recording = ns.load_recording(tmp_path / "x.csv")
    assert len(caught) == 21 and "10 more; see Recording.warnings" in str(caught[-1].message)
    assert len(recording.warnings) == 30


def test_what_holds_for_many_runs_is_said_once() -> None:
    from nonsmooth.recordings.reading import Remarks

    remarks = Remarks()
    for i in range(30):
        remarks.of(f"Run #{i}", "Turn", f"{100 + i} blank fields dropped")
    remarks.of("Run #2", "Angle", "5 blank fields dropped")
    assert remarks.sentences() == (
        "run 'Run #0', channel 'Turn': 100 blank fields dropped (and likewise 29 more runs, to 'Run #29')",
        "run 'Run #2', channel 'Angle': 5 blank fields dropped",
    )
