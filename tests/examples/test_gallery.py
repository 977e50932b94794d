"""Every example has a page in the gallery with its picture, what it teaches and its code, and a card leads to it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GALLERY = ROOT / "docs" / "gallery"
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.py"))


def test_the_gallery_shows_all_examples_and_nothing_else() -> None:
    assert sorted(page.stem for page in GALLERY.glob("*.md") if page.stem != "index") == EXAMPLES


@pytest.mark.parametrize("name", EXAMPLES)
def test_picture_then_lesson_then_code(name: str) -> None:
    page = (GALLERY / f"{name}.md").read_text(encoding="utf-8")
    order = [
        page.index(part)
        for part in (f"](../pictures/{name}.png)", "## You learn", "## Checked", f"../../examples/{name}.py")
    ]
    assert order == sorted(order)
    for folder in ("pictures", "pictures/small"):
        assert (ROOT / "docs" / folder / f"{name}.png").is_file()
    index = (GALLERY / "index.md").read_text(encoding="utf-8")
    assert re.search(rf":img-top: \.\./pictures/small/{name}\.png\n:img-alt: .+\n:link: {name}\n", index)
    assert re.search(rf"^{name}$", index, flags=re.M)  # in its table of contents
