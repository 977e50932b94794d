"""The commands as a user calls them: what they print, how they end."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import xarray as xr

from nonsmooth import models
from nonsmooth.cli import main as cli
from nonsmooth.results.store import save


def run(*arguments: str | Path) -> int:
    return cli.main([str(item) for item in arguments])


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run("--version")
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith("nonsmooth 0.")


@pytest.mark.parametrize("command", ["run", "reproduce", "models", "show"])
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        run(command, "--help")
    assert ended.value.code == 0
    assert "usage: nonsmooth" in capsys.readouterr().out


def test_the_models_are_listed_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("models") == 0
    listed = capsys.readouterr().out
    for name in models.names():
        assert name in listed
    assert run("models", "discontinuous_support") == 0
    assert "k_s" in capsys.readouterr().out
    assert run("models", "discontinous_support") == 2
    assert "nearest: discontinuous_support" in capsys.readouterr().err


def test_show_tells_what_a_file_holds(swept: xr.Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = save(swept, tmp_path / "swept.nc")
    assert run("show", path) == 0
    out = capsys.readouterr().out
    assert "sweep of 'oscillator'" in out
    assert "method exact" in out
    assert "rho 5" in out
    assert "ok 8, diverged 2" in out
    assert "the system as text" not in out
    assert run("show", path, "--text") == 0
    assert "the system as text" in capsys.readouterr().out


def test_show_tells_what_a_recording_holds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tap.csv"
    path.write_text("Time (s) Run #1,Position (m) Run #1\n0,0.25\n0.01,0.5\n0.02,0.75\n")
    assert run("show", path) == 0
    shown = capsys.readouterr().out
    assert "tap.csv" in shown and "3 samples at 100 Hz" in shown and "Position [m]" in shown


def test_a_damaged_file_is_one_message_and_exit_code_2(
    swept: xr.Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = save(swept, tmp_path / "swept.nc")
    path.write_bytes(path.read_bytes()[:2000])
    assert run("show", path) == 2
    out, err = capsys.readouterr()
    assert not out
    assert err.startswith("nonsmooth: ")
    assert "swept.nc" in err
    assert "Traceback" not in err


def test_an_unknown_study_is_answered_with_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("reproduce", "savi2008") == 2
    assert "savi2007" in capsys.readouterr().err


def test_a_figure_that_a_study_has_not_is_answered_with_those_it_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("19", "fig19"):
        assert run("reproduce", "savi2007", "--figure", name, "--out", tmp_path / "out") == 2
        said = capsys.readouterr().err
        assert f"figure {name}: " in said and "2, 4, 5" in said and "fig11_rig, " in said and "basins13" in said
    assert not (tmp_path / "out").exists()


def test_a_study_says_what_it_does_before_anything_is_loaded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def load(name: str) -> None:
        told.append(capsys.readouterr().err)
        raise ValueError("loaded")

    told: list[str] = []
    monkeypatch.setattr("nonsmooth.studies.import_module", load)
    for screen, *words in (True,), (True, "--quiet"), (False,):
        monkeypatch.setattr(sys.stderr, "isatty", lambda screen=screen: screen)
        assert run("reproduce", "savi2007", "--quick", *words) == 2
        assert "loaded" in capsys.readouterr().err
    assert told == [f"reproducing savi2007 into {Path('out') / 'savi2007_quick'}\n", "", ""]


def test_ctrl_c_ends_with_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(models, "names", interrupt)
    assert run("models") == 130
    assert capsys.readouterr().err == "nonsmooth: interrupted\n"


def test_show_says_what_a_chart_varies() -> None:
    from nonsmooth.cli.show import summary
    from nonsmooth.diagrams.chart import chart

    system = models.discontinuous_support(g=0.02)
    found = chart(system, {"omega": [3.0, 4.0], "rho": [0.1, 0.2]}, transient=20, keep=20, progress=False)
    text = summary(found)
    assert "omega = varied" in text and "rho = varied" in text and "g = 0.02" in text
