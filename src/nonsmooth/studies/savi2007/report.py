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
from nonsmooth.studies.savi2007.rig_parameters import NAMES, table_rows
from nonsmooth.studies.savi2007.rows import CLOSE, NOT_ASKED, Data, Row
from nonsmooth.studies.savi2007.special import SpecialPoint, ratios, special_table, table_of_points

__all__ = ["write_report"]

TITLE = "Savi, Divenyi, Franca & Weber (2007): the paper, its model and a virtual rig, side by side"
_HEADER = (
    "claim", "where", "paper says", "exact flow", "smoothed switch, RKF45", "difference", "verdict, model",
    "virtual rig (synthetic)", "verdict, rig", "why",
)  # fmt: skip


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
            "doi:10.1016/j.jsv.2006.09.014. Every statement is measured here on the paper's own model with the "
            "parameters of its Table 1, none of them tuned: by the exact flow, and by the paper's smoothed switch with "
            f"eta = {ETA:g} m, integrated by Runge-Kutta-Fehlberg at rtol = {SMOOTHED.options['rtol']:g}. Written by "
            f"nonsmooth {package_version()}; all numbers are read off the "
            "datasets beside this file."
        ),
    ]
    if any(figure.rig for figure in figures):
        blocks.append(Paragraph(_ABOUT_THE_RIG))
    if settings.quick:
        blocks.append(
            Paragraph("A quick run: coarse grids and short transients. Intervals are wide, and verdicts provisional.")
        )
    if not complete:
        names = ", ".join(figure.name for figure in figures)
        blocks.append(Paragraph(f"A partial run ({names}): only the statements these figures decide are listed."))
    if rows:
        blocks += [Heading("Statements"), Paragraph(_summary(rows)), Paragraph(_rules()), _table(rows)]
    if "table1" in data:
        blocks += [Heading("Table 1, identified"), _parameters(data)]
    points = table_of_points(data)
    if points:
        blocks += [Heading("Special points"), Paragraph(_about_points(points)), special_table(points)]
    blocks += [Heading("What the paper leaves open"), Bullets(_OPEN), Heading("Figures")]
    for figure in figures:
        title = figure.title if figure.number is None else f"Fig. {figure.number}: {figure.title}"
        title += f" (not in the paper; beside Fig. {figure.beside})" if figure.beside is not None else ""
        title += " (virtual rig, synthetic)" if figure.rig else ""
        caption = figure.caption(data[figure.name])
        blocks += [Heading(title, 3), Picture(folder / f"{figure.name}.png", f"{figure.name}.pdf", caption)]
    return blocks


def _table(rows: Sequence[Row]) -> Table:
    cells, last = [], ""
    for row in rows:
        name = row.id if row.id != last else ""
        cells.append((
            name, row.place, row.says, row.exact, row.smoothed, row.difference, row.verdict, row.rig, row.rig_verdict,
            row.why,
        ))  # fmt: skip
        last = row.id
    marked = tuple(_HEADER.index(f"verdict, {word}") for word in ("model", "rig"))
    return Table(_HEADER, tuple(cells), marked=marked)


def _parameters(data: Data) -> Table:
    """Paper, identified with its 95 % interval, truth of the rig."""
    rows = []
    for name, (printed, number, truth) in table_rows(data["table1"]).items():
        off = 100 * (number.value / truth - 1)
        inside = "in it" if number.low <= truth <= number.high else "outside"
        interval = f"{number.low:.6g} ... {number.high:.6g}"
        rows.append((
            name, NAMES[name][0], printed or "not printed", f"{number.value:.6g} ± {number.uncertainty:.2g}", interval,
            f"{truth:.6g}", inside, f"{off:+.3f} %",
        ))  # fmt: skip
    header = (
        "parameter", "unit", "paper", "identified ± standard uncertainty (synthetic)", "95 % interval",
        "truth of the rig", "truth is", "identified from truth",
    )  # fmt: skip
    return Table(header, tuple(rows))


def _summary(rows: Sequence[Row]) -> str:
    model = _counted("By the model", [(row, row.verdict) for row in rows])
    rig = _counted("By the virtual rig", [(row, row.rig_verdict) for row in rows])
    return f"{len(rows)} statements. {model} {rig}"


def _counted(whose: str, judged: Sequence[tuple[Row, str]]) -> str:
    asked = [(row, verdict) for row, verdict in judged if verdict != NOT_ASKED]
    within = sum(verdict.startswith("agrees within") for _, verdict in asked)
    plain, partly = (sum(verdict == word for _, verdict in asked) for word in ("agrees", "agrees in part"))
    differs = [(row, verdict) for row, verdict in asked if verdict.startswith("differs")]
    text = (
        f"{whose}, of {len(asked)} that it can decide: {plain} agree, {within} agree within {CLOSE:g} %, {partly} "
        f"agree in part, {len(differs)} differ"
    )
    if differs:
        text += ": " + "; ".join(f"{row.id}, {row.says} ({verdict})" for row, verdict in differs)
    return text + "."


def _rules() -> str:
    one, other = (NUMBERS[key] for key in ("natural frequency", "natural frequency, measured"))
    return (
        "a ± b is the middle and half the width of the step of a sweep (or between two runs of the rig) in which the "
        "change lies; of a quantity identified, its value and half its 95 % interval. A printed number "
        f"agrees when it lies there within its own rounding; it agrees within N % up to {CLOSE:g} %, which is about "
        f"how far the paper's own two natural frequencies ({one} and {other}) lie apart; beyond that it differs. "
        "Differences are (found - printed) / printed."
    )


def _about_points(points: Sequence[SpecialPoint]) -> str:
    text = (
        "Every flip, fold and grazing point of the periodic orbits of Figs. 9, 10, 11, 13 and 17 (exact flow), along "
        "the branches, which are continued from one stable orbit of each figure and switched at flips. The largest "
        "multiplier is +1 at a fold and -1 at a flip; at a graze it is given without the contact and with a contact of "
        "no length. The motion without contact grazes where g = (rho/m) / sqrt((2k/m - omega^2)^2 + (c omega/m)^2), a "
        "closed form; of the others none is known."
    )
    for figure, found in ratios(points).items():
        text += (
            f" Ratios of successive intervals between the flips of periods 1, 2, 4, 8 in Fig. {int(figure[3:])}: "
            f"{', '.join(f'{ratio:.3f}' for ratio in found)}."
        )
    return text


_ABOUT_THE_RIG = (
    "What the paper measured is measured here on a virtual rig (synthetic): a computed apparatus with the paper's "
    "Table 1 and more physics than the model (strings, an uneven motor, dry friction, a support that takes time to "
    "come back, sensors with steps and noise). Its records were written to files (folder rig), the parameters were "
    "identified from these files alone, and the records are laid over the model with these parameters. Agreement of "
    "the rig with a parameter of the paper shows that the procedure finds what was put in; it is no evidence on the "
    "paper's own measurement."
)
_OPEN = (
    "The tolerance of the Runge-Kutta-Fehlberg integration, the steps of the sweeps and the lengths of the transients.",
    "The phase of the Poincare section in Figs. 11 to 14, 17 and 18; phase 0 of rho cos(omega t) here.",
    "The rate at which the forcing rises in Fig. 11, the lengths of the records, how many samples the DFT of Fig. 5 "
    "has, the dry friction of the rig, the length of its strings, and from where its gaps are counted.",
    "The first states: where motions coexist, they decide what a figure shows.",
    "The memory of S_a (the velocity at its entry) when a run starts inside the band; here it is the velocity at the "
    "start.",
)
