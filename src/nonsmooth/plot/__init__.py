"""Figures of results: ``(result, ax=None, ...) -> ax``, one file per concept.

Those of identified parameters stand in ``plot.identification``. Matplotlib is loaded when the first figure is drawn.
All figures but sketches take ``title=``, ``legend=False``, ``unit="mm"`` and properties of lines (``linewidth=2``) too.
"""

from typing import Any

from nonsmooth.plot import identification
from nonsmooth.plot.branches import branch, controlled_branch, curve, manifolds, multipliers
from nonsmooth.plot.comparison import (
    comparison_diagram,
    comparison_distances,
    comparison_phase_portrait,
    comparison_record,
    comparison_response,
    comparison_section,
    comparison_time,
)
from nonsmooth.plot.labels import name_plane
from nonsmooth.plot.mechanism import mechanism
from nonsmooth.plot.planes import basin_fractions, basins, chart
from nonsmooth.plot.prefixes import prefixed
from nonsmooth.plot.regions import regions
from nonsmooth.plot.style import COLORS, COLUMN, PAGE, annotate, journal, save_figure, shared_legend, slides
from nonsmooth.plot.sweeps import (
    bifurcation,
    bifurcation_diagram,
    density,
    frequency_response,
    one_branch,
    smoothing_report,
)
from nonsmooth.plot.trajectories import (
    amplitude_spectrum,
    orbit,
    phase_portrait,
    section,
    shade_zone,
    time_history,
)

__all__ = [
    "COLORS",
    "COLUMN",
    "PAGE",
    "amplitude_spectrum",
    "annotate",
    "basin_fractions",
    "basins",
    "bifurcation",
    "bifurcation_diagram",
    "branch",
    "chart",
    "comparison_diagram",
    "comparison_distances",
    "comparison_phase_portrait",
    "comparison_record",
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
    "mechanism",
    "multipliers",
    "name_plane",
    "one_branch",
    "orbit",
    "phase_portrait",
    "prefixed",
    "regions",
    "save_figure",
    "section",
    "shade_zone",
    "shared_legend",
    "slides",
    "smoothing_report",
    "time_history",
]


def __getattr__(name: str) -> Any:
    from nonsmooth.errors import unknown

    there = not name.startswith("_") and hasattr(identification, name)
    hint = f"; there is ns.plot.identification.{name}" if there else ""
    raise AttributeError(unknown(name, "a figure", "nonsmooth.plot", __all__) + hint, name=name)
