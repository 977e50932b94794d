"""A figure of the reproduction: how it is computed, drawn and described; finished ones in a folder are gone on from."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure as MatplotlibFigure

import nonsmooth
from nonsmooth import DataFileError, load, plot, save
from nonsmooth_savi2007.flows import Settings

Canvas: TypeAlias = "MatplotlibFigure"
Datasets: TypeAlias = "dict[str, xr.Dataset]"  # of a figure, by key

#: The procedures on which those parameters rest with which records of the rig are laid over the model.
RESTS_ON = ("springs", "support", "impulse", "response", "drop", "contact")


@dataclass(frozen=True)
class Figure:
    """One figure.

    Parameters
    ----------
    name : str
        Stem of its files: ``fig11``.
    number : int or None
        The paper's number, if it is the paper's.
    title : str
    compute : callable
        Settings -> datasets by key; the file of key ``exact`` is ``fig11_exact.nc``.
    sheet : callable
        (an empty Matplotlib figure, datasets) -> None: draws on it.
    caption : callable
        Datasets -> the caption, with the numbers of this run.
    size : (float, float)
        Width and height in widths of a page.
    rig : bool
        Whether it is measured on the virtual rig (``settings.bench``); what it shows is then synthetic.
    beside : int, optional
        Of a figure that the paper has not: the one of the paper whose parameters it has.
    full : bool
        Whether it is made in a full run only.
    procedures : tuple of str
        Of a figure of the rig: the procedures of Section 3.1 whose records it needs.
    """

    name: str
    number: int | None
    title: str
    compute: Callable[[Settings], Datasets]
    sheet: Callable[[Canvas, Datasets], None]
    caption: Callable[[Datasets], str]
    size: tuple[float, float] = (1.0, 0.5)
    rig: bool = False
    beside: int | None = None
    full: bool = False
    procedures: tuple[str, ...] = RESTS_ON

    @property
    def place(self) -> float:
        """Its place in the report: that of its number; of none, at the end."""
        if self.number is None and self.beside is not None:
            return self.beside + 0.5
        return 99.0 if self.number is None else self.number

    def draw(self, data: Datasets) -> Canvas:
        """The figure of these data, which pyplot does not list."""

        with plot.journal():
            canvas = MatplotlibFigure(figsize=(self.size[0] * plot.PAGE, self.size[1] * plot.PAGE))
            self.sheet(canvas, data)
        return canvas


def only_outer(grid: Any) -> None:
    """Hide the axes' names but for those at the foot and on the left; hidden, they still tell the unit of the ticks."""
    rows = np.atleast_2d(grid)
    for row in rows[:-1]:
        for ax in row:
            ax.xaxis.label.set_visible(False)
    for ax in rows[:, 1:].ravel():
        ax.yaxis.label.set_visible(False)


def two_rows(
    canvas: Canvas,
    rows: Sequence[str],
    titles: Sequence[str],
    cell: Callable[[Axes, int, int], object],
    sharey: bool | Literal["col"] = True,
) -> None:
    """Draw a sheet of two rows with names and of titled columns; ``cell(ax, i, j)`` draws a place."""
    grid = canvas.subplots(2, len(titles), sharex="col", sharey=sharey, squeeze=False)
    for i, name in enumerate(rows):
        for j, title in enumerate(titles):
            cell(grid[i, j], i, j)
            grid[i, j].set_ylabel(f"{name}\n{grid[i, j].get_ylabel()}")
            if i == 0:
                grid[i, j].set_title(f"({'abcd'[j]}) {title}", y=1.0, pad=9)
    only_outer(grid)


#: The datasets of a figure by key, and the seconds that they took.
Made: TypeAlias = "tuple[dict[str, xr.Dataset], float]"


def finish(name: str, data: Mapping[str, xr.Dataset], seconds: float, settings: Settings) -> None:
    """Write the datasets of a figure, and last the record that it is finished."""

    folder = settings.place
    record = folder / f"{name}.json"
    record.unlink(missing_ok=True)
    for key, dataset in data.items():
        save(dataset, folder / f"{name}_{key}.nc")
    words = {"made_by": _made_by(settings), "datasets": list(data), "seconds": seconds}
    record.write_text(json.dumps(words) + "\n", encoding="utf-8")


def finished(name: str, settings: Settings) -> Made | None:
    """Read what :func:`finish` wrote with the same sources and settings; None where that is not there, or damaged.

    Raises
    ------
    ValueError
        If it is of a quick run and this one is not, or the reverse.
    """
    folder = settings.place
    try:
        made_by = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))["made_by"]
        quick = bool(made_by["quick"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    if quick != settings.quick:
        raise ValueError(
            f"{folder} holds figures of a {'quick' if quick else 'whole'} run, and would mix the two: give another "
            "folder (--out)"
        )
    wanted = _made_by(settings)
    return _loaded(folder, name) if made_by in (wanted, wanted | {"full": True}) else None


def just_made(name: str, settings: Settings) -> Made:
    """Read what another process of this run has finished, even if the sources have been changed meanwhile.

    Raises
    ------
    RuntimeError
        If it is not there, or damaged.
    """
    found = _loaded(settings.place, name)
    if found is None:
        raise RuntimeError(f"{settings.place}: datasets of {name} are not there, or damaged, although it was measured")
    return found


def _loaded(folder: Path, name: str) -> Made | None:
    try:
        record = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        return {key: load(folder / f"{name}_{key}.nc") for key in record["datasets"]}, float(record["seconds"])
    except (OSError, DataFileError, ValueError, KeyError, TypeError):
        return None


def _made_by(settings: Settings) -> dict[str, str | bool]:
    """Identity of a figure: the sources of both packages, and how much work was asked for."""
    return {"sources": _sources(), "quick": settings.quick, "full": settings.full}


@cache
def _sources() -> str:
    """A hash of all sources of the toolbox and of this study."""

    digest = hashlib.sha256()
    for room in (Path(nonsmooth.__file__).parent, Path(__file__).parent):
        for file in sorted(room.rglob("*.py")):
            digest.update(f"{file.relative_to(room)}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def refuse_strange(folder: Path, names: Collection[str]) -> None:
    """Refuse a folder that holds files, none of them of this study.

    Raises
    ------
    ValueError
        If it is such a folder.
    """
    there = [path.name for path in folder.iterdir()]
    ours = {"rig", "claims.json", *(f"{name}.json" for name in names), *(f"{name}.png" for name in names)}
    if there and not ours.intersection(there):
        raise ValueError(
            f"{folder} holds other files ({', '.join(sorted(there)[:3])}{', ...' if len(there) > 3 else ''}), which a "
            "reproduction might replace: give a new or an empty folder (--out)"
        )
