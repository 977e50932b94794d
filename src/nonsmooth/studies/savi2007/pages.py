"""The little of a document that the report needs, written as Markdown and as self-contained HTML."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TypeAlias

__all__ = ["Block", "Bullets", "Heading", "Paragraph", "Picture", "Table", "to_html", "to_markdown"]


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
class Bullets:
    """Plain texts, each a point."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Plain cells; ``marked`` are the columns whose verdicts are coloured in HTML."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    marked: tuple[int, ...] = ()


@dataclass(frozen=True)
class Picture:
    """A PNG file beside the report, with the vector file it stands for and its caption."""

    path: Path
    vector: str
    caption: str


Block: TypeAlias = Heading | Paragraph | Bullets | Table | Picture


def to_markdown(blocks: Sequence[Block]) -> str:
    """The document as Markdown with tables; pictures are linked."""
    return "\n\n".join(_markdown(block) for block in blocks) + "\n"


def _markdown(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"{'#' * level} {text}"
        case Paragraph(text):
            return text
        case Bullets(items):
            return "\n".join(f"- {item}" for item in items)
        case Table(header, rows):
            lines = [header, tuple("---" for _ in header), *rows]
            return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
        case Picture(path, vector, caption):
            return f"![{vector}]({path.name})\n\n{caption} ([PDF]({vector}))"


_STYLE = """
body { font: 16px/1.5 Georgia, 'Times New Roman', serif; color: #222; max-width: 76rem; margin: 2rem auto;
  padding: 0 1rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2.2rem; border-bottom: 1px solid #ccc; padding-bottom: .2rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .82rem; line-height: 1.35; }
th, td { border: 1px solid #ccc; padding: .3rem .5rem; text-align: left; vertical-align: top; }
th { background: #f2f2f2; } td.agrees { background: #d9efe0; } td.partly { background: #fbeecb; }
td.differs { background: #f9d9cf; }
figure { margin: 1.5rem 0; } figure img { max-width: 100%; height: auto; }
figcaption { font-size: .9rem; max-width: 60rem; }
"""


def to_html(blocks: Sequence[Block], title: str) -> str:
    """The document as one HTML file: style inline, pictures embedded."""
    body = "\n".join(_html(block) for block in blocks)
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{_STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _html(block: Block) -> str:
    match block:
        case Heading(text, level):
            return f"<h{level}>{escape(text)}</h{level}>"
        case Paragraph(text):
            return f"<p>{escape(text)}</p>"
        case Bullets(items):
            return "<ul>" + "".join(f"<li>{escape(item)}</li>" for item in items) + "</ul>"
        case Table(header, rows, marked):
            head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
            lines = "\n".join(_row(row, marked) for row in rows)
            return f'<div class="wide"><table>\n<tr>{head}</tr>\n{lines}\n</table></div>'
        case Picture(path, vector, caption):
            image = base64.b64encode(path.read_bytes()).decode("ascii")
            return (
                f'<figure id="{escape(path.stem)}"><img alt="{escape(caption)}" src="data:image/png;base64,{image}">'
                f"<figcaption>{escape(caption)} (vector file: {escape(vector)})</figcaption></figure>"
            )


def _row(row: tuple[str, ...], marked: tuple[int, ...]) -> str:
    cells = "".join(
        f"<td{_kind(cell) if i in marked else ''}>{escape(cell)}</td>" for i, cell in enumerate(row)
    )  # fmt: skip
    return f"<tr>{cells}</tr>"


def _kind(verdict: str) -> str:
    """The class of a cell with a verdict; none where nothing was asked."""
    if verdict == "agrees" or verdict.startswith("agrees within"):
        return ' class="agrees"'
    if verdict.startswith("differs"):
        return ' class="differs"'
    return ' class="partly"' if verdict.startswith(("agrees", "adds")) else ""
