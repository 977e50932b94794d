"""Studies are distributions of their own: found where they are installed, named where they are not."""

from __future__ import annotations

from pathlib import Path

import pytest

import nonsmooth as ns
from nonsmooth.cli.main import main
from nonsmooth.explorer.catalogue import Catalogue
from nonsmooth.studies import installed, study

INSTALL = "python -m pip install ./studies/savi2007"


def test_a_study_is_found_by_its_entry_point() -> None:
    assert "savi2007" in installed()
    assert study("savi2007").reproduce.__module__.startswith("nonsmooth_savi2007")
    assert ns.identify is study("savi2007", "identification").identify
    with pytest.raises(ValueError, match="`savi2008` is not a study of this installation; nearest: savi2007"):
        study("savi2008")


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """The general toolbox, without any study."""
    monkeypatch.setattr("nonsmooth.studies.entry_points", lambda group: ())
    vars(ns).pop("identify", None)


@pytest.mark.usefixtures("alone")
def test_without_the_study_its_verbs_say_how_to_install_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(AttributeError, match=INSTALL):
        ns.identify  # noqa: B018
    (tmp_path / "session.toml").touch()
    for words in (["reproduce", "savi2007"], ["identify", str(tmp_path)], ["rig", "--out", str(tmp_path / "rig")]):
        assert main(words) == 2
        assert INSTALL in capsys.readouterr().err


@pytest.mark.usefixtures("alone")
def test_without_the_study_the_explorer_shows_the_model_without_its_figures() -> None:
    assert Catalogue.of(None).state_of([]).model == "discontinuous_support"
