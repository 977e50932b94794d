"""A quick reproduction: all files are there, the report is whole, and its numbers are those of the datasets."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import nonsmooth as ns
from nonsmooth.recordings.session import load_session
from nonsmooth_savi2007 import Reproduction, reproduce, study
from nonsmooth_savi2007.claims.claims import CLAIMS
from nonsmooth_savi2007.claims.verdicts import Verdict
from nonsmooth_savi2007.figures.figure import finish, finished, just_made
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import Laboratory
from nonsmooth_savi2007.printed import TABLE_1
from nonsmooth_savi2007.study import Measurement, figures_of_the_study

NUMBERS = {2, *range(4, 19)}
MEASURED = {*range(4, 15), 16, 17, 18}
CLAIM_IDS = {
    "M1",
    "M2",
    "M3",
    "M4",
    "R1",
    "R2",
    "P1",
    "P2",
    "P3",
    "P4",
    "P5",
    "P6",
    "P7",
    "P8",
    "F9a",
    "F9b",
    "F9c",
    "F10",
    "F11",
    "F12",
    "F13",
    "F14",
    "F15",
    "F16",
    "F17",
    "F18",
    "C1",
}


def test_the_study_has_all_figures_and_claims() -> None:
    figures = figures_of_the_study()
    assert {figure.number for figure in figures if figure.number is not None} == NUMBERS
    assert {figure.number for figure in figures if figure.rig and figure.number is not None} == MEASURED
    assert {claim.id for claim in CLAIMS} == CLAIM_IDS
    names = {figure.name for figure in figures}
    assert all(set(claim.figures) <= names for claim in CLAIMS)


def test_files_are_there_and_can_be_read(quick: Reproduction) -> None:
    for figure in quick.figures:
        assert (quick.out / f"{figure.name}.pdf").read_bytes().startswith(b"%PDF")
        assert (quick.out / f"{figure.name}.png").stat().st_size > 10_000
        for key, dataset in list(quick.data[figure.name].items())[-1:]:
            assert ns.load(quick.out / f"{figure.name}_{key}.nc").identical(dataset)


def test_every_row_is_complete(quick: Reproduction) -> None:
    rows = json.loads((quick.out / "claims.json").read_text(encoding="utf-8"))
    assert {row["id"] for row in rows} == {"R1", "R2", "P8", "F9a", "F9b", "F9c", "F11"}
    for row in rows:
        assert all(row[key] for key in ("place", "says", "exact", "smoothed", "difference", "rig", "rig_verdict"))
        assert {row["verdict"], row["rig_verdict"]} <= set(Verdict)
        assert (row["reason"] is None) == ("differs" not in (row["verdict"], row["rig_verdict"]))
        assert not re.search(r"nan|None", " ".join(text for text in row.values() if isinstance(text, str))), row
        assert "not found" not in row["exact"] + row["smoothed"]


def test_the_rig_finds_the_parameters_that_it_was_given(quick: Reproduction) -> None:
    """Table 1 as printed is the rig's truth, but for omega_0: sqrt(2k/m) of it (closed form)."""
    identified = ns.ParameterSet.from_dataset(quick.data["table1"]["identified"])
    found = {**identified.estimates, **identified.extra}
    truth = {name: printed.value for name, printed in TABLE_1.items()}
    truth |= {"omega_0": (2 * 8.47 / 0.838) ** 0.5, "gap_at_rest": 0.0018}
    for name, expected in truth.items():
        assert abs(found[name].value - expected) <= 4 * found[name].uncertainty, name
        assert found[name].value == pytest.approx(expected, rel=0.01), name
    rows = {row.says: row for row in quick.rows if row.id == "P8"}
    assert all(row.rig_verdict is Verdict.INPUT for row in rows.values())  # read back: no agreement
    known = rows["omega_0 = 4.60 rad/s"]
    assert known.verdict is Verdict.AGREES and "-2.3 %" in known.rig  # 4.496 against 4.60, read to 0.15 rad/s


def test_all_that_the_rig_gives_is_labelled_synthetic(quick: Reproduction) -> None:
    markdown = (quick.out / "report.md").read_text(encoding="utf-8")
    for figure in quick.figures:
        if figure.rig:
            assert all(one.attrs["synthetic"] == "yes" for one in quick.data[figure.name].values())
            assert f"{figure.title} (virtual rig, synthetic)" in markdown
    for notebook in (quick.out / "rig").glob("*/session.toml"):
        assert "synthetic = true" in notebook.read_text(encoding="utf-8")
        assert not list(notebook.parent.glob("truth*"))
    assert (quick.out / "rig" / "truth.toml").exists()


def test_exact_and_smoothed_agree_on_the_printed_numbers(quick: Reproduction) -> None:
    """Fig. 11's flips as an independent code has them (heyoka, shooting), within the steps of the quick sweep."""
    says = {row.says: row for row in quick.rows if row.id == "F11"}
    flips = {"period 1 for": 0.401469575, "period 2 down": 0.270021822, "period 4 down": 0.245022499}
    for start, flip in flips.items():
        row = next(row for text, row in says.items() if text.startswith(start))
        for text in (row.exact, row.smoothed):
            middle, error = (float(word) for word in re.match(r"(\S+) ± (\S+)", text).groups())
            assert abs(middle - flip) <= 2 * 3**0.5 * error  # the step before or after: half of it is sqrt(3) u


def test_the_report_is_self_contained(quick: Reproduction) -> None:
    html = (quick.out / "report.html").read_text(encoding="utf-8")
    assert html.count("data:image/png;base64,") == len(quick.figures)
    markdown = (quick.out / "report.md").read_text(encoding="utf-8")
    for row in quick.rows:
        assert row.says in markdown
    assert "A partial run (table1, fig09, fig09_rig, fig11, fig11_rig)" in markdown


def test_a_photograph_is_refused(tmp_path) -> None:
    with pytest.raises(ValueError, match=r"figure 3: .*reproduced are 2, 4, 5.*a photograph.*fig11_rig"):
        reproduce(tmp_path / "none", figures=[3], progress=False)
    with pytest.raises(ValueError, match=r"figure fig19: "):
        reproduce(tmp_path / "none", figures=[9, "fig19"], progress=False)
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_a_failed_measurement_says_where_to_look(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And its process takes no library from the folder that it is started in."""
    (tmp_path / "numpy.py").write_text("raise RuntimeError('this is the numpy.py of the folder')")
    monkeypatch.chdir(tmp_path)
    unknown = replace(figures_of_the_study()[0], name="nothing")
    with (
        Measurement(tmp_path, [unknown], quick=True) as bench,
        pytest.raises(RuntimeError, match="log.txt.*KeyError: 'nothing'"),
    ):
        bench.wait(print)


def test_a_figure_by_itself_has_its_own_procedures_with_the_same_records(quick: Reproduction, tmp_path: Path) -> None:
    """Fig. 11: six of eight."""
    (figure,) = (one for one in quick.figures if one.name == "fig11_rig")
    alone = Laboratory(tmp_path, True, figure.procedures).session
    whole = load_session(quick.out / "rig" / "identification")
    assert set(alone.procedures) == set(figure.procedures) < set(whole.procedures)
    for procedure in alone.procedures:
        mine, beside = alone.recordings(procedure), whole.recordings(procedure)
        assert [item.settings for item in mine] == [item.settings for item in beside] != []
        for item, other in zip(mine, beside, strict=True):
            for channel in item.recording.channels:
                one, two = (each.recording.channel(channel, each.run) for each in (item, other))
                np.testing.assert_array_equal(one.values, two.values)


@pytest.mark.slow
def test_what_a_figure_needs_is_all_that_is_measured(quick: Reproduction, tmp_path: Path) -> None:
    """Fig. 11 by itself: the records of six procedures, and the same data as beside Table 1 with all of them."""
    alone = reproduce(tmp_path, figures=["fig11_rig"], quick=True, progress=False)
    assert [figure.name for figure in alone.figures] == ["fig11_rig"]
    session = load_session(tmp_path / "rig" / "identification")
    assert set(session.procedures) == {"springs", "support", "impulse", "response", "drop", "contact"}
    assert {path.name for path in (tmp_path / "rig").iterdir()} == {
        "fig11_300_s",
        "identification",
        "log.txt",
        "truth.toml",
    }
    (key,) = alone.data["fig11_rig"]
    mine, beside = (one.data["fig11_rig"][key] for one in (alone, quick))
    for name in mine.data_vars:
        np.testing.assert_array_equal(mine[name].values, beside[name].values, err_msg=name)


def test_what_is_finished_is_used_again(quick: Reproduction, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second run computes nothing; its report is that of the folder, whatever was asked for."""
    before = {path: path.read_bytes() for path in quick.out.iterdir() if path.suffix in (".nc", ".md", ".png")}
    monkeypatch.setattr(study, "Measurement", lambda folder, figures, *kind: Measurement(folder, [], quick=True))
    for figure in quick.figures:
        monkeypatch.setitem(figure.__dict__, "compute", None)
    again = reproduce(quick.out, figures=[9], quick=True, progress=False)
    assert again.seconds == pytest.approx(quick.seconds)
    assert {path: path.read_bytes() for path in before} == before


def test_a_run_of_another_kind_is_not_mixed_with_it(quick: Reproduction) -> None:
    with pytest.raises(ValueError, match="holds figures of a quick run, and would mix the two: give another folder"):
        reproduce(quick.out, figures=[9], progress=False)


def test_a_damaged_or_an_unfinished_figure_is_made_again(tmp_path: Path) -> None:
    settings = Settings(quick=True, folder=tmp_path)
    data = {"one": xr.Dataset({"x": ("n", [1.0, 2.0])}, attrs={"nonsmooth": '{"verb": "test"}'})}
    finish("fig02", data, 1.5, settings)
    kept = finished("fig02", settings)
    assert kept is not None and kept[1] == 1.5 and kept[0]["one"].identical(data["one"])
    file = tmp_path / "fig02_one.nc"
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    assert finished("fig02", settings) is None
    file.write_bytes(whole)
    record = tmp_path / "fig02.json"
    words = json.loads(record.read_text())
    words["made_by"]["sources"] = "another version"
    record.write_text(json.dumps(words))
    assert finished("fig02", settings) is None
    assert just_made("fig02", settings)[1] == 1.5  # by a process of this run, before the sources changed
    record.write_text("{")
    assert finished("fig02", settings) is None
    record.unlink()  # interrupted before the end
    assert finished("fig02", settings) is None


def test_a_folder_with_other_files_and_one_that_cannot_be_written_into_are_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(ValueError, match=r"holds other files \(thesis.tex\).*--out"):
        reproduce(tmp_path, figures=[2], progress=False)
    with pytest.raises(OSError, match=r"cannot be written into .*another folder"):
        reproduce(tmp_path / "thesis.tex" / "out", figures=[2], progress=False)
    made = reproduce(tmp_path / "new", figures=[2], progress=False)
    assert (made.out / "report.html").exists()


@pytest.mark.slow
def test_the_whole_study_runs_quickly(tmp_path) -> None:
    """All figures at coarse settings: every claim has its rows, and both flows say the same of each.

    Of the rig: what was printed in the paper and put into the rig comes out of the procedures of Section 3.1.
    """
    whole = reproduce(tmp_path, quick=True, progress=False)
    assert {row.id for row in whole.rows} == CLAIM_IDS
    assert not any(re.search(r"\bnan\b", " ".join(map(str, vars(row).values()))) for row in whole.rows)
    assert {figure.number for figure in whole.figures} == NUMBERS | {None}
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "A quick run" in text
    assert "A partial run" not in text
    # Facts of the model, whatever the grid: contact at 8.64 rad/s, none at 9.88; order 2 in eta.
    says = {row.says: row for row in whole.rows}
    assert "swapped" in says["omega = 8.64 rad/s: periodic, no contact"].why
    assert says["the choice of eta is important"].verdict == "agrees"
    assert says["g = 0.0018 m: a strange attractor, sections at four phases"].verdict == "agrees"
    procedures = [row for row in whole.rows if row.id in ("P1", "P2", "P5")]
    assert procedures
    assert all(row.rig_verdict is Verdict.INPUT for row in procedures)
    viscous = next(row for row in whole.rows if row.says.startswith("c = 0.87"))
    assert float(re.search(r"([+-]\d\.\d) %", viscous.rig).group(1)) > 1  # dry friction passes for viscous


def test_the_guide_says_what_each_figure_needs() -> None:
    guide = Path(__file__).parents[3] / "docs" / "guides" / "study_files.md"
    table = guide.read_text(encoding="utf-8").partition("| figure | by the model |")[2].partition("\n\n")[0]
    rows = [[cell.strip(" `") for cell in line.split("|")[1:4]] for line in table.splitlines()[2:]]
    written = {name: (bool(model), set(records.split(", ")) - {""}) for name, model, records in rows}
    needed: dict[str, tuple[bool, set[str]]] = {}
    for figure in figures_of_the_study():
        name = figure.name if figure.number is None else str(figure.number)
        model, records = needed.get(name, (False, set()))
        needed[name] = (model or not figure.rig, records | set(figure.procedures if figure.rig else ()))
    assert written == needed
