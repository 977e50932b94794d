"""From a simulation to a first guess: let the motion settle, find its period, read off its signature."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import Round
from nonsmooth.continuation.problems.visits import round_of
from nonsmooth.flow.engines.engine import Section, State
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.continuation.searches.search import Search
    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.system import System

__all__ = ["CLOSED", "NEAR", "Guess", "forced_guesses", "settle_forced", "touching"]

CHOICE = 6  # candidates tried: period numbers, or returning points for a given one
CLOSED = 1e-8  # a return nearer than this has closed: the shortest such period comes first
TOUCH = 1e-6  # of the period, of the motion's size: a contact as short, an impact as weak as this may be a touch
NEAR = 0.2  # of the motion's size: a return farther off than this is no candidate


@dataclass
class Guess(Round):
    """An interval of motion that nearly closes; ``gap`` tells how far off it closes (scaled)."""

    gap: float = 0.0
    size: FloatArray = field(default_factory=lambda: np.empty(0))  # (n_u,) half the range of each state
    gaps: FloatArray = field(default_factory=lambda: np.empty(0))  # after 1, 2 ... forcing periods
    kicks: FloatArray | None = None  # (m,) change of state in each crossing, scaled; None: not known


@dataclass
class Settled:
    """Section points after the transient."""

    points: FloatArray  # (keep, n_u)
    modes: NDArray[np.int64]  # (keep,)
    size: FloatArray
    state: State
    status: int
    engine: Engine
    tables: Any


def settle_forced(system: System, engine: Engine, state: State, transient: int, keep: int, search: Search) -> Settled:
    """Run a forced system through a transient and keep the section points after it."""
    tables = engine.prepare(system.parameter_vector()[None, :])
    passed, left, begun = engine.kept(1, 1), transient, state.copy()

    def march(piece: float) -> bool:
        nonlocal left
        some = min(max(1, round(piece)), left)
        if some:
            engine.chain(tables, 0, 1, state, None, Section(), some - 1, 1, passed)
            left -= some
        return int(passed.status[0]) in (codes.OK, codes.NOT_GUARANTEED)

    search.in_pieces(float(transient), march)
    if passed.status[0] == codes.BEYOND_STOP:  # an impact on the section: a motion that was cut there cannot begin
        state, left, passed.status[0] = begun, transient, codes.OK
    out = engine.kept(1, keep)
    if passed.status[0] in (codes.OK, codes.NOT_GUARANTEED):
        engine.chain(tables, 0, 1, state, None, Section(), left, keep, out)
    else:
        out.status[0] = passed.status[0]
    search.look()
    scale = system.scale_vector()
    size = np.maximum(0.5 * (out.high - out.low)[0, : len(scale)], 1e-3 * scale)
    return Settled(np.nan_to_num(out.section[0]), out.section_mode[0], size, state, int(out.status[0]), engine, tables)


def forced_guesses(system: System, settled: Settled, period_number: int | None, most: int) -> list[Guess]:
    """Candidates for the period number, the smallest first, from the last section point.

    For a given period number: from the section points that return nearest to themselves. A return is one in the mode
    it began in.
    """
    points = settled.points / settled.size

    def gap(i: int, j: int) -> float:
        return float(np.abs(points[i] - points[j]).max()) if settled.modes[i] == settled.modes[j] else np.inf

    guesses = []
    if period_number is not None:
        p = period_number
        gaps = np.array([gap(i, i + p) for i in range(len(points) - p)])
        places = [int(i) for i in np.argsort(gaps, kind="stable")[:CHOICE]]
        if len(settled.state.memory):  # the memory is known at the last point only
            places = [len(gaps) - 1]
        starts = [(p, i, float(gaps[i])) for i in places]
    else:
        last = len(points) - 1
        gaps = np.array([gap(last, last - p) for p in range(1, most + 1)])
        starts = [(p, last, float(gaps[p - 1])) for p in range(1, most + 1) if gaps[p - 1] <= NEAR]
        # Chaos comes near its beginning again and again: the nearest few are tried.
        starts = sorted(sorted(starts, key=lambda start: (max(start[2], CLOSED), start[0]))[:CHOICE])
    for p, i, _ in starts:
        back = period_number is None
        returns = np.array([gap(i, i - q if back else i + q) for q in range(1, p + 1)])
        guess = _read_round(system, settled, p, i, returns) if np.isfinite(returns[-1]) else None
        if guess is not None:
            guesses.append(guess)
    return guesses


def _read_round(system: System, settled: Settled, p: int, i: int, gaps: FloatArray) -> Guess | None:
    """The motion over p forcing periods from section point i, as an orbit; None where it ends in another mode."""
    state = settled.state.copy()
    if i < len(settled.points) - 1:
        state.u[:], state.counters[0] = settled.points[i], settled.modes[i]
        state.counters[1:] = (-1, 0, 0)
    state.clock[:], state.settled = 0.0, True
    period = float(system.period() or 0.0)
    start = np.concatenate([state.u, state.memory])
    mode = int(state.counters[0])
    log = settled.engine.record(settled.tables, state, p * period, np.empty(0))
    if log.status not in (codes.OK, codes.NOT_GUARANTEED):
        return None
    flow, values = VariationalFlow.of(system), system.parameter_vector()
    once = round_of(flow, values, log, start, mode, p * period, p)
    if once is None:
        return None
    kicks = np.abs(np.nan_to_num(log.u_after - log.u_before) / settled.size).max(axis=1, initial=0.0)
    begun, ended = once.states[[0, -1], len(state.u) :]  # the memory returns too, or the round is a longer one
    apart = np.abs(ended - begun) / np.maximum(np.maximum(np.abs(begun), np.abs(ended)), 1e-12)
    gaps[-1] = max(gaps[-1], float(apart.max(initial=0.0)))
    return Guess(**vars(once), gap=float(gaps[-1]), size=settled.size, gaps=gaps, kicks=kicks)


R = TypeVar("R", bound=Round)


def touching(guess: R, system: System, kicks: FloatArray | None = None) -> list[R]:
    """The same motion without contacts that are no more than a touch: an orbit at its grazing point, or none such."""
    found, i, jumps = guess, 0, system.transitions
    kicks = np.full(len(guess.times), np.inf) if kicks is None else kicks
    while i < len(found.times):
        visits, times = found.signature.visits, found.times
        here, count = jumps[visits[i].transition], 0
        if here.at is not None:
            pass  # it happens whether it changes the state or not
        elif here.reset is not None and here.source == here.target and kicks[i] < TOUCH:
            count = 1
        elif i + 1 < len(times) and times[i + 1] - times[i] < TOUCH * guess.period:
            count = 2 if visits[i].mode == visits[i + 2].mode and visits[i + 1].row >= 0 else 0
        if count:
            found, kicks = found.without(i, count), np.delete(kicks, np.arange(i, i + count))
        else:
            i += 1
    return [] if found is guess else [found]
