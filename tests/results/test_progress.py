"""A bar on a terminal only, and exceptions pass."""

from __future__ import annotations

import io
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from nonsmooth.results.progress import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_nothing_is_drawn_where_there_is_no_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with progress(10, "work") as advance:
        advance(10)
    assert capsys.readouterr() == ("", "")


def test_a_bar_counts_the_steps_of_all_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with progress(40, "sweep") as advance, ThreadPoolExecutor(4) as pool:
        list(pool.map(advance, [1] * 40))
    assert "sweep" in terminal.getvalue()
    assert "40/40" in terminal.getvalue()


def test_an_exception_ends_the_bar_and_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    with pytest.raises(KeyboardInterrupt), progress(3, "work"):
        raise KeyboardInterrupt
