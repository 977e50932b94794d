"""The place of a run, as numbers from which it can go on, and the section points it visits from there.

A *place* is a start with everything that the run needs besides its mode: the states, then the memory, then, where a
forced system is looked at on a Poincare section, the time since the forcing period began (:attr:`Settler.width` numbers
in all). A plain start has the states only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray, IntArray, Section, State
from nonsmooth.flow.engines.loop import Engine
from nonsmooth.kernels.hybrid import codes
from nonsmooth.system.phases import phases, varying_phases

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["Trace", "mode_at", "period_of", "place_of", "state_at", "trace"]


@dataclass(frozen=True)
class Trace:
    """Section points of one run; none where it failed."""

    points: FloatArray  # (keep, n)
    modes: IntArray  # (keep,)
    times: FloatArray  # (keep,) since the run began
    end: FloatArray  # (width,): the place where it ended
    mode: int


def period_of(tables: Any, row: int = 0) -> float:
    """Period of the forcing at one row of an engine's tables; infinite where there is none."""
    return float(tables.period[row])


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


def state_at(system: System, place: FloatArray, mode: int, clock: float, period: float) -> State:
    """A state at a place; what the place does not say (memory, time within the period) is as at a fresh start."""
    n, n_memory = len(system.traced.u), len(system.traced.m)
    state = State(place[:n].copy(), system.memory_vector())
    if len(place) >= n + n_memory:
        state.memory[:] = place[n : n + n_memory]
    state.counters[0] = mode
    if period < np.inf:
        state.clock[0] = place[-1] if len(place) > n + n_memory else clock
        state.clock[2] = period
    return state


def place_of(state: State, width: int) -> FloatArray:
    """The place at which a state stands."""
    return np.concatenate([state.u, state.memory, state.clock[:1]])[:width]


def trace(
    system: System, engine: Engine, plan: Section, point: FloatArray, place: FloatArray, mode: int, transient: int,
    keep: int, width: int,
) -> Trace:  # fmt: skip
    """Run on from a place on the section."""
    tables = engine.prepare(point)
    period = period_of(tables)
    state = state_at(system, place, mode, plan.phase * period if plan.indicator < 0 else 0.0, period)
    begin = state.clock[0] + (state.clock[1] * period if period < np.inf else 0.0)
    out = engine.kept(1, keep)
    engine.chain(tables, 0, 1, state, None, plan._replace(extremes=False), transient, keep, out)
    if out.status[0] not in (codes.OK, codes.NOT_GUARANTEED):
        none = np.zeros(0)
        return Trace(np.zeros((0, len(system.states))), np.zeros(0, dtype=np.int64), none, place, mode)
    return Trace(
        out.section[0], out.section_mode[0], out.section_time[0] - begin, place_of(state, width),
        int(state.counters[0]),
    )  # fmt: skip
