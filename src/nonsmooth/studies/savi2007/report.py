"""The report: one row per statement, the figures, and what the paper leaves open; Markdown, HTML and JSON."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from nonsmooth.results.provenance import package_version
from nonsmooth.studies.savi2007.figure import Figure
from nonsmooth.studies.savi2007.flows import ETA, SMOOTHED, Settings
from nonsmooth.studies.savi2007.pages import (
    Block,
    Bullets,
    Heading,
    Paragraph,
    Picture,
    Table,
    to_html,
    to_markdown,
)  # fmt: skip
from nonsmooth.studies.savi2007.printed import NUMBERS
from nonsmooth.studies.savi2007.rows import CLOSE, Data, Row

__all__ = ["write_report"]

TITLE = "Savi, Divenyi, Franca & Weber (2007): the paper and its model, side by side"
_HEADER = ("claim", "where", "paper says", "exact flow", "smoothed switch, RKF45", "difference", "verdict", "why")


def write_report(
    folder: Path, figures: Sequence[Figure], data: Data, rows: Sequence[Row], settings: Settings, *, complete: bool
) -> None:
    """Write ``report.md``, ``report.html`` and ``claims.json`` into the folder that holds the figures."""
    blocks = _blocks(folder, figures, data, rows, settings, complete)
    (folder / "report.md").write_text(to_markdown(blocks), encoding="utf-8")
    (folder / "report.html").write_text(to_html(blocks, TITLE), encoding="utf-8")
    text = json.dumps([asdict(row) for row in rows], indent=1, ensure_ascii=False)
    (folder / "claims.json").write_text(text + "\n", encoding="utf-8")


def _blocks(
    folder: Path, figures: Sequence[Figure], data: Data, rows: Sequence[Row], settings: Settings, complete: bool
) -> list[Block]:
    blocks: list[Block] = [
        Heading(TITLE, 1),
        Paragraph(
            "M.A. Savi, S. Divenyi, L.F.P. Franca, H.I. Weber, Numerical and experimental investigations of the "
            "nonlinear dynamics and chaos in non-smooth systems, J. Sound Vib. 301 (2007) 59-73, "
            "doi:10.1016/j.jsv.2006.09.014. Every statement that needs no rig is measured here on the paper's own "
            "model with the parameters of its Table 1, none of them tuned: by the exact flow, and by the paper's "
            f"smoothed switch with eta = {ETA:g} m, integrated by Runge-Kutta-Fehlberg at rtol = "
            f"{SMOOTHED.options['rtol']:g}. Written by nonsmooth {package_version()}; all numbers are read off the "
            "datasets beside this file."
        ),
    ]
    if settings.quick:
        blocks.append(
            Paragraph("A quick run: coarse grids and short transients. Intervals are wide, and verdicts provisional.")
        )
    if not complete:
        names = ", ".join(figure.name for figure in figures)
        blocks.append(Paragraph(f"A partial run ({names}): only the statements these figures decide are listed."))
    if rows:
        blocks += [Heading("Statements"), Paragraph(_summary(rows)), Paragraph(_rules()), _table(rows)]
    blocks += [Heading("What the paper leaves open"), Bullets(_OPEN), Heading("Figures")]
    for figure in figures:
        title = figure.title if figure.number is None else f"Fig. {figure.number}: {figure.title}"
        caption = figure.caption(data[figure.name])
        blocks += [Heading(title, 3), Picture(folder / f"{figure.name}.png", f"{figure.name}.pdf", caption)]
    return blocks


def _table(rows: Sequence[Row]) -> Table:
    cells, last = [], ""
    for row in rows:
        name = row.id if row.id != last else ""
        cells.append((name, row.place, row.says, row.exact, row.smoothed, row.difference, row.verdict, row.why))
        last = row.id
    return Table(_HEADER, tuple(cells), marked=_HEADER.index("verdict"))


def _summary(rows: Sequence[Row]) -> str:
    within = sum(row.verdict.startswith("agrees within") for row in rows)
    plain, partly = (sum(row.verdict == word for row in rows) for word in ("agrees", "agrees in part"))
    differs = [row for row in rows if row.verdict.startswith("differs")]
    text = (
        f"{len(rows)} statements: {plain} agree, {within} agree within {CLOSE:g} %, {partly} agree in part, "
        f"{len(differs)} differ"
    )
    if differs:
        text += ": " + "; ".join(f"{row.id}, {row.says} ({row.verdict})" for row in differs)
    return text + "."


def _rules() -> str:
    one, other = (NUMBERS[key] for key in ("natural frequency", "natural frequency, measured"))
    return (
        "a ± b is the middle and half the width of the step of a sweep in which the change lies. A printed number "
        f"agrees when it lies there within its own rounding; it agrees within N % up to {CLOSE:g} %, which is about "
        f"how far the paper's own two natural frequencies ({one} and {other}) lie apart; beyond that it differs. "
        "Differences are (found - printed) / printed."
    )


_OPEN = (
    "The tolerance of the Runge-Kutta-Fehlberg integration, the steps of the sweeps and the lengths of the transients.",
    "The phase of the Poincare section in Figs. 11 to 14, 17 and 18; phase 0 of rho cos(omega t) here.",
    "The first states: where motions coexist, they decide what a figure shows.",
    "The memory of S_a (the velocity at its entry) when a run starts inside the band; here it is the velocity at the "
    "start.",
)
