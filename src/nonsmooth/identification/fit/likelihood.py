"""Likelihood about the optimum of a fit: other minima, profiles of unknowns, and their posterior (emcee).

The sum of squares of a motion with contacts has a smooth piece for every sequence of transitions, and derivatives tell
of their own piece alone: in the next one there may be another minimum, or nothing may depend on the unknown any more.
So each unknown is moved alone by some standard uncertainties. There a parabola has risen by the square of their number
or more, since the others do not follow; where it has risen by less, the fit is begun anew, and an unknown that may as
well lie there is in doubt: its uncertainty is told by its profile, in which it is held beside its best value while all
others, and the starts, follow.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError, not_installed
from nonsmooth.identification.arrow import concerned, inverted, reduced, settle
from nonsmooth.identification.finding import Estimate, Finding, normal_draws
from nonsmooth.identification.fit.first_level import BETTER, Stage
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.identification.fit.windows import Windows
from nonsmooth.recordings.signals.sections import first_zero
from nonsmooth.results.progress import Progress, progress


def limits_of(values: FloatArray, rise: FloatArray, best: float) -> tuple[float, float]:
    """Limits of a parameter at 95 %, by its rising values and the rise of chi^2 above its least, at ``best``.

    A limit is NaN where chi^2 does not rise to 3.84 within the values: the data do not bound the parameter
    there.
    """
    from scipy.stats import chi2

    beyond, middle = rise - chi2.ppf(0.95, 1), int(np.argmin(np.abs(values - best)))
    return first_zero(values[middle::-1], beyond[middle::-1]), first_zero(values[middle:], beyond[middle:])


_AWAY = (*np.arange(0.5, 4.5, 0.5), *(4.0 + 2.0 ** np.arange(8)))  # standard uncertainties, on either side, at most
_HIGH = 5.0  # rise of chi^2 beyond which no limit at 95 % lies
PROFILED = (
    "profile likelihood: the unknown is held while all others and the starts follow; the limits are where chi^2, over "
    "the residuals' own correlation, has risen by 3.84 (Wilks 1938)"
)


def profiled(
    grown: Grown, names: list[str], normal: FloatArray, covariance: FloatArray, synthetic: bool, watched: Progress
) -> list[Finding]:
    """A finding for each of these unknowns.

    ``normal`` (p, p) is the normal matrix, priors included: its inverse would be the covariance of white residuals. By
    the ``covariance`` of the fit the rise of chi^2 is scaled.
    """
    u, white, found = grown.problem.unknowns, np.diag(inverted(normal)[0]), []
    with progress(2 * len(names), "profiles", watched) as advance:
        for name in names:
            i = u.names.index(name)
            error = float(np.sqrt(covariance[i, i]))
            above: list[tuple[float, float]] = []
            for sign in (-1.0, 1.0):
                above += _side(grown, i, sign * error, white[i] / covariance[i, i])
                advance()
            values, rise = np.array(sorted([*above, (grown.theta[i], 0.0)])).T
            best = values[np.argmin(rise)]  # a better fit than the best, where the sum of squares has corners
            rise = rise - rise.min()
            estimate = Estimate(grown.theta[i], error, u.units[i])
            ends = dict(zip(("low", "high"), limits_of(values, rise, best), strict=True))
            low, high = (f"{end:.4g}" if np.isfinite(end) else "no limit" for end in ends.values())
            by_error = " to ".join(f"{end:.4g}" for end in estimate.interval())
            note = f"{name}: 95 % limits {low} to {high} by its profile; {by_error} by its standard uncertainty"
            if not np.isfinite(list(ends.values())).all():
                note += "; the record does not bound it on both sides"
            data = xr.Dataset(
                {"cost": ("value", rise), "best": ((), best), **{k: ((), v) for k, v in ends.items()}},
                {"value": ("value", values, {"units": estimate.unit})},
                {"parameter": name, "units": estimate.unit, "synthetic": "yes" if synthetic else "no"},
            )
            used = grown.readings, grown.runs, (note,)
            found.append(Finding(f"{name}, profile", estimate, PROFILED, *used, data=data, plot="profile"))
    return found


def _side(grown: Grown, i: int, step: float, scale: float) -> list[tuple[float, float]]:
    """Values of an unknown on one side and the rise of chi^2 there, up to where it is enough."""
    problem, u = grown.problem, grown.problem.unknowns
    theta, starts, least = grown.theta, grown.starts, problem.cost(grown.theta, grown.starts)
    rows: list[tuple[float, float]] = []
    for far in _AWAY:
        value = grown.theta[i] + far * step
        if not u.low[i] <= value <= u.high[i]:
            break
        theta = np.where(np.arange(len(theta)) == i, value, theta)
        held = np.where(np.arange(len(theta)) == i, value, [u.low, u.high])
        theta, starts, *_ = settle(replace(problem, unknowns=replace(u, low=held[0], high=held[1])), theta, starts)
        rise = (problem.cost(theta, starts) - least) * scale
        if not np.isfinite(rise):
            break
        rows.append((value, rise))
        if rise > _HIGH:
            break
    return rows


_MOST = 80  # unknowns and numbers of starts: beyond, an ensemble moves too slowly
_BURNT = 0.25  # of the steps, before the ensemble has forgotten where it began
_SPANNED = 50.0  # autocorrelation times that the steps should span
SAMPLED = (
    "affine-invariant ensemble of walkers (Goodman and Weare 2010; Foreman-Mackey et al. 2013), started about the "
    "optimum; noise and its correlation as the fit has found them, all starts among the unknowns"
)


def posterior_of(grown: Grown, steps: int, seed: int, watched: Progress) -> Finding:
    """Draws of the unknowns from their posterior; a note says whether there are enough.

    SolveError for windows so many that an ensemble does not move, or a direction that nothing determines.
    """
    try:
        import emcee
    except ImportError as error:
        raise ImportError(f"a posterior needs {not_installed('emcee', 'posterior')}") from error

    problem, u = grown.problem, grown.problem.unknowns
    p = len(grown.theta)
    at = [(i, k) for i, window in enumerate(problem.pieces) for k in window.free]
    size = p + len(at)
    if size > _MOST:
        raise SolveError(
            f"a posterior over {size} numbers ({p} unknowns and the starts of {len(problem.pieces)} windows) does not "
            f"mix; at most {_MOST}: fit a shorter part of the record"
        )

    def log_density(x: FloatArray) -> float:
        theta, starts = x[:p], grown.starts.copy()
        if (theta < u.low).any() or (theta > u.high).any():
            return -np.inf
        for value, place in zip(x[p:], at, strict=True):
            starts[place] = value
        found = -0.5 * problem.cost(theta, starts)
        return found if np.isfinite(found) else -np.inf

    rng = np.random.default_rng(seed)
    walkers = 2 * size + 2
    begin = _drawn(grown, at, walkers, rng)
    sampler = emcee.EnsembleSampler(walkers, size, log_density)
    generator = np.random.RandomState(int(rng.integers(2**32)))  # of the kind that emcee takes
    first = emcee.State(begin, random_state=generator.get_state())
    with progress(steps, "posterior", watched) as advance:
        for _ in sampler.sample(first, iterations=steps):
            advance()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        tau = np.max(sampler.get_autocorr_time(tol=0))
    thin = max(1, int(tau / 5)) if np.isfinite(tau) else 1
    draws = sampler.get_chain(discard=int(_BURNT * steps), thin=thin, flat=True)[:, :p]
    rows = {
        name: Estimate(np.mean(draws[:, i]), np.std(draws[:, i], ddof=1), u.units[i]) for i, name in enumerate(u.names)
    }
    notes = [
        f"{walkers} walkers, {steps} steps, the first {_BURNT:.0%} left out, every {thin}th kept; the chains forget "
        f"within {tau:.3g} steps"
    ]
    if not steps > _SPANNED * tau:
        notes.append(f"too few steps for the chains' memory: take {_SPANNED * tau:.0f} or more")
    (_, estimate), *others = rows.items()
    data = xr.Dataset(
        {"value": (("draw", "parameter"), draws, {"long_name": "draws from the posterior"})},
        {"parameter": list(u.names), "unit": ("parameter", list(u.units))},
    )
    return Finding("posterior", estimate, SAMPLED, grown.readings, grown.runs, tuple(notes), dict(others), data=data)


def _drawn(grown: Grown, at: list[tuple[int, int]], count: int, rng: np.random.Generator) -> FloatArray:
    """First places of the walkers: from the normal law of the unknowns and the starts about the optimum."""
    problem, u, p = grown.problem, grown.problem.unknowns, len(grown.theta)
    state = problem.residuals(grown.theta, grown.starts, True)
    normal, _, back = reduced(problem, state)
    covariance = inverted(normal + u.precision)[0]
    if (loose := grown.loose(state)).size:
        names = ", ".join(u.names[i] for i in np.flatnonzero(concerned(loose).any(axis=1)))
        raise SolveError(f"the records do not determine {names}: give a prior or a value, then sample")
    steps = normal_draws(np.zeros(p), covariance, count, rng)
    found = np.empty((count, p + len(at)))
    found[:, :p] = np.clip(grown.theta + steps, u.low, u.high)
    for row, step in zip(found, steps, strict=True):
        starts = grown.starts.copy()
        for i, (inverse, cross, _) in enumerate(back):
            own = inverse @ rng.standard_normal(len(inverse))
            starts[i] += own - inverse @ (cross @ step[problem.pieces[i].which])
        row[p:] = [starts[place] for place in at]
    return found


_MOVED = (2.0, 3.5, 5.0, 6.5, 8.0, 10.0, 12.0, *np.arange(14.0, 62.0, 2.0))  # standard uncertainties
_NEARLY, _APART = 12.0, 3.0  # of these, and of those over short windows: as far as a fit is looked beside
_LESS = 0.5  # of the least rise of a parabola: below, there is another piece
_MOVES = 4  # from minimum to minimum, at most
_GAIN = 0.1  # of the sum of squares, in squares of the noise: less is the end of the iteration


def looked_beside(grown: Grown, finished: Callable[[Stage], Grown]) -> Grown:
    """The best of the minima found from one to the next, with the unknowns in doubt; ``finished`` is a fit's end."""
    for left in range(_MOVES, -1, -1):
        found = _beside(grown)
        better = _better(grown, found) if left else None
        if better is None:
            break
        try:
            grown = replace(finished(better), stuck=grown.stuck, apart=grown.apart)
        except SolveError:
            break
    return replace(grown, doubted=tuple(dict.fromkeys(i for rise, i, _ in found if rise < BETTER)))


def _beside(grown: Grown) -> list[tuple[float, int, FloatArray]]:
    """Points where the sum of squares has risen less than a parabola, the lowest first: rise, unknown moved, place."""
    problem, theta, u = grown.problem, grown.theta, grown.problem.unknowns
    state = problem.residuals(theta, grown.starts, True)
    covariance = inverted(reduced(problem, state)[0] + u.precision)[0]
    least, found = problem.cost(theta, grown.starts), []
    here = _transitions(problem, theta, grown.starts)
    errors = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    reach = np.maximum(_NEARLY * errors, _APART * grown.apart if len(grown.apart) else 0.0)
    for i, error in enumerate(errors):
        for side in (1.0, -1.0) if error > 0.0 else ():
            fars = [side * far for far in _MOVED if far * error <= reach[i]]
            fars = [far for far in fars if u.low[i] <= theta[i] + far * error <= u.high[i]]
            places = {far: np.where(np.arange(len(theta)) == i, theta[i] + far * error, theta) for far in fars}
            if fars and not problem.steady and _transitions(problem, places[fars[-1]], grown.starts) == here:
                fars = fars[-1:]  # the same piece as far as that
            for far in fars:
                rise = problem.cost(places[far], grown.starts) - least
                if rise < _LESS * far**2:
                    found.append((rise, i, places[far]))
    return sorted(found, key=lambda row: row[0])


def _transitions(problem: Windows, theta: FloatArray, starts: FloatArray) -> list[list[int] | None]:
    """The transitions of each window's motion; None where it does not come to its end."""
    motions = [problem.marched(theta, window, start) for window, start in zip(problem.pieces, starts, strict=True)]
    return [None if one is None else one.log.crossing_transition.tolist() for one in motions]


def _better(grown: Grown, beside: list[tuple[float, int, FloatArray]]) -> Stage | None:
    """The better fit from the lowest of these points of each unknown; None where there is none."""
    lowest: dict[int, FloatArray] = {}
    for _, i, place in beside:
        lowest.setdefault(i, place)
    best, least = None, grown.problem.cost(grown.theta, grown.starts) - _GAIN
    for place in lowest.values():
        try:
            theta, starts, *_ = settle(grown.problem, place, grown.starts)
        except SolveError:
            continue
        if (cost := grown.problem.cost(theta, starts)) < least:
            best, least = Stage(grown.problem, theta, starts), cost
    return best
