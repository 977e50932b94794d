"""Short text and HTML of the package's objects, for a terminal and for a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

LINES = 24  # of a representation
WIDTH = 100  # of a line that can be broken; one that cannot is cut at twice that

_LEFT = 'style="text-align: left; vertical-align: top; padding-right: 1em"'


def cut(text: str, most: int = 2 * WIDTH) -> str:
    """Return the text, its end left out where it is longer than ``most``."""
    return text if len(text) <= most else f"{text[: most - 4].rstrip()} ..."


def text_table(title: str, rows: Sequence[tuple[str, str]], *, whole: bool = True, more: str = "print() shows") -> str:
    """Return a title and indented rows (heading, text), broken after commas.

    Parameters
    ----------
    whole : bool
        All of it; else lines that are too many or too long are left out, and ``more`` says where they are.
    """
    width = max((len(head) for head, _ in rows), default=0)
    lines = []
    for head, text in rows:
        for part in _broken(text if whole else cut(text), WIDTH - width - 4):
            lines.append(f"  {head:<{width}}  {part}".rstrip())
            head = ""
    if not whole and len(lines) > LINES:
        lines[LINES - 1 :] = [f"  ... {more} {len(lines) - LINES + 1} more lines"]
    return "\n".join([title, *lines])


def html_table(
    title: str, rows: Sequence[Sequence[str]], *, header: Sequence[str] = (), details: Sequence[str] = (), of: str = ""
) -> str:
    """Return a title and a table as HTML; ``details`` (so many ``of``) are folded up below it."""
    shown, left = rows[:LINES], len(rows) - LINES
    body = "".join(
        f"<tr><th {_LEFT}>{escape(row[0])}</th>"
        + "".join(f"<td {_LEFT}>{escape(cut(cell))}</td>" for cell in row[1:])
        + "</tr>"
        for row in shown
    )
    head = "".join(f"<th {_LEFT}>{escape(name)}</th>" for name in header)
    text = f"<div><strong>{escape(title)}</strong><table>"
    text += (f"<thead><tr>{head}</tr></thead>" if head else "") + f"<tbody>{body}</tbody></table>"
    if left > 0:
        text += f"<p>... and {left} more</p>"
    if details:
        items = "".join(f"<li>{escape(cut(item))}</li>" for item in details[:LINES])
        text += f"<details><summary>{len(details)} {escape(of)}</summary><ul>{items}</ul></details>"
    return text + "</div>"


def _broken(text: str, width: int) -> list[str]:
    """The text in lines, each as many of its parts between commas as fit."""
    lines = [""]
    for part in text.split(", "):
        joined = f"{lines[-1]}, {part}" if lines[-1] else part
        if len(joined) <= width or not lines[-1]:
            lines[-1] = joined
        else:
            lines[-1] += ","
            lines.append(part)
    return lines
