"""Runs the code of a page of the documentation and yields what each block printed beside what the page says.

A page is run from top to bottom in one folder, with one set of names. Blocks of ``python`` are executed; a block of
``toml`` whose first line is ``# NAME.toml``, or a ``{code-block}`` with a caption, is written to a file of that name;
lines of ``sh`` that begin with ``nonsmooth`` are run, but for `ELSEWHERE`. A block of ``text`` directly below is what
they must print, or the error they must raise, wrapped at will; ``...`` stands for anything.
"""

from __future__ import annotations

import ast
import contextlib
import io
import re
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

#: Commands that have tests of their own; the second one serves a page until it is stopped.
ELSEWHERE = ("reproduce", "explore")
Shorter = Sequence[tuple[str, str, bool]]
_BLOCK = re.compile(r"^```(python|toml|sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_GIVEN = re.compile(r"\{download\}`[^`<]*<([^>`]+)>`")
_FILE = re.compile(r"^```\{code-block\} \w+\n:caption: (\S+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(text: str) -> list[tuple[str, str, str | None, int]]:
    """(language, code, text expected or None, line) of each block that can be run."""
    found = list(_BLOCK.finditer(text))
    result = []
    for i, this in enumerate(found):
        after = found[i + 1] if i + 1 < len(found) else None
        if this[1] == "text":
            continue
        follows = after is not None and after[1] == "text" and not text[this.end() : after.start()].strip()
        expected = after[2] if after is not None and follows else None
        result.append((this[1], this[2], expected, text.count("\n", 0, this.start()) + 1))
    return result


def run_page(page: Path, folder: Path, shorter: Shorter = ()) -> Iterator[tuple[str, str, str | None, int]]:
    """Run every block of a page in ``folder``, as the cells of a notebook.

    Yields (what it printed or raised, what a notebook shows below it, what is expected, line). ``shorter``: texts,
    what stands in their place, and whether the block prints the same; else nothing is expected of it."""
    names: dict[str, Any] = {"__name__": "page"}
    text = page.read_text(encoding="utf-8")
    for name in _GIVEN.findall(text):  # files that the page gives its reader
        shutil.copy(page.parent / name, folder)
    with contextlib.chdir(folder):
        for name, content in _FILE.findall(text):
            Path(name).write_text(content, encoding="utf-8")
        for language, code, expected, line in blocks(text):
            for old, new, same in shorter:
                if old in code:
                    code, expected = code.replace(old, new), expected if same else None
            if language == "python":
                parsed = ast.parse("\n" * line + code, str(page))
                yield *_python(parsed, str(page), names, may_raise=expected is not None), expected, line
            elif language == "toml":
                named = re.match(r"# (\S+\.toml)\n", code)
                if named is not None:
                    Path(named[1]).write_text(code, encoding="utf-8")
            else:
                yield _shell(code), "", expected, line


def _python(code: ast.Module, page: str, names: dict[str, Any], may_raise: bool) -> tuple[str, str]:
    last = code.body.pop() if isinstance(code.body[-1], ast.Expr) else None
    printed, shown = io.StringIO(), None
    with contextlib.redirect_stdout(printed):
        try:
            exec(compile(code, page, "exec"), names)
            if isinstance(last, ast.Expr):
                shown = eval(compile(ast.Expression(last.value), page, "eval"), names)
        except Exception as error:
            if not may_raise:
                raise
            return f"{type(error).__name__}: {error}", ""
    return printed.getvalue(), "" if shown is None else repr(shown)


def _shell(code: str) -> str:
    from nonsmooth.cli.main import main

    printed = io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
        for line in code.splitlines():
            words = line.split("#")[0].split()
            if words[:1] == ["nonsmooth"] and words[1] not in ELSEWHERE:
                main(words[1:])
    return printed.getvalue()
