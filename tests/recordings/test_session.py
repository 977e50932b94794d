"""Session folders: what a notebook may say, and what it is told where it says something else."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from nonsmooth.errors import DataFileError
from nonsmooth.recordings import Recording, RecordingWarning, load_session
from nonsmooth_savi2007.rig import write_capstone_csv

HEAD = """
[session]
title = "a bench"
synthetic = true

[apparatus]
distance_per_turn = 0.0789
mass = { value = 0.838, uncertainty = 0.001 }
"""
ENTRY = """
[[recording]]
file = "response.csv"
procedure = "response"
runs = [ { run = "Run #1", crank_length = 0.0165, voltage = 4, direction = "up" } ]
"""


def bench(folder: Path, text: str = HEAD + ENTRY, runs: int = 1) -> Path:
    t = np.arange(200) / 100
    data = xr.Dataset({"Angle": ("time", np.sin(t), {"units": "rad"})}, {"time": ("time", t, {"units": "s"})})
    recording = Recording.from_runs({f"Run #{i + 1}": {"Angle": data} for i in range(runs)}, synthetic=True)
    write_capstone_csv(recording, folder / "response.csv")
    (folder / "session.toml").write_text(text, encoding="utf-8")
    return folder


def test_a_session_reads(tmp_path: Path) -> None:
    session = load_session(bench(tmp_path))
    assert session.title == "a bench" and session.synthetic
    assert session.procedures == ("response",) and session.files == ("response.csv",)
    assert session.apparatus["mass"].value == 0.838 and session.apparatus["mass"].uncertainty == 0.001
    assert float(session.apparatus["distance_per_turn"]) == 0.0789
    assert session.apparatus["distance_per_turn"].uncertainty == 0.0
    ((recording, run, settings),) = session.recordings("response")
    assert run == "Run #1" and settings == {"crank_length": 0.0165, "voltage": 4.0, "direction": "up"}
    assert isinstance(settings["voltage"], float)
    np.testing.assert_allclose(recording.channel("Angle", run), np.sin(np.arange(200) / 100), atol=1e-8)
    assert session.recordings("springs") == []
    assert session.recordings("response")[0].recording is recording  # read once
    assert "response: response.csv, 1 runs" in repr(session)
    with pytest.raises(ValueError, match="`rsponse` is not a procedure of a session; nearest: response"):
        session.recordings("rsponse")
    with pytest.raises(TypeError):
        session.apparatus["mass"] = 1.0


def test_a_bare_notebook_is_enough(tmp_path: Path) -> None:
    folder = bench(tmp_path, ENTRY)
    notebook = folder / "session.toml"
    notebook.write_text(notebook.read_text(), encoding="utf-8-sig")  # as Notepad does
    session = load_session(str(folder))
    assert session.title == folder.name and not session.synthetic and not session.apparatus


def test_a_computed_file_in_a_measured_session_is_an_error(tmp_path: Path) -> None:
    session = load_session(bench(tmp_path, HEAD.replace("true", "false") + ENTRY))
    with pytest.raises(ValueError, match=r"says that it is synthetic, the notebook does not: put `synthetic = true`"):
        session.recordings("response")


def test_options_of_the_reader_are_handed_on(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("our bench\nt;pos\n" + "".join(f"{i / 100};{i}\n" for i in range(100)))
    (tmp_path / "session.toml").write_text(
        '[[recording]]\nfile = "log.csv"\nprocedure = "impulse"\nruns = [ { run = "Run #1" } ]\n'
        'read = { header = 2, na = "-", columns = { time = "t", Angle = ["pos", "rad"] } }\n'
    )
    session = load_session(tmp_path)
    with pytest.warns(RecordingWarning, match="the time column has no unit"):
        ((recording, run, _),) = session.recordings("impulse")
    assert recording.channel("Angle", run).attrs["units"] == "rad"


def test_nothing_is_left_out_silently(tmp_path: Path) -> None:
    folder = bench(tmp_path, runs=3)
    for name in ("more.cap", "more.h5", "more.parquet"):
        (folder / name).write_bytes(b"PK")
    with pytest.warns(RecordingWarning, match=r"does not name more\.cap, more\.h5, more\.parquet; not used"):
        session = load_session(folder)
    with pytest.warns(RecordingWarning, match=r"response\.csv: the notebook does not name Run #2, Run #3; not used"):
        session.recordings("response")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        session.recordings("response")  # said once


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("x = [", DataFileError, "is not a TOML file"),
        ("[sezzion]\n", ValueError, "`sezzion` is not a table of this place; nearest: session"),
        (HEAD, ValueError, r"needs at least one \[\[recording\]\]"),
        (HEAD.replace("title", "titl") + ENTRY, ValueError, r"\[session\]: `titl` is not a key.*nearest: title"),
        (HEAD.replace("true", '"yes"') + ENTRY, TypeError, "synthetic true or false"),
        (HEAD.replace("mass", "mas") + ENTRY, ValueError, "`mas` is not a key of this place; nearest: mass"),
        (HEAD.replace("uncertainty", "error") + ENTRY, ValueError, r"mass: `error` is not a key"),
        (HEAD.replace("value = 0.838, ", "") + ENTRY, ValueError, "mass: needs `value`"),
        (HEAD.replace("0.838", '"0.838"') + ENTRY, TypeError, "mass: value must be a real number, not '0.838'"),
        (HEAD.replace("0.838", "-0.838") + ENTRY, ValueError, "must be positive, an uncertainty zero or more"),
        (HEAD.replace("0.838", "nan") + ENTRY, ValueError, "must be finite"),
        (HEAD + ENTRY.replace("voltage", "volts"), ValueError, "run 1: `volts` is not a setting.*nearest: voltage"),
        (HEAD + ENTRY.replace("crank_length = 0.0165, ", ""), ValueError, "'response' must state crank_length"),
        (HEAD + ENTRY.replace('"up"', '"sideways"'), ValueError, "direction = 'sideways'; allowed: 'up', 'down'"),
        (HEAD + ENTRY.replace("4,", '"4",'), TypeError, "voltage must be a real number, not '4'"),
        (HEAD + ENTRY.replace('run = "Run #1", ', ""), ValueError, "needs run = "),
        (HEAD + ENTRY.replace('= "response"\n', '= "rsponse"\n'), ValueError, "nearest: response"),
        (HEAD + ENTRY.replace("response.csv", "../response.csv"), ValueError, "must be the name of a file in the"),
        (HEAD + ENTRY.replace("response.csv", "none.csv"), DataFileError, r"none\.csv: no such file"),
        (HEAD + ENTRY.replace("procedure", "proc"), ValueError, "`proc` is not a key"),
        (HEAD + ENTRY.replace('procedure = "response"', ""), ValueError, "needs `procedure`"),
        (HEAD + ENTRY + "read = { rates = 100 }", ValueError, "`rates` is not an option of load_recording"),
        (HEAD + ENTRY + ENTRY, ValueError, r"response\.csv is named twice"),
        (HEAD + ENTRY.split("runs")[0] + "runs = 3", ValueError, "runs must be a list of tables"),
        (HEAD + ENTRY.split("runs")[0] + "runs = [3]", ValueError, "must be a table with keys, got 3"),
    ],
)
def test_what_a_notebook_may_not_say(tmp_path: Path, text: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        load_session(bench(tmp_path, text))


def test_a_run_twice_is_an_error(tmp_path: Path) -> None:
    one = '{ run = "Run #1", crank_length = 0.0165 }'
    text = HEAD + ENTRY.split("runs")[0] + f"runs = [ {one}, {one} ]"
    with pytest.raises(ValueError, match="run 'Run #1' is named twice"):
        load_session(bench(tmp_path, text))


def test_a_run_that_is_not_there_is_an_error(tmp_path: Path) -> None:
    session = load_session(bench(tmp_path, HEAD + ENTRY.replace("Run #1", "Run #9")))
    with pytest.raises(ValueError, match=r"response\.csv has no run 'Run #9'; it has: Run #1"):
        session.recordings("response")


def test_no_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"cannot be opened .*; a session has a session\.toml"):
        load_session(tmp_path / "nowhere")
