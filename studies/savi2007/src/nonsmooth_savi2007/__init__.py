"""Savi, Divenyi, Franca & Weber, J. Sound Vib. 301 (2007) 59-73: its numerical figures and its claims.

``reproduce`` computes Figs. 2, 9-15, 17 and 18 of the paper by the exact flow and by the paper's own way (the smoothed
switch with eta = 1e-5, integrated by Runge-Kutta-Fehlberg), the effect of eta, and a report that puts each statement of
the paper beside what the model gives; beside Figs. 13 and 17 the basins of what coexists there, and in a full run
charts over two parameters. In ``figures`` one file computes and draws one group of
figures; ``claims`` measures the statements on the datasets of the figures, its ``verdicts`` is the rule by which they
are judged, ``report`` writes them down; ``finished`` knows what is there already. The paper's experiment is ``rig``
(the virtual one, which writes sessions), ``identification`` (its Section 3.1: ``nonsmooth.identify``) and
``comparison`` (its records over the model).
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nonsmooth_savi2007.measure import grazing_frequencies as grazing_frequencies
    from nonsmooth_savi2007.study import Reproduction as Reproduction
    from nonsmooth_savi2007.study import reproduce as reproduce

#: Loaded when first used: identifying a rig needs nothing of the reproduction.
_WHERE = {"Reproduction": "study", "grazing_frequencies": "measure", "reproduce": "study"}

__all__ = ["Reproduction", "grazing_frequencies", "reproduce"]


def __getattr__(name: str) -> Any:
    if name in _WHERE:
        return getattr(import_module(f"nonsmooth_savi2007.{_WHERE[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
