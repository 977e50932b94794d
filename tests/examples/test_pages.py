"""The code in the pages of the documentation runs, and prints what the page says it prints.

The README is typed by ``test_newcomer``, and one tutorial runs as a notebook in ``test_notebooks``."""

from __future__ import annotations

import doctest
import os
from itertools import islice
from pathlib import Path

import pytest
from page_code import blocks, run_page

ROOT = Path(__file__).parents[2]
PAGES = sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts)
# The first two need files of the reader's own; the third is run as a notebook.
ELSEWHERE = {"recordings", "your_rig", "from_a_paper"}
PAGES = [page for page in PAGES if page.stem not in ELSEWHERE and blocks(page.read_text(encoding="utf-8"))]
LONGEST = 60  # lines of an output: in a notebook the next cell stays in sight
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
#: What a page of more than five seconds does in place of its own; what that block prints is compared where it does all.
SHORTER = {
    "a_bench": ("draws=60", "draws=12"),
    "control_based_continuation": ("step=0.3, points=60", "step=0.3, points=3"),
    "sketches_and_animations": ("seconds=5, rate=12", "seconds=0.5, rate=12"),
    "smoothing": ("np.geomspace(1e-4, 1e-1, 7)", "np.geomspace(1e-4, 1e-1, 3)"),
    "uncertainty": ("draws=60", "draws=12"),
}
LONG = [page for page in PAGES if page.stem in SHORTER]


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).with_suffix("").as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_code_of_page(page: Path, tmp_path: Path) -> None:
    if 'os.environ["NONSMOOTH_DATA"]' in page.read_text(encoding="utf-8") and not os.environ.get("NONSMOOTH_DATA"):
        pytest.skip("NONSMOOTH_DATA names no folder with measurements of other laboratories")
    judge(page, tmp_path, SHORTER.get(page.stem))


@pytest.mark.slow
@pytest.mark.parametrize("page", LONG, ids=name_of)
def test_whole_code_of_page(page: Path, tmp_path: Path) -> None:
    judge(page, tmp_path)


def test_first_file_of_the_page_on_recordings(tmp_path: Path) -> None:
    judge(ROOT / "docs" / "guides" / "recordings.md", tmp_path, blocks=2)


def judge(page: Path, folder: Path, shorter: tuple[str, str] | None = None, blocks: int | None = None) -> None:
    import matplotlib.pyplot as plt

    checker = doctest.OutputChecker()
    for printed, shown, expected, line in islice(run_page(page, folder, shorter), blocks):
        assert printed.count("\n") + shown.count("\n") < LONGEST, f"{page.name}, block at line {line}: a long output"
        if expected is not None:
            assert checker.check_output(expected, printed, FLAGS), (
                f"{page.name}, block at line {line}, prints\n{printed}\nand not\n{expected}"
            )
    plt.close("all")


def test_every_public_name_stands_in_the_reference() -> None:
    import nonsmooth

    reference = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "api").glob("*.md"))
    missing = [name for name in nonsmooth.__all__ if f"nonsmooth.{name}\n" not in reference]
    by_automodule = {"DataFileError", "Interrupted", "SolveError", "SystemDefinitionError"}
    covered = by_automodule | {"models", "plot", "__version__"}
    assert not set(missing) - covered
