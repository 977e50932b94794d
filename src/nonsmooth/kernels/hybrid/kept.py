"""Records of the kernels and of Python alike: a section, kept points of some runs there; ends of segments."""

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

    Extremes include both limits of a jump, not what lies between at its instant; with the wrong sign they are infinite
    where nothing was kept."""

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


class Segments(NamedTuple):
    """Ends and derivatives of m segments."""

    z: Any  # (m, n)
    Phi: Any  # (m, n, n)
    P: Any  # (m, n, n_active), at fixed t0 and tau
    f_begin: Any  # (m, n)
    f_end: Any  # (m, n) = dz/dtau
    divergence: Any  # (m,) integral of div f = log det Phi
    status: Any  # (m,) 0, DIVERGED or NO_CONVERGENCE

    @classmethod
    def room(cls, m: int, n: int, n_active: int) -> Segments:
        """Room for so many."""
        sizes = (m, n), (m, n, n), (m, n, n_active), (m, n), (m, n), m
        return cls._make([*(np.empty(size) for size in sizes), np.empty(m, dtype=np.int64)])

    def start_time(self) -> Any:
        """dz/dt0 at fixed tau (m, n): f_end - Phi f_begin."""
        return self.f_end - np.einsum("mij,mj->mi", self.Phi, self.f_begin)
