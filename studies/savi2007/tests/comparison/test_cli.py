"""``nonsmooth compare``: study files, session folders, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli.main import main
from nonsmooth_savi2007.rig import VirtualRig
from nonsmooth_savi2007.rig.driven import SteadyRun, records
from nonsmooth_savi2007.rig.figures import TAPS, without_support
from nonsmooth_savi2007.rig.motor import mean_position, voltage_for
from nonsmooth_savi2007.rig.notebook import write_session

pytestmark = pytest.mark.filterwarnings("ignore::nonsmooth.recordings.RecordingWarning")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session at Fig. 14's first gap, from two places, and a run without the support."""
    rig = VirtualRig.published()
    length = 0.03896
    gap = -0.0012 + mean_position(rig, length)
    settings = [SteadyRun(voltage_for(rig, 11.15), length, gap, 15.0, {}, place) for place in (None, -0.02)]
    made = {
        "section": records(rig, "section", settings, settle=30.0),
        "response": records(rig, "response", without_support(rig, 14)),
        "impulse": rig.impulse(velocities=TAPS),
    }
    top = tmp_path_factory.mktemp("lab")
    write_session(rig, top / "session", made, title="a test")
    return top


def study(folder: Path, name: str, text: str) -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return str(folder / name)


MOTION = """
[system]
model = "discontinuous_support"
[measured]
session = "session"
procedure = "section"
run = "Run #1"
[compare]
draws = 3
[output]
data = "out/motion.nc"
figure = "out/motion.png"
picture = "phase_portrait"
"""


def test_a_study_file_is_compared_and_kept(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", study(folder, "motion.toml", MOTION)]) == 0
    said = capsys.readouterr().out
    assert "comparison of a motion" in said and "(synthetic)" in said
    kept = ns.load(folder / "out" / "motion.nc")
    assert int(kept["measured_period_number"]) == 1 == int(kept["theory_period_number"])
    # The zero of the sensor is known within a count: with it the gap, and the draws differ by it.
    assert np.ptp(kept["drawn_g"].values) > 1e-6
    assert f"{float(kept['orbit_distance']):.5g}" in said
    assert (folder / "out" / "motion.png").stat().st_size > 5000


def test_a_session_folder_is_compared_run_by_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Both runs with the support; the run without it is only the reference."""
    assert main(["compare", str(folder / "session")]) == 0
    said = capsys.readouterr().out
    assert said.count("comparison of") == 2 and "section.csv, Run #2" in said
    assert "comparison of a response" not in said
    assert not list(folder.glob("session/*.nc"))


def test_quiet_is_quiet(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            [
                "compare",
                study(folder, "quiet.toml", MOTION.replace("motion.", "quiet.").replace("draws = 3", "draws = 0")),
                "--quiet",
            ]
        )
        == 0
    )
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[measured]", "[measuerd]", "`measuerd` is not a table.*nearest: measured"),
        ("procedure =", "procedur =", "`procedur` is not a key.*nearest: procedure"),
        ('run = "Run #1"', 'run = "Run #7"', "`Run #7` is not a run"),
        ('picture = "phase_portrait"', 'picture = "response"', "`response` is not a picture of a comparison"),
        ("draws = 3", "drows = 3", "`drows` is not a key.*nearest: draws"),
        ('session = "session"', 'session = "nowhere"', "nowhere"),
    ],
)
def test_what_a_study_gets_wrong_is_named(
    old: str,
    new: str,
    message: str,
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    import re

    monkeypatch.chdir(tmp_path)  # a result whose picture fails is kept in the current folder
    text = MOTION.replace('data = "out/motion.nc"\n', "").replace("out/motion.png", "out/never.png")
    assert main(["compare", study(folder, "wrong.toml", text.replace(old, new))]) == 2
    assert re.search(message, capsys.readouterr().err)


def test_options_of_a_folder_do_not_go_with_a_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = study(folder, "motion.toml", MOTION)
    assert main(["compare", file, "--identified", "rig.nc"]) == 2
    assert "a study file has [identified]" in capsys.readouterr().err
    assert main(["compare", str(folder / "none.toml")]) == 2
    assert "no such study file" in capsys.readouterr().err
