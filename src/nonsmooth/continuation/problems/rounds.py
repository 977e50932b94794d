"""One simulated round of an orbit, read as a signature: which transitions happen, and in which order.

The simulation isolates every crossing, so a round that shows an orbit's own signature proves it admissible.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import AT_ONCE, Round, Signature, Visit
from nonsmooth.continuation.problems.visits import anchored, led, round_of, visits_of
from nonsmooth.flow.engines.engine import State
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Shooting
    from nonsmooth.flow.engines.engine import TrajectoryLog
    from nonsmooth.flow.engines.loop import Engine

RTOL = 1e-13  # where the flow is not exact
ROUNDING = 1e-14  # of the period
INSTANT = 1e-12  # of the period: transitions as near as this happen at one instant
SHORT = 1e-6  # of the period: as soon after an impact follows the next one shortly before rest
INTO = 0.38  # of the visit in which a round begins: half way, symmetric motion may touch something
LATE = 0.25  # of the period: the largest change of the period of a neighbour


class Rounds:
    """Rounds of orbits of one system, begun within their longest visits."""

    def __init__(self, shooting: Shooting) -> None:
        self.system, self.flow, self.period_number = shooting.system, shooting.flow, shooting.period_number
        self.engine = engine_for(shooting.system, rtol=RTOL)
        if self.engine.name == "exact":
            self.engine = engine_for(shooting.system)

    def read(
        self, shooting: Shooting, X: FloatArray, values: FloatArray, change: FloatArray | float = 0.0
    ) -> Round | None:
        """The round at ``values`` from within the longest visit of an orbit, its state changed by ``change``.

        None where it fails, or does not come back to the mode where it began."""
        i, begin, z, period = self._within(shooting, X, values)
        mode = int(shooting.modes[i])
        own = np.ones(len(z), dtype=bool)
        own[: len(self.system.states)] = [not lacks for lacks in self.system.traced.lacking[mode]]
        z = np.where(own, z + change, z)
        return (self._forced if shooting.forced else self.free)(values, z, mode, begin, period)

    def shows(self, shooting: Shooting, X: FloatArray, values: FloatArray) -> bool:
        """Return whether the round of an orbit takes the transitions of its signature; True where it fails.

        What the exact flow denies the series are asked too."""
        i, begin, z, period = self._within(shooting, X, values)
        times, taken = shooting.split(X)[0], [visit.transition for visit in shooting.signature.crossings]
        own, at = taken[i:] + taken[:i], np.concatenate([times[i:], times[:i] + period])
        for engine in (lambda: self.engine, lambda: self.second):
            log = self._run(values, z, int(shooting.modes[i]), begin, begin + period, [], engine())
            if log is None or log.crossing_transition.tolist() == own:
                return True
            shown = [visit.transition for visit in visits_of(self.flow, values, log, z[len(self.system.states) :])[0]]
            if shown == own or self._told(shown, log.crossing_time, period) == self._told(own, at, period):
                return True
        return False

    def _told(self, transitions: list[int], times: FloatArray, period: float) -> list[Any]:
        """The transitions but for impacts that another one follows at once: how many come before rest is rounding. So
        is the order of those that happen at one instant, each by itself: of them the conditions."""
        jumps, told, among = self.system.traced.transitions, list[Any](), list[int]()
        for k, until in zip(transitions, np.diff(times, append=np.inf), strict=True):
            if not (INSTANT * period < until < SHORT * period and jumps[k].source == jumps[k].target):
                among.append(k)
            if until > INSTANT * period:
                told += among if len(among) < 2 else sorted(repr(jumps[one].rows) for one in among)
                among = []
        return told

    @cached_property
    def second(self) -> Engine:
        """The engine that is asked where the first one denies a signature."""
        alone = self.engine.name != "exact" or self.system.traced.patterns is not None
        return self.engine if alone else engine_for(self.system, "taylor", rtol=RTOL)

    def _within(self, shooting: Shooting, X: FloatArray, values: FloatArray) -> tuple[int, float, FloatArray, float]:
        """The longest visit of an orbit, time and state within it, and the period."""
        times, states = shooting.split(X)
        forced = shooting.forced
        period = self.period_number * self.flow.period(values)[0] if forced else float(X[shooting.size - 1])
        ends = np.concatenate([[0.0], times, [period]])
        lengths = np.diff(ends)
        if not forced and len(times):  # the section lies within a visit, which may have become a short one
            lengths[0], lengths[-1] = lengths[0] + lengths[-1], 0.0
        i = int(lengths.argmax())
        begin = float(ends[i])
        into = INTO * float(lengths[i]) if forced or i else 0.0
        return i, begin + into, led(self.flow, values, shooting.modes[i], begin, into, states[i]), period

    def _run(
        self,
        values: FloatArray,
        z: FloatArray,
        mode: int,
        begin: float,
        until: float,
        at: Any,
        engine: Engine | None = None,
    ) -> TrajectoryLog | None:
        n = len(self.system.states)
        state = State(z[:n].copy(), z[n:].copy())
        state.counters[0], state.settled = mode, True
        T = self.flow.period(values)[0]
        state.clock[:] = (begin % T, begin // T, T) if np.isfinite(T) else (begin, 0.0, 0.0)
        engine = engine or self.engine
        log = engine.record(engine.prepare(values[None, :]), state, until, np.asarray(at, dtype=float))
        return log if log.status in (codes.OK, codes.NOT_GUARANTEED) else None

    def _forced(self, values: FloatArray, z: FloatArray, mode: int, begin: float, period: float) -> Round | None:
        log = self._run(values, z, mode, begin, begin + period, [period])
        once = None if log is None else round_of(self.flow, values, log, z, mode, period, self.period_number)
        if log is None or once is None:
            return None
        first = self._behind(once, values)
        section, memory = np.nan_to_num(log.sample_u[0]), log.sample_memory[0]
        if first < len(once.times) and once.times[first] - period < ROUNDING * period:  # a transition at the section
            section, memory = np.nan_to_num(log.u_before[first]), once.states[first, len(section) :]
        found = once.begun(first, period, np.concatenate([section, memory]))
        found.times = np.maximum(found.times, 0.0)
        return found

    def _behind(self, once: Round, values: FloatArray) -> int:
        """The first visit that ends at the section or behind it, whatever rounding: what happens at phase 0, with what
        follows at once, is before it."""
        before = True
        for j, visit in enumerate(once.signature.crossings):
            if visit.row == -1:
                turn = visit.turn + self.flow.phase(values, visit.transition)[0]
                before = bool(turn <= self.period_number)
            elif visit.row != AT_ONCE:
                before = bool(once.times[j] < once.period)
            if not before:
                return j
        return len(once.times)

    def free(self, values: FloatArray, z: FloatArray, mode: int, begin: float, period: float) -> Round | None:
        """A round without forcing, from a state, that takes about ``period``."""
        log = self._run(values, z, mode, 0.0, (1.5 + LATE) * period, [])
        if log is None:
            return None
        visits, after = visits_of(self.flow, values, log, z[len(self.system.states) :])
        instants = log.crossing_time
        if not visits:
            return Round(0, period, Signature((Visit(mode),)), np.empty(0), z[None, :])
        again = [
            j
            for j in range(1, len(visits))
            if visits[j] == visits[0] and abs(instants[j] - instants[0] - period) < LATE * period
        ]
        if not again:
            return None
        j = min(again, key=lambda j: float(np.abs(after[j] - after[0]).max()))
        signature, states = Signature((*visits[:j], Visit(mode))), np.vstack([z, after[:j]])
        period = float(instants[j] - instants[0])
        return anchored(self.flow, values, Round(0, period, signature, instants[:j], states))
