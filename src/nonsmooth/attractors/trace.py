"""The place of a run, as numbers from which it can go on, and the section points it visits from there.

A *place* is a start with everything that the run needs besides its mode: the states, then the memory, then, where a
forced system is looked at on a Poincare section, the time since the forcing period began (:attr:`Settler.width` numbers
in all). A plain start has the states only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.system.transition import phases, varying_phases

if TYPE_CHECKING:
    from nonsmooth.system.system import System


@dataclass(frozen=True)
class SectionTrace:
    """Section points of one run; none where it failed."""

    points: FloatArray  # (keep, n)
    modes: IntArray  # (keep,)
    times: FloatArray  # (keep,) since the run began
    end: FloatArray  # (width,): the place where it ended
    mode: int


def mode_at(system: System, phase: float, values: FloatArray) -> int:
    """The mode in which a run begins at a phase of the forcing: the first, or where transitions before it lead.

    ``values`` are those of the parameters.

    A start says nothing of the mode. At phase 0 it is the first; a run that begins later in the period, on a bang-bang
    force say, must not begin on the branch that is over by then."""
    mode, jumps = 0, system.traced.transitions
    varying = varying_phases(system.traced)
    at = phases(system.traced) if varying is None else varying(values)
    for k in np.argsort(at, kind="stable"):
        if 0.0 < at[k] <= phase and jumps[k].source == mode:
            mode = jumps[k].target
    return mode
