"""Calls that stand in the sentences of the pages, where nothing runs them: each fits the function that it names."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path

import pytest

import nonsmooth as ns

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^( *)(```|:::).*?^\1\2", re.DOTALL | re.MULTILINE)


def calls(page: Path) -> Iterator[ast.Call]:
    for code in re.findall(r"`([^`]*\bns\.[^`]*)`", BLOCK.sub("", page.read_text(encoding="utf-8"))):
        try:
            tree = ast.parse(" ".join(code.split()))
        except SyntaxError:  # a piece of a call
            continue
        found = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
        yield from (call for call in found if re.fullmatch(r"ns(\.\w+)+", ast.unparse(call.func)))


@pytest.mark.parametrize("page", [page for page in PAGES if page.stem not in ("decisions", "changelog")], ids=str)
def test_a_call_in_a_sentence_fits_its_function(page: Path) -> None:
    for call in calls(page):
        function = attrgetter(ast.unparse(call.func).removeprefix("ns."))(ns)
        given = [one for one in call.args if not (isinstance(one, ast.Constant) and one.value is ...)]
        named = {one.arg: None for one in call.keywords if one.arg}
        try:
            inspect.signature(function).bind_partial(*given, **named)
        except TypeError as error:
            pytest.fail(f"{ast.unparse(call)}: {error}")
