"""A page that opens on a study file or a result shows its system, its range and its initial state."""

from __future__ import annotations

import sys
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli.main import main
from nonsmooth.cli.study import read_study
from nonsmooth.explorer.catalogue import Catalogue
from nonsmooth.explorer.export import opened_result, opened_study

STUDY = """
[system]
model = "discontinuous_support"
parameters = { k = 9.0 }

[sweep]
parameter = "g"
values = { from = -0.001, to = 0.002, n = 5 }
direction = "down"
transient = 50
keep = 20
start = { v = 0.01 }

[output]
y = "x"
"""


def view(query: str) -> dict[str, str]:
    return dict(parse_qsl(query))


def test_a_study_opens_on_its_model_range_and_start(tmp_path: Path) -> None:
    file = tmp_path / "study.toml"
    file.write_text(STUDY)
    study = read_study(file)
    system, query = opened_study(study.system, study.options, study.output)
    found = view(query)
    assert system is None
    assert {key: found[key] for key in ("model", "over", "direction", "transient", "keep", "start", "shown")} == {
        "model": "discontinuous_support",
        "over": "g",
        "direction": "down",
        "transient": "50",
        "keep": "20",
        "start": "0.0 0.01",
        "shown": "x",
    }
    assert [float(found[key]) for key in ("p.k", "low", "high")] == [9.0, -0.001, 0.002]
    Catalogue.of(system).state_of(parse_qsl(query))


def test_a_result_opens_on_the_system_in_its_record(tmp_path: Path) -> None:
    oscillator = ns.models.discontinuous_support(k=7.5)
    swept = ns.sweep(oscillator, "rho", np.linspace(0.3, 0.4, 3), transient=10, keep=8, progress=False)
    ns.save(swept, tmp_path / "swept.nc")
    system, query = opened_result(ns.load(tmp_path / "swept.nc"))
    found = view(query)
    assert (system, found["model"], found["over"]) == (None, "discontinuous_support", "rho")
    assert [float(found[key]) for key in ("p.k", "low", "high")] == [7.5, 0.3, 0.4]
    own = ns.System.from_text(oscillator.to_text().replace("support", "stop"))
    system, query = opened_result(ns.simulate(own, periods=3, start={"x": -0.01}))
    found = view(query)
    assert system == own
    assert (found["model"], found["start"]) == ("given", "-0.01 0.0")
    Catalogue.of(system).state_of(parse_qsl(query))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.toml", "[system]\nmodel = 'discontinuous_support'\n", "verb"),
        ("a.nc", "no result", "a.nc"),
        ("gone.nc", None, "no such file"),
        ("rig.csv", "t,x\n0,1\n", "drop it into the page"),
    ],
)
def test_what_cannot_be_opened_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: str | None, said: str
) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    assert main(["explore", str(tmp_path / name), "--no-browser"]) != 0
    assert said in capsys.readouterr().err


def test_without_bokeh_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [one for one in sys.modules if one.startswith(("bokeh.", "nonsmooth.explorer."))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "bokeh", None)
    assert main(["explore", "impact_oscillator", "--no-browser"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("nonsmooth: the explorer needs the package bokeh, which is not installed:")
