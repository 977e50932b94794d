"""Fits over windows that grow from level to level until one window holds a whole record, or no longer one fits.

Over short windows a sum of squares has one minimum, however chaotic the motion; over long ones the parameters are found
more accurately. So each level begins where the one before it ended, and a level whose windows are longer than a
trajectory can be followed is given up (H.G. Bock 1981; H.U. Voss, J. Timmer, J. Kurths, Int. J. Bifurcation and
Chaos 14 (2004) 1905).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.identification.arrow import Residuals, concerned, inverted, reduced, settle
from nonsmooth.identification.fit.first_level import (
    BETTER,
    Stage,
    level,
    other_beginnings,
    rechosen,
    settle_first,
)
from nonsmooth.identification.fit.first_windows import first_windows
from nonsmooth.identification.fit.noise import colours, residuals_of, robust_size, strange
from nonsmooth.identification.fit.window import Window
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.recordings.signals.spectrum import correlation_times

POOR = 50.0  # chi^2 per degree of freedom of the first windows, from which there is no use in longer ones
_CHAOS = 1e3  # growth of a start's change within a window, from which neighbouring motions are not followed
_REGULAR = 10.0  # that growth, below which a motion is regular enough to be followed over twice the time
_WORSE = 1.5  # chi^2 per degree of freedom against that of the level before: a longer window does not fit
_GOOD, _WHITE = 1.3, 5.0  # residuals over irregularity, and readings that share an error, of a fit that needs no other
_NEAR = 0.6  # residuals of a guess over the readings' own size, up to which the longest windows are fitted from it
_QUIET = 0.5  # residuals of the first windows over irregularity, from which these are the noise
_CHANCE = 1e-3  # that short windows fit so much better by chance
_EXACT = 1e-4  # of the noise squared: residuals of short windows that are those of the arithmetic
SHORT = 0.05  # standard uncertainties from the minimum, beyond which a fit is said not to have come to its end
_FASTER = (4.0, 2.0)  # by how much windows become longer at a time, tried in turn
_ROUNDS = 12  # of noise from residuals and residuals from noise


@dataclass(frozen=True, eq=False, kw_only=True)
class Grown(Stage):
    """A finished fit, its windows the last ones, with the noise as found.

    Attributes
    ----------
    short : float
        Distance to the minimum where no step leads on, in standard uncertainties; 0 at a minimum.
    left : array (p,)
        That distance in each parameter.
    rms : float
        Size of the residuals over that of noise of their correlation that the record's own irregularity shows.
    missing : bool
        Whether they have a structure that shows that the model is missing a part.
    stuck : bool
        Whether longer windows did not fit though neighbouring motions do not separate fast.
    opened : bool, optional
        Whether short windows with starts of their own fit better than noise allows; None where nobody has looked.
    apart : array (p,)
        Standard uncertainties of the unknowns over these windows, empty where nobody has looked.
    begins : tuple of (int, int, float)
        Records that may begin in several modes: the record, its mode, by how much the next best raises chi^2.
    doubted : tuple of int
        Unknowns along which the sum of squares is no parabola.
    """

    short: float
    left: FloatArray
    rms: float
    missing: bool = False
    stuck: bool = False
    opened: bool | None = None
    apart: FloatArray = field(default_factory=lambda: np.zeros(0))
    begins: tuple[tuple[int, int, float], ...] = ()
    doubted: tuple[int, ...] = ()

    @property
    def readings(self) -> int:
        """Number of readings that were used."""
        return int(self.problem.counts.sum())

    @property
    def runs(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(record.name for record in self.problem.records)

    @property
    def unused(self) -> int:
        """Number of readings in parts of the record that could not be simulated."""
        return sum(int(np.isfinite(record.values).sum()) for record in self.problem.records) - self.readings

    @property
    def whole(self) -> bool:
        """Return whether one window holds each record."""
        return len(self.problem.pieces) == len(self.problem.records)

    @property
    def length(self) -> float:
        """The median length of its windows."""
        return float(np.median([window.time[-1] - window.time[0] for window in self.problem.pieces]))

    def loose(self, state: Residuals) -> FloatArray:
        """Directions of the unknowns that readings and priors leave open; the starts' own wide prior tells nothing."""
        read, *_ = reduced(self.problem, state, self.problem.weights(state, starts=False))
        return inverted(read + self.problem.unknowns.precision)[1]

    @property
    def rank(self) -> tuple[bool, bool, bool, float]:
        """Order of fits, the better one first."""
        return self.unused > 0, self.stuck, self.short > SHORT, self._unlikely

    @property
    def _unlikely(self) -> float:
        """Minus the logarithm of the likelihood, for each reading."""
        counts, of = self.problem.counts, np.concatenate([window.readings[1] for window in self.problem.pieces])
        own = self.problem.noise * np.sqrt(1.0 - self.problem.colour**2)
        return float(np.mean(np.log(own[of])) + 0.5 * self.misfits @ counts / counts.sum())

    @property
    def good(self) -> bool:
        """Return whether the residuals are what the record's own irregularity leaves, and no more than noise.

        Where a record is sampled so coarsely that its irregularity is the motion itself, the residuals still have to
        be independent, and over windows with starts of their own they are not taken for coloured noise.
        """
        tau = [w.correlation(r) for w, r in self.problem.rows(self.state)]
        ends = not self.stuck and not self.unused and self.short <= SHORT
        white = not self.problem.colour.any() and float(np.median(tau)) < _WHITE
        return self.rms <= _GOOD and not self.missing and ends and (self.whole or white)


def grow(
    problem: Windows,
    theta: FloatArray,
    lengths: tuple[float, float, float],
    start: FloatArray | None,
    free: bool,
    told: Callable[[], None],
) -> Grown:
    """Fit from a first guess; SolveError if not even the first windows can be fitted.

    ``problem`` is without windows, its ``noise`` a first estimate; ``lengths`` are those of the shortest windows, of
    the first ones here and of the longest ones; ``start`` and ``free`` as in :func:`first_windows`; ``told`` is called
    once a level is done.
    """
    short, length, longest = lengths
    near = _at_once(problem, theta, start, free, longest)
    if near is not None:
        near = seen(near, short, start, free)
        if not near.opened:
            told()
            return near
        theta = near.theta
    stage = settle_first(problem, theta, length, start, free)
    quiet = np.minimum(problem.noise, _noise(stage.problem, stage.state))
    if (quiet < _QUIET * problem.noise).any():  # few samples a swing: their irregularity was the motion's
        stage = settle_first(replace(problem, noise=quiet), stage.theta, length, start, free)
    told()
    poor = _reduced(stage) > POOR
    stage, stuck = (stage, False) if poor else _lengthened(stage, length, longest, told)
    found = replace(finished(stage, problem.noise, 2 if poor else _ROUNDS), stuck=stuck)
    return found if near is None or found.rank < near.rank else near


def _lengthened(stage: Stage, wide: float, longest: float, told: Callable[[], None]) -> tuple[Stage, bool]:
    """The fit over windows that grow up to the longest ones, and whether they got stuck on the way."""
    while len(stage.problem.pieces) > len(stage.problem.records) and wide < longest:
        for wider in (min(factor * wide, longest) for factor in _FASTER):
            longer = _longer_windows(stage, wider)
            told()
            if longer is not None:
                stage, wide = longer, wider
                break
        else:
            return stage, _spreads(stage) < _REGULAR
    return stage, False


def finished(stage: Stage, irregular: FloatArray, rounds: int = _ROUNDS) -> Grown:
    """The fit at its minimum, with the noise from its residuals, each record in the mode in which it fits best."""
    return _begun(_final(stage, irregular, rounds), irregular, rounds)


def _at_once(problem: Windows, theta: FloatArray, start: FloatArray | None, free: bool, longest: float) -> Grown | None:
    """The fit over the longest windows, from a guess so near that it needs no shorter ones; None where it is not."""
    now = problem.of(first_windows(problem, theta, longest, start, free))
    if not now.pieces:
        return None
    stage = Stage(now, theta, now.starts)
    for c in range(len(problem.sensors)):
        size = np.nanstd(np.concatenate([record.values[:, c] for record in problem.records]))
        if not np.sqrt(np.mean(residuals_of(now, stage.state, c) ** 2)) < _NEAR * size:
            return None
    try:
        found = level(stage)
        if _reduced(found) > 2.0 * _GOOD**2:
            return None
        final = finished(found, problem.noise)
    except SolveError:
        return None
    return final if final.good and _spreads(found) < _CHAOS else None


def seen(whole: Grown, length: float, start: FloatArray | None, free: bool) -> Grown:
    """A fit with its marks of short windows with starts of their own: how far these leave the unknowns open, and
    whether they fit better than noise allows (F-test of nested models): then the sum of squares over long ones has
    another minimum, or the model lacks a part."""
    from scipy.stats import f

    if whole.opened is not None:
        return whole
    plain, closed = whole.problem.plain, replace(whole, opened=False)
    now = plain.of(first_windows(plain, whole.theta, length, start, free))
    (few, total), (many, all_) = _freedom(now), _freedom(plain)
    if total != all_ or not many > few:
        return closed
    try:
        short = level(Stage(now, whole.theta, now.starts))
    except SolveError:
        return closed
    residuals = [residuals_of(now, short.state, c) for c in range(len(now.sensors))]
    if not np.isfinite(np.concatenate(residuals)).all():
        return closed
    of_long = (1.0 + whole.problem.colour) / (1.0 - whole.problem.colour)  # short windows take some of it away
    each, shared = _reduced(short), max(*map(correlation_times, residuals), *of_long)
    gained = (_reduced(Stage(plain, whole.theta, whole.starts)) * many - each * few) / (many - few)
    better = f.sf(gained / max(each, _EXACT) / shared, many - few, few) < _CHANCE
    covariance, loose = inverted(reduced(now, short.state)[0] + now.unknowns.precision)
    apart = np.where(concerned(loose).any(axis=1), np.inf, np.sqrt(np.diag(covariance)))
    return replace(whole, opened=bool(better), apart=apart)


def _longer_windows(stage: Stage, length: float) -> Stage | None:
    """The fit over windows joined up to ``length``; None where it does not come to an end, or fits much worse."""
    joined = _joined(stage, length)
    if len(joined) == len(stage.problem.pieces):
        return None
    trial = stage.problem.of(joined)
    try:
        found = level(rechosen(Stage(trial, stage.theta, trial.starts)))
    except SolveError:
        return None
    return None if _reduced(found) > _WORSE * max(_reduced(stage), 1.0) or _spreads(found) > _CHAOS else found


def _spreads(stage: Stage) -> float:
    """By how much a motion answers to its start, at most, both in units of their own size."""
    found, sizes = 0.0, np.abs(stage.starts).max(axis=0)
    for window, slopes in zip(stage.problem.pieces, stage.state.in_start, strict=True):
        rows = np.abs(slopes[: len(window.readings[0])]) * sizes
        for c in np.unique(window.readings[1]):
            size = np.ptp(window.values[np.isfinite(window.values[:, c]), c]) or 1.0
            found = max(found, np.max(rows[window.readings[1] == c]) / size)
    return found


def _joined(stage: Stage, length: float) -> list[Window]:
    """Windows joined up to ``length``, each with the start of its first."""
    groups: list[list[tuple[Window, FloatArray]]] = []
    for window, start in zip(stage.problem.pieces, stage.starts, strict=True):
        here = groups[-1][0][0] if groups else None
        if here is not None and here.record == window.record and window.time[-1] - here.time[0] <= 1.3 * length:
            groups[-1].append((window, start))
        else:
            groups.append([(window, start)])
    found = []
    for k, group in enumerate(groups):
        head, start = group[0]
        record = stage.problem.records[head.record]
        behind = groups[k + 1][0][0] if k + 1 < len(groups) else head
        # samples between, of windows that could not be simulated, come back here
        last = behind.first if behind.record == head.record and behind is not head else len(record.time)
        found.append(head.cut(record, last, start=start))
    return found


def _reduced(stage: Stage) -> float:
    """Sum of squared residuals over the noise, per degree of freedom."""
    return float(stage.misfits @ stage.problem.counts) / _freedom(stage.problem)[0]


def _freedom(problem: Windows) -> tuple[float, int]:
    """Degrees of freedom of the readings, a tenth of these at least, and the number of readings."""
    free, total = sum(w.n_free for w in problem.pieces) + len(problem.unknowns.names), int(problem.counts.sum())
    return max(total - free, 0.1 * total), total


def _final(stage: Stage, irregular: FloatArray, rounds: int) -> Grown:
    """The fit at its minimum, with the noise of each quantity from its residuals."""
    problem, theta, starts = stage.problem, stage.theta, stage.starts
    for _ in range(rounds):
        colour = colours(problem, problem.plain.residuals(theta, starts))
        problem, before = replace(problem, colour=colour), problem
        noise = _noise(problem, replace(problem, steady=()).residuals(theta, starts))
        steady = tuple(
            one.with_noise(*problem.of_steady(theta, i)[:2], len(theta)) for i, one in enumerate(problem.steady)
        )
        ratios = [one.noise / old.noise for one, old in zip(steady, before.steady, strict=True)]
        moves = [np.concatenate([noise / before.noise, *ratios]) - 1.0, colour - before.colour]
        changed = np.max(np.abs(np.concatenate(moves)), initial=0.0)
        problem = replace(problem, noise=noise, steady=steady)
        theta, starts, _, short, left = settle(problem, theta, starts)
        if changed < 0.02:
            break
    state = problem.residuals(theta, starts)
    far, missing = strange(problem, problem.plain.residuals(theta, starts), state, irregular)
    return Grown(problem, theta, starts, state, short=short, left=left, rms=far, missing=missing)


def with_steady(problem: Windows, theta: FloatArray, grown: Grown | None = None) -> Grown:
    """The fit to the readings of steady states too, from a fit to the records; or to them alone."""
    now, starts = problem.of([]), np.zeros((0, problem.marcher.flow.n))
    if grown is not None:
        now, starts = replace(grown.problem, steady=problem.steady), grown.starts
    final = _final(level(Stage(now, theta, starts)), problem.noise, _ROUNDS)
    return (
        final
        if grown is None
        else replace(final, stuck=grown.stuck, opened=grown.opened, begins=grown.begins, doubted=grown.doubted)
    )


def _begun(final: Grown, irregular: FloatArray, rounds: int) -> Grown:
    """The fit with each record in the mode in which it fits best from its beginning, all unknowns free."""
    begins = []
    for i in range(len(final.problem.pieces)):
        now, best = final.chi2, None
        others = other_beginnings(final, i)
        if not others:
            continue
        least, mode = np.inf, final.problem.pieces[i].mode
        for _, window, start in others:
            try:
                found = level(final.with_others({i: (window, start)}))
            except SolveError:
                continue
            if found.chi2 < least:
                least, best = found.chi2, found
        if best is not None and least < now - BETTER:
            final, mode = _final(best, irregular, rounds), best.problem.pieces[i].mode
        begins.append((final.problem.pieces[i].record, mode, abs(least - now)))
    return replace(final, begins=tuple(begins))


def _noise(problem: Windows, state: Residuals) -> FloatArray:
    """Standard deviation of a reading of each quantity: from its residuals, or as it is known."""
    freedom, total = _freedom(problem)
    grow = total / max(freedom, 1e-9)
    found = np.empty(len(problem.sensors))
    for c, sensor in enumerate(problem.sensors.values()):
        r = residuals_of(problem, state, c)
        if sensor.noise is not None:
            found[c] = np.hypot(sensor.noise, sensor.floor)
        else:
            size = robust_size(r) if np.isfinite(problem.loss) else np.sqrt(np.mean(r**2)) if len(r) else 0.0
            found[c] = max(size * np.sqrt(grow), problem.least[c])
    return found
