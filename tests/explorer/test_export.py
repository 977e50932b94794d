"""Files saved from a page make what it showed: scripts and study files are run, and compared with the data."""

from __future__ import annotations

import contextlib
import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.cli import main as cli
from nonsmooth.explorer.catalogue import first_state
from nonsmooth.explorer.export import KINDS, exported

SYSTEM = ns.models.discontinuous_support(rho=0.26)
STATE = first_state("discontinuous_support", SYSTEM)
SHORT: dict[str, Any] = {"transient": 60, "start": [0.0, 0.0]}


@pytest.fixture(scope="module")
def results() -> dict[str, Any]:
    return {
        "diagram": ns.sweep(
            SYSTEM,
            "rho",
            np.linspace(0.25, 0.3, 7),
            direction="both",
            keep=20,
            section=ns.Stroboscopic(0.0),
            progress=False,
            **SHORT,
        ),
        "run": ns.simulate(SYSTEM, periods=8, **SHORT),
        "section": ns.poincare(SYSTEM, section=ns.Stroboscopic(0.25), n=12, **SHORT),
        "response": ns.frequency_response(SYSTEM, np.linspace(3.0, 5.0, 5), keep=20, progress=False, **SHORT),
        "chart": ns.chart(
            SYSTEM,
            {"rho": np.linspace(0.2, 0.5, 6), "omega": np.linspace(3.0, 5.0, 5)},
            refine=True,
            progress=False,
            **SHORT,
        ),
        "basins": ns.basins(
            SYSTEM, {"x": np.linspace(-0.01, 0.01, 5), "v": np.linspace(-0.1, 0.1, 4)}, transient=60, progress=False
        ),
    }


def write(folder: Path, view: str, kind: str, results: Any, state: Any = STATE) -> Path:
    name, content = exported(view, kind, results, state)
    (folder / name).write_bytes(content)
    return folder / name


def run(script: Path) -> None:
    """Run a script as a process of its own would, in this one."""
    import matplotlib.pyplot as plt

    with contextlib.chdir(script.parent):
        runpy.run_path(script.name, run_name="__main__")
    plt.close("all")


def named_only(figure: Any, path: Any, **more: Any) -> None:
    """Write the first bytes of a figure's file: the rest takes half a second."""
    assert figure.axes
    Path(path).write_bytes({".pdf": b"%PDF"}[Path(path).suffix])


def same(path: Path, shown: Any) -> None:
    made = ns.load(path)
    assert made.drop_attrs().identical(shown.drop_attrs())


@pytest.mark.parametrize(
    ("view", "key"),
    [
        ("diagram", "diagram"),
        ("portrait", "run"),
        ("section", "section"),
        ("response", "response"),
        ("chart", "chart"),
        ("basins", "basins"),
    ],
)
def test_the_script_and_the_study_file_make_what_was_shown(
    view: str, key: str, results: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Equidistant values are told by their ends and their number. One of the figures is written, and all are drawn."""
    if view != "diagram":
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", named_only)
    script = write(tmp_path, view, "py", results)
    run(script)
    data = script.with_suffix(".nc")
    same(data, results[key])
    told = {"diagram": (0.25, 0.3, 7), "response": (3.0, 5.0, 5), "chart": (0.2, 0.5, 6), "basins": (-0.1, 0.1, 4)}
    ends = told.get(view)
    assert ends is None or f"np.linspace{ends}" in script.read_text()
    data.unlink()
    script.with_suffix(".pdf").unlink()
    study = write(tmp_path, view, "toml", results)
    assert ends is None or "{{ from = {}, to = {}, n = {} }}".format(*ends) in study.read_text()
    assert cli.main(["run", str(study), "--quiet"]) == 0
    same(data, results[key])
    assert script.with_suffix(".pdf").read_bytes().startswith(b"%PDF")


def test_a_system_of_ones_own_and_a_smoothed_one_are_written_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", named_only)
    made = ns.simulate(SYSTEM.smoothed(1e-4), periods=1, start=[0.0, 0.0])
    own = replace(STATE, model="given")
    for state in (STATE, own):
        script = write(tmp_path, "history", "py", {"run": made}, state)
        run(script)
        same(script.with_suffix(".nc"), made)
    study = write(tmp_path, "portrait", "toml", {"run": made}, own)  # it carries the system, in text
    assert cli.main(["run", str(study), "--quiet"]) == 0
    same(study.with_suffix(".nc"), made)


def test_views_that_do_not_move_in_a_file_say_so(results: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="'Phase plane' and 'Time history'"):
        exported("diagram", "gif", results, STATE)


@pytest.mark.parametrize("view", ["branches", "spectrum"])
def test_what_has_no_table_in_a_study_file_is_saved_as_the_script_that_makes_it(
    view: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", named_only)
    shown = (
        ns.bifurcation_diagram(SYSTEM, "rho", (0.42, 0.5), start=[0.0, 0.0], transient=100, progress=False)
        if view == "branches"
        else ns.amplitude_spectrum(SYSTEM, **SHORT)
    )
    script = write(tmp_path, view, "py", {view: shown})
    run(script)
    same(script.with_suffix(".nc"), shown)
    assert script.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
    with pytest.raises(ValueError, match="no table in a study file"):
        exported(view, "toml", {view: shown}, STATE)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("py", "toml")])
def test_figures_and_data(kind: str, results: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from PIL import Image

    if kind == "html":  # a tenth of its pictures, which the other moving file has all
        whole = ns.animate
        monkeypatch.setattr(ns, "animate", lambda run, seconds, **more: whole(run, seconds=seconds / 10, **more))

    begins = {
        "pdf": b"%PDF",
        "png": b"\x89PNG",
        "svg": b"<?xml",
        "nc": b"\x89HDF",
        "gif": b"GIF8",
        "html": b"<!doctype",
    }[kind]
    path = write(tmp_path, "portrait" if kind == "gif" else "history", kind, results)
    assert path.read_bytes().startswith(begins)
    if kind == "nc":
        same(path, results["run"])
    if kind == "gif":
        with Image.open(path) as picture:
            assert picture.n_frames == 60
    if kind == "html":
        assert "<script>" in path.read_text()  # it moves


def test_a_first_look_is_not_saved(results: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="has no result to save yet"):
        exported("diagram", "pdf", {"diagram": results["diagram"].drop_vars("period_number")}, STATE)
    with pytest.raises(ValueError, match="cannot be saved as 'exe'"):
        exported("diagram", "exe", results, STATE)
