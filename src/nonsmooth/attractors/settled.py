"""Ends of many starts, one array per quantity, one row per job; the place of one, from which it can go on.

A *place* is a start with everything that the run needs besides its mode: the states, then the memory, then, where a
forced system is looked at on a Poincare section, the time since the forcing period began (:attr:`Settler.width` numbers
in all). A plain start has the states only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.flow.failure import LEAST
from nonsmooth.flow.poincare import result_status
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.transition import phases, varying_phases

if TYPE_CHECKING:
    from nonsmooth.kernels.judging.settle import Jobs
    from nonsmooth.system.system import System


ROUNDED = 1e-4  # of a state's value: what is smaller cannot be told from rounding where returns are to be nil

USABLE = (codes.OK, codes.SLOW, codes.NOT_PERIODIC, codes.NOT_GUARANTEED)


def usable(status: Any) -> NDArray[np.bool_]:
    """Marks of runs that came to their end, so that extremes and last points mean something."""
    return np.isin(status, USABLE)


def least_sizes(method: str, scale: FloatArray) -> tuple[FloatArray, float]:
    """The least size of a motion (n,), and as a part of the states' values, where a method integrates.

    A Runge-Kutta pair does not stop: its steps grow until its error, ``rtol`` of the value and the scale, holds
    them, and a return cannot be smaller. The others settle to rounding."""
    return (scale, 1.0) if method == "rkf45" else (LEAST * scale, ROUNDED)


def half_ranges(maximum: FloatArray, minimum: FloatArray, least: FloatArray) -> FloatArray:
    """Half the range of each state (..., n), and no less than the least size: this of one that no mode visited has."""
    return np.asarray(np.fmax(0.5 * (maximum - minimum), least))


@dataclass
class Settled:
    """Results of J jobs. Extremes and counts are over whole cycles where there is a period, else the kept window; of a
    state that no mode visited has NaN.

    ``multiplier`` is the largest modulus over ``period_number`` returns (NaN: unknown).
    """

    period_number: IntArray  # (J,)
    status: IntArray
    residual: FloatArray
    multiplier: FloatArray
    crossings: FloatArray
    contacts: FloatArray
    maximum: FloatArray  # (J, n)
    minimum: FloatArray  # (J, n)
    last: FloatArray  # (J, width): the section point at the end, and what else is needed to go on from there
    mode: IntArray

    @classmethod
    def empty(cls, jobs: int, n: int, width: int | None = None) -> Settled:
        """Room for so many jobs of n states."""

        def whole() -> IntArray:
            return np.zeros(jobs, dtype=np.int64)

        def one() -> FloatArray:
            return np.full(jobs, np.nan)

        def state(size: int = n) -> FloatArray:
            return np.full((jobs, size), np.nan)

        return cls(
            whole(),
            whole(),
            one(),
            one(),
            one(),
            one(),
            state(),
            state(),
            state(width or n),
            whole(),
        )

    @classmethod
    def joined(cls, parts: Sequence[Settled]) -> Settled:
        """The jobs of all parts, one after the other."""
        return cls(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(cls)))

    def judged(self, jobs: Jobs) -> Settled:
        """The same with what was found out about the jobs; statuses of results in place of the kernel's codes."""
        for name in ("period_number", "status", "residual", "multiplier"):
            getattr(self, name)[:] = getattr(jobs, name)
        unseen = self.maximum < self.minimum
        self.maximum[unseen], self.minimum[unseen] = np.nan, np.nan
        failed = ~usable(self.status)
        self.status[failed] = [result_status(code) for code in self.status[failed]]
        return self

    def put(self, which: Any, some: Settled) -> None:
        """Take the results of some jobs."""
        for item in fields(self):
            getattr(self, item.name)[which] = getattr(some, item.name)

    def __getitem__(self, which: Any) -> Settled:
        return Settled(*(getattr(self, item.name)[which] for item in fields(self)))


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
