"""First guesses of the cycles of autonomous systems: recurrence on a section that is found on the way.

Where transitions happen they are the section: a cycle is a sequence of transitions that repeats, with the states after
them. Else the section is the level half way up the state that swings most, passed upwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import Round, Signature, Visit
from nonsmooth.continuation.problems.visits import anchored, visits_of
from nonsmooth.continuation.searches.settled import NEAR, Guess
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.engine import Log, State
from nonsmooth.flow.equilibria import AT_REST, ROUNDING, equilibrium_at
from nonsmooth.flow.failure import solve_error
from nonsmooth.flow.variational import VariationalFlow
from nonsmooth.kernels.hybrid import codes

if TYPE_CHECKING:
    from nonsmooth.continuation.searches.search import Search
    from nonsmooth.flow.engines.loop import Engine
    from nonsmooth.system.system import System

__all__ = ["autonomous_guesses"]

SAMPLES = 4001
FEW, MANY = 8, 200  # rounds in a stretch of motion that is long, and short, enough to look at
LONGEST = 1e6
REST = 1e-7  # of its scale: a motion smaller than this has come to rest
AT_ONCE = 1e-12  # of a unit of time: what happens within it happens at the start
ELSEWHERE = (
    "Give start=, a state away from it, or follow the equilibrium with continue_equilibrium to where a cycle emanates"
)


def autonomous_guesses(
    system: System, engine: Engine, state: State, transient: int, most: int, given: int | None, search: Search
) -> list[Guess]:
    """Candidates for once round, the shortest first."""
    tables = engine.prepare(system.parameter_vector()[None, :])

    def run(duration: float) -> tuple[Log, FloatArray]:
        begin = float(state.clock[0])
        instants = begin + np.linspace(0.0, duration, SAMPLES)
        log = search.record(engine, tables, state, begin + duration, instants)
        if log.status not in (codes.OK, codes.NOT_GUARANTEED):
            raise solve_error(log.status, begun=(system, state.u))
        return log, instants

    first = state.copy()  # in the mode to which transitions that already hold lead
    engine.record(tables, first, float(first.clock[0]) + AT_ONCE, np.empty(0))
    _refuse_equilibrium(system, first, "the start", ROUNDING)
    duration = 64.0
    while True:
        log, instants = run(duration)
        rounds = len(_passages(log, instants, system)[0])
        if not rounds and _at_rest(log, system):
            _refuse_equilibrium(system, state, "the motion tends to an equilibrium:", AT_REST, stable=True)
        if rounds < FEW and duration < LONGEST:
            duration *= 4.0
        elif rounds > MANY:
            duration *= FEW / rounds * 4.0
        else:
            break
    if rounds < 2:  # a motion that drifts passes once
        _refuse_equilibrium(system, state, "the motion tends to an equilibrium:", AT_REST)
        raise SolveError(
            f"the motion does not come back: over {duration:.3g} units of time the state that moves most passed the "
            "middle of its range at most once. There is no cycle here; give another start",
            status="not_periodic",
        )
    one = duration / rounds
    if transient:
        search.doing = f"letting {transient} rounds of some {one:.3g} units of time pass"
        run(transient * one)
    log, instants = run(max((2 * (given or min(most, 8)) + 3), FEW) * one)
    if _at_rest(log, system):
        _refuse_equilibrium(system, state, "the motion tends to an equilibrium:", AT_REST)
        said = f"the motion tends to an equilibrium: there is no cycle here. {ELSEWHERE}"
        raise SolveError(said, status="equilibrium")
    found = _by_transitions(system, log, most, given) if len(log.crossing_time) > 1 else []
    return found or _by_level(system, log, instants, most, given)


def _refuse_equilibrium(system: System, state: State, what: str, near: float, stable: bool = False) -> None:
    """SolveError where the state is an equilibrium (``stable``: a stable one), with its name."""
    at = equilibrium_at(system, state.u, int(state.counters[0]), memory=state.memory, near=near)
    if at is not None and (at.kind == "stable" or not stable):
        raise SolveError(
            f"{what} {at.words(list(system.states))}. No cycle passes there. {ELSEWHERE}", status="equilibrium"
        )


def _swing(log: Log, system: System) -> tuple[int, float, FloatArray]:
    """The state that swings most over the second half, its middle, and half the range of each."""
    u = np.nan_to_num(log.sample_u[len(log.sample_u) // 2 :])
    low, high = u.min(axis=0), u.max(axis=0)
    half = 0.5 * (high - low)
    j = int((half / system.scale_vector()).argmax())
    return j, float(0.5 * (low[j] + high[j])), half


def _passages(log: Log, instants: FloatArray, system: System) -> tuple[FloatArray, NDArray[np.intp]]:
    """Times (interpolated) and sample indices at which the level half way up is passed upwards, in the second half."""
    j, level, half = _swing(log, system)
    x = np.nan_to_num(log.sample_u[:, j]) - level
    begin = len(x) // 2
    at = begin + np.flatnonzero((x[begin:-1] < 0.0) & (x[begin + 1 :] >= 0.0))
    if half[j] <= REST * system.scale_vector()[j]:
        at = at[:0]
    fraction = x[at] / (x[at] - x[at + 1])
    return instants[at] + fraction * (instants[1] - instants[0]), at


def _at_rest(log: Log, system: System) -> bool:
    """Return whether the motion is as good as still, or shrinks steadily towards it."""
    _, _, half = _swing(log, system)
    return bool((half <= REST * system.scale_vector()).all())


def _size(log: Log, system: System) -> FloatArray:
    return np.maximum(_swing(log, system)[2], 1e-3 * system.scale_vector())


def _by_transitions(system: System, log: Log, most: int, given: int | None) -> list[Guess]:
    """Sequences of transitions that repeat."""
    traced, flow, values = system.traced, VariationalFlow.of(system), system.parameter_vector()
    size = _size(log, system)
    k, after = log.crossing_transition, np.nan_to_num(log.u_after)
    last = len(k) - 1
    guesses = []
    for length in range(1, min(last, 40 * most) + 1):
        if k[last - length] != k[last]:
            continue
        gap = float(np.abs((after[last] - after[last - length]) / size).max())
        if gap > NEAR:
            continue
        begin = float(log.crossing_time[last - length])
        period = float(log.crossing_time[last]) - begin
        times = log.crossing_time[last - length + 1 :] - begin
        visits, states = visits_of(flow, values, log, log.memory_after[last - length], last - length + 1)
        signature = Signature((*visits, Visit(traced.transitions[k[last]].target)))
        once = anchored(flow, values, Round(0, period, signature, times, np.vstack([states[-1:], states])))
        guesses.append(Guess(**vars(once), gap=gap, size=size))
        if len(guesses) >= (given or most):
            break
    return guesses[given - 1 : given] if given else guesses


def _by_level(system: System, log: Log, instants: FloatArray, most: int, given: int | None) -> list[Guess]:
    """Returns to the level half way up."""
    times, at = _passages(log, instants, system)
    size = _size(log, system)
    if len(times) < 2:
        return []
    u = np.nan_to_num(log.sample_u)
    fraction = ((times - instants[at]) / (instants[1] - instants[0]))[:, None]
    points = (1 - fraction) * u[at] + fraction * u[at + 1]
    guesses = []
    for p in range(1, min(most, len(points) - 1) + 1):
        if given is not None and p != given:
            continue
        gap = float(np.abs((points[-1] - points[-1 - p]) / size).max())
        if gap > NEAR:
            continue
        z = np.concatenate([points[-1], log.sample_memory[-1]])
        mode = int(log.sample_mode[at[-1]])
        guesses.append(Guess(0, float(times[-1] - times[-1 - p]), Signature((Visit(mode),)), np.empty(0), z[None, :],
                             max(gap, 1e-3), size))  # fmt: skip
    return guesses
