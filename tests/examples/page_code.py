"""Runs the code of a page of the documentation and yields what each block printed beside what the page says.

A page is run from top to bottom in one folder, with one set of names. Blocks of ``python`` are executed; a block of
``toml`` whose first line is ``# NAME.toml``, or a ``{code-block}`` with a caption, is written to a file of that name;
lines of ``sh`` that begin with ``nonsmooth`` are run (``reproduce`` excepted, which has tests of its own). A block of
``text`` directly below is what they must print, or the error they must raise, wrapped at will; ``...`` stands for
anything.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

_BLOCK = re.compile(r"^```(python|toml|sh|text)\n(.*?)^```", re.MULTILINE | re.DOTALL)
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


def run_page(page: Path, folder: Path) -> Iterator[tuple[str, str | None, int]]:
    """Run every block of a page in ``folder``; yields (what it printed or raised, what is expected, line)."""
    names: dict[str, Any] = {"__name__": "page"}
    text = page.read_text(encoding="utf-8")
    with contextlib.chdir(folder):
        for name, content in _FILE.findall(text):
            Path(name).write_text(content, encoding="utf-8")
        for language, code, expected, line in blocks(text):
            if language == "python":
                place = compile("\n" * line + code, str(page), "exec")
                yield _python(place, names, may_raise=expected is not None), expected, line
            elif language == "toml":
                named = re.match(r"# (\S+\.toml)\n", code)
                if named is not None:
                    Path(named[1]).write_text(code, encoding="utf-8")
            else:
                yield _shell(code), expected, line


def _python(code: Any, names: dict[str, Any], may_raise: bool) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        try:
            exec(code, names)
        except Exception as error:
            if not may_raise:
                raise
            return f"{type(error).__name__}: {error}"
    return printed.getvalue()


def _shell(code: str) -> str:
    printed = ""
    for line in code.splitlines():
        words = line.split("#")[0].split()
        if words[:1] != ["nonsmooth"] or words[1:2] == ["reproduce"]:
            continue
        done = subprocess.run(
            [sys.executable, "-m", "nonsmooth.cli.main", *words[1:]], capture_output=True, text=True,
            env=os.environ | {"MPLBACKEND": "Agg"},
        )  # fmt: skip
        printed += done.stdout + done.stderr
    return printed
