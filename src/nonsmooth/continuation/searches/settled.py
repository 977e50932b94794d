"""From a simulation to a first guess: let the motion settle, find its period, read off its signature.

Of autonomous systems by recurrence on a section that is found on the way. Where transitions happen they are the
section: a cycle is a sequence of transitions that repeats, with the states after them. Else the section is the level
half way up the state that swings most, passed upwards.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import AT_ONCE, Round, Signature, Visit
from nonsmooth.continuation.problems.visits import anchored, round_of
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.engine import IntArray, State, TrajectoryLog
from nonsmooth.flow.equilibria import AT_REST, ROUNDING, equilibrium_at
from nonsmooth.flow.failure import solve_error
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes
from nonsmooth.kernels.hybrid.kept import Section

if TYPE_CHECKING:
    from nonsmooth.continuation.searches.search import Search
    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.system import System

CHOICE = 6  # candidates tried: period numbers, or returning points for a given one
CLOSED = 1e-8  # a return nearer than this has closed: the shortest such period comes first
TOUCH = 1e-6  # of the period, of the motion's size: a contact as short, an impact as weak as this may be a touch
NEAR = 0.2  # of the motion's size: a return farther off than this is no candidate
SAMPLES = 4001
FEW, MANY = 8, 200  # rounds in an interval of motion that is long, and short, enough to look at
LONGEST = 1e6
REST = 1e-7  # of its scale: a motion smaller than this has come to rest
INSTANT = 1e-12  # of a unit of time: what happens within it happens at the start
TENDS = "the motion tends to an equilibrium:"
ELSEWHERE = (
    "Give start=, a state away from it, or follow the equilibrium with continue_equilibrium to where a cycle emanates"
)


@dataclass
class Guess(Round):
    """An interval of motion that nearly closes; ``gap`` tells how far off it closes (scaled)."""

    gap: float = 0.0
    size: FloatArray = field(default_factory=lambda: np.empty(0))  # (n_u,) half the range of each state
    gaps: FloatArray = field(default_factory=lambda: np.empty(0))  # after 1, 2 ... forcing periods
    kicks: FloatArray | None = None  # (m,) change of state in each crossing, scaled; None: not known


@dataclass
class SteadySection:
    """Section points after the transient, and the state at the last of them."""

    points: FloatArray  # (keep, n_u)
    modes: NDArray[np.int64]  # (keep,)
    size: FloatArray
    state: State
    status: int


def settle_forced(system: System, engine: Engine, state: State, transient: int, keep: int) -> SteadySection:
    """Run a forced system through a transient and keep the section points after it."""
    out, scale = engine.kept(1, keep), system.scale_vector()
    engine.chain(engine.prepare(system.parameter_vector()[None, :]), 0, 1, state, None, Section(), transient, keep, out)
    size = np.maximum(0.5 * (out.high - out.low)[0, : len(scale)], 1e-3 * scale)
    return SteadySection(np.nan_to_num(out.section[0]), out.section_mode[0], size, state, int(out.status[0]))


def forced_guesses(
    system: System, engine: Engine, settled: SteadySection, period_number: int | None, most: int
) -> list[Guess]:
    """Candidates for the period number, the smallest first, from the last section point.

    For a given period number: from the section points that return nearest to themselves, of those that have closed from
    the first, be it on an unstable orbit that the motion leaves. A return is one in the mode it began in.
    """
    points, modes = settled.points / settled.size, settled.modes
    last = len(points) - 1

    def gap(i: int, j: int) -> float:
        return float(np.abs(points[i] - points[j]).max()) if modes[i] == modes[j] else np.inf

    if period_number is not None:
        way, p = 1, period_number
        # The memory is known at the last point only.
        places = [last - p] if len(settled.state.memory) else range(last - p + 1)
        starts = [(p, i) for i in sorted(places, key=lambda i: max(gap(i, i + p), CLOSED))[:CHOICE]]
    else:
        way, near = -1, [p for p in range(1, most + 1) if gap(last, last - p) <= NEAR]
        # Chaos comes near its beginning again and again: the nearest few are tried.
        near.sort(key=lambda p: max(gap(last, last - p), CLOSED))
        starts = [(p, last) for p in sorted(near[:CHOICE])]
    rounds = ((p, i, np.array([gap(i, i + way * q) for q in range(1, p + 1)])) for p, i in starts)
    guesses = [_read_round(system, engine, settled, *one) for one in rounds if np.isfinite(one[2][-1])]
    return [guess for guess in guesses if guess is not None]


def _read_round(
    system: System, engine: Engine, settled: SteadySection, p: int, i: int, gaps: FloatArray
) -> Guess | None:
    """The motion over p forcing periods from section point i, as an orbit; None where it ends in another mode."""
    state = settled.state.copy()
    if i < len(settled.points) - 1:
        state.u[:], state.counters[:] = settled.points[i], (settled.modes[i], -1, 0, 0)
    state.clock[:], state.settled = 0.0, True
    values, period = system.parameter_vector(), p * float(system.period() or 0.0)
    start, mode = state.place, int(state.counters[0])
    log = engine.record(engine.prepare(values[None, :]), state, period, np.empty(0))
    flow, good = VariationalFlow.of(system), log.status in (codes.OK, codes.NOT_GUARANTEED)
    once = round_of(flow, values, log, start, mode, period, p) if good else None
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
    found, i, jumps, turned = guess, 0, system.transitions, guess.times[:1] + (guess.period - guess.times[-1:])
    kicks = np.full(len(guess.times), np.inf) if kicks is None else kicks
    if guess.period_number and (turned < TOUCH * guess.period).any():  # a short visit that the section parts is one
        found, kicks = guess.begun(1, 0.0, guess.states[1]), np.roll(kicks, -1)
    while i < len(found.times):
        visits, times = found.signature.visits, found.times
        here, count = jumps[visits[i].transition], 0
        if here.at is not None:
            pass  # it happens whether it changes the state or not
        elif here.reset is not None and here.source == here.target and kicks[i] < TOUCH:
            count = 1
        elif i + 1 < len(times) and times[i + 1] - times[i] < TOUCH * guess.period:
            count = 2 if visits[i].mode == visits[i + 2].mode and visits[i + 1].row >= 0 else 0
        while count and visits[i + count].row == AT_ONCE:
            count += 1
        if count and visits[i + count].mode == visits[i].mode:
            found, kicks = found.without(i, count), np.delete(kicks, np.arange(i, i + count))
        else:
            i += 1
    return [found] if len(found.times) < len(guess.times) else []


@dataclass
class _Interval:
    """An interval of motion, and what its second half tells: passages of the level half way up, and half the ranges."""

    log: TrajectoryLog
    times: FloatArray  # of the passages upwards, interpolated
    points: FloatArray  # the states there
    modes: IntArray
    rests: bool  # as good as still
    size: FloatArray


def autonomous_guesses(
    system: System, engine: Engine, state: State, transient: int, most: int, given: int | None, search: Search
) -> list[Guess]:
    """Candidates for once round, the shortest first."""
    tables = engine.prepare(system.parameter_vector()[None, :])

    def run(duration: float) -> _Interval:
        begin = float(state.clock[0])
        instants = begin + np.linspace(0.0, duration, SAMPLES)
        state.settled = False  # an event just where it begins is taken as at any start
        log = engine.record(tables, state, begin + duration, instants)
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            raise solve_error(log.status, begun=(system, state.u))
        return _seen(log, instants, system)

    first = state.copy()  # in the mode to which transitions that already hold lead
    engine.record(tables, first, float(first.clock[0]) + INSTANT, np.empty(0))
    _refuse_equilibrium(system, first, "the start", ROUNDING)
    duration = 64.0
    while True:
        interval = run(duration)
        rounds = len(interval.times)
        if interval.rests:
            _refuse_equilibrium(system, state, TENDS, AT_REST, stable=True)
        if rounds < FEW and duration < LONGEST:
            duration *= 4.0
        elif rounds > MANY:
            duration *= FEW / rounds * 4.0
        else:
            break
    if rounds < 2:  # a motion that drifts passes once
        _refuse_equilibrium(system, state, TENDS, AT_REST)
        raise SolveError(
            f"the motion does not come back: over {duration:.3g} units of time the state that moves most passed the "
            "middle of its range at most once. There is no cycle here; give another start",
            status="not_periodic",
        )
    one = duration / rounds
    if transient:
        search.doing = f"letting {transient} rounds of some {one:.3g} units of time pass"
        run(transient * one)
    interval = run(max((2 * (given or min(most, 8)) + 3), FEW) * one)
    if interval.rests:
        _refuse_equilibrium(system, state, TENDS, AT_REST)
        raise SolveError(f"{TENDS} there is no cycle here. {ELSEWHERE}", status="equilibrium")
    found = _by_transitions(system, interval, most, given) if len(interval.log.crossing_time) > 1 else []
    return found or _by_level(interval, most, given)


def _seen(log: TrajectoryLog, instants: FloatArray, system: System) -> _Interval:
    """The passages of the level half way up the state that swings most."""
    u, scale = np.nan_to_num(log.sample_u), system.scale_vector()
    begin = len(u) // 2
    low, high = u[begin:].min(axis=0), u[begin:].max(axis=0)
    half = 0.5 * (high - low)
    j = int((half / scale).argmax())
    x, rests = u[:, j] - 0.5 * (low[j] + high[j]), bool((half <= REST * scale).all())
    at = begin + np.flatnonzero((x[begin:-1] < 0.0) & (x[begin + 1 :] >= 0.0) & (not rests))
    part = x[at] / (x[at] - x[at + 1])
    points = (1 - part)[:, None] * u[at] + part[:, None] * u[at + 1]
    times = instants[at] + part * (instants[1] - instants[0])
    return _Interval(log, times, points, log.sample_mode[at], rests, np.maximum(half, 1e-3 * scale))


def _refuse_equilibrium(system: System, state: State, what: str, near: float, stable: bool = False) -> None:
    """SolveError where the state is an equilibrium (``stable``: a stable one), with its name."""
    at = equilibrium_at(system, state.u, int(state.counters[0]), memory=state.memory, near=near)
    if at is not None and (at.kind == "stable" or not stable):
        raise SolveError(
            f"{what} {at.words(list(system.states))}. No cycle passes there. {ELSEWHERE}", status="equilibrium"
        )


def _by_transitions(system: System, interval: _Interval, most: int, given: int | None) -> list[Guess]:
    """Sequences of transitions that repeat."""
    flow, values, log = VariationalFlow.of(system), system.parameter_vector(), interval.log
    k, after = log.crossing_transition, np.nan_to_num(log.u_after)
    last, mode, guesses = len(k) - 1, system.traced.transitions[k[-1]].target, []
    for begun in range(last - 1, max(last - 40 * most, 0) - 1, -1):
        gap = float(np.abs((after[last] - after[begun]) / interval.size).max())
        if k[begun] != k[last] or gap > NEAR:
            continue
        begin, z = float(log.crossing_time[begun]), np.append(after[begun], log.memory_after[begun])
        once = round_of(flow, values, log, z, mode, float(log.crossing_time[last]) - begin, 0, begun + 1, begin)
        if once is not None:
            guesses.append(Guess(**vars(anchored(flow, values, once)), gap=gap, size=interval.size))
        if len(guesses) >= (given or most):
            break
    return guesses[given - 1 : given] if given else guesses


def _by_level(interval: _Interval, most: int, given: int | None) -> list[Guess]:
    """Returns to the level half way up."""
    times, points, guesses = interval.times, interval.points, []
    for p in [given] if given else range(1, most + 1):
        if p >= len(points) or p > most:
            break
        gap = float(np.abs((points[-1] - points[-1 - p]) / interval.size).max())
        if gap <= NEAR:
            z = np.concatenate([points[-1], interval.log.sample_memory[-1]])[None, :]
            signature = Signature((Visit(int(interval.modes[-1])),))
            guesses.append(
                Guess(0, float(times[-1] - times[-1 - p]), signature, np.empty(0), z, max(gap, 1e-3), interval.size)
            )
    return guesses
