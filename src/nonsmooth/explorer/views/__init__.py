"""Views that can be chosen in the panels of the page, one class per file. A new one is listed here alone."""

from __future__ import annotations

from nonsmooth.explorer.views.basins import Basins
from nonsmooth.explorer.views.branches import Branches
from nonsmooth.explorer.views.chart import Chart
from nonsmooth.explorer.views.response import Response
from nonsmooth.explorer.views.spectrum import Spectrum
from nonsmooth.explorer.views.view import Setting, View

__all__ = ["CHOSEN", "PANELS", "SETTINGS", "VIEWS"]

#: Views in the order of their tabs.
VIEWS: tuple[type[View], ...] = (Branches, Response, Chart, Basins, Spectrum)
#: The views that were there first, by panel, and after them those of this list.
PANELS: dict[str, dict[str, str]] = {
    panel: {**first, **{view.name: view.title for view in VIEWS if view.panel == panel and view.title}}
    for panel, first in {
        "upper": {"diagram": "Bifurcation"}, "plane": {"portrait": "Phase plane"}, "lower": {"history": "Time history"},
    }.items()
}  # fmt: skip
SETTINGS: dict[str, Setting] = {name: one for view in VIEWS for name, one in view.settings.items()}
#: The view of every stage.
CHOSEN: dict[str, type[View]] = {stage: view for view in VIEWS for stage in view.stages}
