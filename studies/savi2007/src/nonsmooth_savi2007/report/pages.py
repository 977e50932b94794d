"""The little of a document that the report needs: blocks, written as Markdown and as self-contained HTML; its style."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import NamedTuple

from nonsmooth_savi2007.claims.verdicts import Beside, Verdict


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


#: Verdicts are told by words; the colours (after Okabe and Ito) help the eye.
STYLE = """
:root { color-scheme: light dark; --paper: #fff; --ink: #1c1f23; --muted: #59616b; --line: #d4d9df; --soft: #f4f6f8;
  --link: #0a5a94; --model: #0072b2; --other: #56b4e9; --rig: #d55e00; --zone: #dfe5ea; --notice: #fff3d1;
  --agrees: #cfeadd; --part: #fdeab5; --undecided: #dfe3e8; --differs: #f9cfbd; --input: #e4dcf3; --adds: #d3e9f8; }
@media screen and (prefers-color-scheme: dark) { :root { --paper: #14171a; --ink: #e6e9ec; --muted: #a3acb6;
  --line: #3a424b; --soft: #1d2227; --link: #7cc0f0; --model: #56b4e9; --other: #a9d9f5; --rig: #ff9a52;
  --zone: #2c343c; --notice: #4a3b10; --agrees: #1d4f3b; --part: #594609; --undecided: #3a424b; --differs: #6d2d16;
  --input: #42366a; --adds: #1b4763; } }
* { box-sizing: border-box; }
body { font: 1rem/1.5 system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif; color: var(--ink);
  background: var(--paper); max-width: 72rem; margin: 0 auto; padding: 1.2rem 1rem 4rem; overflow-wrap: break-word; }
h1, h2, h3 { line-height: 1.2; text-wrap: balance; } h1 { font-size: 1.7rem; margin: .4rem 0 .6rem; }
h2 { font-size: 1.3rem; margin: 2.4rem 0 .8rem; padding-bottom: .25rem; border-bottom: 2px solid var(--line); }
h3 { font-size: 1.05rem; margin: 1.6rem 0 .5rem; } p, li, figcaption, dd { max-width: 62rem; }
a { color: var(--link); } p { margin: .6rem 0; }
.notice { background: var(--notice); padding: .5rem .8rem; border-radius: .3rem; }
.lines { display: grid; grid-template-columns: 9rem 1fr; gap: .5rem 1rem; margin: 1rem 0; font-size: 1.06rem; }
.lines dt { font-weight: 700; } .lines dd { margin: 0; }
.tally { display: grid; grid-template-columns: max-content 1fr; gap: .3rem 1rem; align-items: center;
  margin: 1rem 0 .4rem; }
.bar { display: flex; gap: 2px; } .bar span { min-width: 1.5rem; text-align: center; padding: .15rem 0;
  font-weight: 600; } .who { font-size: .9rem; } .chips { display: flex; flex-wrap: wrap; gap: .3rem; }
.chips span { font-size: .82rem; padding: .05rem .5rem; border-radius: .2rem; }
figure { margin: 1.2rem 0; } figure img { max-width: 100%; height: auto; background: #fff; border-radius: .2rem; }
figcaption { font-size: .88rem; color: var(--muted); }
.comparison .grid { display: grid; grid-template-columns: minmax(10rem, 19rem) 1fr auto; gap: 0 .8rem;
  align-items: center; grid-auto-flow: row dense; } .comparison .label { grid-column: 1; }
.comparison .axis { grid-column: 2; } .comparison .values { grid-column: 3; }
.comparison .label, .comparison .values { font-size: .88rem; padding: .15rem 0; }
.comparison .values { font-variant-numeric: tabular-nums; white-space: nowrap; display: flex; }
.values span { width: 3.7rem; text-align: right; } .values .s0 { color: var(--model); } .values .s1 {
  color: var(--muted); } .values .s2 { color: var(--rig); }
.axis { position: relative; height: 1.7rem; } .axis i { position: absolute; display: block; }
.zone { top: 0; bottom: 0; background: var(--zone); } .zero { left: 50%; top: 0; bottom: 0; width: 1px;
  background: var(--muted); }
.m { width: .7rem; height: .7rem; top: 50%; transform: translate(-50%, -50%); } .m.s0 { background: var(--model);
  border-radius: 50%; } .m.s1 { border: 2px solid var(--other); border-radius: 50%; width: .95rem; height: .95rem; }
.m.s2 { background: var(--rig); transform: translate(-50%, -50%) rotate(45deg); width: .6rem; height: .6rem; }
.u { height: 2px; top: calc(50% - 1px); } .u.s0 { background: var(--model); } .u.s1 { background: var(--other); }
.u.s2 { background: var(--rig); }
.ticks span { position: absolute; transform: translateX(-50%); font-size: .78rem; color: var(--muted);
  white-space: nowrap; } .ticks span:first-child { transform: none; } .ticks span:last-child {
  transform: translateX(-100%); }
.key { display: flex; flex-wrap: wrap; gap: .2rem 1.4rem; font-size: .88rem; margin-bottom: .4rem; }
.key span { display: inline-flex; align-items: center; gap: .5rem; } .key i { position: static; transform: none;
  display: inline-block; } .key .m.s2 { transform: rotate(45deg); } .key .zone { width: 1.4rem; height: .9rem; }
nav { background: var(--soft); border-radius: .3rem; padding: .6rem 1rem; margin: 1.6rem 0; font-size: .92rem; }
nav p { margin: 0; font-weight: 700; } nav ul { margin: .2rem 0; padding-left: 1.1rem; } nav > ul { padding-left: 0;
  list-style: none; } nav ul ul { columns: 21rem; column-gap: 2rem; font-size: .92em; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .86rem; line-height: 1.35; width: 100%; }
th, td { padding: .32rem .5rem; text-align: left; vertical-align: top; } th { background: var(--soft);
  border-bottom: 2px solid var(--line); } tbody { border-bottom: 1px solid var(--line); break-inside: avoid; }
.note td { color: var(--muted); padding-top: 0; font-size: .95em; }
.v-agrees { background: var(--agrees); } .v-in_part { background: var(--part); } .v-undecided {
  background: var(--undecided); } .v-differs { background: var(--differs); } .v-input { background: var(--input); }
.v-adds { background: var(--adds); } .v-not_asked { color: var(--muted); } .bar .v-not_asked, .chips .v-not_asked {
  background: var(--soft); }
@media screen and (max-width: 52rem) {
  .lines { grid-template-columns: 1fr; gap: .1rem; font-size: 1rem; } .lines dd { margin-bottom: .6rem; }
  .tally { grid-template-columns: 1fr; gap: .1rem; } .bar span { min-width: 1.1rem; font-size: .85rem; }
  .values .s1 { display: none; } .comparison .grid { grid-template-columns: 1fr auto; }
  .comparison .values { grid-column: 2; }
  .comparison .axis { grid-column: 1 / -1; height: 1.2rem; margin-bottom: .35rem; }
  table thead { display: none; } table, table tbody, table tr,
  table td { display: block; } table tbody { padding: .5rem 0; }
  table td { padding: .15rem .4rem; } table td:empty { display: none; }
  table td[data-label]::before { content: attr(data-label) ": "; color: var(--muted); }
  td:first-child { font-weight: 700; } nav ul ul { columns: 1; } h1 { font-size: 1.4rem; }
}
@media print { html { font-size: 9.5pt; } body { max-width: none; padding: 0; } h2 { break-after: avoid; } figure {
  break-inside: avoid; } nav { display: none; } a { color: inherit; text-decoration: none; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""
