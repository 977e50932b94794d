"""The little of a document that the report needs: blocks, each written as Markdown and as self-contained HTML."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from nonsmooth_savi2007.claims.verdicts import Beside, Verdict
from nonsmooth_savi2007.report.style import STYLE


class Written(NamedTuple):
    """A part of the document; of a heading its text and level."""

    markdown: str
    html: str
    text: str = ""
    level: int = 0


def to_markdown(blocks: Sequence[Written]) -> str:
    """The document as Markdown with tables; pictures are linked."""
    return "\n\n".join(block.markdown for block in blocks if block.markdown) + "\n"


def to_html(blocks: Sequence[Written], title: str) -> str:
    """The document as one HTML file: style inline, pictures embedded, no script."""
    body = "\n".join(block.html for block in blocks)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def heading(text: str, level: int = 2) -> Written:
    """A heading of level 1, 2 or 3."""
    return Written(f"{'#' * level} {text}", f'<h{level} id="{_anchor(text)}">{escape(text)}</h{level}>', text, level)


def paragraph(text: str) -> Written:
    """Plain text."""
    return Written(text, f"<p>{escape(text)}</p>")


def notice(text: str) -> Written:
    """A text that must be seen before the rest."""
    return Written(f"**{text}**", f'<p class="notice">{escape(text)}</p>')


def sentences(items: Sequence[tuple[str, str]]) -> Written:
    """A few sentences, each under a word."""
    lines = "".join(f"<dt>{escape(word)}</dt><dd>{escape(text)}</dd>" for word, text in items)
    return Written("\n".join(f"- **{word}.** {text}" for word, text in items), f'<dl class="lines">{lines}</dl>')


def bullets(items: Sequence[str]) -> Written:
    """Plain texts, each a point."""
    points = "".join(f"<li>{escape(item)}</li>" for item in items)
    return Written("\n".join(f"- {item}" for item in items), f"<ul>{points}</ul>")


def image(path: Path, vector: str, caption: str) -> Written:
    """A PNG file beside the report, with the vector file it stands for and its caption."""
    data, words = base64.b64encode(path.read_bytes()).decode("ascii"), escape(caption)
    return Written(
        f"![{vector}]({path.name})\n\n{caption} ([PDF]({vector}))",
        f'<figure id="{escape(path.stem)}"><img alt="{words}" src="data:image/png;base64,{data}">'
        f"<figcaption>{words} (vector file: {escape(vector)})</figcaption></figure>",
    )


def contents(document: Iterable[Written]) -> Written:
    """The list of the headings of level 2, with those of level 3 below; in HTML only."""
    parts: list[tuple[str, list[str]]] = []
    for block in document:
        if block.level == 2:
            parts.append((block.text, []))
        elif block.level == 3 and parts:
            parts[-1][1].append(block.text)
    items = []
    for text, below in parts:
        inner = "".join(f"<li>{_link(one)}</li>" for one in below)
        items.append(f"<li>{_link(text)}{f'<ul>{inner}</ul>' if inner else ''}</li>")
    return Written("", f'<nav aria-label="Contents"><p>Contents</p><ul>{"".join(items)}</ul></nav>')


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _link(text: str) -> str:
    return f'<a href="#{_anchor(text)}">{escape(text)}</a>'


def _kind(text: str) -> str:
    """The class of a cell that is a verdict; none of any other."""
    return f"v-{Verdict(text).name.lower()}" if text in list(Verdict) else ""


def table(header: Sequence[str], rows: Sequence[Sequence[str]], notes: Sequence[str] = ()) -> Written:
    """Plain cells; a cell that is a verdict is coloured in HTML. ``notes``: why, below each row."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    bodies = []
    for row, note in zip(rows, notes or [""] * len(rows), strict=True):
        cells = "".join(
            f'<td class="{_kind(cell)}" data-label="{escape(word)}">{escape(cell)}</td>' if cell else "<td></td>"
            for word, cell in zip(header, row, strict=True)
        )
        below = f'<tr class="note"><td></td><td colspan="{len(row) - 1}">{escape(note)}</td></tr>' if note else ""
        bodies.append(f"<tbody><tr>{cells}</tr>{below}</tbody>")
    if notes:
        header, rows = [*header, "why"], [[*row, text] for row, text in zip(rows, notes, strict=True)]
    lines = [header, ["---"] * len(header), *rows]
    markdown = "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
    body = "\n".join(bodies)
    return Written(markdown, f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n{body}\n</table></div>')


def tally(counts: Mapping[str, Mapping[Verdict, int]]) -> Written:
    """Number of statements with each verdict, by side, and their sum: a table, or a bar for each side."""
    sums = {whose: str(sum(mine.values())) for whose, mine in counts.items()}
    rows = [[str(verdict), *(str(mine.get(verdict, 0)) for mine in counts.values())] for verdict in Verdict]
    bars = ""
    for whose, mine in counts.items():
        parts = "".join(
            f'<span class="{_kind(verdict)}" style="flex-grow:{mine[verdict]}" title="{verdict}">{mine[verdict]}</span>'
            for verdict in Verdict
            if mine.get(verdict)
        )
        bars += f'<div class="who">{escape(whose)}: {sums[whose]} statements</div><div class="bar">{parts}</div>'
    shown = [verdict for verdict in Verdict if any(mine.get(verdict) for mine in counts.values())]
    key = "".join(f'<span class="{_kind(verdict)}">{verdict}</span>' for verdict in shown)
    return Written(
        table(["verdict", *counts], [*rows, ["all statements", *sums.values()]]).markdown,
        f'<div class="tally">{bars}<div></div><div class="chips">{key}</div></div>',
    )


def comparison(
    sides: Sequence[str], rows: Sequence[tuple[str, Sequence[Beside | None]]], tolerance: float, caption: str
) -> Written:
    """Printed numbers beside numbers found, in percent of the printed: a row has a label and numbers by side.

    Drawn as a line per printed number: zero in its middle, a mark per side with its expanded uncertainty.
    """
    cells = [[label, *("" if one is None else str(one) for one in found)] for label, found in rows]
    found = [one for _, row in rows for one in row if one is not None]
    reach = max([abs(one.percent) + min(one.expanded_percent, 3.0) for one in found] + [1.5 * tolerance])
    span = min(next(n for n in (4, 6, 8, 10, 12, 16, 20) if n >= min(reach, 20)), 20)

    def at(percent: float) -> float:
        return 50 + 50 * max(-1.0, min(1.0, percent / span))

    lines = []
    for label, row in rows:
        marks = []
        for side, one in enumerate(row):
            if one is None:
                continue
            low, high = (at(one.percent + sign * one.expanded_percent) for sign in (-1, 1))
            marks.append(
                f'<i class="u s{side}" style="left:{low:.2f}%;width:{high - low:.2f}%"></i>'
                f'<i class="m s{side}" style="left:{at(one.percent):.2f}%" title="{escape(str(one))}"></i>'
            )
        known = [one for one in row if one is not None]
        band = max(tolerance, 100 * known[0].resolution / abs(known[0].printed)) if known else tolerance
        zone = f'<i class="zone" style="left:{at(-band):.2f}%;width:{at(band) - at(-band):.2f}%"></i>'
        words = "".join(
            f'<span class="s{side}">{"" if one is None else f"{one.percent:+.1f} %"}</span>'
            for side, one in enumerate(row)
        )
        lines.append(
            f'<div class="label">{escape(label)}</div><div class="values">{words}</div>'
            f'<div class="axis">{zone}<i class="zero"></i>{"".join(marks)}</div>'
        )
    ticks = "".join(
        f'<span style="left:{at(p):.1f}%">{p:+g}{" %" if p == span else ""}</span>'.replace("+0", "0")
        for p in (-span, -span / 2, 0, span / 2, span)
    )
    key = "".join(f'<span><i class="m s{i}"></i>{escape(side)}</span>' for i, side in enumerate(sides))
    lines.append(f'<div class="axis ticks">{ticks}</div>')
    return Written(
        f"{table(['printed', *sides], cells).markdown}\n\n{caption}",
        f'<figure class="comparison"><div class="key">{key}<span><i class="zone"></i>tolerance</span></div>'
        f'<div class="grid">{"".join(lines)}</div><figcaption>{escape(caption)}</figcaption></figure>',
    )
