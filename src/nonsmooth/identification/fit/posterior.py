"""The posterior of a fit by an ensemble sampler (emcee), started about its optimum."""

from __future__ import annotations

import warnings

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError, not_installed
from nonsmooth.identification.arrow import concerned, inverted, reduced
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.identification.uncertainty import normal_draws
from nonsmooth.results.progress import Progress, progress

_MOST = 80  # unknowns and numbers of starts: beyond, an ensemble moves too slowly
_BURNT = 0.25  # of the steps, before the ensemble has forgotten where it began
_ENOUGH = 50.0  # autocorrelation times that the steps should span
METHOD = (
    "affine-invariant ensemble of walkers (Goodman and Weare 2010; Foreman-Mackey et al. 2013), started about the "
    "optimum; noise and its correlation as the fit has found them, all starts among the unknowns"
)


def posterior_of(grown: Grown, steps: int, seed: int, watched: Progress) -> Finding:
    """Draws of the unknowns from their posterior; a note says whether there are enough.

    Raises
    ------
    ImportError
        Without emcee.
    SolveError
        Windows so many that an ensemble does not move, or a direction that nothing determines.
    """
    import xarray as xr

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
    weights = problem.weights(problem.residuals(grown.theta, grown.starts))

    def log_density(x: FloatArray) -> float:
        theta, starts = x[:p], grown.starts.copy()
        if (theta < u.low).any() or (theta > u.high).any():
            return -np.inf
        for value, place in zip(x[p:], at, strict=True):
            starts[place] = value
        found = -0.5 * problem.cost(theta, starts, weights)
        return found if np.isfinite(found) else -np.inf

    rng = np.random.default_rng(seed)
    walkers = 2 * size + 2
    begin = _drawn(grown, weights, at, walkers, rng)
    sampler = emcee.EnsembleSampler(walkers, size, log_density)
    generator = np.random.RandomState(int(rng.integers(2**32)))  # of the kind that emcee takes
    first = emcee.State(begin, random_state=generator.get_state())
    with progress(steps, "posterior", watched) as advance:
        for _ in sampler.sample(first, iterations=steps):
            advance()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        tau = float(np.max(sampler.get_autocorr_time(tol=0)))
    thin = max(1, int(tau / 5)) if np.isfinite(tau) else 1
    draws = sampler.get_chain(discard=int(_BURNT * steps), thin=thin, flat=True)[:, :p]
    rows = {
        name: Estimate(float(np.mean(draws[:, i])), float(np.std(draws[:, i], ddof=1)), u.units[i])
        for i, name in enumerate(u.names)
    }
    notes = [
        f"{walkers} walkers, {steps} steps, the first {_BURNT:.0%} left out, every {thin}th kept; the chains forget "
        f"within {tau:.3g} steps"
    ]
    if not steps > _ENOUGH * tau:
        notes.append(f"too few steps for the chains' memory: take {_ENOUGH * tau:.0f} or more")
    (_, estimate), *others = rows.items()
    data = xr.Dataset(
        {"value": (("draw", "parameter"), draws, {"long_name": "draws from the posterior"})},
        {"parameter": list(u.names), "unit": ("parameter", list(u.units))},
    )
    return Finding("posterior", estimate, METHOD, grown.readings, grown.runs, tuple(notes), dict(others), data=data)


def _drawn(
    grown: Grown, weights: list[FloatArray], at: list[tuple[int, int]], count: int, rng: np.random.Generator
) -> FloatArray:
    """First places of the walkers: from the normal law of the unknowns and the starts about the optimum."""
    problem, u, p = grown.problem, grown.problem.unknowns, len(grown.theta)
    state = problem.derivatives(grown.theta, grown.starts)
    normal, _, back = reduced(problem, state, weights, p)
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
