"""Words of ``nonsmooth run`` and ``nonsmooth plan``: on results that were kept, and on studies they are not for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli import main as cli

CHART = """
[system]
model = "discontinuous_support"
parameters = { g = 0.02 }

[chart]
grid = { omega = { from = 4.4, to = 4.5, n = 3 }, rho = [0.14, 0.15] }
transient = 20
keep = 17
"""
SWEEP = '[system]\nmodel = "discontinuous_support"\n[sweep]\nparameter = "rho"\nvalues = [0.2]\n'


def said(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, *words: str, code: int = 0) -> str:
    file = tmp_path / "study.toml"
    file.write_text(text, encoding="utf-8")
    command, *more = words
    assert cli.main([command, str(file), *more]) == code
    out, err = capsys.readouterr()
    return out if code == 0 else err


def test_what_was_written_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = said(tmp_path, capsys, CHART + '[output]\ndata = "chart.nc"\n', "run")
    assert f"written to {tmp_path / 'chart.nc'}" in out and "computed in" in out and "nothing was kept" not in out
    found = ns.load(tmp_path / "chart.nc")
    assert found["omega"].values == pytest.approx(np.linspace(4.4, 4.5, 3)) and (found["period_number"] == 1).all()


def test_a_store_is_told_and_goes_elsewhere_than_the_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = '[output]\ndata = "chart.nc"\nstore = "chunks.zarr"\n'
    out = said(tmp_path, capsys, CHART + output, "run")
    assert f"chunks are kept in {tmp_path / 'chunks.zarr'}" in out and (tmp_path / "chunks.zarr").is_dir()
    other = tmp_path / "other.zarr"
    assert f"chunks are kept in {other}" in said(tmp_path, capsys, CHART + output, "run", "--store", str(other))
    assert other.is_dir()
    err = said(tmp_path, capsys, CHART + output, "run", "--store", str(tmp_path / "chart.nc"), code=2)
    assert "is where the result is to be written (data): give another name" in err


def test_what_is_not_kept_is_told_and_quiet_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "nothing was kept: the file has no [output] with" in said(tmp_path, capsys, CHART, "run")
    assert said(tmp_path, capsys, CHART, "run", "--quiet") == ""


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        (SWEEP, (), "plan is for charts, this study runs sweep"),
        (CHART, ("--seconds", "0"), "--seconds 0: the time to spend on the sample must be positive"),
        (CHART, ("--workers", "0"), "--workers"),
    ],
)
def test_what_plan_is_not_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, words: tuple[str, ...], message: str
) -> None:
    assert message in said(tmp_path, capsys, text, "plan", *words, code=2)


def test_a_plan_of_a_refined_chart_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = said(tmp_path, capsys, CHART, "plan", "--seconds", "0.01")
    assert "refine" not in plain
    refined = said(tmp_path, capsys, CHART + "refine = true\n", "plan", "--seconds", "0.01")
    assert "refine      computes a part of these points; the time above is that of all" in refined
