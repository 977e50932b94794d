"""The tutorials as notebooks: made from their pages; one is executed by nbconvert, each output right and short.

The code of the others is run by ``test_pages``, in the process of the tests."""

from __future__ import annotations

import base64
import doctest
import importlib.util
import re
from pathlib import Path

import nbformat
import pytest
from page_code import blocks

DOCS = Path(__file__).parents[2] / "docs"
spec = importlib.util.spec_from_file_location("make_notebooks", DOCS / "make_notebooks.py")
assert spec is not None and spec.loader is not None
make = importlib.util.module_from_spec(spec)
spec.loader.exec_module(make)
LONGEST = 12  # lines of an output
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


@pytest.mark.parametrize("page", make.PAGES, ids=lambda page: page.stem)
def test_a_notebook_is_that_of_its_page(page: Path) -> None:
    stored = page.with_suffix(".ipynb").read_text(encoding="utf-8")
    assert stored == make.written(page), "python docs/make_notebooks.py"
    notebook = nbformat.reads(stored, 4)
    nbformat.validate(notebook)
    assert ":::" not in stored and "this page as a notebook" not in stored
    code = [cell["source"].strip() for cell in notebook.cells if cell["cell_type"] == "code"]
    assert code == [text.strip() for language, text, _, _ in blocks(page.read_text("utf-8")) if language == "python"]


def test_a_notebook_runs_with_short_outputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    [page] = [one for one in make.PAGES if one.stem == "from_a_paper"]
    from nbconvert.preprocessors import ExecutePreprocessor

    monkeypatch.delenv("MPLBACKEND")  # so that figures appear below their cells
    for folder in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(folder, str(tmp_path))
    notebook = nbformat.read(page.with_suffix(".ipynb"), 4)
    ExecutePreprocessor(timeout=300).preprocess(notebook, {"metadata": {"path": str(tmp_path)}})
    checker = doctest.OutputChecker()
    cells = [cell for cell in notebook.cells if cell["cell_type"] == "code"]
    python = [block for block in blocks(page.read_text(encoding="utf-8")) if block[0] == "python"]
    pictures = 0
    for cell, (_, _, expected, line) in zip(cells, python, strict=True):
        where = f"{page.name}, block at line {line}"
        printed = "".join(out["text"] for out in cell["outputs"] if out.get("name") == "stdout")
        if expected is not None:
            assert checker.check_output(expected, printed, FLAGS), f"{where} prints\n{printed}\nand not\n{expected}"
        for out in cell["outputs"]:
            assert out.get("name") != "stderr" or "compiling" in out["text"], (where, out["text"])  # bars leave nothing
            data = out.get("data", {})
            assert len((out.get("text", "") + data.get("text/plain", "")).splitlines()) <= LONGEST, where
            if "image/png" in data:
                pictures += 1
                assert base64.b64decode(data["image/png"]).startswith(b"\x89PNG"), where
    assert pictures >= len(re.findall(r"^!\[", page.read_text(encoding="utf-8"), re.M))
