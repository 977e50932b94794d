"""A figure of the reproduction: how it is computed, drawn and described."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure as MatplotlibFigure

from nonsmooth import plot
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
        return 99.0 if self.number is None else float(self.number)

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
