"""A newcomer's first quarter of an hour: the README, typed line by line in a fresh folder.

The blocks of Python go into an interactive console, the commands to the program ``nonsmooth``, the one that computes to
the installed one, on a terminal. What the page says is printed must be printed, in that order, and the
files it names must be there. The first tutorial, which begins with the same lines, is run by ``test_pages``.
"""

from __future__ import annotations

import code
import contextlib
import doctest
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from page_code import blocks

ROOT = Path(__file__).parents[2]
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def environment() -> dict[str, str]:
    """That of a terminal in which the package's environment is active."""
    program = Path(sys.executable).parent
    return os.environ | {"MPLBACKEND": "Agg", "PATH": os.pathsep.join([str(program), os.environ.get("PATH", "")])}


def typed(page: Path, folder: Path) -> list[tuple[str, str | None, int]]:
    """(what it printed, what the page says, line) of each block of Python, all in one interactive console."""
    console, found = code.InteractiveConsole(), []
    for language, lines, expected, line in blocks(page.read_text(encoding="utf-8")):
        if language == "python":
            said, wrong = io.StringIO(), io.StringIO()
            with contextlib.chdir(folder), contextlib.redirect_stdout(said), contextlib.redirect_stderr(wrong):
                for one in [
                    *shorter(lines).splitlines(),
                    "",
                ]:  # an empty line ends a function, as for somebody who types it
                    console.push(one)
            assert "Traceback" not in wrong.getvalue() and "Error" not in wrong.getvalue(), wrong.getvalue()
            found.append((said.getvalue(), expected, line))
    return found


def on_a_terminal(words: list[str], folder: Path) -> str:
    """The output of a command that writes to a terminal."""
    import pty

    ours, theirs = pty.openpty()
    program = subprocess.Popen(
        words,
        cwd=folder,
        env=environment() | {"TERM": "xterm", "COLUMNS": "80"},
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    )
    os.close(theirs)
    said = b""
    while True:
        try:
            more = os.read(ours, 4096)
        except OSError:  # Linux says so where nobody writes any more
            more = b""
        if not more:
            break
        said += more
    os.close(ours)
    text = said.decode().replace("\r\n", "\n")
    assert program.wait() == 0, text
    return text


def here(words: list[str], folder: Path) -> str:
    """The output of a command in this process."""
    from nonsmooth.cli.main import main

    said = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        assert main(words[1:]) == 0, said.getvalue()
    return said.getvalue()


#: Of sweeps, so that they take a quarter of the time.
FEWER = {"0.5, 601)": "0.5, 151)", "n = 601": "n = 151"}


def shorter(text: str) -> str:
    for all_of_them, few in FEWER.items():
        text = text.replace(all_of_them, few)
    return text


def study(page: Path) -> str:
    """The study file that a page shows."""
    [text] = [text for language, text, _, _ in blocks(page.read_text(encoding="utf-8")) if language == "toml"]
    assert text.startswith("# fig11.toml\n")
    return text


README, TUTORIAL = ROOT / "README.md", ROOT / "docs" / "tutorials" / "first_diagram.md"


def test_lines_of_python(tmp_path: Path) -> None:
    checker = doctest.OutputChecker()
    for printed, expected, line in typed(README, tmp_path):
        said = re.sub(r"^<Axes: .*>\n", "", printed, flags=re.MULTILINE)  # an interpreter shows what a function returns
        assert expected is None or checker.check_output(expected, said, FLAGS), (
            f"{README.name}, block at line {line}, prints\n{said}\nand not\n{expected}"
        )
    assert {"fig11.nc", "fig11.pdf"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
def test_commands(tmp_path: Path) -> None:
    """The README's; the tutorial shows the same file."""
    assert study(README) == study(TUTORIAL)
    (tmp_path / "fig11.toml").write_text(shorter(study(README)), encoding="utf-8")
    shell = [text for language, text, _, _ in blocks(README.read_text(encoding="utf-8")) if language == "sh"]
    commands = [line.split("#")[0].split() for text in shell for line in text.splitlines()]
    commands = [words for words in commands if words[:1] == ["nonsmooth"]]
    said = {words[1]: (on_a_terminal if words[1] == "run" else here)(words, tmp_path) for words in commands}
    assert list(said) == ["models", "init", "run", "show"]
    assert "discontinuous_support" in said["models"] and "Savi" in said["models"]
    assert "sweep over rho:" in said["run"] and "/151 [" in said["run"]  # a bar
    assert "written to fig11.nc" in said["run"] and "discontinuous support" in said["show"]
    assert {"fig11.nc", "fig11.pdf"} <= {path.name for path in tmp_path.iterdir()}
