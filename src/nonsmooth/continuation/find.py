"""``find_orbit``: the periodic orbit that a simulation settles on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.branches.orbit import Orbit, orbit_of
from nonsmooth.continuation.problems.curve import Point
from nonsmooth.continuation.problems.multipliers import multipliers_of, nearest_to_one, stability
from nonsmooth.continuation.problems.orbits import OrbitPoint, Orbits
from nonsmooth.continuation.problems.primitive import primitive
from nonsmooth.continuation.problems.rounds import INSTANT
from nonsmooth.continuation.problems.shooting import Shooting, Solved, in_a_family
from nonsmooth.continuation.problems.solve import solve
from nonsmooth.continuation.searches.search import search_within
from nonsmooth.continuation.searches.settled import (
    CLOSED,
    NEAR,
    Guess,
    autonomous_guesses,
    forced_guesses,
    settle_forced,
    touching,
)
from nonsmooth.errors import SolveError
from nonsmooth.flow.engines.methods import engine_for
from nonsmooth.flow.failure import solve_error, warn_if_slow
from nonsmooth.flow.loads import checked_loads
from nonsmooth.flow.options import as_called
from nonsmooth.flow.starts import first_state
from nonsmooth.kernels.hybrid import codes
from nonsmooth.results.progress import Progress
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import above, at_least

if TYPE_CHECKING:
    from nonsmooth.continuation.searches.search import Search
    from nonsmooth.flow.engines.engine import State
    from nonsmooth.system.system import System

GOOD = (codes.OK, codes.NOT_GUARANTEED)
MOST, CONVERGED = 30, 1e-12  # iterations, the last step in scaled unknowns
RTOL = 1e-12  # of the runs from which orbits are read, where the flow is not exact
NOISE = 1e-11  # of the motion's size: beyond a boundary by less than this is on it
FAR = 30.0  # how far from the motion, in units of its gap, the orbit may lie
NEUTRAL = 1e-2  # a multiplier nearer to 1 than this explains that Newton's method did not converge
SLOW = 3.0  # or of the distance that its multipliers give for that gap


@checked
def find_orbit(
    system: System,
    *,
    start: Any = None,
    period_number: Annotated[int, at_least(1)] | None = None,
    transient: Annotated[int, at_least(0)] = 500,
    max_period: Annotated[int, at_least(1)] = 32,
    loads: bool = False,
    budget: Annotated[float, above(0)] = 60.0,
    progress: Progress = True,
) -> Orbit:
    """Find a periodic orbit from a simulation: period, signature and phases are read off it, Newton does the rest.

    Parameters
    ----------
    system : System
    start : state, or a result of ``simulate``, optional
        Where the simulation starts; zeros where not given.
    period_number : int, optional
        Forcing periods once round. Given, the orbit may be unstable: Newton goes to whatever orbit of that period lies
        near the motion; one that closes earlier already does not count. Not given, the smallest period whose orbit is
        stable is taken.
    transient : int
        Forcing periods to wait first (autonomous systems: rounds). 0 takes the start as it is, and an unstable orbit
        near it too.
    max_period : int
        The longest period searched.
    loads : bool
        True: the orbit has its ``loads``, those of elements and work per forcing period; see :func:`nonsmooth.sweep`.
    budget : float
        Seconds of processor time after which the search ends with an error (``budget``); compiling does not count.
    progress : bool, or function
        A bar of the budget, on a terminal and in a notebook; nothing elsewhere.

    Returns
    -------
    Orbit
        With Floquet multipliers, signature, clearances and its system.

    Raises
    ------
    SolveError
        The motion is not periodic (``not_periodic``) or rests at an equilibrium (``equilibrium``), which is named;
        Newton's method did not converge (``no_convergence``), because a multiplier is 1 (``neutral``); the orbit found
        has not the period asked for (``shorter_period``); the budget is spent, or the simulation failed. The message
        says what to do.
    ValueError, TypeError
        Arguments that do not fit.
    """
    asked = as_called(locals())
    if system.explicit_time:
        raise ValueError(f"{system.name!r} depends on time without a period: it has no periodic orbits")
    wanted = bool(checked_loads(system, loads, "find_orbit"))
    state = first_state(system, start)
    with search_within(budget, "find_orbit", progress, looks=True) as search:
        guesses = _guesses(system, state, period_number, transient, max_period, search)
        orbit = _polished(system, guesses, period_number is not None, transient == 0, search)
    warn_if_slow(system, orbit.maximum, orbit.minimum)
    return replace(orbit.with_loads() if wanted else orbit, options=asked)


def _guesses(
    system: System, state: State, period_number: int | None, transient: int, max_period: int, search: Search
) -> list[Guess]:
    """Intervals of the motion that nearly close.

    Raises
    ------
    SolveError
        There is none, or the motion fails.
    """
    engine = engine_for(system, rtol=RTOL)
    if system.period() is None:
        guesses = autonomous_guesses(system, engine, state, transient, max_period, period_number, search)
    else:
        keep = 2 * max(max_period, period_number or 1) + 2
        begun = state.copy()
        settled = settle_forced(system, engine, state, transient, keep)
        if settled.status not in GOOD and not transient and period_number is not None:
            # The motion leaves an unstable orbit and fails later: its first rounds are enough.
            settled = settle_forced(system, engine, begun, 0, period_number + 1)
        if settled.status not in GOOD:
            raise solve_error(settled.status, begun=(system, begun.u))
        guesses = forced_guesses(system, engine, settled, period_number, max_period)
    if not guesses:
        unit = "rounds" if system.period() is None else "iterates" if system.is_map else "forcing periods"
        raise SolveError(
            f"no periodic motion was found: after {transient} {unit} no return up to the period number "
            f"{period_number or max_period} came near its beginning (chaotic, quasi-periodic, a longer period). Give "
            "another start, a longer transient or max_period, or period_number= for an unstable orbit within it",
            status="not_periodic",
        )
    return guesses


def _polished(system: System, guesses: list[Guess], given: bool, unstable: bool, search: Search) -> Orbit:
    """Newton from each guess; the first orbit that is admissible, near, and stable (or asked for)."""
    reasons: list[tuple[str, str]] = []
    search.look()
    for guess in [one for first in guesses for one in (*touching(first, system, first.kicks), first)]:
        shooting, X = Shooting.of(system, guess)
        size = np.concatenate([guess.size, np.ones(shooting.n - len(guess.size))])
        name = _name(guess.period_number)
        search.doing = f"looking for a {name} orbit by Newton's method"
        shooting.anchor(X[: shooting.n], shooting.values, size)
        left = shooting.evaluate(X).residual[: shooting.n]  # what the guess lacks to close
        curve = Orbits(shooting, size, guess.period, ())
        solved, tried = _newton(curve, X, search)
        shorter = None if solved is None else primitive(shooting, solved, size)
        gap = guess.gap
        if shorter is not None and given:
            number = shorter[0].period_number
            word = f"is {_name(number)}" if number else "is a shorter one"
            reasons.append(("shorter_period", f"the {name} orbit found {word}, gone round several times"))
            continue
        if shorter is not None:
            shooting, X = shorter
            curve = Orbits(shooting, size, guess.period, ())
            solved, tried = _newton(curve, X, search)
            name = _name(shooting.period_number)
            if shooting.forced:
                gap = float(guess.gaps[shooting.period_number - 1])
                left = np.full(shooting.n, np.nan)
        if solved is None or in_a_family(shooting, solved):
            reasons.append(_why(shooting, tried, name))
            continue
        point = curve.described(Point(curve, solved.X / curve.scale, np.empty(0), 0.0, 0, solved))
        if point is None:
            reasons.append(("no_convergence", f"the {name} orbit found could not be followed"))
            continue
        virtual = bool((point.path.margins < -NOISE * float(guess.size.max())).any())
        orbit = orbit_of(point, virtual)
        if virtual:
            reasons.append(("virtual", f"the {name} orbit found passes through a boundary it should obey"))
        elif given or unstable or (orbit.stable and _is_near(orbit, guess, gap, left)):
            _look_at_instants(point)
            return orbit
        elif not orbit.stable:
            kind = stability(orbit.floquet_multipliers, shooting.forced)
            told = "neutral (a multiplier has modulus 1, nothing is damped)" if kind == "neutral" else kind
            reasons.append(("not_periodic", f"the {name} orbit near the motion is {told}"))
        else:
            reasons.append(("no_convergence", f"Newton's method left the motion for a {name} orbit far from it"))
    status = reasons[0][0] if guesses[0].gap <= CLOSED or given else "not_periodic"
    remedy = "Give another start, a longer transient, or period_number= (then an unstable orbit is taken too)"
    neutral = [one for one in reasons if one[0] == "neutral"]
    if neutral:
        status, remedy = "neutral", "Add damping or a restoring force, or give another start or a longer transient"
        reasons = neutral[:1] + [one for one in reasons if one[0] not in ("neutral", "no_convergence")]
    said = "; ".join(dict.fromkeys(text for _, text in reasons))
    raise SolveError(
        f"the motion settled on no periodic orbit that could be confirmed: {said}. {remedy}", status=status
    )


def _look_at_instants(point: OrbitPoint) -> None:
    """Warn of transitions at one instant whose order matters to the multipliers (``saltation.of_one_instant``)."""
    shooting, times = point.shooting, point.once.times
    first = 0
    for last in np.flatnonzero(np.diff(times, append=np.inf) > INSTANT * point.period).tolist():
        if last > first:
            chain = [visit.transition for visit in shooting.signature.visits[first : last + 1]]
            shooting.flow.jump(point.values, chain, float(times[first]), point.solved.segments.z[first])
        first = last + 1


def _why(shooting: Shooting, tried: Solved, name: str) -> tuple[str, str]:
    """Status and sentence for a Newton iteration that did not converge: a multiplier is 1, or nothing is known."""
    if np.isfinite(tried.monodromy).all():
        nearest = nearest_to_one(multipliers_of(tried.monodromy), shooting.forced)
        if abs(nearest - 1.0) <= NEUTRAL:
            size = "1" if abs(nearest - 1.0) <= 1e-6 else f"{nearest.real:.6g}, nearly 1"
            return "neutral", (
                f"a multiplier is {size}, so that Newton's method has no single orbit to converge to: the motion "
                "drifts, dies out or grows very slowly, or belongs to a family of orbits (an undamped system, a free "
                "translation, a conserved energy, a mass that friction holds wherever it is)"
            )
    return "no_convergence", f"Newton's method did not converge to a {name} orbit"


def _name(period_number: int) -> str:
    return f"period-{period_number}" if period_number else "closed"


def _is_near(orbit: Orbit, guess: Guess, gap: float, left: FloatArray) -> bool:
    """Return whether an orbit is the one that a motion settles on: as near as its gap says.

    A slow motion closes better than it is near: by the multipliers, the orbit is (I - M)^-1 times the gap away.
    """
    moved = float(np.abs((orbit.u - guess.states[0, : len(orbit.u)]) / guess.size).max())
    if moved <= max(FAR * gap, 1e-6):
        return True
    if not orbit.period_number or not np.isfinite(left).all() or moved > NEAR:
        return False
    away = np.linalg.lstsq(np.eye(len(left)) - orbit.monodromy_matrix, left, rcond=None)[0]
    return moved <= SLOW * float(np.abs(away[: len(guess.size)] / guess.size).max())


def _newton(curve: Orbits, X: FloatArray, search: Search) -> tuple[Solved | None, Solved]:
    """Solve at fixed parameters; None where it does not converge, and the last iterate."""
    shooting, X, last = curve.shooting, X.copy(), np.inf
    scale = curve.scale / np.sqrt(shooting.m + 1)  # each visit's states by their own size
    for i in range(MOST):
        search.look()
        solved = shooting.evaluate(X)
        if not np.isfinite(solved.residual).all():
            return None, solved
        try:
            step = solve(solved.jacobian * scale, -solved.residual)
        except np.linalg.LinAlgError:
            return None, solved
        length = float(np.abs(step).max())
        if not np.isfinite(length):
            return None, solved
        if length < CONVERGED or (i > 3 and length < 1e-9 and length > 0.5 * last):
            return solved, solved
        if length > 0.5:
            step *= 0.5 / length
        X += scale * step
        last = length
    return None, solved
