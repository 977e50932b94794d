"""The report: the verdict in three lines, the printed numbers, the differences with their cause, every statement."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from nonsmooth import __version__
from nonsmooth_savi2007.claims.verdicts import CLOSE, MEANING, RULE, Cause, Data, Statement, Verdict, judge
from nonsmooth_savi2007.figures.figure import Figure
from nonsmooth_savi2007.figures.parameters import NAMES, table_rows
from nonsmooth_savi2007.flows import ETA, SMOOTHED, Settings
from nonsmooth_savi2007.report.pages import (
    Written,
    bullets,
    comparison,
    contents,
    heading,
    image,
    notice,
    paragraph,
    sentences,
    table,
    tally,
    to_html,
    to_markdown,
)
from nonsmooth_savi2007.report.special import SpecialPoint, ratios, special_table, table_of_points

REPORTS = ("claims.json", "report.md", "report.html")

TITLE = "Savi, Divenyi, Franca & Weber (2007), reproduced"
_PAPER = (
    "M.A. Savi, S. Divenyi, L.F.P. Franca, H.I. Weber, Numerical and experimental investigations of the nonlinear "
    "dynamics and chaos in non-smooth systems, J. Sound Vib. 301 (2007) 59-73, doi:10.1016/j.jsv.2006.09.014."
)
#: The long table in parts, by the first letter of a statement's id.
_PARTS = {
    "M": "The model (Section 2)",
    "RP": "Apparatus and parameters (Section 3)",
    "F": "Results (Section 4)",
    "C": "Conclusions (Section 5)",
}
_MODEL, _RIG = "model", "virtual rig (synthetic)"


def write_report(
    folder: Path,
    figures: Sequence[Figure],
    data: Data,
    rows: Sequence[Statement],
    settings: Settings,
    *,
    complete: bool,
) -> None:
    """Write ``REPORTS`` into the folder that holds the figures."""
    blocks = [heading(TITLE, 1), paragraph(_PAPER)]
    if settings.quick:
        blocks.append(notice("A quick run: coarse grids and short transients. Verdicts are provisional."))
    if not complete:
        names = ", ".join(figure.name for figure in figures)
        blocks.append(notice(f"A partial run ({names}): only the statements that these figures decide are listed."))
    if rows:
        blocks += [sentences(_in_short(rows)), tally(_counts(rows))]
        blocks += _numbers(rows)
        blocks += _differences(rows)
    first = len(blocks)
    if rows:
        blocks += [heading("The rule"), bullets(RULE)]
        blocks.append(table(("verdict", "meaning"), [(str(one), text) for one, text in MEANING.items()]))
        for letters, title in _PARTS.items():
            mine = [row for row in rows if row.id[0] in letters]
            blocks += [heading(title), _table(mine)] if mine else []
    if "table1" in data:
        blocks += [heading("Table 1, identified"), _parameters(data)]
    points = table_of_points(data)
    if points:
        blocks += [heading("Special points"), paragraph(_about_points(points)), special_table(points)]
    blocks.append(heading("Figures"))
    for figure in figures:
        title = figure.title if figure.number is None else f"Fig. {figure.number}: {figure.title}"
        title += f" (not in the paper; beside Fig. {figure.beside})" if figure.beside is not None else ""
        title += " (virtual rig, synthetic)" if figure.rig else ""
        caption = figure.caption(data[figure.name])
        blocks += [heading(title, 3), image(folder / f"{figure.name}.png", f"{figure.name}.pdf", caption)]
    blocks += [heading("The computation"), paragraph(_ABOUT_THE_MODEL)]
    if any(figure.rig for figure in figures):
        blocks.append(paragraph(_ABOUT_THE_RIG))
    blocks += [heading("What the paper leaves open"), bullets(_OPEN)]
    blocks.insert(first, contents(blocks))
    text = json.dumps([asdict(row) | {"reason": row.reason} for row in rows], indent=1, ensure_ascii=False)
    for name, content in zip(REPORTS, (text + "\n", to_markdown(blocks), to_html(blocks, TITLE)), strict=True):
        (folder / name).write_text(content, encoding="utf-8")


def _counts(rows: Sequence[Statement]) -> dict[str, dict[Verdict, int]]:
    """Number of statements with each verdict, from the model and from the rig; both sum to all of them."""
    return {
        _MODEL: Counter(row.verdict for row in rows),
        _RIG: Counter(row.rig_verdict for row in rows),
    }


#: Verdicts on statements that count for or against the paper.
_DECIDING = (Verdict.AGREES, Verdict.IN_PART, Verdict.UNDECIDED, Verdict.DIFFERS)


def _in_short(rows: Sequence[Statement]) -> tuple[tuple[str, str], ...]:
    """Three lines: the model, why it differs, the rig."""
    model, rig = _counts(rows).values()
    lines = []
    if any(model[verdict] for verdict in _DECIDING):
        text = f"{_spread(model)}. Its parameters are those of Table 1, none tuned."
        pairs = [(row.exact_beside, row.smoothed_beside) for row in rows]
        both = [judge(a.printed, a, a.resolution) is judge(b.printed, b, b.resolution) for a, b in pairs if a and b]
        if both:
            text += f" The paper's smoothed switch: the same verdict on {sum(both)} of {len(both)} printed numbers."
        lines.append(("The model", text))
    different = [row for row in rows if row.verdict is Verdict.DIFFERS]
    if different:
        words = []
        for cause in Cause:
            mine = [row for row in different if row.reason is cause]
            if mine:
                names = ", ".join(dict.fromkeys(row.id for row in mine))
                words.append(f"{len(mine)} {_CAUSES[cause]} ({names})")
        lines.append(("Where it differs", f"Of {len(different)} statements: {'; '.join(words)}."))
    if any(rig[verdict] for verdict in (*_DECIDING, Verdict.INPUT)):
        text = f"{_spread(rig)}. " if any(rig[verdict] for verdict in _DECIDING) else ""
        if rig[Verdict.INPUT]:
            text += f"{rig[Verdict.INPUT]} values that were put in came back, which is no evidence on the paper."
        lines.append(("The virtual rig", f"Synthetic: a computed apparatus with more physics than the model. {text}"))
    return tuple(lines)


#: The causes in a sentence.
_CAUSES = {
    Cause.MISPRINT: "misprinted",
    Cause.TABLE_1: "because Table 1 contradicts itself (omega_0 = 4.60 rad/s; its k and m give 4.50)",
    Cause.REAL: "real, neither misprinted nor due to Table 1",
    Cause.RIG: "by the virtual rig",
}


def _spread(counts: Mapping[Verdict, int]) -> str:
    """``27 of the 34 statements that it can decide agree, 2 in part, 1 undecided, 4 differ``."""
    n = {verdict: counts.get(verdict, 0) for verdict in _DECIDING}
    text = f"{n[Verdict.AGREES] or 'None'} of the {sum(n.values())} statements that it can decide agree"
    text += f", {n[Verdict.IN_PART]} in part" if n[Verdict.IN_PART] else ""
    text += f", {n[Verdict.UNDECIDED]} undecided" if n[Verdict.UNDECIDED] else ""
    return text + f", {n[Verdict.DIFFERS] or 'none'} {'differs' if n[Verdict.DIFFERS] == 1 else 'differ'}"


def _numbers(rows: Sequence[Statement]) -> list[Written]:
    """The picture of all printed numbers that something was found for."""
    shown = []
    for row in rows:
        mine = (row.exact_beside, row.smoothed_beside, None if row.rig_verdict is Verdict.INPUT else row.rig_beside)
        if any(one is not None for one in mine):
            shown.append((f"{row.id}: {row.says}", mine))
    if not shown:
        return []
    caption = (
        "All printed numbers: what the exact flow, the paper's smoothed switch and the virtual rig (synthetic) give, "
        "in percent of the printed number. Bars: expanded uncertainty. Grey: the tolerance of the rule. Inputs that "
        "came back are left out."
    )
    sides = ("exact flow", "smoothed switch", "virtual rig")
    return [heading("Printed numbers"), comparison(sides, shown, CLOSE, caption)]


def _differences(rows: Sequence[Statement]) -> list[Written]:
    """The statements that differ, each with its cause."""
    cells, notes = [], []
    for row in sorted((row for row in rows if row.differs), key=lambda row: list(Cause).index(row.reason or Cause.RIG)):
        by = [word for word, verdict in ((_MODEL, row.verdict), ("rig", row.rig_verdict)) if verdict is Verdict.DIFFERS]
        found = row.exact if row.verdict is Verdict.DIFFERS else row.rig
        off = row.difference if row.verdict is Verdict.DIFFERS and row.exact_beside is None else ""
        off = str(row.exact_beside) if row.verdict is Verdict.DIFFERS and row.exact_beside is not None else off
        cells.append((row.id, row.says, found, off, " and ".join(by), str(row.reason)))
        notes.append(row.why)
    if not cells:
        return []
    header = ("claim", "the paper says", "found", "difference", "by", "cause")
    return [heading("Differences and their cause"), table(header, cells, notes)]


def _table(rows: Sequence[Statement]) -> Written:
    """The long table: a row per statement, its reasons below."""
    header = (
        "claim",
        "the paper says",
        "exact flow",
        "smoothed switch",
        "difference",
        "verdict, model",
        "virtual rig (synthetic)",
        "verdict, rig",
    )
    cells = [
        (
            row.id,
            f"{row.says} ({row.place})",
            row.exact,
            row.smoothed,
            row.difference,
            str(row.verdict),
            row.rig,
            str(row.rig_verdict),
        )
        for row in rows
    ]
    return table(header, cells, [row.why for row in rows])


def _parameters(data: Data) -> Written:
    """Paper, identified with its 95 % interval, truth of the rig."""
    rows = []
    for name, (printed, number, truth) in table_rows(data["table1"]).items():
        off = 100 * (number.value / truth - 1)
        low, high = number.interval()
        inside = "in it" if low <= truth <= high else "outside"
        interval = f"{low:.6g} ... {high:.6g}"
        rows.append(
            (
                name,
                NAMES[name][0],
                printed or "not printed",
                f"{number.value:.6g} ± {number.uncertainty:.2g}",
                interval,
                f"{truth:.6g}",
                inside,
                f"{off:+.3f} %",
            )
        )
    header = (
        "parameter",
        "unit",
        "paper",
        "identified ± standard uncertainty (synthetic)",
        "95 % interval",
        "truth of the rig",
        "truth is",
        "identified from truth",
    )
    return table(header, rows)


def _about_points(points: Sequence[SpecialPoint]) -> str:
    text = (
        "Every flip, fold and grazing point of the periodic orbits of Figs. 9, 10, 11, 13 and 17 (exact flow), along "
        "the branches, which are continued from the periodic motions of sweeps and switched at flips. The largest "
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


_ABOUT_THE_MODEL = (
    "Every statement is measured on the paper's own model with the parameters of its Table 1: by the exact flow, and "
    f"by the paper's smoothed switch with eta = {ETA:g} m, integrated by Runge-Kutta-Fehlberg at rtol = "
    f"{SMOOTHED.options['rtol']:g}. Written by nonsmooth {__version__}; all numbers are read off the datasets beside "
    "this file."
)
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
