"""The fit over the first, short windows: from a guess that may be far off to where longer windows take over.

Far from the solution the noise is taken for as large as a part of the residuals, and the parameters for known about
their guess to their own size: so no step runs away while the residuals are large, and both fade as they fall. Steps are
taken as if a reading lay on either side of the next jump, however far, and judged with it where it lies. A window
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
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import SolveError, check_keys, shortened
from nonsmooth.identification.arrow import Residuals, settle
from nonsmooth.identification.fit.first_windows import first_length, first_windows, told_start
from nonsmooth.identification.fit.window import Window
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.recordings.recording import runs_of
from nonsmooth.system.system import System


@dataclass(frozen=True, eq=False)
class Stage:
    """A stage of a fit: windows, unknowns and starts.

    ``given`` are the residuals there, where they are known.
    """

    problem: Windows
    theta: FloatArray
    starts: FloatArray
    given: Residuals | None = None

    @cached_property
    def state(self) -> Residuals:
        """The residuals there."""
        return self.problem.residuals(self.theta, self.starts) if self.given is None else self.given

    @property
    def chi2(self) -> float:
        """Sum of the weighted squares there, those of the starts among them."""
        return self.state.chi2(self.problem.weights(self.state, summed=True))

    @cached_property
    def misfits(self) -> FloatArray:
        """Mean squared residual over the noise, of each window."""
        noise = self.problem.noise
        return np.array([np.mean((r / noise[w.readings[1]]) ** 2) for w, r in self.problem.rows(self.state)])

    def with_others(self, others: Mapping[int, tuple[Window, FloatArray]]) -> Stage:
        """The same with other windows and starts in these places; itself where there are none."""
        if not others:
            return self
        pieces, starts = list(self.problem.pieces), self.starts.copy()
        for i, other in others.items():
            pieces[i], starts[i] = other
        return Stage(self.problem.of(pieces), self.theta, starts)


def level(stage: Stage, used: Any = None, reach: float = 1.0) -> Stage:
    """A rough fit on the way, in which the parameters are known to about their own size.

    What windows so short do not tell then stays where it is: a coefficient of restitution of 1e8, tried where hardly an
    impact was seen, makes a motion of hours. Its steps are those of this ``reach``.
    """
    problem = stage.problem
    if not np.isfinite(np.concatenate([*stage.state.residuals, stage.state.alone])).all():
        raise SolveError("a motion over longer windows, or to a steady state, does not come to its end")
    trial = replace(problem, reach=reach)
    theta, starts, state, *_ = settle(trial, stage.theta, stage.starts, used, _known(problem), rough=True)
    if problem.jumps and reach != problem.reach:
        state = problem.residuals(theta, starts, True)
    return Stage(problem, theta, starts, state)


def _known(problem: Windows) -> FloatArray:
    """The precision to which parameters are known on the way: to about their own size."""
    return problem.unknowns.precision + np.diag(own_size(problem) ** -2.0)


def own_size(problem: Windows) -> FloatArray:
    guess = problem.unknowns.guess
    return np.where(guess != 0.0, np.abs(guess), np.inf)


def alone(stage: Stage, trials: list[tuple[Window, FloatArray]], most: int) -> list[tuple[float, Window, FloatArray]]:
    """Of these windows with starts, those that fit best before their starts are fitted, fitted; the best first."""
    problem, theta = stage.problem, stage.theta
    fixed = replace(problem, unknowns=replace(problem.unknowns, low=theta, high=theta, centre=theta))
    begun = [Stage(fixed.of([window]), theta, start[None, :]) for window, start in trials]
    found = []
    for k in np.argsort([one.misfits[0] for one in begun], kind="stable")[:most]:
        window, start = trials[k]
        try:
            one = level(Stage(fixed.of([replace(window, start=start)]), theta, start[None, :]))
        except SolveError:
            continue
        found.append((one.misfits[0], one.problem.pieces[0], one.starts[0]))
    return sorted(found, key=lambda row: row[0])


BETTER = 9.0  # by which the sum of squares has to fall for another mode
_TRIED = 12  # starts drawn for each mode
_FITTED = 2  # of these


def read_modes(system: System, given: Any, runs: Sequence[str]) -> list[tuple[int, ...]]:
    """The modes in which each run may begin, the first guess first: all, or the one that is given."""
    modes = list(system.modes)
    if given is None:
        return [tuple(range(len(modes)))] * len(runs)
    if isinstance(given, str):
        given = dict.fromkeys(runs, given)
    if not isinstance(given, Mapping):
        raise TypeError(f"mode = {shortened(given)}: allowed are the name of a mode, and a mapping of run to names")
    check_keys(given, runs, "mode", "a run", "this recording")
    check_keys(given.values(), modes, "mode", "a mode", repr(system.name))
    return [(modes.index(given[run]),) if run in given else tuple(range(len(modes))) for run in runs]


def rechosen(stage: Stage) -> Stage:
    """The stage with each record begun in the mode that fits its first window best."""
    found = {}
    for i, window in enumerate(stage.problem.pieces):
        others = other_beginnings(stage, i)
        if others and (now := alone(stage, [(window, stage.starts[i])], 1)):
            best = min(others, key=lambda row: row[0])
            if (now[0][0] - best[0]) * len(window.readings[0]) > BETTER:
                found[i] = best[1:]
    return stage.with_others(found)


def other_beginnings(stage: Stage, i: int) -> list[tuple[float, Window, FloatArray]]:
    """A window at the beginning of its record in each other mode, its start fitted: mean squared residual, window,
    start."""
    problem, window, start = stage.problem, stage.problem.pieces[i], stage.starts[i]
    if window.first or len(problem.modes[window.record]) == 1:
        return []
    told = told_start(problem, stage.theta, window)
    known = np.isfinite(told) & (window.spread > 0)
    rng, found = np.random.default_rng(0), []
    for mode in problem.modes[window.record]:
        other, trials = replace(window, mode=mode), [start, np.where(known, told, start)]
        begun = (problem.motion(stage.theta, other, z) for z in trials) if mode != window.mode else ()
        if not any(motion is not None and int(motion.log.sample_mode[0]) == mode for motion in begun):
            continue  # the mode that is tried already, or one that a condition ends at once
        reach = np.where(known, 0.0, 0.2) * window.spread
        trials += [trials[k % 2] + reach * rng.standard_normal(len(reach)) for k in range(_TRIED * reach.any())]
        found += alone(stage, [(other, z) for z in trials], _FITTED)[:1]
    return found


_ROUNDS = 10
_PART = 1 / 3  # of the residuals
_REACH = 4.0  # factor within which parameters stay about their guess at first
_FAR = 5.0  # mean squared residual of a window over that of most, from which its start is searched anew
_DRAWN = 60  # starts drawn for such a window


def settle_first(problem: Windows, theta: FloatArray, length: float, start: FloatArray | None, free: bool) -> Stage:
    """The fit over windows of this length; SolveError if no window of the record can be simulated."""
    now = problem.of(first_windows(problem, theta, length, start, free))
    if not now.pieces:
        raise SolveError("the motion of the first guess ends before any window of the record does")
    rng = np.random.default_rng(len(now.pieces))
    stage, used = Stage(now, theta, now.starts), np.ones(len(now.pieces), bool)
    for _ in range(_ROUNDS):
        noise = np.maximum(problem.noise, _sizes(stage))
        fitted = _soft(stage, noise, used)
        bad = _bad(fitted)
        changed = not np.array_equal(bad, ~used)
        begun = rechosen(fitted)
        others: dict[int, tuple[Window, FloatArray]] = {}
        for i in np.flatnonzero(bad).tolist() if np.mean(bad) <= 0.5 else ():  # with other starts, and modes
            best = alone(begun, _others(begun.with_others(others), i, rng), 3)
            if best and best[0][0] < 0.7 * begun.misfits[i]:
                others[i] = best[0][1:]
        stage = begun.with_others(others)
        if stage is not begun:
            bad = _bad(stage)
        used = ~bad
        if not changed and stage is fitted and not _smaller(stage, noise):
            break
    stage = level(stage, used, np.inf)
    moves = [bool(np.isfinite(r).all()) for r in stage.state.residuals]
    if not any(moves):
        raise SolveError("no window of the record can be simulated at the parameters that fit it best")
    if not all(moves):
        now = stage.problem.of([w for w, whole in zip(stage.problem.pieces, moves, strict=True) if whole])
        stage = Stage(now, stage.theta, stage.starts[moves], now.residuals(stage.theta, stage.starts[moves], True))
    return stage


def _bad(stage: Stage) -> BoolArray:
    """Mark the windows that fit much worse than most."""
    return stage.misfits > _FAR * max(np.median(stage.misfits), 1.0)


def settle_soft(stage: Stage) -> Stage:
    """A fit from far off, over the windows as they are."""
    for _ in range(_ROUNDS):
        noise = np.maximum(stage.problem.noise, _sizes(stage))
        stage = _soft(stage, noise)
        if not _smaller(stage, noise):
            break
    return stage


def _sizes(stage: Stage) -> FloatArray:
    """A part of the size of the residuals of each quantity, of most windows: as how large the noise is taken."""
    found = np.zeros(len(stage.problem.sensors))
    for c in range(len(found)):
        rows = [r[w.readings[1] == c] for w, r in stage.problem.rows(stage.state)]
        each = [np.mean(r**2) for r in rows if len(r)]
        found[c] = _PART * np.sqrt(np.median(each or [0.0]))
    return found


def _smaller(stage: Stage, noise: FloatArray) -> bool:
    """Return whether the residuals have fallen, so that the noise may be taken for less."""
    return bool(((_sizes(stage) < 0.8 * noise) & (noise > stage.problem.noise)).any())


def _soft(stage: Stage, noise: FloatArray, used: Any = None) -> Stage:
    """The level at this noise; while that is not yet its own, the parameters stay about their guess."""
    problem = stage.problem
    if (noise <= problem.noise).all():
        return level(stage, used, np.inf)
    u, size = problem.unknowns, own_size(problem)
    near, far = np.where(size < np.inf, size / _REACH, -np.inf), _REACH * size
    low = np.maximum(u.low, np.where(u.guess > 0, near, -far))
    high = np.minimum(u.high, np.where(u.guess < 0, -near, far))
    soft = replace(problem, noise=noise, unknowns=replace(u, low=low, high=high))
    return replace(level(replace(stage, problem=soft), used, np.inf), problem=problem)


def _others(stage: Stage, i: int, rng: np.random.Generator) -> list[tuple[Window, FloatArray]]:
    """Other starts of a window: as the window before it ends, as the samples tell, and drawn about these."""
    problem, theta, window = stage.problem, stage.theta, stage.problem.pieces[i]
    told, run = told_start(problem, theta, window), window.record
    found = [(window, stage.starts[i])]
    if i and problem.pieces[i - 1].record == run:
        before, begin = problem.pieces[i - 1], problem.at(theta, run).begun(np.array([window.begin]))
        motion = problem.march(theta, run, before.begin, begin, stage.starts[i - 1], before.mode)
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
    stage = settle_first(problem, theta, first_length(problem), None, True)
    now, each = stage.problem, stage.misfits
    usual = max(np.median(each), 1.0)
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
            worst = np.sqrt(np.max(each[mine[first:behind]]) / usual)
            said.append(
                f"left out: run {record.name}, {begin:.6g} to {end:.6g}, whose residuals are up to {worst:.3g} times "
                "those of the rest"
            )
        for first, behind in runs_of(~_closed(bad[mine])):
            a = 0 if first == 0 else now.pieces[mine[first]].first
            b = len(record.time) if behind == len(mine) else now.pieces[mine[behind - 1]].last
            name = record.name if b - a == len(record.time) else f"{record.name} from {record.time[a]:.6g}"
            time, values = record.time[a:b], record.values[a:b]
            records.append(replace(record, name=name, time=time, values=values, first=a == 0))
            origin.append(i)
            modes.append(problem.modes[i] if a == 0 else tuple(range(len(problem.system.modes))))
    u = problem.unknowns
    whose = [*origin, *range(len(problem.records), len(u.places))]
    unknowns = replace(u, guess=np.clip(stage.theta, u.low, u.high), places=u.places[whose])
    return replace(problem, records=records, modes=modes, unknowns=unknowns), said


def _closed(bad: BoolArray) -> BoolArray:
    """The same, with short parts between two that disagree."""
    found = bad.copy()
    for first, behind in runs_of(~bad):
        if behind - first < _CLOSED and bad.any():
            found[first:behind] = True
    return found
