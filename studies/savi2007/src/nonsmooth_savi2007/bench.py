"""The rig's figures are measured by a process of their own, beside the numerical ones.

Reading and smoothing records is Python with short compiled pieces, the sweeps are compiled and use all cores: two
processes take little more than the longer of both. That process runs :func:`main`; it writes the figures' datasets,
and of each a record that it is finished. It is a fresh interpreter, not a fork: compiled kernels that run in threads
cannot be forked, and a caller's script is not run a second time.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from nonsmooth_savi2007.figures.figure import Figure
from nonsmooth_savi2007.finished import finish
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import Laboratory

RIG = "rig"
_LOG = "log.txt"
_TIMED = " s of a processor"
_LOOK = 0.2  # s; between two looks at what it says


class Measurement:
    """A running measurement of some figures; ``with`` it, and it ends with the block whatever happens there."""

    def __init__(self, folder: Path, figures: Sequence[Figure], quick: bool, full: bool = False) -> None:
        self.folder, self.figures = folder, figures
        self.process: subprocess.Popen[bytes] | None = None
        if figures:
            (folder / RIG).mkdir(parents=True, exist_ok=True)
            run = f"from {__name__} import main; main()"
            # -P: with -c alone a file of the caller's folder (a pint.py, say) would stand for a library.
            command = [sys.executable, "-P", "-c", run, str(folder), *(figure.name for figure in figures)]
            with open(folder / RIG / _LOG, "wb") as log:
                self.process = subprocess.Popen(
                    command + ["--quick"] * quick + ["--full"] * full,
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
        log = self.folder / RIG / _LOG
        with open(log, encoding="utf-8", errors="replace") as lines:
            while (code := self.process.poll()) is None:
                _pass_on(lines.read(), heard)
                time.sleep(_LOOK)
            _pass_on(lines.read(), heard)
        if code != 0:
            said = log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["(nothing)"]
            raise RuntimeError(f"the measurement on the virtual rig failed; see {log}. It said last: {said[-1]}")


def _pass_on(text: str, heard: Callable[[str], None]) -> None:
    """Print what a person reads: the times, without the notes on single recordings."""
    for line in text.splitlines():
        if line.endswith(_TIMED):
            heard(f"virtual rig: {line}")


def measure(folder: Path, names: Sequence[str], quick: bool, full: bool = False) -> None:
    """Measure figures of the rig, and write what they show.

    Identification comes first; what needs only its result is shared among processes, where the system can fork this
    one (which has no threads then).
    """
    from nonsmooth_savi2007.study import figures_of_the_study

    known = {figure.name: figure for figure in figures_of_the_study() if figure.rig}
    if wrong := sorted(set(names) - set(known)):
        raise ValueError(f"{', '.join(wrong)}: not measured on the rig; that are {', '.join(sorted(known))}")
    laboratory = Laboratory(folder / RIG, quick, {name for one in names for name in known[one].procedures})
    settings = Settings(quick=quick, full=full, progress=False, laboratory=laboratory, folder=folder)
    job = _Job(settings, known)
    begin, busy = time.perf_counter(), time.process_time()
    n = len(laboratory.identified)  # kept there for all that follows
    took = time.perf_counter() - begin
    print(f"{n} parameters identified: {took:.1f} s, {time.process_time() - busy:.1f}{_TIMED}", flush=True)
    tasks = [[name for name in group if name in names] for group in _GROUPS]
    tasks += [[name] for name in names if not any(name in group for group in _GROUPS)]
    rows = [row for done in job.shared([task for task in tasks if task]) for row in done]
    for note in dict.fromkeys([*laboratory.notes, *(note for row in rows for note in row)]):
        print(f"note: {note}")


#: Figures that use the same records, and the longest first.
_GROUPS = (("fig10_rig",), ("fig09_rig",), ("fig13_rig", "fig14_rig"), ("fig11_rig",), ("fig12_rig",), ("fig17_rig",))


@dataclass(frozen=True)
class _Job:
    """Data that the processes share."""

    settings: Settings
    figures: Mapping[str, Figure]

    def shared(self, tasks: Sequence[Sequence[str]]) -> list[list[str]]:
        """Measure the figures; the notes of each task."""
        workers = min(os.cpu_count() or 1, len(tasks))
        if workers < 2 or "fork" not in multiprocessing.get_all_start_methods():
            return [self.task(task) for task in tasks]
        global _job
        _job = self  # the forked processes have it; closures cannot be sent to them
        with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
            return list(pool.map(_forked, tasks))

    def task(self, names: Sequence[str]) -> list[str]:
        """Figures one after the other, and what there is to note."""
        for name in names:
            begin, busy = time.perf_counter(), time.process_time()
            data = self.figures[name].compute(self.settings)
            took = time.perf_counter() - begin
            finish(name, data, took, self.settings)
            print(f"{name}: {took:.1f} s, {time.process_time() - busy:.1f}{_TIMED}", flush=True)
        return list(self.settings.bench.notes)


_job: _Job | None = None


def _forked(names: Sequence[str]) -> list[str]:
    assert _job is not None
    return _job.task(names)


def main() -> None:
    """Measure the figures named on the command line."""
    parser = argparse.ArgumentParser(description="Measure figures of Savi et al. (2007) on the virtual rig.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--full", action="store_true")
    options = parser.parse_args()
    measure(options.folder, options.names, options.quick, options.full)
