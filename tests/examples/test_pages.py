"""The code in the pages of the documentation runs, and prints what the page says it prints.

The README is typed by ``test_newcomer``, and one tutorial runs as a notebook in ``test_notebooks``."""

from __future__ import annotations

import doctest
import os
from itertools import islice
from pathlib import Path

import pytest
from page_code import Shorter, blocks, run_page

ROOT = Path(__file__).parents[2]
PAGES = sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts)
# The first two need files of the reader's own; the third is run as a notebook.
ELSEWHERE = {"recordings", "your_rig", "from_a_paper"}
PAGES = [page for page in PAGES if page.stem not in ELSEWHERE and blocks(page.read_text(encoding="utf-8"))]
LONGEST = 60  # lines of an output: in a notebook the next cell stays in sight
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
#: What pages do in place of their own in more than a second, and whether they print the same. The whole is marked slow.
SHORTER = {
    "a_bench": [("draws=60", "draws=6", False)],
    "continuation": [('{"omega": (2.5, 8.0), "rho": (0.05, 0.3)}', '{"omega": (4.4, 6.0), "rho": (0.07, 0.16)}', True)],
    "control_based_continuation": [("step=0.3, points=60", "step=0.3, points=2", False)],
    "elements": [
        ('"mu", [0.1, 0.2, 0.4]', '"mu", [0.1, 0.2, 0.4], transient=100', True),
        ("1.6, 21)", "1.6, 5)", True),
    ],
    "fit_your_own_model": [
        ("6.4, 41)", "6.4, 15)", False),
        ('settings={"0": {"rho": 0.0}},', 'settings={"0": {"rho": 0.0}}, tries=1,', False),
        ("duration=12.0, samples=np.arange(0, 12, 0.05)", "duration=6.0, samples=np.arange(0, 6, 0.05)", False),
        ("folds=3", "folds=2", True),
    ],
    "first_diagram": [
        ("0.5, 601)", "0.5, 151)", True),
        ("n = 601", "n = 7", True),
        ("6.5, 0.01)", "6.5, 0.05)", False),
    ],
    "index": [("0.5, 601)", "0.5, 151)", True)],
    "orbits_and_branches": [
        ('"omega": (2.5, 8.0), "rho": (0.05, 0.3)', '"omega": (4.4, 6.0), "rho": (0.07, 0.16)', True),
        ("(0.05, 3.0)", "(0.5, 2.3)", True),
        ("range=(7.0, 10.0)", "range=(7.5, 8.6)", True),
        ("length=4.0", "length=2.0", True),
        ("(-0.0015, 0.002)", "(0.0003, 0.0016)", True),
        ('"P", (0.0, 1.0)', '"P", (0.0, 1.0), points=5', True),
    ],
    "safe_region": [
        ("14.0, 37)", "14.0, 13)", True),
        ("1.0, 19)", "1.0, 7)", True),
        ("safe.mean()", "safe.mean()", False),
        ("plane, loads=True,", "plane, loads=True, transient=100, keep=20,", True),
        ("14.0, 121)", "14.0, 31)", True),
    ],
    "sketches_and_animations": [("seconds=5, rate=12", "seconds=0.5, rate=12", True)],
    "smoothing": [
        ("np.geomspace(1e-6, 1e-3, 7)", "[3e-5, 1e-4]", True),
        ("np.geomspace(1e-4, 1e-1, 7)", "[3e-3, 1e-2]", True),
        ("n_starts=60", "n_starts=30", True),
        ('3e-4, 1e-3, 3e-3, 1e-2], band=["linear", "tanh"]', '1e-2], band=["linear"]', False),
        ("periods=4000", "periods=1000", False),
    ],
    "uncertainty": [("draws=60", "draws=6", False)],
}
LONG = [page for page in PAGES if page.stem in SHORTER]


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).with_suffix("").as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_code_of_page(page: Path, tmp_path: Path) -> None:
    judge(page, tmp_path, SHORTER.get(page.stem, ()))


@pytest.mark.slow
@pytest.mark.parametrize("page", LONG, ids=name_of)
def test_whole_code_of_page(page: Path, tmp_path: Path) -> None:
    judge(page, tmp_path)


def test_first_file_of_the_page_on_recordings(tmp_path: Path) -> None:
    judge(ROOT / "docs" / "guides" / "recordings.md", tmp_path, blocks=2)


def judge(page: Path, folder: Path, shorter: Shorter = (), blocks: int | None = None) -> None:
    if 'os.environ["NONSMOOTH_DATA"]' in page.read_text(encoding="utf-8") and not os.environ.get("NONSMOOTH_DATA"):
        pytest.skip("NONSMOOTH_DATA names no folder with measurements of other laboratories")
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
