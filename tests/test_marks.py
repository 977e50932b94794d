"""Tests that are marked ``physics`` import public names of the package only; mutants stand where their text is."""

from __future__ import annotations

import ast
import tomllib
from functools import cache
from pathlib import Path

HERE = Path(__file__).parent
MARK = "\npytestmark = pytest.mark.physics\n"


@cache
def imported(path: Path) -> frozenset[str]:
    """Names of the modules that a file imports."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {one.name for node in nodes if isinstance(node, ast.Import) for one in node.names}
    return frozenset(plain | {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)})


def files_of(path: Path) -> set[Path]:
    """A file of tests and the helpers that it imports, as they import each other."""
    found = {path}
    for one in (waiting := [path]):
        for name in imported(one):
            places = [
                HERE.parent / f"{name.replace('.', '/')}.py",
                one.parent / f"{name}.py",
                HERE / "independent" / f"{name}.py",
            ]
            new = {place for place in places if place.is_file()} - found
            found |= new
            waiting += new
    return found


def test_public_names_only() -> None:
    marked = [path for path in HERE.rglob("test_*.py") if MARK in path.read_text(encoding="utf-8")]
    assert len(marked) > 40
    inner = {
        (path.name, one.name, name)
        for path in marked
        for one in files_of(path)
        for name in imported(one)
        if name.startswith("nonsmooth.")
    }
    assert inner == set()


def test_every_mutant_has_its_place() -> None:
    """Code that moves takes its mutants along: each text stands once in its file."""
    every = tomllib.loads((HERE / "mutants.toml").read_text(encoding="utf-8"))["mutant"]
    found = {one["name"]: (HERE.parent / one["file"]).read_text(encoding="utf-8").count(one["old"]) for one in every}
    assert [name for name, number in found.items() if number != 1] == []
    assert len(found) == len(every), "two mutants have one name"
    tests = {tuple(test.partition("[")[0].split("::")) for one in every for test in one["tests"]}
    texts = {name: (HERE.parent / name).read_text(encoding="utf-8") for name, *_ in tests}
    assert [test for test in tests if any(f"def {name}(" not in texts[test[0]] for name in test[1:])] == []
