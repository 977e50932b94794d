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
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path

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


def measure(folder: str, names: Sequence[str], quick: bool, full: bool) -> None:
    """Measure figures of the rig, and write what they show.

    Identification comes first; what needs only its result is shared among processes, where the system can fork this
    one (which has no threads then).
    """
    from nonsmooth_savi2007.study import figures_of_the_study

    global _settings, _figures
    place = Path(folder)
    _figures = {figure.name: figure for figure in figures_of_the_study(full=True)}
    laboratory = Laboratory(place / RIG, quick, {one for name in names for one in _figures[name].procedures})
    _settings = Settings(quick=quick, full=full, progress=False, laboratory=laboratory, folder=place)
    with _timed("parameters identified"):
        _ = laboratory.identified  # kept there for all that follows
    tasks = [[name for name in group if name in names] for group in _GROUPS]
    tasks += [[name] for name in names if not any(name in group for group in _GROUPS)]
    tasks = [task for task in tasks if task]
    workers = min(os.cpu_count() or 1, len(tasks))
    if workers < 2 or "fork" not in multiprocessing.get_all_start_methods():
        for task in tasks:
            _task(task)
    else:
        with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
            list(pool.map(_task, tasks))  # so that what goes wrong is raised


#: Figures that use the same records, and the longest first.
_GROUPS = (("fig10_rig",), ("fig09_rig",), ("fig13_rig", "fig14_rig"), ("fig11_rig",), ("fig12_rig",), ("fig17_rig",))
_settings: Settings  # the forked processes have them, with all that was identified
_figures: dict[str, Figure]


def _task(names: Sequence[str]) -> None:
    """Measure figures one after the other."""
    for name in names:
        begin = time.perf_counter()
        with _timed(name):
            data = _figures[name].compute(_settings)
        finish(name, data, time.perf_counter() - begin, _settings)


@contextmanager
def _timed(words: str) -> Iterator[None]:
    """Say how long something took."""
    begin, busy = time.perf_counter(), time.process_time()
    yield
    print(f"{words}: {time.perf_counter() - begin:.1f} s, {time.process_time() - busy:.1f}{_TIMED}", flush=True)
