"""Files that the rig writes: a session that reads back, the truth beside it, everything labelled synthetic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nonsmooth.cli.main import main
from nonsmooth.errors import DataFileError
from nonsmooth.recordings import Recording, load_recording, load_session
from nonsmooth_savi2007.rig import IDENTIFICATION, VirtualRig, load_truth

pytestmark = pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")


#: Shorter than what identification would want.
OPTIONS: dict[str, dict[str, Any]] = {
    "springs": {"n": 2},
    "support": {"n": 2},
    "drop": {"n": 2},
    "impulse": {"velocities": (0.5, -0.3), "duration": 3.0},
    "response": {"voltages": (4.0, 7.0), "duration": 3.0},
    "contact": {"regimes": ((9.55, 0.027),), "duration": 3.0},
}


@pytest.fixture(scope="module")
def rig() -> VirtualRig:
    return VirtualRig(3)


@pytest.fixture(scope="module")
def written(rig: VirtualRig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return rig.write_session(tmp_path_factory.mktemp("lab") / "rig_03", options=OPTIONS)


def test_the_session_reads_back(rig: VirtualRig, written: Path) -> None:
    session = load_session(written)
    assert session.procedures == IDENTIFICATION
    assert session.synthetic and session.title == "virtual rig, seed 3"
    for procedure in session.procedures:
        made = rig.record(procedure, **OPTIONS.get(procedure, {}))
        runs = session.recordings(procedure)
        assert [run for _, run, _ in runs] == list(made.runs)
        for recording, run, settings in runs:
            assert recording.synthetic
            stated = {key: value for key, value in made.tree[run].attrs.items() if key != "procedure"}
            assert dict(settings) == stated
            for sensor in made.tree[run].children.values():
                for name, array in sensor.to_dataset().data_vars.items():
                    read = recording.channel(str(name), run)
                    assert read.attrs["units"] == array.attrs["units"]
                    exact = procedure == "impulse"  # in the instrument's own format
                    np.testing.assert_allclose(read, array, rtol=0, atol=0 if exact else 5.1e-9)
                    np.testing.assert_allclose(read["time"], array["time"], rtol=0, atol=0 if exact else 5.1e-9)


def test_the_notebook_knows_what_an_experimenter_knows(rig: VirtualRig, written: Path) -> None:
    known = load_session(written).apparatus
    assert known["distance_per_turn"].value == 0.0789 and known["counts_per_turn"].value == 1440
    assert known["force_gain_limit"].value == 0.01
    for name, truth in (("mass", "m"), ("test_mass", "test_mass"), ("string_length", "string_length")):
        assert known[name].uncertainty > 0
        assert abs(known[name].value - rig.truth[truth]) < 5 * known[name].uncertainty


def test_the_truth_lies_beside_and_not_within(rig: VirtualRig, written: Path) -> None:
    assert load_truth(written.parent / "rig_03.truth.toml") == dict(rig.truth)
    text = (written / "session.toml").read_text()
    for name, value in rig.truth.items():
        common = value in (0.0, 1.0, -1.0)  # what is off, or has a sign only
        assert repr(value) not in text or common or name in ("creep_velocity", "clock_jitter", "force_noise")
    assert not [file for file in written.iterdir() if "truth" in file.name]
    with pytest.raises(ValueError, match="must not lie in the session's folder"):
        rig.write_session(written, ["drop"], truth=written / "truth.toml")


def test_equal_seeds_write_equal_files(rig: VirtualRig, written: Path, tmp_path: Path) -> None:
    names = ["impulse", "crank", "voltage"]
    again = VirtualRig(3).write_session(tmp_path / "again", names, options={"impulse": OPTIONS["impulse"]})
    for name in ("impulse.cap", "crank.csv", "voltage.csv"):
        assert (again / name).read_bytes() == (written / name).read_bytes()
    assert load_session(again).procedures == tuple(names)


def test_every_file_says_that_it_is_synthetic(written: Path) -> None:
    for file in written.iterdir():
        if file.suffix in (".csv", ".cap"):
            assert load_recording(file).synthetic, file
    assert b"synthetic" in (written / "springs.csv").read_bytes()[:400]


def test_truth_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match="cannot be opened"):
        load_truth(tmp_path / "none.toml")
    (tmp_path / "other.toml").write_text("[session]\ntitle = 'x'\n")
    with pytest.raises(DataFileError, match="is not the truth of a virtual rig"):
        load_truth(tmp_path / "other.toml")


def test_a_perfect_rig_without_a_string_has_no_string_in_its_notebook(tmp_path: Path) -> None:
    rig = VirtualRig(1, string=False, noise=False)
    session = load_session(rig.write_session(tmp_path / "rig", ["voltage"]))
    assert "string_length" not in session.apparatus
    assert session.apparatus["mass"].value == pytest.approx(rig.truth["m"], abs=5.1e-5)


def test_the_command_writes_a_session(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(["rig", "--seed", "5", "--out", str(tmp_path / "lab"), "--procedures", "voltage", "crank"])
    out = capsys.readouterr().out
    assert code == 0 and "crank.csv" in out and "lab.truth.toml" in out
    assert load_session(tmp_path / "lab").procedures == ("voltage", "crank")
    assert load_truth(tmp_path / "lab.truth.toml") == dict(VirtualRig(5).truth)


def test_the_command_writes_a_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = tmp_path / "elsewhere" / "truth.toml"
    arguments = ["rig", "--figure", "8", "--out", str(tmp_path / "fig8"), "--truth", str(truth), "--quiet"]
    assert main(arguments) == 0
    assert capsys.readouterr().out == ""
    session = load_session(tmp_path / "fig8")
    assert session.title == "virtual rig, seed 0, Fig. 8" and session.procedures == ("voltage", "crank")
    assert load_truth(truth)["k"] == 8.47  # Table 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--figure", "2"], "figure 2: measurements stand behind"),
        (["--procedures", "crnk"], "nearest: crank"),
        (["--figure", "4", "--procedures", "crank"], "give --figure or --procedures, not both"),
        (["--seed", "-3"], "seed = -3 must be a whole number"),
    ],
)
def test_the_command_refuses(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["rig", "--out", str(tmp_path / "lab"), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "lab").exists()


def test_a_recording_of_the_rig_says_what_it_is(rig: VirtualRig) -> None:
    recording = rig.voltage(voltages=(5.0,))
    assert isinstance(recording, Recording) and recording.synthetic
    assert recording.source["seed"] == 3 and "ripple" in recording.source["features"]
