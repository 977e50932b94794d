"""The rig's figures are measured by a process of their own, beside the numerical ones.

Reading and smoothing records is Python with short compiled pieces, the sweeps are compiled and use all cores: two
processes take little more than the longer of both. That process runs :func:`main`; it writes the figures' datasets and
``rig/measured.json``, in which their keys and times stand. It is a fresh interpreter, not a fork: compiled kernels that
run in threads cannot be forked, and a caller's script is not run a second time.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.studies.savi2007.figure import Figure

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
            command = [sys.executable, "-c", run, str(folder), *(figure.name for figure in figures)]
            with open(folder / RIG / _LOG, "wb") as log:
                self.process = subprocess.Popen(
                    command + (["--quick"] if quick else []), stdin=subprocess.DEVNULL, stdout=log,
                    stderr=subprocess.STDOUT,
                )  # fmt: skip

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process is not None and self.process.poll() is None:
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
    """Measure figures of the rig one after the other, and write what they show."""
    from nonsmooth.results.store import save
    from nonsmooth.studies.savi2007.flows import Settings
    from nonsmooth.studies.savi2007.laboratory import Laboratory
    from nonsmooth.studies.savi2007.study import figures_of_the_study

    laboratory = Laboratory(folder / RIG, quick)
    settings = Settings(quick=quick, progress=False, laboratory=laboratory)
    manifest = {}
    for figure in figures_of_the_study():
        if figure.name in names:
            begin = time.perf_counter()
            data = figure.compute(settings)
            for key, dataset in data.items():
                save(dataset, folder / f"{figure.name}_{key}.nc")
            manifest[figure.name] = {"keys": list(data), "seconds": time.perf_counter() - begin}
            print(f"{figure.name}: {manifest[figure.name]['seconds']:.1f} s", flush=True)
    for note in dict.fromkeys(laboratory.notes):
        print(f"note: {note}")
    (folder / RIG / _MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    """Measure the figures named on the command line."""
    parser = argparse.ArgumentParser(description="Measure figures of Savi et al. (2007) on the virtual rig.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    measure(options.folder, options.names, options.quick)
