"""``reproduce``: compute the figures, write them with their data, and report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from nonsmooth.results.progress import say
from nonsmooth.studies.savi2007.bench import Bench
from nonsmooth.studies.savi2007.figure import Figure
from nonsmooth.studies.savi2007.flows import Settings

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.studies.savi2007.claims import Row

__all__ = ["Reproduction", "figures_of_the_study", "reproduce"]

PICTURE_DPI = 200
PARAMETERS = "table1"  # identified for every figure of the rig


@dataclass(frozen=True)
class Reproduction:
    """What a run of :func:`reproduce` made: the folder, the figures, the rows of the report, and the time each took."""

    out: Path
    figures: tuple[Figure, ...]
    data: dict[str, dict[str, xr.Dataset]]
    rows: tuple[Row, ...]
    seconds: dict[str, float] = field(default_factory=dict)


def figures_of_the_study(full: bool = False) -> tuple[Figure, ...]:
    """All figures, in the order of the paper, the model's before the rig's; the effect of eta last.

    Those that take long only where ``full`` is asked for.
    """
    from nonsmooth.studies.savi2007 import (
        amplitude,
        band,
        charts,
        coexisting,
        frequency,
        gap,
        regions,
        resonance,
        rig_amplitude,
        rig_frequency,
        rig_gap,
        rig_parameters,
        rig_response,
    )

    rooms = (
        regions, rig_parameters, resonance, rig_response, amplitude, rig_amplitude, gap, rig_gap, frequency,
        rig_frequency, coexisting, charts, band,
    )  # fmt: skip
    figures = [figure for room in rooms for figure in room.FIGURES if full or not figure.full]
    places = {PARAMETERS: 8.5}
    return tuple(sorted(figures, key=lambda figure: (places.get(figure.name, figure.place), figure.rig)))


def reproduce(
    out: str | Path,
    figures: Sequence[int] | None = None,
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
        ``report.md``, ``report.html`` (self-contained), ``claims.json``; the rig's sessions in ``rig``.
    figures : list of int, optional
        Numbers of the paper's figures, with the basins and charts that belong to them; all, and the effect of eta,
        where not given. The report then holds the statements that these figures decide.
    quick : bool
        Coarse grids, short transients and records: a first look, whose numbers have wide intervals.
    full : bool
        The charts over two parameters too, of a million points each, and finer basins. Finished parts of a chart are
        kept in ``chartNN_store.zarr``: a run that was interrupted goes on from there.
    progress : bool
        Bars and a line per figure, on a terminal and in a notebook; nothing elsewhere.

    Returns
    -------
    Reproduction

    Raises
    ------
    ValueError
        A figure that is not one of the study.
    RuntimeError
        If the measurement on the virtual rig failed.
    """
    from nonsmooth.studies.savi2007.claims import measure_claims
    from nonsmooth.studies.savi2007.report import write_report

    chosen = _chosen(figures, full)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    settings = Settings(quick=quick, full=full, progress=progress, folder=folder)
    data: dict[str, dict[str, xr.Dataset]] = {}
    seconds: dict[str, float] = {}
    computed = [figure for figure in chosen if not figure.rig]
    with Bench(folder, [figure for figure in chosen if figure.rig], quick) as bench:
        for i, figure in enumerate(computed):
            if progress:
                say(f"[{i + 1}/{len(computed)}] {figure.name}: {figure.title}")
            begin = time.perf_counter()
            data[figure.name] = figure.compute(settings)
            _save(figure, data[figure.name], folder)
            _draw(figure, data[figure.name], folder)
            seconds[figure.name] = time.perf_counter() - begin
        if progress and bench.figures:
            say("waiting for the records of the virtual rig")
        measured, times = bench.results()
    data |= measured
    seconds |= times
    for figure in chosen:
        if figure.rig:
            _draw(figure, data[figure.name], folder)
    rows = measure_claims(data)
    write_report(folder, chosen, data, rows, settings, complete=figures is None)
    return Reproduction(folder, chosen, data, rows, seconds)


def _chosen(numbers: Sequence[int] | None, full: bool) -> tuple[Figure, ...]:
    known = figures_of_the_study(full)
    if numbers is None:
        return known
    there = {figure.number for figure in known if figure.number is not None}
    wrong = sorted(set(numbers) - there)
    if wrong or not numbers:
        raise ValueError(
            f"figure {', '.join(map(str, wrong)) or '(none)'} is not among the paper's figures that are reproduced: "
            f"{', '.join(map(str, sorted(there)))} (1 is a sketch, 3 a photograph)"
        )
    with_rig = any(figure.rig and figure.number in numbers for figure in known)
    return tuple(
        figure
        for figure in known
        if figure.number in numbers or figure.beside in numbers or (with_rig and figure.name == PARAMETERS)
    )


def _save(figure: Figure, data: dict[str, xr.Dataset], folder: Path) -> None:
    from nonsmooth.results.store import save

    for key, dataset in data.items():
        save(dataset, folder / f"{figure.name}_{key}.nc")


def _draw(figure: Figure, data: dict[str, xr.Dataset], folder: Path) -> None:
    from nonsmooth.plot import journal, save_figure

    canvas = figure.draw(data)
    save_figure(canvas, folder / f"{figure.name}.pdf")
    with journal():
        canvas.savefig(folder / f"{figure.name}.png", dpi=PICTURE_DPI, metadata={"Software": None})
