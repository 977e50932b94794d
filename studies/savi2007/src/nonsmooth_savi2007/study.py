"""``reproduce``: compute the figures, write them with their data, and report.

The rig's figures are measured by a process of their own, beside the numerical ones: reading and smoothing records is
Python with short compiled pieces, the sweeps are compiled and use all cores, so that two processes take little more
than the longer of both. That process runs :func:`measure`; it writes the figures' datasets, and of each a record that
it is finished. It is a fresh interpreter, not a fork: compiled kernels that run in threads cannot be forked, and a
caller's script is not run a second time.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import xarray as xr

from nonsmooth.plot import journal, save_figure
from nonsmooth_savi2007.claims.claims import Statement, measure_claims
from nonsmooth_savi2007.figures import (
    band,
    charts,
    diagrams,
    measured_diagrams,
    motions,
    parameters,
    portraits,
    resonance,
)
from nonsmooth_savi2007.figures.figure import Figure, finish, finished, just_made, refuse_strange
from nonsmooth_savi2007.flows import Settings
from nonsmooth_savi2007.laboratory import Laboratory
from nonsmooth_savi2007.report.report import REPORTS, write_report

PICTURE_DPI = 200
PARAMETERS = "table1"
#: Files that hold figures.
FILES = (
    resonance,
    diagrams,
    portraits,
    charts,
    band,
    parameters,
    measured_diagrams,
    motions,
)


@dataclass(frozen=True)
class Reproduction:
    """Output of :func:`reproduce`: the folder, the figures, the rows of the report, and the time each took."""

    out: Path
    figures: tuple[Figure, ...]
    data: dict[str, dict[str, xr.Dataset]]
    rows: tuple[Statement, ...]
    seconds: dict[str, float] = field(default_factory=dict)


def figures_of_the_study(full: bool = False) -> tuple[Figure, ...]:
    """All figures, in the order of the paper, the model's before the rig's; the effect of eta last.

    Those that take long only where ``full`` is asked for.
    """
    figures = [figure for file in FILES for figure in file.FIGURES if full or not figure.full]
    places = {PARAMETERS: 8.5}
    return tuple(sorted(figures, key=lambda figure: (places.get(figure.name, figure.place), figure.rig)))


def reproduce(
    out: str | Path,
    figures: Sequence[int | str] | None = None,
    quick: bool = False,
    progress: bool = True,
    full: bool = False,
) -> Reproduction:
    """Reproduce the figures of Savi et al. (2007) by model and virtual rig, and check the paper's statements.

    What the paper measured is measured here on a virtual rig with the paper's parameters: a session is recorded, the
    parameters are identified from its files, and the records are laid over the model with these parameters. All of
    that is synthetic and says so.

    Parameters
    ----------
    out : path
        Folder to write into, made where missing: ``figNN.pdf``, ``figNN.png``, datasets ``figNN_*.nc``,
        ``report.md``, ``report.html`` (self-contained), ``claims.json``; the rig's sessions in ``rig``. Figures that
        an earlier run of the same version finished there with the same settings are used again.
    figures : list of int or str, optional
        Numbers of the paper's figures (of model and rig), or names of single ones: ``fig11_rig``, ``table1``,
        ``eta``, ``basins13``. Nothing else is computed, and the report holds the statements that these figures
        decide, with those of figures that are there already. All where not given.
    quick : bool
        Coarse grids, short transients and records: a first look, whose numbers have wide intervals.
    full : bool
        The charts over two parameters too, of a million points each, and finer basins. Finished parts of a chart are
        kept in ``chartNN_store.zarr``: a run that was interrupted goes on from there.
    progress : bool
        Bars and a line per figure, on a terminal.

    Returns
    -------
    Reproduction

    Raises
    ------
    ValueError
        A figure that is not one of the study, or a folder that holds other files, or figures of another kind of run.
    OSError
        A folder that cannot be written into.
    RuntimeError
        If the measurement on the virtual rig failed.
    """

    chosen = _chosen(figures, full)
    folder = Path(out)
    _make(folder)
    settings = Settings(quick=quick, full=full, progress=progress, folder=folder)
    known = figures_of_the_study(full=True)
    made = {figure.name: found for figure in known if (found := finished(figure.name, settings)) is not None}
    missing = [figure for figure in chosen if figure.name not in made]
    if made:
        _say(f"finished before in {folder}: {', '.join(made)}", progress)
    if missing:
        for name in REPORTS:  # a report that stands is of the figures beside it
            (folder / name).unlink(missing_ok=True)
    computed = [figure for figure in missing if not figure.rig]
    measured = [figure for figure in missing if figure.rig]
    with Measurement(folder, measured, quick, full) as bench:
        for i, figure in enumerate(computed):
            _say(f"[{i + 1}/{len(computed)}] {figure.name}: {figure.title}", progress)
            begin = time.perf_counter()
            datasets = figure.compute(settings)
            seconds = time.perf_counter() - begin
            finish(figure.name, datasets, seconds, settings)
            made[figure.name] = datasets, seconds
            _draw(figure, datasets, folder)
        names = ", ".join(one.name for one in measured)
        _say(f"waiting for the virtual rig: {names}", progress and bool(measured))
        bench.wait(lambda line: _say(line, progress))
    made |= {figure.name: just_made(figure.name, settings) for figure in measured}
    shown = tuple(figure for figure in known if figure.name in made)
    data = {figure.name: made[figure.name][0] for figure in shown}
    for figure in shown:
        if figure in measured or not _drawn(figure, folder):
            _draw(figure, data[figure.name], folder)
    rows = measure_claims(data)
    write_report(folder, shown, data, rows, settings, complete=set(figures_of_the_study(full)) <= set(shown))
    return Reproduction(folder, shown, data, rows, {name: seconds for name, (_, seconds) in made.items()})


def _say(line: str, progress: bool) -> None:
    """A line on stderr, on a terminal."""
    if progress and getattr(sys.stderr, "isatty", bool)():
        print(line, file=sys.stderr, flush=True)


def _make(folder: Path) -> None:
    """Make the folder, and find out before any work whether it can be written into."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"{folder} cannot be written into ({error.strerror}): give another folder (--out)") from error
    refuse_strange(folder, [figure.name for figure in figures_of_the_study(full=True)])


def _chosen(wanted: Sequence[int | str] | None, full: bool) -> tuple[Figure, ...]:
    """The figures with these numbers or names, in the order of the report."""
    if wanted is None:
        return figures_of_the_study(full)
    known = figures_of_the_study(full=True)
    numbers = sorted({figure.number for figure in known if figure.number is not None})
    names = [figure.name for figure in known]
    asked = {str(one) for one in wanted}
    wrong = sorted(asked - set(names) - {str(number) for number in numbers})
    if wrong or not asked:
        raise ValueError(
            f"figure {', '.join(wrong) or '(none)'}: the paper's figures that are reproduced are "
            f"{', '.join(map(str, numbers))} (1 is a sketch, 3 a photograph); a single one of model or rig, or one "
            f"that the paper has not, goes by its name: {', '.join(names)}"
        )
    return tuple(figure for figure in known if figure.name in asked or str(figure.number) in asked)


def _drawn(figure: Figure, folder: Path) -> bool:
    return all((folder / f"{figure.name}.{kind}").exists() for kind in ("pdf", "png"))


def _draw(figure: Figure, data: dict[str, xr.Dataset], folder: Path) -> None:

    canvas = figure.draw(data)
    save_figure(canvas, folder / f"{figure.name}.pdf")
    with journal():
        canvas.savefig(folder / f"{figure.name}.png", dpi=PICTURE_DPI, metadata={"Software": None})


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
