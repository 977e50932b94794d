"""Without the package zarr everything but stores works, and those name the extra before any work."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.campaign.store import describe_store, open_store
from nonsmooth.cli import main as cli

EXTRA = r'zarr, which is not installed: .*pip install "\.\[zarr\]"'
CHART = """
[system]
model = "discontinuous_support"
[chart]
grid = { omega = [3.0, 3.1], rho = [0.3, 0.31] }
transient = 3
keep = 3
"""


@pytest.fixture(autouse=True)
def no_zarr(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "zarr"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "zarr", None)


def test_netcdf_works_and_zarr_names_the_extra(swept: xr.Dataset, tmp_path: Path) -> None:
    xr.testing.assert_identical(ns.load(ns.save(swept, tmp_path / "r.nc")), swept)
    with pytest.raises(ImportError, match=rf"r\.zarr: a Zarr store needs the package {EXTRA}"):
        ns.save(swept, tmp_path / "r.zarr")
    with pytest.raises(ImportError, match=EXTRA):
        ns.load(tmp_path / "r.zarr")
    for function in (lambda path: open_store(path, None), describe_store):
        with pytest.raises(ImportError, match=EXTRA):
            function(tmp_path / "chunks.zarr")


@pytest.mark.parametrize("output", ['data = "a.zarr"', 'store = "a.zarr"'])
def test_a_study_says_so_before_it_computes(output: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "study.toml"
    path.write_text(f"{CHART}[output]\n{output}\n")
    assert cli.main(["run", str(path)]) == 2
    out, err = capsys.readouterr()
    assert not out and "pip install" in err and "[zarr]" in err and "kept in" not in err


def test_a_plan_does_without(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "study.toml"
    path.write_text(CHART)
    assert cli.main(["plan", str(path), "--seconds", "0.1"]) == 0
    assert "store       not measured: it needs the package zarr" in capsys.readouterr().out
