"""Write the tutorials as notebooks, beside their pages: ``python docs/make_notebooks.py``.

A page is the source; its notebook has the same text and code, without outputs. Answers to exercises are folded up, and
printed output and pictures are left out where the code above makes them.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

TUTORIALS = Path(__file__).resolve().parent / "tutorials"
NAMES = ("first_diagram", "impact_oscillator", "friction_oscillator", "from_a_paper")
PAGES = [TUTORIALS / f"{name}.md" for name in NAMES]
_PARTS = re.compile(
    r"^```python\n(?P<code>.*?)^```\n"
    r"(?:\n*^```(?:text|\{code-block\} text)\n.*?^```\n)?"  # what it prints
    r"(?:\n*^!\[[^\]]*\]\([^)]*\)\n)?"  # what it draws
    r"|^:::\{dropdown\} (?P<title>[^\n]*)\n|^(?P<end>:::)\n",
    re.MULTILINE | re.DOTALL,
)
_ITSELF = re.compile(r"^.*\]\(\w+\.ipynb\).*\n", re.MULTILINE)


def notebook(page: Path) -> dict[str, Any]:
    """The notebook of a page."""
    text = _ITSELF.sub("", page.read_text(encoding="utf-8"))
    cells: list[dict[str, Any]] = []
    folded = False

    def add(kind: str, source: str) -> None:
        if source.strip():
            cell = {"cell_type": kind, "id": f"cell-{len(cells)}", "metadata": {}, "source": _lines(source.strip())}
            if kind == "code":
                cell |= {"execution_count": None, "outputs": []}
                if folded:
                    cell["metadata"] = {"jupyter": {"source_hidden": True}, "tags": ["answer"]}
            cells.append(cell)

    done = 0
    for part in _PARTS.finditer(text):
        add("markdown", text[done : part.start()])
        done = part.end()
        if part["title"]:
            folded = True
            add("markdown", f"**{part['title']}** (run the cell, or open it by a click on the three dots)")
        elif part["end"]:
            folded = False
        else:
            add("code", part["code"])
    add("markdown", text[done:])
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": cells,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": 4,
        "nbformat_minor": 5,
    }


def _lines(source: str) -> list[str]:
    return source.splitlines(keepends=True)


def written(page: Path) -> str:
    """The file of a page's notebook."""
    return json.dumps(notebook(page), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    for page in PAGES:
        page.with_suffix(".ipynb").write_text(written(page), encoding="utf-8")
        print(page.with_suffix(".ipynb").name)
