"""``find_orbit``: the periodic orbit that a simulation settles on."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.continuation.anchor import anchor_at
from nonsmooth.continuation.orbit import Orbit, orbit_of
from nonsmooth.continuation.path import Walk
from nonsmooth.continuation.primitive import primitive
from nonsmooth.continuation.settled import CLOSED, NEAR, Guess, forced_guesses, settle_forced, touching
from nonsmooth.continuation.shooting import Shooting
from nonsmooth.errors import SolveError
from nonsmooth.flow.arguments import check_system, whole_number
from nonsmooth.flow.failure import solve_error
from nonsmooth.flow.methods import engine_for
from nonsmooth.flow.starts import first_state, plain_start
from nonsmooth.kernels import codes
from nonsmooth.system.names import by_name

if TYPE_CHECKING:
    from nonsmooth.system.system import System

__all__ = ["find_orbit"]

FloatArray = NDArray[np.float64]
GOOD = (codes.OK, codes.NOT_GUARANTEED)
RTOL = 1e-12  # of the runs from which orbits are read, where the flow is not exact
NOISE = 1e-11  # of the motion's size: beyond a boundary by less than this is on it
FAR = 30.0  # how far from the motion, in units of its gap, the orbit may lie
SLOW = 3.0  # or of the distance that its multipliers give for that gap


@by_name
def find_orbit(
    system: System,
    *,
    start: Any = None,
    period_number: int | None = None,
    transient: int = 500,
    max_period: int = 32,
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
        The longest period looked for.

    Returns
    -------
    Orbit
        With Floquet multipliers, signature, clearances and its system.

    Raises
    ------
    SolveError
        The motion is not periodic (``not_periodic``), Newton's method did not converge (``no_convergence``), the orbit
        found has not the period asked for (``shorter_period``), or the simulation failed; the message says what to do.
    ValueError, TypeError
        Arguments that do not fit.
    """
    check_system(system, "find_orbit")
    if system.explicit_time:
        raise ValueError(f"{system.name!r} depends on time without a period: it has no periodic orbits")
    if period_number is not None:
        period_number = whole_number(period_number, "period_number", 1)
    transient, max_period = whole_number(transient, "transient", 0), whole_number(max_period, "max_period", 1)
    engine = engine_for(system, rtol=RTOL)
    state = first_state(system, start)
    if system.period() is None:
        from nonsmooth.continuation.settled_autonomous import autonomous_guesses

        guesses = autonomous_guesses(system, engine, state, transient, max_period, period_number)
    else:
        keep = 2 * max(max_period, period_number or 1) + 2
        begun = state.copy()
        settled = settle_forced(system, engine, state, transient, keep)
        if settled.status not in GOOD and not transient and period_number is not None:
            # The motion leaves an unstable orbit and fails later: its first rounds are enough.
            settled = settle_forced(system, engine, begun, 0, period_number + 1)
        if settled.status not in GOOD:
            raise solve_error(settled.status)
        guesses = forced_guesses(system, settled, period_number, max_period)
    if not guesses:
        raise SolveError(
            f"no periodic motion was found: after {transient} forcing periods no return up to the period number "
            f"{period_number or max_period} came near its beginning (chaotic, quasi-periodic, a longer period). Give "
            "another start, a longer transient or max_period, or period_number= for an unstable orbit within it",
            status="not_periodic",
        )
    orbit = _polished(system, guesses, given=period_number is not None, unstable=transient == 0)
    options = {
        "start": plain_start(system, start), "period_number": period_number, "transient": transient,
        "max_period": max_period,
    }  # fmt: skip
    return replace(orbit, options=options)


def _polished(system: System, guesses: list[Guess], given: bool, unstable: bool) -> Orbit:
    """Newton from each guess; the first orbit that is admissible, near, and stable (or asked for)."""
    reasons: list[tuple[str, str]] = []
    for guess in [one for first in guesses for one in (*touching(first, system), first)]:
        shooting = Shooting(system, guess.signature, guess.period_number)
        X = shooting.join(guess.times, guess.states, guess.period)
        size = np.concatenate([guess.size, np.ones(shooting.n - len(guess.size))])
        name = _name(guess.period_number)
        anchor_at(shooting, shooting.values, X[: shooting.n], size)
        left = shooting.evaluate(X).residual[: shooting.n]  # what the guess lacks to close
        solved = shooting.newton(X, _scale(shooting, size, guess.period))
        shorter = None if solved is None else primitive(shooting, solved, size)
        gap = guess.gap
        if shorter is not None and given:
            number = shorter[0].period_number
            word = f"is {_name(number)}" if number else "is a shorter one"
            reasons.append(("shorter_period", f"the {name} orbit found {word}, gone round several times"))
            continue
        if shorter is not None:
            shooting, X = shorter
            solved = shooting.newton(X, _scale(shooting, size, guess.period))
            name = _name(shooting.period_number)
            if shooting.forced:
                gap = float(guess.gaps[shooting.period_number - 1])
                left = np.full(shooting.n, np.nan)
        if solved is None:
            reasons.append(("no_convergence", f"Newton's method did not converge to a {name} orbit"))
            continue
        walk = Walk(shooting)
        path = walk.along(solved, shooting.split(solved.X)[1])
        if path is None:
            reasons.append(("no_convergence", f"the {name} orbit found could not be followed"))
            continue
        clearance = walk.clearance(path, len(system.indicators))
        noise = NOISE * float(guess.size.max())
        virtual = bool((path.violation() < -noise).any())
        orbit = orbit_of(shooting, solved, path, clearance, virtual)
        if virtual:
            reasons.append(("virtual", f"the {name} orbit found passes through a boundary it should obey"))
        elif given or unstable or (orbit.stable and _is_near(orbit, guess, gap, left)):
            return orbit
        elif not orbit.stable:
            reasons.append(("not_periodic", f"the {name} orbit near the motion is unstable"))
        else:
            reasons.append(("no_convergence", f"Newton's method left the motion for a {name} orbit far from it"))
    status = reasons[0][0] if guesses[0].gap <= CLOSED or given else "not_periodic"
    said = "; ".join(dict.fromkeys(text for _, text in reasons))
    raise SolveError(
        f"the motion settled on no periodic orbit that could be confirmed: {said}. Give another start, a longer "
        "transient, or period_number= (then an unstable orbit is taken too)",
        status=status,
    )


def _name(period_number: int) -> str:
    return f"period-{period_number}" if period_number else "closed"


def _scale(shooting: Shooting, size: FloatArray, period: float) -> FloatArray:
    m = shooting.m
    return shooting.join(np.full(m, period), np.tile(size, (m + 1, 1)), period)


def _is_near(orbit: Orbit, guess: Guess, gap: float, left: FloatArray) -> bool:
    """Whether an orbit is the one that a motion settles on: as near as its gap says.

    A slow motion closes better than it is near: by the multipliers, the orbit is (I - M)^-1 times the gap away.
    """
    moved = float(np.abs((orbit.u - guess.states[0, : len(orbit.u)]) / guess.size).max())
    if moved <= max(FAR * gap, 1e-6):
        return True
    if not orbit.period_number or not np.isfinite(left).all() or moved > NEAR:
        return False
    away = np.linalg.lstsq(np.eye(len(left)) - orbit.monodromy_matrix, left, rcond=None)[0]
    return moved <= SLOW * float(np.abs(away[: len(guess.size)] / guess.size).max())
