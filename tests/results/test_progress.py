"""Progress is shown to a person who watches, on a terminal or in a notebook, and exceptions pass."""

from __future__ import annotations

import io
import os
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import nonsmooth as ns
from nonsmooth.kernels import before_compiling
from nonsmooth.results import progress as module
from nonsmooth.results.progress import progress, say


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def on_terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Called by the test itself: a fixture's stderr is replaced before the test runs."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    return terminal


def test_nothing_is_said_where_nobody_watches(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_mentioned", -1e9)
    with progress(10, "work") as advance:
        advance(10)
    say("a line")
    for call in before_compiling:
        call("record")
    assert capsys.readouterr() == ("", "")


def test_a_bar_counts_the_steps_of_all_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = on_terminal(monkeypatch)
    with progress(50, "sweep", done=10) as advance, ThreadPoolExecutor(4) as pool:
        list(pool.map(advance, [1] * 39))
        time.sleep(0.15)  # a bar is drawn ten times a second
        advance(1)
    assert "sweep" in terminal.getvalue()
    assert "10/50" in terminal.getvalue() and "50/50" in terminal.getvalue()
    assert terminal.getvalue().split("\r")[-1] == ""  # wiped


def test_a_bar_that_is_not_wanted_is_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = on_terminal(monkeypatch)
    with progress(3, "work", False) as advance:
        advance(3)
    assert terminal.getvalue() == ""


def test_an_exception_ends_the_bar_and_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = on_terminal(monkeypatch)
    with pytest.raises(KeyboardInterrupt), progress(3, "work"):
        raise KeyboardInterrupt
    assert terminal.getvalue().split("\r")[-1] == ""


def test_a_notebook_shows_one_output_that_is_empty_in_the_end(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = SimpleNamespace(get_ipython=lambda: SimpleNamespace(config={"IPKernelApp": {}}))
    shown: list[str] = []

    def display(data: dict[str, str], raw: bool, display_id: bool) -> SimpleNamespace:
        assert raw and display_id and not shown
        return SimpleNamespace(update=lambda data, raw: shown.append(data["text/plain"]))

    monkeypatch.setitem(sys.modules, "IPython", kernel)
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display))
    with progress(10, "sweep") as advance:
        time.sleep(0.15)
        advance(3)
        say("a line")
    assert "sweep" in shown[0] and "0/10" in shown[0] and any("3/10" in text for text in shown) and shown[-1] == ""
    assert capsys.readouterr() == ("", "a line\n")


def test_compiling_is_mentioned_once_for_all_kernels_of_some_seconds(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    terminal = on_terminal(monkeypatch)
    monkeypatch.setattr(module, "_mentioned", -1e9)
    monkeypatch.setenv("NONSMOOTH_CACHE_DIR", str(tmp_path))
    for name in ("record", "chain"):
        for call in before_compiling:
            call(name)
    assert terminal.getvalue() == f"nonsmooth: compiling (once; kept in {tmp_path}) ...\n"


def first_words(code: str, environment: dict[str, str]) -> tuple[str, float]:
    """Return what a process writes first on a terminal, and a processor's seconds until then; it is ended there."""
    import pty

    child, terminal = pty.fork()
    if child == 0:
        os.environ.update(environment)
        os.execv(sys.executable, [sys.executable, "-c", code])
    words = os.read(terminal, 4096).decode()
    os.kill(child, signal.SIGKILL)
    _, _, used = os.wait4(child, 0)
    os.close(terminal)
    return words, used.ru_utime + used.ru_stime


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
def test_the_first_call_on_a_terminal_says_that_it_compiles(tmp_path: Path) -> None:
    """Before it does."""
    code = "import nonsmooth as ns; ns.simulate(ns.models.discontinuous_support(), periods=1)"
    # for a processor for which nothing has been compiled ahead
    words, seconds = first_words(code, {"NONSMOOTH_CACHE_DIR": str(tmp_path), "NUMBA_CPU_NAME": "generic"})
    assert words.startswith("nonsmooth: compiling (once; kept in ")
    assert not list(tmp_path.glob("compiled/*"))
    assert seconds < 4.0  # some 1, and 10 where it were said afterwards


@pytest.mark.skipif(sys.platform == "win32", reason="terminals of POSIX")
def test_a_terminal_that_does_not_know_its_size_shows_a_bar() -> None:
    """One that was just opened has no columns and no rows."""
    code = "from nonsmooth.results.progress import progress\nwith progress(10, 'work') as advance: input()"
    words, _ = first_words(code, {})
    assert "work" in words and "0/10" in words


def test_a_function_hears_the_fraction_done_and_may_cancel() -> None:
    heard: list[float] = []
    osc = ns.models.discontinuous_support()
    found = ns.sweep(osc, "rho", np.linspace(0.3, 0.5, 5), transient=20, keep=20, progress=heard.append)
    assert heard[0] == 0.0
    assert heard[-1] == 1.0
    assert heard == sorted(heard)
    assert len(heard) > 3
    again = ns.sweep(osc, "rho", np.linspace(0.3, 0.5, 5), transient=20, keep=20, progress=False)
    assert (found["section"] == again["section"]).all()
    seen: list[float] = []
    with pytest.raises(KeyboardInterrupt, match="cancelled"):
        ns.chart(
            osc,
            {"rho": [0.3, 0.4], "omega": [3.0, 3.6]},
            transient=20,
            progress=lambda done: seen.append(done) or len(seen) < 2,
        )
    assert len(seen) == 2
    with pytest.raises(TypeError, match=r"True, False,? or a function"):
        ns.sweep(osc, "rho", [0.3], progress="yes")
