"""The kept section points of some runs: the record that kernels fill and Python reads."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


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
            np.full((points, keep, n), real), np.full((points, rows), real), np.full((points, rows), real),
            np.zeros(points, whole), np.zeros(points, whole), np.zeros(points), np.full((points, keep), real),
            np.zeros((points, keep), whole), np.zeros(points, whole),
        )  # fmt: skip
