"""Links, pictures and tables of contents of the pages lead to files that are there, without Sphinx."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "_build" not in page.parts)
INCLUDED = {DOCS / "theory" / "measured_methods.md"}  # by a page


def contents(page: Path) -> list[Path]:
    """The pages in the tables of contents of a page."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    lines = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [(page.parent / f"{line}.md").resolve() for line in lines]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(DOCS).as_posix())
def test_what_a_page_leads_to_is_there(page: Path) -> None:
    text = re.sub(r"^```(?!\{).*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    links += re.findall(r"^:img-top: (\S+)$", text, flags=re.M)
    links += [f"{link}.md" for link in re.findall(r"^:link: (\S+)$", text, flags=re.M)]
    missing = [link for link in links if link and not (page.parent / link).is_file()]
    assert not missing
    assert all(target.is_file() for target in contents(page))


def test_every_page_stands_in_one_table_of_contents() -> None:
    listed = [target for page in PAGES for target in contents(page)]
    assert sorted(listed) == sorted(page for page in PAGES if page != DOCS / "index.md" and page not in INCLUDED)


def test_every_picture_is_shown() -> None:
    shown = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert not [file.name for file in (DOCS / "pictures").glob("*.png") if f"pictures/{file.name}" not in shown]


def test_every_name_of_the_reference_is_there() -> None:
    import pkgutil

    reference = "\n".join(page.read_text(encoding="utf-8") for page in (DOCS / "api").glob("*.md"))
    names = re.findall(r"^\.\. auto(?:function|class|module):: (\S+)$", reference, flags=re.M)
    assert len(names) > 50
    for name in names:
        pkgutil.resolve_name(name)  # raises where it is not there
