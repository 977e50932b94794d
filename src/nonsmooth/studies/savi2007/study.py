"""``reproduce``: compute the figures, write them with their data, and report."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from nonsmooth.studies.savi2007.figure import Figure
from nonsmooth.studies.savi2007.flows import Settings

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.studies.savi2007.claims import Row

__all__ = ["Reproduction", "figures_of_the_study", "reproduce"]

PICTURE_DPI = 200


@dataclass(frozen=True)
class Reproduction:
    """What a run of :func:`reproduce` made: the folder, the figures, the rows of the report, and the time each took."""

    out: Path
    figures: tuple[Figure, ...]
    data: dict[str, dict[str, xr.Dataset]]
    rows: tuple[Row, ...]
    seconds: dict[str, float] = field(default_factory=dict)


def figures_of_the_study() -> tuple[Figure, ...]:
    """All figures, in the order of the paper; the effect of eta last."""
    from nonsmooth.studies.savi2007 import amplitude, band, frequency, gap, regions, resonance

    rooms = (regions, resonance, amplitude, gap, frequency, band)
    return tuple(figure for room in rooms for figure in room.FIGURES)


def reproduce(
    out: str | Path, figures: Sequence[int] | None = None, quick: bool = False, progress: bool = True
) -> Reproduction:
    """Reproduce the numerical figures of Savi et al. (2007) and check the paper's statements.

    Parameters
    ----------
    out : path
        Folder to write into, made where missing: ``figNN.pdf``, ``figNN.png``, datasets ``figNN_*.nc``,
        ``report.md``, ``report.html`` (self-contained), ``claims.json``.
    figures : list of int, optional
        Numbers of the paper's figures; all, and the effect of eta, where not given. The report then holds the
        statements that these figures decide.
    quick : bool
        Coarse grids and short transients: a first look, whose numbers have wide intervals.
    progress : bool
        Bars and a line per figure, on a terminal.

    Returns
    -------
    Reproduction

    Raises
    ------
    ValueError
        A figure that is not one of the study.
    """
    from nonsmooth.studies.savi2007.claims import measure_claims
    from nonsmooth.studies.savi2007.report import write_report

    chosen = _chosen(figures)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    settings = Settings(quick=quick, progress=progress)
    data: dict[str, dict[str, xr.Dataset]] = {}
    seconds: dict[str, float] = {}
    for i, figure in enumerate(chosen):
        if progress and sys.stderr.isatty():
            print(f"[{i + 1}/{len(chosen)}] {figure.name}: {figure.title}", file=sys.stderr)
        begin = time.perf_counter()
        data[figure.name] = figure.compute(settings)
        _write(figure, data[figure.name], folder)
        seconds[figure.name] = time.perf_counter() - begin
    rows = measure_claims(data)
    write_report(folder, chosen, data, rows, settings, complete=figures is None)
    return Reproduction(folder, chosen, data, rows, seconds)


def _chosen(numbers: Sequence[int] | None) -> tuple[Figure, ...]:
    known = figures_of_the_study()
    if numbers is None:
        return known
    there = {figure.number for figure in known if figure.number is not None}
    wrong = sorted(set(numbers) - there)
    if wrong or not numbers:
        raise ValueError(
            f"figure {', '.join(map(str, wrong)) or '(none)'} is not among the paper's numerical figures: "
            f"{', '.join(map(str, sorted(there)))} (3-8 and 16 are of the rig)"
        )
    return tuple(figure for figure in known if figure.number in numbers)


def _write(figure: Figure, data: dict[str, xr.Dataset], folder: Path) -> None:
    from nonsmooth.plot import journal, save_figure
    from nonsmooth.results.store import save

    for key, dataset in data.items():
        save(dataset, folder / f"{figure.name}_{key}.nc")
    canvas = figure.draw(data)
    save_figure(canvas, folder / f"{figure.name}.pdf")
    with journal():
        canvas.savefig(folder / f"{figure.name}.png", dpi=PICTURE_DPI, metadata={"Software": None})
