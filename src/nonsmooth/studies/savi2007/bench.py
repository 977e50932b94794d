"""The rig's figures are measured by a process of their own, beside the numerical ones.

Reading and smoothing records is Python with short compiled pieces, the sweeps are compiled and use all cores: two
processes take little more than the longer of both. That process runs :func:`main`; it writes the figures' datasets and
``rig/measured.json``, in which their keys and times stand. It is a fresh interpreter, not a fork: compiled kernels that
run in threads cannot be forked, and a caller's script is not run a second time.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.studies.savi2007.figure import Figure
    from nonsmooth.studies.savi2007.flows import Settings

__all__ = ["Bench", "main", "measure"]

RIG = "rig"
_MANIFEST, _LOG = "measured.json", "log.txt"


class Bench:
    """A running measurement of some figures; ``with`` it, and it ends with the block whatever happens there."""

    def __init__(self, folder: Path, figures: Sequence[Figure], quick: bool) -> None:
        self.folder, self.figures = folder, figures
        self.process: subprocess.Popen[bytes] | None = None
        if figures:
            (folder / RIG).mkdir(parents=True, exist_ok=True)
            run = f"from {__name__} import main; main()"
            # -P: with -c alone a file of the caller's folder (a pint.py, say) would stand for a library.
            command = [sys.executable, "-P", "-c", run, str(folder), *(figure.name for figure in figures)]
            with open(folder / RIG / _LOG, "wb") as log:
                self.process = subprocess.Popen(
                    command + (["--quick"] if quick else []), stdin=subprocess.DEVNULL, stdout=log,
                    stderr=subprocess.STDOUT, start_new_session=True,
                )  # fmt: skip

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process is not None and self.process.poll() is None:
            if hasattr(os, "killpg"):  # the processes that it has forked do not end by themselves
                os.killpg(self.process.pid, signal.SIGTERM)
            else:
                self.process.terminate()
            self.process.wait()

    def results(self) -> tuple[dict[str, dict[str, xr.Dataset]], dict[str, float]]:
        """Datasets by figure and key, and the seconds that each figure took; waits until all are measured.

        Raises
        ------
        RuntimeError
            If the measurement failed; the message ends with what it said last.
        """
        from nonsmooth.results.store import load

        if self.process is None:
            return {}, {}
        if self.process.wait() != 0:
            log = self.folder / RIG / _LOG
            said = log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["(nothing)"]
            raise RuntimeError(f"the measurement on the virtual rig failed; see {log}. It said last: {said[-1]}")
        manifest = json.loads((self.folder / RIG / _MANIFEST).read_text(encoding="utf-8"))
        data = {
            name: {key: load(self.folder / f"{name}_{key}.nc") for key in entry["keys"]}
            for name, entry in manifest.items()
        }
        return data, {name: float(entry["seconds"]) for name, entry in manifest.items()}


def measure(folder: Path, names: Sequence[str], quick: bool) -> None:
    """Measure figures of the rig, and write what they show.

    Identification comes first; what needs only its result is shared among processes, where the system can fork this
    one (which has no threads then).
    """
    from nonsmooth.studies.savi2007.flows import Settings
    from nonsmooth.studies.savi2007.laboratory import Laboratory
    from nonsmooth.studies.savi2007.study import figures_of_the_study

    known = {figure.name: figure for figure in figures_of_the_study() if figure.rig}
    if wrong := sorted(set(names) - set(known)):
        raise ValueError(f"{', '.join(wrong)}: not measured on the rig; that are {', '.join(sorted(known))}")
    laboratory = Laboratory(folder / RIG, quick)
    job = _Job(folder, Settings(quick=quick, progress=False, laboratory=laboratory), known)
    begin, busy = time.perf_counter(), time.process_time()
    n = len(laboratory.identified)  # kept there for all that follows
    took = time.perf_counter() - begin
    print(f"{n} parameters identified: {took:.1f} s, {time.process_time() - busy:.1f} s of a processor", flush=True)
    tasks = [[name for name in group if name in names] for group in _GROUPS]
    tasks += [[name] for name in names if not any(name in group for group in _GROUPS)]
    rows = [row for done in job.shared([task for task in tasks if task]) for row in done]
    entries = {name: {"keys": keys, "seconds": seconds} for name, keys, seconds, _ in rows}
    for note in dict.fromkeys([*laboratory.notes, *(note for row in rows for note in row[3])]):
        print(f"note: {note}")
    manifest = {name: entries[name] for name in known if name in entries}
    (folder / RIG / _MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


#: Figures that use the same records, and the longest first.
_GROUPS = (("fig10_rig",), ("fig09_rig",), ("fig13_rig", "fig14_rig"), ("fig11_rig",), ("fig12_rig",), ("fig17_rig",))

_Row = tuple[str, list[str], float, list[str]]


@dataclass(frozen=True)
class _Job:
    """What the processes share."""

    folder: Path
    settings: Settings
    figures: Mapping[str, Figure]

    def shared(self, tasks: Sequence[Sequence[str]]) -> list[list[_Row]]:
        """Name, keys, seconds and notes of each figure, task by task."""
        workers = min(os.cpu_count() or 1, len(tasks))
        if workers < 2 or "fork" not in multiprocessing.get_all_start_methods():
            return [self.task(task) for task in tasks]
        global _job
        _job = self  # the forked processes have it; closures cannot be sent to them
        with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
            return list(pool.map(_forked, tasks))

    def task(self, names: Sequence[str]) -> list[_Row]:
        """Figures one after the other."""
        from nonsmooth.results.store import save

        rows = []
        for name in names:
            begin, busy = time.perf_counter(), time.process_time()
            data = self.figures[name].compute(self.settings)
            for key, dataset in data.items():
                save(dataset, self.folder / f"{name}_{key}.nc")
            rows.append((name, list(data), time.perf_counter() - begin, list(self.settings.bench.notes)))
            print(f"{name}: {rows[-1][2]:.1f} s, {time.process_time() - busy:.1f} s of a processor", flush=True)
        return rows


_job: _Job | None = None


def _forked(names: Sequence[str]) -> list[_Row]:
    assert _job is not None
    return _job.task(names)


def main() -> None:
    """Measure the figures named on the command line."""
    parser = argparse.ArgumentParser(description="Measure figures of Savi et al. (2007) on the virtual rig.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    measure(options.folder, options.names, options.quick)
