"""A quick reproduction: all files are there, the report is whole, and its numbers are those of the datasets."""

from __future__ import annotations

import json
import re

import pytest

import nonsmooth as ns
from nonsmooth.studies.savi2007 import Reproduction, reproduce
from nonsmooth.studies.savi2007.claims import CLAIMS
from nonsmooth.studies.savi2007.study import figures_of_the_study

NUMBERS = {2, 9, 10, 11, 12, 13, 14, 15, 17, 18}
CLAIM_IDS = {"M1", "M2", "M3", "M4", "F9a", "F9b", "F9c", "F10", "F11", "F12", "F13", "F14", "F15", "F17", "F18", "C1"}


def test_the_study_has_all_numerical_figures_and_claims() -> None:
    figures = figures_of_the_study()
    assert {figure.number for figure in figures if figure.number is not None} == NUMBERS
    assert {claim.id for claim in CLAIMS} == CLAIM_IDS
    names = {figure.name for figure in figures}
    assert all(set(claim.figures) <= names for claim in CLAIMS)


def test_files_are_there_and_can_be_read(quick: Reproduction) -> None:
    for figure in quick.figures:
        assert (quick.out / f"{figure.name}.pdf").read_bytes().startswith(b"%PDF")
        assert (quick.out / f"{figure.name}.png").stat().st_size > 10_000
        for key, dataset in quick.data[figure.name].items():
            assert ns.load(quick.out / f"{figure.name}_{key}.nc").identical(dataset)


def test_every_row_is_complete(quick: Reproduction) -> None:
    rows = json.loads((quick.out / "claims.json").read_text(encoding="utf-8"))
    assert {row["id"] for row in rows} == {"F9a", "F9b", "F9c", "F10", "F11"}
    for row in rows:
        assert all(row[key] for key in ("place", "says", "exact", "smoothed", "difference"))
        assert re.match(r"agrees|differs|adds to the paper", row["verdict"])
        assert not re.search(r"nan|None|not found", " ".join(row.values())), row


def test_exact_and_smoothed_agree_on_the_printed_numbers(quick: Reproduction) -> None:
    """Fig. 11's flips as an independent code has them (heyoka, shooting), within the steps of the quick sweep."""
    says = {row.says: row for row in quick.rows if row.id == "F11"}
    flips = {"period 1 for": 0.401469575, "period 2 down": 0.270021822, "period 4 down": 0.245022499}
    for start, flip in flips.items():
        row = next(row for text, row in says.items() if text.startswith(start))
        for text in (row.exact, row.smoothed):
            middle, half = (float(word) for word in re.match(r"(\S+) ± (\S+)", text).groups())
            assert abs(middle - flip) <= 2 * half


def test_the_report_is_self_contained(quick: Reproduction) -> None:
    html = (quick.out / "report.html").read_text(encoding="utf-8")
    assert html.count("data:image/png;base64,") == len(quick.figures)
    assert not re.search(r'src="(?!data:)|<link|<script', html)
    markdown = (quick.out / "report.md").read_text(encoding="utf-8")
    for row in quick.rows:
        assert row.says in markdown
    assert "A partial run (fig09, fig10, fig11)" in markdown


def test_a_figure_of_the_rig_is_refused(tmp_path) -> None:
    with pytest.raises(ValueError, match=r"figure 16 is not among .* 2, 9, 10"):
        reproduce(tmp_path, figures=[16], progress=False)


@pytest.mark.slow
def test_the_whole_study_runs_quickly(tmp_path) -> None:
    """All figures at coarse settings: every claim has its rows, and both flows say the same of each."""
    whole = reproduce(tmp_path, quick=True, progress=False)
    assert {row.id for row in whole.rows} == CLAIM_IDS
    assert not any("nan" in " ".join(vars(row).values()) for row in whole.rows)
    assert {figure.number for figure in whole.figures} == NUMBERS | {None}
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "A quick run" in text
    assert "A partial run" not in text
    # Facts of the model, whatever the grid: contact at 8.64 rad/s, none at 9.88; order 2 in eta.
    says = {row.says: row for row in whole.rows}
    assert "swapped" in says["omega = 8.64 rad/s: periodic, no contact"].why
    assert says["the choice of eta is important"].verdict == "agrees"
    assert says["g = 0.0018 m: a strange attractor, sections at four phases"].verdict == "agrees"
