"""A simulation's log read as visits of a signature, and as once round an orbit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import AT_ONCE, Round, Signature, Visit
from nonsmooth.continuation.problems.surfaces import one_surface
from nonsmooth.flow.saltation import BEHIND
from nonsmooth.system.symbolic.traced import ALONE, FOUND

if TYPE_CHECKING:
    from nonsmooth.flow.engines.engine import TrajectoryLog
    from nonsmooth.flow.variational import Jump, VariationalFlow

ROUNDING = 1e-13  # of an indicator's size


def visits_of(
    flow: VariationalFlow, values: FloatArray, log: TrajectoryLog, memory: FloatArray, first: int = 0
) -> tuple[list[Visit], FloatArray]:
    """Visits that end with the transitions of a log from ``first`` on, and the states (m, n_z) just after these.

    ``memory`` is that before the first of them. The row of each condition is the one that is zero."""
    flow.catch_up()
    traced, instant = flow.traced, _AtOnce(values[list(flow.places)])
    visits = []
    for i in range(first, len(log.crossing_transition)):
        k, t = int(log.crossing_transition[i]), float(log.crossing_time[i])
        jump = traced.transitions[k]
        if jump.at is not None:
            turn = round(t / flow.period(values)[0] - flow.phase(values, k)[0])
            visits.append(Visit(jump.source, k, -1, turn))
            instant.begin()
        else:
            before = np.concatenate([np.nan_to_num(log.u_before[i]), memory])
            same = i > 0 and t == float(log.crossing_time[i - 1])
            row = _fired_row(flow, values, k, t, before, same)
            if same or t in log.crossing_time[i + 1 : i + 2]:
                follows = instant.follows(flow.jump(values, k, t, before, max(row, -1)), t, before, same)
                row = AT_ONCE if follows else row
            visits.append(Visit(jump.source, *_alone(flow, values, k, row, t, before)))
        memory = log.memory_after[i]
    after = np.concatenate([np.nan_to_num(log.u_after[first:]), log.memory_after[first:]], axis=1)
    return visits, after.reshape(len(visits), flow.n)


class _AtOnce:
    """Transitions of one instant: a later one whose surface is that of one before it, as the maps between them lead on,
    follows it at once whatever the states, the time and the active parameters."""

    def __init__(self, active: FloatArray) -> None:
        self.active = active
        self.begin()

    def begin(self) -> None:
        """No transition of the instant yet whose surface would be met."""
        #: Of each that came by itself: gradient of its surface in states, active parameters and time, its indicator,
        #: the place, and how the maps lead from there on.
        self.met: list[tuple[FloatArray, float, FloatArray, FloatArray]] = []

    def follows(self, jump: Jump, t: float, z: FloatArray, same: bool) -> bool:
        """Return whether a transition follows others of its instant: if not of the ``same``, it is the first."""
        place, n = np.concatenate([z, self.active, [t]]), jump.n
        surface = np.concatenate([jump.h_z, jump.h_p, [jump.h_t]])
        if not same:
            self.begin()
        found = any(one_surface(h_z, h, surface @ led, jump.h, at) for h_z, h, at, led in self.met)
        if not found and (self.met or not same):
            self.met.append((surface, jump.h, place, np.eye(len(place))))
        through = np.eye(len(place))
        through[:-1, :-1], through[:n, -1] = jump.R, jump.R_t
        self.met = [(h_z, h, at, through @ led) for h_z, h, at, led in self.met]
        return found


def _fired_row(flow: VariationalFlow, values: FloatArray, k: int, t: float, z: FloatArray, same: bool) -> int:
    """The row of transition k that is zero; AT_ONCE where one at the ``same`` instant has led behind them all.

    So it is in a mode in which the indicator stands still: none is reached there."""
    found = flow.jump(values, k, t, z)
    for row in range(found.row):  # of several that are zero the first: rounding tells no more
        other = flow.jump(values, k, t, z, row)
        if not same and abs(other.h) <= ROUNDING * _size(flow, other, z):
            return row
    return AT_ONCE if same and (found.rate == 0.0 or abs(found.h) > BEHIND * _size(flow, found, z)) else found.row


def _alone(flow: VariationalFlow, values: FloatArray, k: int, row: int, t: float, z: FloatArray) -> tuple[int, int]:
    """The transition, and its row, of the one element that acts: others are asked with it where they only happen to be
    near, and their answer is the same. Of transitions that are alike the first."""
    jumps = flow.traced.transitions
    answer = jumps[k]
    if answer.kind != FOUND:
        return flow.traced.first_alike(k, row) if row >= 0 else (k, row)
    found = flow.jump(values, k, t, z, row)
    for other, jump in enumerate(jumps):
        if jump.kind == ALONE and (jump.source, jump.target) == (answer.source, answer.target):
            for i in (i for i, fired in enumerate(jump.rows) if fired in answer.rows):
                own = flow.jump(values, other, t, z, i)
                same = (np.abs(own.z_after - found.z_after) < ROUNDING * flow.scale).all()
                if same and abs(own.h) <= BEHIND * _size(flow, own, z) and np.allclose(own.R, found.R):
                    return other, i
    return k, row


def _size(flow: VariationalFlow, jump: Jump, z: FloatArray) -> float:
    """The size of the indicator of a transition."""
    return float(np.abs(jump.h_z) @ flow.scale) + abs(float(jump.h_z @ z))


def round_of(
    flow: VariationalFlow,
    values: FloatArray,
    log: TrajectoryLog,
    z: FloatArray,
    mode: int,
    period: float,
    period_number: int = 0,
    first: int = 0,
    begin: float = 0.0,
) -> Round | None:
    """A log as once round from a time on, in the state z of a mode, before the transition ``first``.

    None where it ends in another mode."""
    visits, after = visits_of(flow, values, log, z[flow.n_u :], first)
    if visits and flow.traced.transitions[visits[-1].transition].target != mode:
        return None
    signature = Signature((*visits, Visit(mode)))
    return Round(period_number, period, signature, log.crossing_time[first:] - begin, np.vstack([z, after]))


def anchored(flow: VariationalFlow, values: FloatArray, once: Round) -> Round:
    """The same autonomous orbit read from the middle of its longest visit."""
    times = once.times
    lengths = np.append(np.diff(times), times[0] + once.period - times[-1])  # of the visit after crossing i
    i = int(lengths.argmax())
    half = 0.5 * float(lengths[i])
    mode = once.signature.visits[(i + 1) % len(times)].mode
    return once.begun(i + 1, float(times[i]) + half, led(flow, values, mode, 0.0, half, once.states[i + 1]))


def led(flow: VariationalFlow, values: FloatArray, mode: int, begin: float, length: float, z: FloatArray) -> FloatArray:
    """The state to which motion in a mode leads."""
    return flow.segments(values, [mode], [begin], [length], z[None, :]).z[0]
