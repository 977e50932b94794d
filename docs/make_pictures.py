"""Draw the pictures of the documentation: one per example, and some from a page's own code.

Run it from anywhere: ``python docs/make_pictures.py``, with names of pictures for some of them only. It takes some ten
seconds (longer the first time) and writes ``docs/pictures/*.png``, which are kept with the source so that the pages can
be built without computing anything. Examples of measured data need the environment variable NONSMOOTH_DATA; without it
their pictures stay as they are.
"""

from __future__ import annotations

import contextlib
import os
import re
import runpy
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib as mpl

from nonsmooth import plot

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
DPI = 170


def keep(drawn: Any, name: str) -> None:
    """Save a figure (or the figure of some axes) as docs/pictures/NAME.png, without date or program in it."""
    figure = getattr(drawn, "figure", drawn)
    with plot.journal():
        figure.savefig(PICTURES / f"{name}.png", dpi=DPI, metadata={"Software": None})
    print(f"{name}.png: {(PICTURES / f'{name}.png').stat().st_size // 1024} kB")


def first_code(page: Path) -> str:
    """The first block of Python of a page."""
    found = re.search(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert found is not None, f"{page} has no block of Python"
    return found[1]


def main(wanted: list[str]) -> None:
    """The pictures named, or all."""
    mpl.use("Agg")
    PICTURES.mkdir(exist_ok=True)
    for page in ("start", "guides/signals"):
        stem = Path(page).name
        if wanted and stem not in wanted:
            continue
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            names: dict[str, Any] = {}
            exec(first_code(DOCS / f"{page}.md"), names)
            keep(names["ax"], stem)
    for path in sorted((DOCS.parent / "examples").glob("*.py")):
        if wanted and path.stem not in wanted:
            continue
        example = runpy.run_path(str(path))
        needs = example.get("NEEDS", "")
        if needs and not (Path(os.environ.get("NONSMOOTH_DATA", "")) / needs).is_file():
            print(f"{path.stem}.png: left as it is; NONSMOOTH_DATA names no folder with {needs}")
            continue
        keep(example["main"](), path.stem)
    total = sum(os.path.getsize(file) for file in PICTURES.glob("*.png"))
    print(f"together {total // 1024} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
