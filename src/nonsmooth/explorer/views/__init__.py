"""Drawing of the views that ``kinds`` lists; the class of a new one is named here too."""

from __future__ import annotations

from nonsmooth.explorer.views.basins import Basins
from nonsmooth.explorer.views.branches import Branches
from nonsmooth.explorer.views.chart import Chart
from nonsmooth.explorer.views.diagram import Diagram
from nonsmooth.explorer.views.motion import History, Portrait, Section
from nonsmooth.explorer.views.readout import Readout
from nonsmooth.explorer.views.recording import Recording
from nonsmooth.explorer.views.response import Response
from nonsmooth.explorer.views.spectrum import Spectrum
from nonsmooth.explorer.views.view import View

__all__ = ["VIEWS"]

#: What draws into another's figure comes behind it.
VIEWS: tuple[type[View], ...] = (
    Portrait, Diagram, Section, Readout, History, Branches, Response, Chart, Basins, Spectrum, Recording,
)  # fmt: skip
