"""Figures of results, one file per kind: ``(result, ax=None, ...) -> ax``.

Matplotlib is loaded when the first figure is drawn.
"""

from nonsmooth.plot.bifurcation import bifurcation
from nonsmooth.plot.frequency_response import frequency_response
from nonsmooth.plot.phase_portrait import phase_portrait
from nonsmooth.plot.regions import regions
from nonsmooth.plot.section import section
from nonsmooth.plot.style import COLORS, COLUMN, PAGE, journal, save_figure
from nonsmooth.plot.time_history import time_history

__all__ = [
    "COLORS",
    "COLUMN",
    "PAGE",
    "bifurcation",
    "frequency_response",
    "journal",
    "phase_portrait",
    "regions",
    "save_figure",
    "section",
    "time_history",
]
