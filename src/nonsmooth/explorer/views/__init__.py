"""Drawing of the views that ``kinds`` lists; the class of a new one is named here too."""

from __future__ import annotations

from nonsmooth.explorer.views.motion import History, Portrait, Readout, Section
from nonsmooth.explorer.views.over_parameters import Branches, Diagram, Response
from nonsmooth.explorer.views.planes import Basins, Chart
from nonsmooth.explorer.views.recording import Recording
from nonsmooth.explorer.views.spectrum import Spectrum
from nonsmooth.explorer.views.view import View

__all__ = ["VIEWS"]

#: What draws into another's figure comes behind it.
VIEWS: tuple[type[View], ...] = (
    Portrait, Diagram, Section, Readout, History, Branches, Response, Chart, Basins, Spectrum, Recording,
)  # fmt: skip
