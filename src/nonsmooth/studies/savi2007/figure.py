"""A figure of the reproduction: how it is computed, drawn and described."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nonsmooth.studies.savi2007.flows import Settings

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure as Canvas

__all__ = ["Figure", "sheet"]


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
    """

    name: str
    number: int | None
    title: str
    compute: Callable[[Settings], dict[str, xr.Dataset]]
    draw: Callable[[Mapping[str, xr.Dataset]], Canvas]
    caption: Callable[[Mapping[str, xr.Dataset]], str]
    rig: bool = False


def sheet(width: float, height: float) -> Canvas:
    """An empty figure in inches, outside pyplot's list of open figures."""
    from matplotlib.figure import Figure as Canvas

    return Canvas(figsize=(width, height))
