"""A figure of the reproduction: how it is computed, drawn and described."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from nonsmooth import plot

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as MatplotlibFigure

    from nonsmooth.studies.savi2007.flows import Settings

__all__ = ["Canvas", "Compute", "Datasets", "Draw", "Figure", "drawn", "only_outer"]

Canvas: TypeAlias = "MatplotlibFigure"
Datasets: TypeAlias = "dict[str, xr.Dataset]"  # of a figure, by key
Compute: TypeAlias = "Callable[[Settings], Datasets]"
Draw: TypeAlias = "Callable[[Datasets], Canvas]"

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
    draw : callable
        Datasets -> a Matplotlib figure.
    caption : callable
        Datasets -> the caption, with the numbers of this run.
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
    compute: Compute
    draw: Draw
    caption: Callable[[Datasets], str]
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


def only_outer(grid: Any) -> None:
    """Hide the axes' names but for those at the foot and on the left; hidden, they still tell the unit of the ticks."""
    rows = np.atleast_2d(grid)
    for row in rows[:-1]:
        for ax in row:
            ax.xaxis.label.set_visible(False)
    for ax in rows[:, 1:].ravel():
        ax.yaxis.label.set_visible(False)


def drawn(width: float, height: float) -> Callable[[Callable[[Canvas, Datasets], None]], Draw]:
    """Give what a function draws on an empty sheet, which pyplot does not list; lengths in widths of a page."""

    def decorated(draw: Callable[[Canvas, Datasets], None]) -> Draw:
        @wraps(draw)
        def framed(data: Datasets) -> Canvas:
            from matplotlib.figure import Figure as Sheet

            with plot.journal():
                canvas = Sheet(figsize=(width * plot.PAGE, height * plot.PAGE))
                draw(canvas, data)
            return canvas

        return framed

    return decorated
