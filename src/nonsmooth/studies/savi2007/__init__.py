"""Savi, Divenyi, Franca & Weber, J. Sound Vib. 301 (2007) 59-73: its numerical figures and its claims.

``reproduce`` computes Figs. 2, 9-15, 17 and 18 of the paper by the exact flow and by the paper's own way (the smoothed
switch with eta = 1e-5, integrated by Runge-Kutta-Fehlberg), the effect of eta, and a report that puts each statement of
the paper beside what the model gives; beside Figs. 13 and 17 the basins of what coexists there, and in a full run
charts over two parameters. One file computes and draws one group of figures; ``claims`` measures the statements on
the datasets of the figures, ``verdicts`` has the rule by which they are judged, ``report`` writes them down;
``finished`` knows what is there already.
"""

from nonsmooth.studies.savi2007.grazing import grazing_frequencies
from nonsmooth.studies.savi2007.study import Reproduction, reproduce

__all__ = ["Reproduction", "grazing_frequencies", "reproduce"]
