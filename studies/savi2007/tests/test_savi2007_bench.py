"""The process that measures the rig's figures ends with the study that began it, and so does what it has forked."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from nonsmooth_savi2007.study import Measurement, figures_of_the_study


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="groups of processes are POSIX's")
def test_what_the_measurement_has_forked_ends_with_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever ends the block: Ctrl-C in a notebook reaches one process only."""
    other, note = tmp_path / "python", tmp_path / "forked"
    other.write_text(f'#!/bin/sh\nsleep 600 &\necho $! > "{note}"\nwait\n')
    other.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(other))
    end = time.monotonic() + 300
    with Measurement(tmp_path, figures_of_the_study()[:1], quick=True):
        while not (note.exists() and note.read_text().endswith("\n")):
            assert time.monotonic() < end
            time.sleep(0.01)
    forked = int(note.read_text())
    while time.monotonic() < end and _runs(forked):
        time.sleep(0.01)
    assert not _runs(forked)


def test_what_a_failed_measurement_said_last_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here by a program that says its arguments and fails; -P keeps out the modules of the folder it is started in."""
    other = tmp_path / "python"
    other.write_text('#!/bin/sh\necho begun\necho "$@" | tr -d "\\n"\nexit 1\n')
    other.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(other))
    heard: list[str] = []
    with (
        Measurement(tmp_path, figures_of_the_study()[:1], quick=True) as bench,
        pytest.raises(RuntimeError, match=r"failed; see .*log\.txt.*said last: -P -c import .*true, false\]"),
    ):
        bench.wait(heard.append)
    assert not heard  # but for what took time


def _runs(process: int) -> bool:
    """Return True while a process runs; one that has ended may wait for whoever collects it."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    facts = Path(f"/proc/{process}/stat")
    return not (facts.exists() and facts.read_text().rpartition(")")[2].split()[0] == "Z")
