"""Records in which an engine is asked for runs, and answers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray

IntArray = NDArray[np.int64]


@dataclass
class State:
    """Place of a trajectory: everything needed to go on. Kernels read and write it in place.

    ``clock[0]`` is the time since the start of the current forcing period (autonomous: the time), ``clock[1]``
    the number of whole periods before it, so that no digits are lost in long runs: t = clock[1] * T + clock[0].
    ``clock[2]`` is the period T in which clock[0] was measured (0: none yet), so that a carried state keeps its
    phase when the forcing frequency changes. ``counters``: [mode, and three places that an engine may use].
    """

    u: FloatArray  # (n,)
    memory: FloatArray  # (n_memory,)
    clock: FloatArray = field(default_factory=lambda: np.zeros(3))
    counters: IntArray = field(default_factory=lambda: np.array([0, -1, 0, 0], dtype=np.int64))
    settled: bool = False  # False: the start rules (transitions that already hold) are still to be applied

    def keep_phase(self, period: float, phase: float) -> None:
        """Go on under a forcing of another period at equal phase of it.

        ``phase`` is that of the section (negative: none): a state left there stays exactly there, else rounding could
        count the same point as a return once more."""
        if not period < np.inf:
            self.clock[2] = 0.0
            return
        if self.clock[2] > 0.0:
            self.clock[0] *= period / self.clock[2]
        if phase >= 0.0 and abs(self.clock[0] - phase * period) <= 1e-12 * period:
            self.clock[0] = phase * period
        self.clock[2] = period

    def motion(self) -> Any:
        """The same arrays as the kernels take them (``kernels.records.Motion``)."""
        from nonsmooth.kernels.hybrid.records import Motion

        return Motion(self.u, self.memory, self.clock, self.counters)

    def copy(self) -> State:
        return State(self.u.copy(), self.memory.copy(), self.clock.copy(), self.counters.copy(), self.settled)


class Changes(NamedTuple):
    """Instants (K,) at which states that stand for inputs change, their values (K, m) from then on, and the number of
    the first of these states."""

    times: FloatArray
    values: FloatArray
    first: int


NO_CHANGES = Changes(np.zeros(0), np.zeros((0, 0)), 0)


@dataclass
class TrajectoryLog:
    """Everything that ``record`` collected, already trimmed: samples at the times asked for, crossings and touches."""

    sample_u: FloatArray  # (n_samples, n)
    sample_memory: FloatArray  # (n_samples, n_memory)
    sample_mode: IntArray  # (n_samples,)
    sample_segment: IntArray  # (n_samples,) number of crossings before the sample
    crossing_time: FloatArray  # (n_crossings,)
    crossing_transition: IntArray
    u_before: FloatArray  # (n_crossings, n)
    u_after: FloatArray
    memory_after: FloatArray  # (n_crossings, n_memory)
    touch_time: FloatArray  # (n_touches,) non-crossing maxima of an armed indicator row
    touch_indicator: IntArray
    touch_u: FloatArray  # (n_touches, n)
    touch_clearance: FloatArray  # (n_touches,) = -(sign * indicator) > 0 at the extremum
    status: int
    message: str = ""
