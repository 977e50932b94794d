"""The rig's figures are measured by a process of their own, beside the numerical ones.

Reading and smoothing records is Python with short compiled pieces, the sweeps are compiled and use all cores: two
processes take little more than the longer of both. That process runs :func:`measure`; it writes the figures' datasets,
and of each a record that it is finished. It is a fresh interpreter, not a fork: compiled kernels that run in threads
cannot be forked, and a caller's script is not run a second time.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from nonsmooth.recordings import RecordingWarning
from nonsmooth_savi2007.figures.figure import Figure, finish
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import Laboratory

RIG = "rig"
_LOG = "log.txt"
_TIMED = " s of a processor"
_LOOK = 0.2  # s; between two looks at what it says


class Measurement:
    """A running measurement of some figures; ``with`` it, and it ends with the block whatever happens there."""

    def __init__(self, folder: Path, figures: Sequence[Figure], quick: bool, full: bool = False) -> None:
        self.log = folder / RIG / _LOG
        self.process: subprocess.Popen[bytes] | None = None
        if figures:
            self.log.parent.mkdir(parents=True, exist_ok=True)
            asked = json.dumps([str(folder), [figure.name for figure in figures], quick, full])
            run = f"import json, sys; from {__name__} import measure; measure(*json.loads(sys.argv[1]))"
            with open(self.log, "wb") as log:
                # -P: with -c alone a file of the caller's folder (a pint.py, say) would stand for a library.
                self.process = subprocess.Popen(
                    [sys.executable, "-P", "-c", run, asked],
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                )

    def __enter__(self) -> Measurement:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process is not None and self.process.poll() is None:
            if hasattr(os, "killpg"):  # the processes that it has forked do not end by themselves
                os.killpg(self.process.pid, signal.SIGTERM)
            else:
                self.process.terminate()
            self.process.wait()

    def wait(self, heard: Callable[[str], None]) -> None:
        """Wait until all figures are measured; ``heard`` gets the lines that are written until then.

        Raises
        ------
        RuntimeError
            If the measurement failed; the message ends with what it said last.
        """
        if self.process is None:
            return
        ended = False
        with open(self.log, encoding="utf-8", errors="replace") as lines:
            while not ended:
                ended = self.process.poll() is not None
                for line in lines.read().splitlines():
                    if line.endswith(_TIMED):  # what a person reads, without the notes on single recordings
                        heard(f"virtual rig: {line}")
                time.sleep(_LOOK)
        if self.process.returncode != 0:
            said = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["(nothing)"]
            raise RuntimeError(f"the measurement on the virtual rig failed; see {self.log}. It said last: {said[-1]}")


def measure(folder: str, names: Sequence[str], quick: bool, full: bool = False) -> None:
    """Measure figures of the rig, and write what they show.

    Identification comes first; what needs only its result is shared among processes, where the system can fork this
    one (which has no threads then).
    """
    known = _known()
    if wrong := sorted(set(names) - set(known)):
        raise ValueError(f"{', '.join(wrong)}: not measured on the rig; that are {', '.join(sorted(known))}")
    place = Path(folder)
    laboratory = Laboratory(place / RIG, quick, {name for one in names for name in known[one].procedures})
    global _settings
    _settings = Settings(quick=quick, full=full, progress=False, laboratory=laboratory, folder=place)
    begin, busy = time.perf_counter(), time.process_time()
    with _noted() as notes:
        n = len(laboratory.identified)  # kept there for all that follows
    took = time.perf_counter() - begin
    print(f"{n} parameters identified: {took:.1f} s, {time.process_time() - busy:.1f}{_TIMED}", flush=True)
    tasks = [[name for name in group if name in names] for group in _GROUPS]
    tasks += [[name] for name in names if not any(name in group for group in _GROUPS)]
    tasks = [task for task in tasks if task]
    workers = min(os.cpu_count() or 1, len(tasks))
    if workers < 2 or "fork" not in multiprocessing.get_all_start_methods():
        rows = [_task(task) for task in tasks]
    else:
        with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
            rows = list(pool.map(_task, tasks))
    for note in dict.fromkeys(note for row in (notes, *rows) for note in row):
        print(f"note: {note}")


#: Figures that use the same records, and the longest first.
_GROUPS = (("fig10_rig",), ("fig09_rig",), ("fig13_rig", "fig14_rig"), ("fig11_rig",), ("fig12_rig",), ("fig17_rig",))
_settings: Settings  # the forked processes have them, with all that was identified


def _known() -> dict[str, Figure]:
    from nonsmooth_savi2007.study import figures_of_the_study

    return {figure.name: figure for figure in figures_of_the_study() if figure.rig}


def _task(names: Sequence[str]) -> list[str]:
    """Measure figures one after the other; what there is to note."""
    with _noted() as notes:
        for name in names:
            begin, busy = time.perf_counter(), time.process_time()
            data = _known()[name].compute(_settings)
            took = time.perf_counter() - begin
            finish(name, data, took, _settings)
            print(f"{name}: {took:.1f} s, {time.process_time() - busy:.1f}{_TIMED}", flush=True)
    return notes


@contextmanager
def _noted() -> Iterator[list[str]]:
    """Warnings about recordings are kept for the log; others stay warnings."""
    notes = list[str]()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield notes
    for item in caught:
        if issubclass(item.category, RecordingWarning):
            notes.append(str(item.message))
        else:
            warnings.warn_explicit(item.message, item.category, item.filename, item.lineno)
