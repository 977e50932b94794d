"""The examples of the docstrings print what they say, typed into an interpreter that has imported nothing for them."""

from __future__ import annotations

import ast
import doctest
from functools import cache
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[2] / "src" / "nonsmooth"
WITH = (ast.Module, ast.ClassDef, ast.FunctionDef)


@cache
def examples(path: Path) -> list[doctest.DocTest]:
    """The examples of a file's docstrings, one list of lines for each."""
    found, parser = [], doctest.DocTestParser()
    source = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)) if ">>>" in source else ():
        if isinstance(node, WITH) and ">>>" in (text := ast.get_docstring(node) or ""):
            name = getattr(node, "name", path.stem)
            found.append(parser.get_doctest(text, {}, name, str(path), getattr(node, "lineno", 1)))
    return found


FILES = [path for path in sorted(SOURCES.rglob("*.py")) if examples(path)]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(SOURCES).with_suffix("").as_posix())
def test_examples_of_a_file(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    for one in examples(path):
        runner.run(one, out=said.append, clear_globs=False)
    assert not runner.failures, "".join(said)
