"""A run under inputs at samples, as it is recorded for its derivatives and for the windows of a fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.flow.engines.engine import State, TrajectoryLog
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.flow.inputs import DelayedInputs, under


@dataclass(frozen=True, eq=False)
class SampledRun:
    """A run under inputs at its samples.

    Attributes
    ----------
    time : array (N,)
        The system's time.
    z : array (N, n)
        States and memory.
    mode, segment : array (N,) of int
        The mode, and how many transitions came before.
    log : TrajectoryLog
    begin : float
    start : (int, array (n,))
        Mode, states and memory at the beginning, before any transition.
    course, changes
        The inputs of the run, the instants at which they change, and the log's samples there.
    moved : array (N,) of int, or 0
        By how many segments a sample stands beside the one in whose time it lies.
    D, rate, of_time : array
        Those of its :class:`Variation`, where they were asked for.
    """

    time: FloatArray
    z: FloatArray
    mode: IntArray
    segment: IntArray
    log: TrajectoryLog
    begin: float
    start: tuple[int, FloatArray]
    course: DelayedInputs | None
    changes: tuple[FloatArray, IntArray]
    moved: IntArray | int = 0
    D: FloatArray | None = None
    rate: FloatArray | None = None
    of_time: FloatArray | None = None

    @property
    def begun(self) -> tuple[int, FloatArray]:
        """Mode, states and memory at the beginning, behind the transitions that are taken there at once."""
        return int(self.log.sample_mode[0]), np.concatenate([held(self.log.sample_u[0]), self.log.sample_memory[0]])


def sampled(
    engine: Engine,
    tables: Any,
    state: State,
    begin: float,
    times: FloatArray,
    course: DelayedInputs | None = None,
    most: float = np.inf,
) -> SampledRun:
    """March from a state at ``begin`` to the samples; given up beyond ``most`` steps for each."""
    changes, instants, cuts = under(course, state, begin, times[-1]), times, np.zeros(0)
    if changes is not None:
        cuts, instants = changes.times, np.union1d(times, changes.times)
    start = int(state.counters[0]), state.place
    # the start itself is a sample too: there the transitions that hold already have been taken
    samples, most = np.append(begin, instants), most * len(instants)
    log = engine.record(tables, state, times[-1], samples, changes=changes, most=most)
    at = slice(1, None) if changes is None else 1 + np.searchsorted(instants, times)
    z = np.hstack([held(log.sample_u), log.sample_memory])[at]
    where = cuts, 1 + np.searchsorted(instants, cuts)
    return SampledRun(times, z, log.sample_mode[at], log.sample_segment[at], log, begin, start, course, where)


def held(u: FloatArray) -> FloatArray:
    """States with zeros for those that a mode lacks."""
    return np.where(np.isnan(u), 0.0, u)
