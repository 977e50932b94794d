"""The fit over the first, short windows: from a guess that may be far off to where longer windows take over.

Far from the solution the noise is taken for as large as a part of the residuals, and the parameters for known about
their guess to their own size: so no step runs away while the residuals are large, and both fade as they fall. A window
that fits much worse than most has missed a transition, or has one too many, and no small step of its start mends it;
its start is then searched anew: from the window before, from the samples, and at random. Rough fits on the way are of
all windows together (`level`), and of one alone at given parameters (`alone`).

In a relay with hysteresis, or behind a play, no state tells the mode in which a record begins. It is a discrete unknown
of each record: over the record's first window every other mode is tried whose conditions do not end it at once, at the
unknowns as they are and in the end with all of them free, and the one that fits best is taken.

Windows that disagree with the rest are found with parameters of the others, left out on request, and named.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import SolveError, shortened, unknown
from nonsmooth.identification.arrow import Residuals, settle
from nonsmooth.identification.fit.first_windows import first_length, first_windows, told_start
from nonsmooth.identification.fit.windows import Window, Windows
from nonsmooth.recordings.recording import runs_of

if TYPE_CHECKING:
    from nonsmooth.system.system import System


def level(
    problem: Windows, theta: FloatArray, starts: FloatArray, used: Any = None
) -> tuple[FloatArray, FloatArray, Residuals]:
    """A rough fit on the way, in which the parameters are known to about their own size.

    What windows so short do not tell then stays where it is: a coefficient of restitution of 1e8, tried where hardly an
    impact was seen, makes a motion of hours.
    """
    state = problem.residuals(theta, starts)
    if not np.isfinite(np.concatenate([*state.residuals, state.alone])).all():
        raise SolveError("a motion over longer windows, or to a steady state, does not come to its end")
    known = problem.unknowns.precision + np.diag(own_size(problem) ** -2.0)
    return settle(problem, theta, starts, used, known, rough=True)


def own_size(problem: Windows) -> FloatArray:
    guess = problem.unknowns.guess
    return np.where(guess != 0.0, np.abs(guess), np.inf)


def misfits(problem: Windows, state: Residuals) -> FloatArray:
    """Mean squared residual over the noise, of each window."""
    return np.array([float(np.mean((r / problem.noise[w.readings[1]]) ** 2)) for w, r in problem.rows(state)])


def alone(
    problem: Windows, theta: FloatArray, trials: list[tuple[Window, FloatArray]], most: int
) -> list[tuple[float, Window, FloatArray]]:
    """Of these windows with starts, those that fit best before their starts are fitted, fitted; the best first."""
    fixed = replace(problem, unknowns=replace(problem.unknowns, low=theta, high=theta, centre=theta))
    costs = []
    for window, start in trials:
        one = fixed.of([window])
        costs.append(float(misfits(one, one.residuals(theta, start[None, :]))[0]))
    found = []
    for k in np.argsort(costs, kind="stable")[:most]:
        window, start = trials[k]
        one = fixed.of([replace(window, start=start)])
        try:
            _, moved, state = level(one, theta, start[None, :])
        except SolveError:
            continue
        found.append((float(misfits(one, state)[0]), one.pieces[0], moved[0]))
    return sorted(found, key=lambda row: row[0])


BETTER = 9.0  # by which the sum of squares has to fall for another mode
_TRIED = 12  # starts drawn for each mode
_FITTED = 2  # of these


def read_modes(system: System, given: Any, runs: Sequence[str]) -> list[tuple[int, ...]]:
    """The modes in which each run may begin, the first guess first: all, or the one that is given.

    Raises
    ------
    ValueError, TypeError
        A mode or a run that does not exist.
    """
    modes = list(system.modes)
    if given is None:
        return [tuple(range(len(modes)))] * len(runs)
    if isinstance(given, str):
        given = dict.fromkeys(runs, given)
    if not isinstance(given, Mapping):
        raise TypeError(f"mode = {shortened(given)}: allowed are the name of a mode, and a mapping of run to names")
    for run, name in given.items():
        if run not in runs:
            raise ValueError(f"mode: {unknown(run, 'a run', 'this recording', list(runs))}")
        if name not in modes:
            raise ValueError(f"mode: {unknown(name, 'a mode', repr(system.name), modes)}")
    return [(modes.index(given[run]),) if run in given else tuple(range(len(modes))) for run in runs]


def rechosen(problem: Windows, theta: FloatArray, starts: FloatArray) -> bool:
    """Begin each record in the mode that fits its first window best, in place; return whether one has changed."""
    changed = False
    for i, window in enumerate(problem.pieces):
        others = other_beginnings(problem, theta, starts, i)
        if others and (now := alone(problem, theta, [(window, starts[i])], 1)):
            best = min(others, key=lambda row: row[0])
            if (now[0][0] - best[0]) * len(window.readings[0]) > BETTER:
                problem.pieces[i], starts[i], changed = best[1], best[2], True
    return changed


def other_beginnings(
    problem: Windows, theta: FloatArray, starts: FloatArray, i: int
) -> list[tuple[float, Window, FloatArray]]:
    """A window at the beginning of its record in each other mode, its start fitted: mean squared residual, window,
    start."""
    window = problem.pieces[i]
    if window.first or len(problem.modes[window.record]) == 1:
        return []
    told = told_start(problem, theta, window)
    known = np.isfinite(told) & (window.spread > 0)
    rng, found = np.random.default_rng(0), []
    for mode in problem.modes[window.record]:
        other, trials = replace(window, mode=mode), [starts[i], np.where(known, told, starts[i])]
        if mode == window.mode or not _stays(problem, theta, other, trials):
            continue
        reach = np.where(known, 0.0, 0.2) * window.spread
        trials += [trials[k % 2] + reach * rng.standard_normal(len(reach)) for k in range(_TRIED if reach.any() else 0)]
        found += alone(problem, theta, [(other, z) for z in trials], _FITTED)[:1]
    return found


def _stays(problem: Windows, theta: FloatArray, window: Window, starts: list[FloatArray]) -> bool:
    """Return whether a motion may begin in the mode of this window: no condition ends it at once."""
    begun = (problem.motion(theta, window, start) for start in starts)
    return any(motion is not None and int(motion.log.sample_mode[0]) == window.mode for motion in begun)


_ROUNDS = 10
_PART = 1 / 3  # of the residuals: as how large the noise is taken
_REACH = 4.0  # factor within which parameters stay about their guess at first
_FAR = 5.0  # mean squared residual of a window over that of most, from which its start is searched anew
_DRAWN = 60  # starts drawn for such a window


def settle_first(
    problem: Windows, theta: FloatArray, length: float, start: FloatArray | None, free: bool
) -> tuple[Windows, FloatArray, FloatArray, Residuals]:
    """Windows, unknowns, starts and residuals of the fit over windows of this length.

    Raises
    ------
    SolveError
        If no window of the record can be simulated.
    """
    pieces = first_windows(problem, theta, length, start, free)
    if not pieces:
        raise SolveError("the motion of the first guess ends before any window of the record does")
    now, starts = problem.of(pieces), problem.of(pieces).starts
    rng = np.random.default_rng(len(pieces))
    state = now.residuals(theta, starts)
    used = np.ones(len(pieces), dtype=bool)
    for _ in range(_ROUNDS):
        noise = np.maximum(problem.noise, _PART * _sizes(now, state))
        theta, starts, state = level(_soft(now, noise), theta, starts, used)
        each, bad = _judged(now, state)
        changed = not np.array_equal(bad, ~used)
        if rechosen(now, theta, starts):
            state, changed = now.residuals(theta, starts), True
            each = misfits(now, state)
        if np.mean(bad) <= 0.5 and _mend(now, theta, starts, each, np.flatnonzero(bad), rng):
            state, changed = now.residuals(theta, starts), True
            each, bad = _judged(now, state)
        used = ~bad
        if not changed and not _smaller(now, state, noise):
            break
    theta, starts, state = level(now, theta, starts, used)
    moves = [bool(np.isfinite(r).all()) for r in state.residuals]
    if not any(moves):
        raise SolveError("no window of the record can be simulated at the parameters that fit it best")
    if not all(moves):
        now, starts = now.of([w for w, whole in zip(now.pieces, moves, strict=True) if whole]), starts[moves]
        state = now.derivatives(theta, starts)
    return now, theta, starts, state


def _judged(problem: Windows, state: Residuals) -> tuple[FloatArray, BoolArray]:
    """Mean squared residual over the noise of each window, and which fit much worse than most."""
    each = misfits(problem, state)
    return each, each > _FAR * max(float(np.median(each)), 1.0)


def settle_soft(problem: Windows, theta: FloatArray, starts: FloatArray) -> tuple[FloatArray, FloatArray, Residuals]:
    """Unknowns, starts and residuals of a fit from far off, over the windows as they are."""
    state = problem.residuals(theta, starts)
    for _ in range(_ROUNDS):
        noise = np.maximum(problem.noise, _PART * _sizes(problem, state))
        theta, starts, state = level(_soft(problem, noise), theta, starts)
        if not _smaller(problem, state, noise):
            break
    return theta, starts, state


def _smaller(problem: Windows, state: Residuals, noise: FloatArray) -> bool:
    """Return whether the residuals have fallen, so that the noise may be taken for less."""
    return bool(((_PART * _sizes(problem, state) < 0.8 * noise) & (noise > problem.noise)).any())


def _soft(problem: Windows, noise: FloatArray) -> Windows:
    """The problem with this noise; while that is not yet its own, the parameters stay about their guess."""
    if (noise <= problem.noise).all():
        return problem
    u, size = problem.unknowns, own_size(problem)
    near, far = np.where(size < np.inf, size / _REACH, -np.inf), _REACH * size
    low = np.maximum(u.low, np.where(u.guess > 0, near, -far))
    high = np.minimum(u.high, np.where(u.guess < 0, -near, far))
    return replace(problem, noise=noise, unknowns=replace(u, low=low, high=high))


def _sizes(problem: Windows, state: Residuals) -> FloatArray:
    """Size of the residuals of each quantity, of most windows."""
    found = np.zeros(len(problem.sensors))
    for c in range(len(found)):
        rows = [r[w.readings[1] == c] for w, r in problem.rows(state)]
        each = [float(np.mean(r**2)) for r in rows if len(r)]
        found[c] = np.sqrt(np.median(each or [0.0]))
    return found


def _mend(
    problem: Windows, theta: FloatArray, starts: FloatArray, each: FloatArray, bad: Any, rng: np.random.Generator
) -> bool:
    """Look for other starts (and modes) of the bad windows, in place; returns whether one was found."""
    found = False
    for i in bad:
        best = alone(problem, theta, _others(problem, theta, starts, int(i), rng), 3)
        if best and best[0][0] < 0.7 * each[i]:
            problem.pieces[i], starts[i], found = best[0][1], best[0][2], True
    return found


def _others(
    problem: Windows, theta: FloatArray, starts: FloatArray, i: int, rng: np.random.Generator
) -> list[tuple[Window, FloatArray]]:
    """Other starts of a window: as the window before it ends, as the samples tell, and drawn about these."""
    window = problem.pieces[i]
    told, run = told_start(problem, theta, window), window.record
    found = [(window, starts[i])]
    if i and problem.pieces[i - 1].record == run:
        before, begin = problem.pieces[i - 1], np.array([problem.clock(theta, run) * window.begin])
        motion = problem.march(theta, run, before.begin, begin, starts[i - 1], before.mode)
        if motion is not None:
            found.append((replace(window, mode=int(motion.mode[0])), motion.z[0]))
    known = np.isfinite(told) & (window.spread > 0)
    found += [(w, np.where(known, told, z)) for w, z in found]
    for k in range(_DRAWN):
        w, z = found[k % len(found)]
        reach = np.where(known, 0.03, 0.2) * window.spread * rng.standard_normal(len(z))
        found.append((w, z + reach))
    return found


_DISAGREES = 8.0  # mean squared residual of a window over that of most, from which it disagrees
_TOO_MANY = 0.5  # of the windows: if more disagree, nothing says which are right
_CLOSED = 3  # windows: a shorter part between two that disagree is left out with them


def without_disagreeing(problem: Windows, theta: FloatArray) -> tuple[Windows, list[str]]:
    """The problem with its records cut where short windows do not fit, its guess the parameters of those that do.

    Each part begins with a free start; unknowns of a run are those of all its parts. The sentences name what is left
    out.
    """
    now, theta, _, state = settle_first(problem, theta, first_length(problem), None, True)
    each = misfits(now, state)
    usual = max(float(np.median(each)), 1.0)
    bad = each > _DISAGREES * usual
    if not bad.any() or np.mean(bad) > _TOO_MANY:
        many = f"{np.mean(bad):.0%} of short windows disagree with the rest: too many, and none was left out"
        return problem, [many] if bad.any() else []
    of_window = np.array([window.record for window in now.pieces])
    records, origin, modes = [], [], []
    said: list[str] = []
    for i, record in enumerate(problem.records):
        mine = np.flatnonzero(of_window == i)
        for first, behind in runs_of(_closed(bad[mine])):
            begin, end = now.pieces[mine[first]].time[0], now.pieces[mine[behind - 1]].time[-1]
            worst = float(np.sqrt(np.max(each[mine[first:behind]]) / usual))
            said.append(
                f"left out: run {record.name}, {begin:.6g} to {end:.6g}, whose residuals are up to {worst:.3g} times "
                "those of the rest"
            )
        for first, behind in runs_of(~_closed(bad[mine])):
            a = 0 if first == 0 else now.pieces[mine[first]].first
            b = len(record.time) if behind == len(mine) else now.pieces[mine[behind - 1]].last
            name = record.name if b - a == len(record.time) else f"{record.name} from {record.time[a]:.6g}"
            records.append(replace(record, name=name, time=record.time[a:b], values=record.values[a:b]))
            origin.append(i)
            modes.append(problem.modes[i] if a == 0 else tuple(range(len(problem.system.modes))))
    u = problem.unknowns
    whose = [*origin, *range(len(problem.records), len(u.places))]
    unknowns = replace(u, guess=np.clip(theta, u.low, u.high), places=u.places[whose])
    return replace(problem, records=records, modes=modes, unknowns=unknowns), said


def _closed(bad: BoolArray) -> BoolArray:
    """The same, with short parts between two that disagree."""
    found = bad.copy()
    for first, behind in runs_of(~bad):
        if behind - first < _CLOSED and bad.any():
            found[first:behind] = True
    return found
