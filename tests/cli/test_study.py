"""Study files: read strictly, computed as the same call in Python, written where they say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.cli import main as cli
from nonsmooth.cli.study import Study, read_study
from nonsmooth.errors import DataFileError
from nonsmooth.results.provenance import read_provenance

SYSTEM = """
[system]
model = "discontinuous_support"
parameters = { omega = 3.69, g = -0.0045 }
"""
SWEEP = """
[sweep]
parameter = "rho"
values = { from = 0.42, to = 0.46, n = 5 }
transient = 60
keep = 8
max_period = 4
"""


@pytest.fixture
def write(tmp_path: Path):
    def _write(text: str) -> Path:
        path = tmp_path / "study.toml"
        path.write_text(text)
        return path

    return _write


def test_a_file_computes_what_the_call_computes(write, tmp_path: Path, capsys) -> None:
    path = write(SYSTEM + SWEEP + '[output]\ndata = "out/a.nc"\nfigure = "out/a.pdf"\ny = "v"\n')
    assert cli.main(["run", str(path)]) == 0
    assert "sweep of" in capsys.readouterr().out
    system = ns.models.discontinuous_support().with_parameters(omega=3.69, g=-0.0045)
    expected = ns.sweep(system, "rho", np.linspace(0.42, 0.46, 5), transient=60, keep=8, max_period=4, progress=False)
    found = ns.load(tmp_path / "out" / "a.nc")
    xr.testing.assert_equal(found, expected)
    assert ns.System.from_text(read_provenance(found)["system"]["text"]) == system
    assert (tmp_path / "out" / "a.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("verb", "figure_of"),
    [
        ("[simulate]\nperiods = 3\n", "u"),
        ("[poincare]\nn = 5\ntransient = 10\nsection = { phase = 0.25 }\n", "section"),
        ("[frequency_response]\nvalues = [3.0, 3.1, 3.2]\ntransient = 20\nkeep = 4\n", "amplitude"),
    ],
)
def test_every_verb_is_a_table(verb: str, figure_of: str, write, tmp_path: Path) -> None:
    path = write(SYSTEM + verb + '[output]\ndata = "r.zarr"\nfigure = "r.svg"\n')
    assert cli.main(["run", str(path), "--quiet"]) == 0
    assert figure_of in ns.load(tmp_path / "r.zarr")
    assert (tmp_path / "r.svg").exists()


def test_a_model_may_come_from_a_file_and_be_smoothed(write, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "from nonsmooth import models\n"
        "oscillator = models.discontinuous_support(g=0.5)\n"
        "def build():\n    return models.impact_oscillator()\n"
        "number = 3\n"
    )
    study = read_study(write('[system]\nmodel = "mine.py:oscillator"\nsmoothed = 1e-5\n' + SWEEP))
    assert study.system.eta == 1e-5
    assert study.system.values["g"] == 0.5
    built = read_study(write('[system]\nmodel = "mine.py:build"\n[simulate]\nperiods = 1\n'))
    assert built.system == ns.models.impact_oscillator()
    for name, message in (("number", "is of type int"), ("oscillators", "nearest: oscillator")):
        with pytest.raises(ValueError, match=message):
            read_study(write(f'[system]\nmodel = "mine.py:{name}"\n[simulate]\nperiods = 1\n'))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SYSTEM + SWEEP + "keeps = 5\n", r"study\.toml, table \[sweep\]: `keeps` is not a key .*nearest: keep; all: "),
        (SYSTEM + SWEEP + "[outputs]\n", r"study\.toml: `outputs` is not a table .*nearest: output"),
        (SYSTEM.replace("model", "models") + SWEEP, r"table \[system\]: `models` is not a key .*nearest: model"),
        (SYSTEM.replace("omega", "omegaa") + SWEEP, r"`omegaa` is not a parameter of 'discontinuous .*nearest: omega"),
        (SYSTEM + SWEEP + '[output]\ncsv = "a"\n', r"table \[output\]: `csv` is not a key .*data, figure, store, x, y"),
        (SYSTEM, "exactly one verb, this one has none"),
        (SYSTEM + SWEEP + "[simulate]\nperiods = 3\n", r"exactly one verb, this one has \['sweep', 'simulate'\]"),
        (SWEEP, r"needs a table \[system\]"),
        (SYSTEM + '[sweep]\nparameter = "rho"\n', r"table \[sweep\]: needs values"),
        (SYSTEM + '[sweep]\nparameter = "rho"\nvalues = { from = 0.1, to = 1 }\n', "values is .* give a list or"),
        (SYSTEM + '[sweep]\nparameter = "rho"\nvalues = { from = 0.1, till = 1 }\n', r"values: `till` is not a key"),
        (SYSTEM + "[poincare]\nsection = 0.5\n", "section is 0.5; give"),
        ("sweep = 3\n" + SYSTEM, r"`sweep` must be a table: write \[sweep\]"),
        ("[system\n", "is not a TOML file: .*line 1"),
    ],
)
def test_what_is_wrong_is_named(text: str, message: str, write, capsys) -> None:
    path = write(text)
    with pytest.raises(ValueError, match=message):
        read_study(path)
    assert cli.main(["run", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.toml: no such study file"):
        read_study(tmp_path / "none.toml")


CHART = """[system]
model = "discontinuous_support"
[chart]
grid = { omega = [9.0, 9.5], rho = [0.2, 0.3] }
transient = 20
keep = 20
[output]
"""


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ('store = "a.zarr"\ndata = "a.zarr"', "replace the chunks"),
        ('store = "a"', "must end in .zarr"),
        ("store = 3", "a name in quotes"),
        ('data = "a.csv"', "must end in .nc, .zarr"),
        ('data = "A.NC"', "must end in .nc, .zarr"),
        ('figure = "a.doc"', "must end in .pdf"),
        ('data = "taken/a.nc"', "nothing may be written"),
    ],
)
def test_what_would_fail_after_the_run_is_told_before(output: str, message: str, write, tmp_path: Path, capsys) -> None:
    (tmp_path / "taken").write_text("a file")
    assert cli.main(["run", str(write(CHART + output))]) == 2
    assert message in capsys.readouterr().err


SIMULATE = "[simulate]\nperiods = 2\n"
BASINS = "[basins]\ngrid = { x = [0.0, 0.1], v = [0.0, 0.1] }\n"
ONE_STATE = """
import nonsmooth as ns
decay = ns.System(states=["x"], parameters={"k": 1.0}, modes={"motion": lambda t, u, p: (-p.k * u.x,)})
"""


@pytest.mark.parametrize(
    ("verb", "output", "message"),
    [
        (SIMULATE, 'x = "nope"', r"x = 'nope' is not in the result; there are: x, v, .*mode"),
        (SIMULATE, 'y = "w"', "y = 'w' is not in the result"),
        (SWEEP, 'y = "nope"', "y = 'nope' is not in the result; there are: x, v$"),
        (SWEEP, 'x = "x"', "x = 'x': this figure has no such choice; take the line out"),
        (BASINS, 'y = "x"', "y = 'x': this figure has no such choice"),
        ("[chart]\ngrid = { omega = [9.0, 9.5], rho = [0.2, 0.3] }\n", 'y = "u"', "y = 'u' is not in the result"),
    ],
)
def test_axes_that_the_figure_cannot_have_are_told_before_the_run(
    verb: str, output: str, message: str, write, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setattr(Study, "compute", lambda *_, **__: pytest.fail("computed"))
    assert cli.main(["run", str(write(SYSTEM + verb + '[output]\nfigure = "r.svg"\n' + output + "\n"))]) == 2
    assert re.search(message, capsys.readouterr().err.strip())


def test_a_figure_of_two_states_needs_two(write, tmp_path: Path, capsys) -> None:
    (tmp_path / "mine.py").write_text(ONE_STATE)
    study = '[system]\nmodel = "mine.py:decay"\n[simulate]\nduration = 1.0\n[output]\nfigure = "r.svg"\n'
    assert cli.main(["run", str(write(study))]) == 2
    assert "the figure is of two states, and the system has one (x)" in capsys.readouterr().err


def test_a_file_of_another_editor_is_read(write, tmp_path: Path) -> None:
    """Notepad writes a mark in front of the first letter."""
    path = write(SYSTEM + SIMULATE)
    path.write_text(path.read_text(), encoding="utf-8-sig")
    assert read_study(path).options == {"periods": 2}


def test_a_name_that_the_disk_refuses_costs_no_result(write, tmp_path: Path, monkeypatch, capsys) -> None:
    """A long one leaves no room for that of the unfinished file."""
    monkeypatch.chdir(tmp_path)
    study = str(write(SYSTEM + SIMULATE + f'[output]\ndata = "{"n" * 250}.nc"\n'))
    assert cli.main(["run", study, "--quiet"]) == 2
    (kept,) = tmp_path.glob("*.nc")
    assert f"the result is kept in {kept}" in capsys.readouterr().err and ns.load(kept)["u"].size


def test_a_figure_that_fails_costs_no_result(write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    """Whatever the reason; the result is kept beside, or said where it is."""

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("no font")

    monkeypatch.setattr(ns.plot, "save_figure", fail)
    monkeypatch.chdir(tmp_path)
    study = str(write(SYSTEM + SIMULATE + '[output]\nfigure = "r.svg"\n'))
    assert cli.main(["run", study, "--quiet"]) == 2
    (kept,) = tmp_path.glob("*.nc")
    said = capsys.readouterr().err
    assert "no font" in said and f"the result is kept in {kept}" in said
    assert ns.load(kept)["u"].size
    study = str(write(SYSTEM + SIMULATE + '[output]\nfigure = "r.svg"\ndata = "a.zarr"\n'))
    assert cli.main(["run", study, "--quiet"]) == 2
    assert f"the result is in {tmp_path / 'a.zarr'}" in capsys.readouterr().err


def test_what_stands_where_the_result_goes_is_told_before_the_run(write, tmp_path: Path, capsys) -> None:
    for name in ("a.nc", "a.zarr", "a.svg"):
        (tmp_path / name).mkdir()
    for line in ('data = "a.nc"', 'data = "a.zarr"', 'figure = "a.svg"'):
        assert cli.main(["run", str(write(SYSTEM + SIMULATE + "[output]\n" + line + "\n"))]) == 2
        assert "give another name" in capsys.readouterr().err


def test_a_result_never_replaces_chunks(write, tmp_path: Path, capsys) -> None:
    """Neither by a study, nor by save; nor does it replace a Zarr store of somebody else."""
    study = str(write(CHART + 'data = "a.nc"'))
    store = tmp_path / "a.zarr"
    assert cli.main(["run", study, "--quiet", "--store", str(store)]) == 0
    there = sorted(file.name for file in store.rglob("*"))
    result = ns.load(tmp_path / "a.nc")
    with pytest.raises(DataFileError, match="left alone"):
        ns.save(result, store)
    data = str(write(CHART + 'data = "a.zarr"'))
    assert cli.main(["run", data, "--quiet", "--store", str(store)]) == 2
    assert "another name" in capsys.readouterr().err
    assert sorted(file.name for file in store.rglob("*")) == there
    ns.save(result, tmp_path / "b.zarr")
    assert ns.save(result, tmp_path / "b.zarr") == tmp_path / "b.zarr"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x = 1\ny = x / 0\n", "line 2: ZeroDivisionError"),
        ("def osc(:\n", "line 1: SyntaxError"),
        ("import nonsmoth\n", "line 1: ModuleNotFoundError"),
        ("def osc(a):\n    return a\n", "missing 1 required"),
        ("import sys\ndef osc():\n    sys.exit(3)\n", "line 3: SystemExit"),
    ],
)
def test_a_model_file_with_an_error_is_one_sentence(text: str, message: str, write, tmp_path: Path, capsys) -> None:
    (tmp_path / "mine.py").write_text(text)
    assert cli.main(["run", str(write(CHART.replace("discontinuous_support", "mine.py:osc")))]) == 2
    said = capsys.readouterr().err
    assert "mine.py" in said and message in said and "Traceback" not in said
