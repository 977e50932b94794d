"""A section, and the kept points of some runs there: records of the kernels and of Python alike."""

from __future__ import annotations

from math import inf
from typing import Any, NamedTuple

import numpy as np


class Section(NamedTuple):
    """The section whose returns are counted, and how long one is waited for."""

    phase: float = 0.0  # of the forcing, in periods
    indicator: int = -1  # that is zero there; -1: a phase
    rising: int = 1  # direction 1, -1, or 0 for both
    mode: int = -1  # -1: any
    after: int = 1  # 1: the state after a transition on the section, 0: before it
    every: int = 1  # so many passes are one return
    t_max: float = inf
    extremes: int = 1  # wanted in the kept window; 0: an engine may leave them out
    repeats: int = 1  # may be left out where the motion repeats itself bit for bit; 0: every return is run


class Kept(NamedTuple):
    """The kept section points of P runs, with true extremes and counts of the kept window; or one run's row of it.

    Extremes include both limits of a jump; with the wrong sign they are infinite where nothing was kept."""

    section: Any  # (P, keep, n)
    high: Any  # (P, rows): maxima of states, indicators, outputs
    low: Any  # and minima
    crossings: Any  # (P,) transitions
    contacts: Any
    elapsed: Any  # time spanned by the kept returns
    section_time: Any  # (P, keep)
    section_mode: Any
    status: Any  # (P,)

    @classmethod
    def room(cls, points: int, keep: int, n: int, rows: int) -> Kept:
        """Room for ``keep`` section points of each of so many runs."""
        whole, real = np.int64, np.nan
        return cls(
            np.full((points, keep, n), real),
            np.full((points, rows), real),
            np.full((points, rows), real),
            np.zeros(points, whole),
            np.zeros(points, whole),
            np.zeros(points),
            np.full((points, keep), real),
            np.zeros((points, keep), whole),
            np.zeros(points, whole),
        )
