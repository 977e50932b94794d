"""Interface that a flow method offers to the analyses: two calls, the same for every method.

An engine is bound to one system (its parameters' values apart), one method and one tolerance. It never
raises for numerical trouble; it writes a status code (``kernels.codes``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.results.memory import room_for

__all__ = ["Chain", "Engine", "Log", "SectionPlan", "State"]

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


@dataclass(frozen=True)
class SectionPlan:
    """A section in integers. Stroboscopic: ``indicator`` = -1 and ``phase`` (0..1). Poincare: the indicator's
    index, ``rising`` +1 / -1 / 0 (both), ``mode`` index or -1 (any), ``after`` 1 (limit after a transition
    at the same instant) or 0 (before), ``every`` k-th return, ``t_max`` the longest wait for one return."""

    phase: float = 0.0
    indicator: int = -1
    rising: int = 1
    mode: int = -1
    after: int = 1
    every: int = 1
    t_max: float = np.inf
    extremes: bool = True  # False: extremes are not wanted, an engine may leave them out


@dataclass
class Chain:
    """Buffers for P points run one after the other; ``keep`` section points are stored for each.

    Extremes are the true ones over the kept window, both limits of a jump included. ``indicator_*`` give the
    clearances. ``elapsed`` is the time spanned by the kept returns."""

    section: FloatArray  # (P, keep, n)
    maximum: FloatArray  # (P, n)
    minimum: FloatArray  # (P, n)
    indicator_max: FloatArray  # (P, n_indicators)
    indicator_min: FloatArray
    output_max: FloatArray  # (P, n_outputs)
    output_min: FloatArray
    crossings: IntArray  # (P,) transitions in the kept window
    contacts: IntArray  # (P,)
    elapsed: FloatArray  # (P,)
    section_time: FloatArray  # (P, keep)
    section_mode: IntArray  # (P, keep)
    status: IntArray  # (P,) OK, DIVERGED, CHATTER, TOO_MANY_CROSSINGS, NOT_GUARANTEED, NO_CONVERGENCE, BEYOND_STOP

    @classmethod
    def empty(cls, points: int, keep: int, n: int, n_indicators: int, n_outputs: int) -> Chain:
        room_for(8.0 * points * keep * (n + 2), f"{points:.6g} x {keep:.6g} section points", "ask for fewer of them")
        nan, zero = np.nan, np.int64
        return cls(
            np.full((points, keep, n), nan), np.full((points, n), nan), np.full((points, n), nan),
            np.full((points, n_indicators), nan), np.full((points, n_indicators), nan),
            np.full((points, n_outputs), nan), np.full((points, n_outputs), nan),
            np.zeros(points, zero), np.zeros(points, zero), np.zeros(points),
            np.full((points, keep), nan), np.zeros((points, keep), zero), np.zeros(points, zero),
        )  # fmt: skip

    def widened(self, n: int) -> Chain:
        """The same buffers but for those of the states, which have n columns."""
        points, keep = self.section.shape[:2]
        return replace(
            self, section=np.full((points, keep, n), np.nan), maximum=np.full((points, n), np.nan),
            minimum=np.full((points, n), np.nan),
        )  # fmt: skip

    def record(self) -> Any:
        """The same arrays as the kernels of the exact flow take them (``kernels.records.Kept``)."""
        from nonsmooth.kernels.hybrid.records import Kept

        return Kept(
            self.section, self.maximum, self.minimum, self.indicator_max, self.indicator_min, self.output_max,
            self.output_min, self.crossings, self.contacts, self.elapsed, self.section_time, self.section_mode,
            self.status,
        )  # fmt: skip


@dataclass
class Log:
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


class Engine(Protocol):
    name: str  # "exact", "taylor" or "rkf45"

    def prepare(self, points: FloatArray) -> Any:
        """Tables for the parameter points ``points`` (P, n_parameters), to be passed to the calls below."""

    def chain(
        self, tables: Any, first: int, last: int, state: State, starts: FloatArray | None,
        plan: SectionPlan, transient: int, keep: int, out: Chain,
    ) -> None:  # fmt: skip
        """Points ``first <= i < last``: run ``transient`` section returns, then ``keep`` more into ``out``.

        With ``starts`` None each point goes on from ``state`` (carried along, left at the end of the last
        point); else point i begins afresh at ``starts[i]`` in the first mode, at t = 0. Releases the GIL.
        A point that fails gets its status; the next carried one then starts from the last finite state of
        the previous good point."""

    def room(self, tables: Any) -> Any:
        """Memory of ``record`` for many short runs with these tables."""

    def record(self, tables: Any, state: State, until: float, samples: FloatArray, room: Any = None) -> Log:
        """Point 0: march ``state`` to the time ``until``, with dense samples at the increasing absolute
        times ``samples`` (a sample exactly at a crossing is the limit after it)."""
