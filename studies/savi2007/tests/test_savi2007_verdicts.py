"""The rule of the report on cases that are worked out by hand, and the page that it makes of them."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from nonsmooth.identification import Estimate
from nonsmooth_savi2007.claims.verdicts import (
    MEANING,
    RULE,
    Beside,
    Cause,
    Cell,
    Statement,
    Verdict,
    against_printed,
    judge,
    judge_step,
    printed_cell,
)
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.measure import Interval
from nonsmooth_savi2007.printed import NATURAL_FREQUENCY, TABLE_1, Printed
from nonsmooth_savi2007.report.pages import to_html, to_markdown
from nonsmooth_savi2007.report.report import write_report


def _known(value: float, expanded: float) -> Interval:
    return Interval(value - expanded, value + expanded)


@pytest.mark.parametrize(
    ("printed", "value", "expanded", "verdict"),
    [
        ("5.29", 5.29, 0.0, "agrees"),
        ("5.29", 5.25, 0.001, "agrees"),  # 0.8 %
        ("5.29", 5.16, 0.001, "differs"),  # 2.5 %
        ("0.26", 0.2397, 0.025, "undecided"),  # -7.8 %, known to a tenth: once "agrees"
        ("0.28", 0.2699, 0.0003, "differs"),  # -3.6 %, known well
        ("0.28", 0.2699, 0.006, "undecided"),
        ("100", 98.5, 0.4, "agrees"),  # at most 1.9 %
        ("100", 98.5, 0.6, "undecided"),  # at most 2.1 %
        ("100", 97.0, 0.9, "differs"),  # at least 2.1 %
        ("0.1", 0.14, 0.005, "agrees"),  # within half a unit of the last digit, 0.05: coarser than 2 %
        ("0.1", 0.16, 0.005, "differs"),
    ],
)
def test_the_rule(printed: str, value: float, expanded: float, verdict: str) -> None:
    row = against_printed("a number", Printed(printed, "N", "here"), [_known(value, expanded), None])
    assert row.verdict == verdict


def test_a_larger_uncertainty_only_ever_makes_it_undecided() -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        printed, value, resolution = 1.0, 1 + rng.normal(0, 0.03), rng.choice([0.0, 0.005, 0.04])
        met = [judge(printed, _known(value, u), resolution) for u in np.linspace(0, 0.1, 41)]
        changes = [new for old, new in pairwise(met) if new is not old]
        assert changes == [Verdict.UNDECIDED]


def test_a_printed_number_is_taken_to_its_resolution() -> None:
    """0.732 Hz is a line of a DFT of 2048 samples at 100 Hz: half a line is 0.0244 Hz, 0.153 rad/s."""
    printed = TABLE_1["omega_0"]
    assert NATURAL_FREQUENCY == pytest.approx(4.4961, abs=1e-4)
    assert printed.rounding == pytest.approx(0.005)
    assert printed.resolution == pytest.approx(0.15340, abs=1e-5)
    assert judge(printed.value, _known(NATURAL_FREQUENCY, 0.0), printed.rounding) is Verdict.DIFFERS
    assert judge(printed.value, _known(NATURAL_FREQUENCY, 0.0), printed.resolution) is Verdict.AGREES


def test_an_input_that_comes_back_is_no_agreement() -> None:
    mass = TABLE_1["m"]
    back, lost, vague = (
        printed_cell(mass, Estimate(value, u, "kg"), put_in=True).verdict
        for value, u in ((0.8379, 0.0005), (0.90, 0.0005), (0.84, 0.05))
    )
    assert (back, lost, vague) == (Verdict.INPUT, Verdict.DIFFERS, Verdict.UNDECIDED)
    assert printed_cell(mass, _known(0.838, 0.001)).verdict is Verdict.AGREES


def test_a_closed_form_lies_in_the_step_or_beside_it() -> None:
    assert judge_step(5.16, Interval(5.15, 5.17)) is Verdict.AGREES
    assert judge_step(5.175, Interval(5.15, 5.17)) is Verdict.AGREES
    assert judge_step(5.19, Interval(5.15, 5.17)) is Verdict.DIFFERS
    assert judge_step(5.16, Interval(5.0, 5.3)) is Verdict.UNDECIDED  # a step of 6 % tells nothing
    assert judge_step(5.16, None) is Verdict.DIFFERS


def test_plus_minus_is_the_standard_uncertainty() -> None:
    assert str(Interval(5.1, 5.3)) == "5.200 ± 0.058"  # 0.2 / sqrt(12)
    assert str(Estimate(8.47, 0.012, "N/m")) == "8.470 ± 0.012 N/m"
    assert str(Beside(0.28, 0.005, 0.2699, 0.0003)) == "-3.6 % (3.5 to 3.7)"
    assert str(Beside(4.6, 0.15, 4.6, 0.0)) == "+0.0 %"


def _row(claim: str, verdict: Verdict, rig: Verdict, cause: Cause | None = None) -> Statement:
    beside = Beside(1.0, 0.005, 1.01, 0.001) if verdict is Verdict.AGREES else None
    row = Statement(
        "here",
        f"{claim} says",
        "exact",
        "smoothed",
        "off",
        verdict,
        "Reason.",
        id=claim,
        cause=cause,
        exact_beside=beside,
        smoothed_beside=beside,
    )
    return row.measured(Cell("rig", rig))


ROWS = (
    _row("M1", Verdict.AGREES, Verdict.NOT_ASKED),
    _row("P1", Verdict.NOT_ASKED, Verdict.INPUT),
    _row("F9b", Verdict.DIFFERS, Verdict.UNDECIDED, Cause.TABLE_1),
    _row("F11", Verdict.DIFFERS, Verdict.DIFFERS),
    _row("F12", Verdict.AGREES, Verdict.DIFFERS),
    _row("F13", Verdict.ADDS, Verdict.IN_PART),
    _row("F14", Verdict.DIFFERS, Verdict.AGREES, Cause.MISPRINT),
    _row("C1", Verdict.INPUT, Verdict.AGREES),
    _row("C1", Verdict.IN_PART, Verdict.ADDS),
)


def test_the_page_says_it_in_three_lines_whose_totals_add_up(tmp_path: Path) -> None:
    write_report(tmp_path, [], {}, ROWS, Settings(), complete=True)
    text = (tmp_path / "report.md").read_text(encoding="utf-8")
    assert "2 of the 6 statements that it can decide agree, 1 in part, 3 differ." in text
    assert "same verdict on 2 of 2 printed numbers" in text
    assert re.search(r"Of 3 statements: 1 misprinted \(F14\); 1 because Table 1 .*\(F9b\); 1 real.*\(F11\)\.", text)
    assert "2 of the 6 statements that it can decide agree, 1 in part, 1 undecided, 2 differ. 1 value" in text
    counts = {row[0]: row[1:] for row in re.findall(r"^\| ([a-z ]+) \| (\d+) \| (\d+) \|$", text, re.M)}
    assert counts.pop("all statements") == (str(len(ROWS)),) * 2
    assert set(counts) == set(Verdict)
    for side in (0, 1):
        assert sum(int(numbers[side]) for numbers in counts.values()) == len(ROWS)
    for sentence in (*RULE, *MEANING.values()):
        assert sentence in text
    causes = re.findall(r"^\| (\w+) \| \w+ says \| \w+ \| \w* \| ([a-z ]+) \| ([^|]+) \| Reason. \|$", text, re.M)
    assert causes == [
        ("F14", "model", "misprint"),
        ("F9b", "model", "Table 1 inconsistent with itself"),
        ("F11", "model and rig", "real"),
        ("F12", "rig", "the virtual rig"),
    ]


def test_the_page_is_whole_by_itself(tmp_path: Path) -> None:
    write_report(tmp_path, [], {}, ROWS, Settings(quick=True), complete=False)
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert not re.search(r'<script|<link|src="(?!data:)|url\(|@import|https?://', html)
    anchors = re.findall(r'id="([^"]+)"', html)
    assert len(set(anchors)) == len(anchors)
    assert set(re.findall(r'href="#([^"]+)"', html)) <= set(anchors)
    for verdict in Verdict:
        assert f'<td class="v-{verdict.name.lower()}"' in html
    # On a phone a cell stands by itself, under its column's name.
    assert not re.search(r"<td(?! )[^>]*>[^<]", html)
    assert "A quick run" in html and "A partial run" in html
    assert html.index("The model</dt>") < html.index('class="comparison"') < html.index("Differences and their cause")
    assert html.index("Differences and their cause") < html.index("<nav") < html.index("The rule</h2>")


def test_what_a_cell_holds_is_text() -> None:
    from nonsmooth_savi2007.report.pages import table

    block = table(("a", "b"), (("<b>", "x | y"),), ("<i>",))
    assert "<b>" not in to_html([block], "t").partition("<body>")[2]
    assert "x \\| y" in to_markdown([block])
