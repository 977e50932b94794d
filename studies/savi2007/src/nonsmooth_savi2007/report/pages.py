"""The little of a document that the report needs, written as Markdown and as self-contained HTML."""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TypeAlias

from nonsmooth_savi2007.claims.verdicts import Beside, Verdict
from nonsmooth_savi2007.report.style import STYLE


@dataclass(frozen=True)
class Heading:
    """A heading of level 1, 2 or 3."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Paragraph:
    """Plain text."""

    text: str


@dataclass(frozen=True)
class Notice:
    """A text that must be seen before the rest."""

    text: str


@dataclass(frozen=True)
class Lines:
    """A few sentences, each under a word."""

    items: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Bullets:
    """Plain texts, each a point."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Contents:
    """The list of the headings of level 2, with those of level 3 below."""


@dataclass(frozen=True)
class Tally:
    """Number of statements with each verdict, by side."""

    counts: Mapping[str, Mapping[Verdict, int]]


@dataclass(frozen=True)
class Comparison:
    """Printed numbers beside numbers found, in percent of the printed: a row has a label and numbers by side."""

    sides: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Beside | None, ...]], ...]
    tolerance: float
    caption: str


@dataclass(frozen=True)
class Table:
    """Plain cells; a cell that is a verdict is coloured in HTML. ``notes``: a text below each row, under a header."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    note: str = "why"


@dataclass(frozen=True)
class Image:
    """A PNG file beside the report, with the vector file it stands for and its caption."""

    path: Path
    vector: str
    caption: str


Block: TypeAlias = Heading | Paragraph | Notice | Lines | Bullets | Contents | Tally | Comparison | Table | Image


def to_markdown(blocks: Sequence[Block]) -> str:
    """The document as Markdown with tables; pictures are linked."""
    return "\n\n".join(_markdown(block) for block in blocks if not isinstance(block, Contents)) + "\n"


def _markdown(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {text}"
        case Paragraph(text):
            return text
        case Notice(text):
            return f"**{text}**"
        case Lines(items):
            return "\n".join(f"- **{word}.** {text}" for word, text in items)
        case Bullets(items):
            return "\n".join(f"- {item}" for item in items)
        case Tally():
            return _markdown(_tally_table(block))
        case Comparison(sides, rows, _, caption):
            cells = [(label, *("" if one is None else str(one) for one in found)) for label, found in rows]
            return f"{_markdown(Table(('printed', *sides), tuple(cells)))}\n\n{caption}"
        case Table(header, rows, notes, note):
            if notes:
                header, rows = (*header, note), tuple((*row, text) for row, text in zip(rows, notes, strict=True))
            lines = [header, tuple("---" for _ in header), *rows]
            return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
        case Image(path, vector, caption):
            return f"![{vector}]({path.name})\n\n{caption} ([PDF]({vector}))"
    return ""


def to_html(blocks: Sequence[Block], title: str) -> str:
    """The document as one HTML file: style inline, pictures embedded, no script."""
    body = "\n".join(_html(block, blocks) for block in blocks)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _html(block: Block, document: Sequence[Block]) -> str:
    match block:
        case Heading(text, level):
            return f'<h{level} id="{_anchor(text)}">{escape(text)}</h{level}>'
        case Paragraph(text):
            return f"<p>{escape(text)}</p>"
        case Notice(text):
            return f'<p class="notice">{escape(text)}</p>'
        case Lines(items):
            lines = "".join(f"<dt>{escape(word)}</dt><dd>{escape(text)}</dd>" for word, text in items)
            return f'<dl class="lines">{lines}</dl>'
        case Bullets(items):
            return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"
        case Contents():
            return _contents(document)
        case Tally():
            return _tally(block)
        case Comparison():
            return _comparison(block)
        case Table():
            return _table(block)
        case Image(path, vector, caption):
            image = base64.b64encode(path.read_bytes()).decode("ascii")
            return (
                f'<figure id="{escape(path.stem)}"><img alt="{escape(caption)}" src="data:image/png;base64,{image}">'
                f"<figcaption>{escape(caption)} (vector file: {escape(vector)})</figcaption></figure>"
            )
    return ""


def _anchor(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")


def _contents(document: Sequence[Block]) -> str:
    parts: list[tuple[str, list[str]]] = []
    for block in document:
        if isinstance(block, Heading) and block.level == 2:
            parts.append((block.text, []))
        elif isinstance(block, Heading) and block.level == 3 and parts:
            parts[-1][1].append(block.text)
    items = []
    for text, below in parts:
        inner = "".join(f"<li>{_link(one)}</li>" for one in below)
        items.append(f"<li>{_link(text)}{f'<ul>{inner}</ul>' if inner else ''}</li>")
    return f'<nav aria-label="Contents"><p>Contents</p><ul>{"".join(items)}</ul></nav>'


def _link(text: str) -> str:
    return f'<a href="#{_anchor(text)}">{escape(text)}</a>'


def _tally_table(tally: Tally) -> Table:
    """The numbers of each verdict, with their sums."""
    rows = [(str(verdict), *(str(counts.get(verdict, 0)) for counts in tally.counts.values())) for verdict in Verdict]
    sums = tuple(str(sum(counts.values())) for counts in tally.counts.values())
    return Table(("verdict", *tally.counts), (*rows, ("all statements", *sums)))


def _tally(tally: Tally) -> str:
    """A bar for each side, with its sum, and what the colours are."""
    bars = []
    for whose, counts in tally.counts.items():
        parts = "".join(
            f'<span class="{_kind(verdict)}" style="flex-grow:{counts[verdict]}" title="{verdict}">{counts[verdict]}'
            "</span>"
            for verdict in Verdict
            if counts.get(verdict)
        )
        who = f"{escape(whose)}: {sum(counts.values())} statements"
        bars.append(f'<div class="who">{who}</div><div class="bar">{parts}</div>')
    shown = [verdict for verdict in Verdict if any(counts.get(verdict) for counts in tally.counts.values())]
    key = "".join(f'<span class="{_kind(verdict)}">{verdict}</span>' for verdict in shown)
    return f'<div class="tally">{"".join(bars)}<div></div><div class="chips">{key}</div></div>'


def _kind(text: str) -> str:
    """The class of a cell that is a verdict; none of any other."""
    return f"v-{Verdict(text).name.lower()}" if text in list(Verdict) else ""


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    lines = []
    for i, row in enumerate(table.rows):
        cells = "".join(
            f'<td class="{_kind(cell)}" data-label="{escape(word)}">{escape(cell)}</td>' if cell else "<td></td>"
            for word, cell in zip(table.header, row, strict=True)
        )
        note = table.notes[i] if table.notes else ""
        below = f'<tr class="note"><td></td><td colspan="{len(row) - 1}">{escape(note)}</td></tr>' if note else ""
        lines.append(f"<tbody><tr>{cells}</tr>{below}</tbody>")
    body = "\n".join(lines)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n{body}\n</table></div>'


def _comparison(drawn: Comparison) -> str:
    """A line per printed number: zero in its middle, a mark per side with its expanded uncertainty."""
    found = [one for _, row in drawn.rows for one in row if one is not None]
    reach = max([abs(one.percent) + min(one.expanded_percent, 3.0) for one in found] + [1.5 * drawn.tolerance])
    span = min(next(n for n in (4, 6, 8, 10, 12, 16, 20) if n >= min(reach, 20)), 20)

    def at(percent: float) -> float:
        return 50 + 50 * max(-1.0, min(1.0, percent / span))

    lines = []
    for label, row in drawn.rows:
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
        band = max(drawn.tolerance, 100 * known[0].resolution / abs(known[0].printed)) if known else drawn.tolerance
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
    key = "".join(f'<span><i class="m s{i}"></i>{escape(side)}</span>' for i, side in enumerate(drawn.sides))
    lines.append(f'<div class="axis ticks">{ticks}</div>')
    return (
        f'<figure class="comparison"><div class="key">{key}<span><i class="zone"></i>tolerance</span></div>'
        f'<div class="grid">{"".join(lines)}</div><figcaption>{escape(drawn.caption)}</figcaption></figure>'
    )
