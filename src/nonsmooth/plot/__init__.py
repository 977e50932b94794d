"""Figures of results, one file per kind: ``(result, ax=None, ...) -> ax``.

Those of identified parameters stand in ``plot.identification``. Matplotlib is loaded when the first figure is drawn.
"""

from typing import Any

from nonsmooth.plot import identification
from nonsmooth.plot.amplitude_spectrum import amplitude_spectrum
from nonsmooth.plot.basin_fractions import basin_fractions
from nonsmooth.plot.basins import basins
from nonsmooth.plot.bifurcation import bifurcation
from nonsmooth.plot.bifurcation_diagram import bifurcation_diagram
from nonsmooth.plot.branch import branch
from nonsmooth.plot.chart import chart
from nonsmooth.plot.comparison_diagram import comparison_diagram
from nonsmooth.plot.comparison_motion import (
    comparison_distances,
    comparison_phase_portrait,
    comparison_section,
    comparison_time,
)
from nonsmooth.plot.comparison_response import comparison_response
from nonsmooth.plot.controlled_branch import controlled_branch
from nonsmooth.plot.curve import curve
from nonsmooth.plot.density import density
from nonsmooth.plot.frequency_response import frequency_response
from nonsmooth.plot.manifolds import manifolds
from nonsmooth.plot.multipliers import multipliers
from nonsmooth.plot.orbit import orbit
from nonsmooth.plot.phase_portrait import phase_portrait
from nonsmooth.plot.regions import regions
from nonsmooth.plot.section import section
from nonsmooth.plot.smoothing_report import smoothing_report
from nonsmooth.plot.style import COLORS, COLUMN, PAGE, journal, save_figure
from nonsmooth.plot.time_history import time_history

__all__ = [
    "COLORS",
    "COLUMN",
    "PAGE",
    "amplitude_spectrum",
    "basin_fractions",
    "basins",
    "bifurcation",
    "bifurcation_diagram",
    "branch",
    "chart",
    "comparison_diagram",
    "comparison_distances",
    "comparison_phase_portrait",
    "comparison_response",
    "comparison_section",
    "comparison_time",
    "controlled_branch",
    "curve",
    "density",
    "frequency_response",
    "identification",
    "journal",
    "manifolds",
    "multipliers",
    "orbit",
    "phase_portrait",
    "regions",
    "save_figure",
    "section",
    "smoothing_report",
    "time_history",
]


def __getattr__(name: str) -> Any:
    from nonsmooth.system.names import unknown

    raise AttributeError(unknown(name, "a figure", "nonsmooth.plot", __all__), name=name)
