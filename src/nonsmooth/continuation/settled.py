"""From a simulation to a first guess: let the motion settle, find its period, read off its signature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.signature import Signature, Visit
from nonsmooth.flow.engine import Chain, Log, SectionPlan, State
from nonsmooth.kernels import codes

if TYPE_CHECKING:
    from nonsmooth.continuation.shooting import Shooting
    from nonsmooth.flow.engine import Engine
    from nonsmooth.system.system import System

__all__ = ["Guess", "forced_guesses", "read", "settle_forced"]

FloatArray = NDArray[np.float64]
NEAR = 0.2  # of the motion's size: a return farther off than this is no candidate


@dataclass
class Guess:
    """A stretch of motion that nearly closes: its beginning, its log over one round, and how far off it closes."""

    period_number: int  # 0: autonomous
    period: float
    u: FloatArray
    memory: FloatArray
    mode: int
    log: Log
    gap: float  # scaled
    size: FloatArray  # (n_u,) half the range of each state


@dataclass
class Settled:
    """Section points after the transient."""

    points: FloatArray  # (keep, n_u)
    size: FloatArray
    state: State
    status: int
    engine: Engine
    tables: Any


def settle_forced(system: System, engine: Engine, state: State, transient: int, keep: int) -> Settled:
    """Run a forced system through a transient and keep the section points after it."""
    traced = system.traced
    out = Chain.empty(1, keep, len(traced.u), len(traced.indicators), len(traced.outputs))
    tables = engine.prepare(system.parameter_vector()[None, :])
    engine.chain(tables, 0, 1, state, None, SectionPlan(), transient, keep, out)
    size = np.maximum(0.5 * (out.maximum[0] - out.minimum[0]), 1e-3 * system.scale_vector())
    return Settled(out.section[0], size, state, int(out.status[0]), engine, tables)


def forced_guesses(system: System, settled: Settled, period_number: int | None, most: int) -> list[Guess]:
    """Candidates for the period number, the smallest first; each begins at the last section point."""
    points = settled.points / settled.size
    period = float(system.period() or 0.0)
    guesses = []
    numbers = range(1, most + 1) if period_number is None else [period_number]
    for p in numbers:
        if p >= len(points):
            break
        gap = float(np.abs(points[-1] - points[-1 - p]).max())
        if period_number is None and gap > NEAR:
            continue
        state = settled.state.copy()
        state.clock[:], state.settled = 0.0, True
        u, memory, mode = state.u.copy(), state.memory.copy(), int(state.counters[0])
        log = settled.engine.record(settled.tables, state, p * period, np.empty(0))
        if log.status in (codes.OK, codes.NOT_GUARANTEED):
            guesses.append(Guess(p, p * period, u, memory, mode, log, gap, settled.size))
    return guesses


def read(guess: Guess, system: System, rows: Any) -> Signature:
    """The signature of a logged round; ``rows(k, t, z)`` tells which row of transition k is zero there."""
    period = system.period()
    visits = []
    memory = guess.memory
    traced = system.traced
    for i, k in enumerate(guess.log.crossing_transition):
        jump, t = traced.transitions[k], float(guess.log.crossing_time[i])
        if jump.at is not None:
            visits.append(Visit(jump.source, int(k), -1, round(t / float(period or 1.0) - jump.at)))
        else:
            z = np.concatenate([np.nan_to_num(guess.log.u_before[i]), memory])
            visits.append(Visit(jump.source, int(k), rows(int(k), t, z)))
        memory = guess.log.memory_after[i]
    last = traced.transitions[guess.log.crossing_transition[-1]].target if visits else guess.mode
    return Signature((*visits, Visit(int(last))))


def first_unknowns(guess: Guess, shooting: Shooting) -> FloatArray:
    """X of a logged round."""
    start = np.concatenate([np.nan_to_num(guess.u), guess.memory])
    after = np.concatenate([np.nan_to_num(guess.log.u_after), guess.log.memory_after], axis=1)
    return shooting.join(guess.log.crossing_time, np.vstack([start, after]), guess.period)
