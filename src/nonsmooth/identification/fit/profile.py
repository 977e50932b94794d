"""Profiles of unknowns of a fit: each held beside its best value while all others, and the starts, follow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.arrow import Unsettled, inverted, settle
from nonsmooth.identification.finding import Estimate, Finding
from nonsmooth.identification.fit.growth import Grown
from nonsmooth.results.progress import Progress, progress


class Profile(NamedTuple):
    """A parameter's profile likelihood: its values, the rise of chi^2 above its least, and the 95 % limits.

    A limit is NaN where chi^2 does not rise to 3.84 within the values: the data do not bound the parameter there.
    """

    values: FloatArray
    cost: FloatArray
    best: float
    low: float
    high: float


def profile_of(values: Any, rise: Any, best: float, *, level: float = 0.95) -> Profile:
    """Profile of a rise of chi^2, with its limits.

    Parameters
    ----------
    values, rise : array (m,)
        The parameter in rising order, and chi^2 above its least there.
    best : float
        Where it is least, between the first and the last value.
    level : float
        Probability of the interval.
    """
    from scipy.stats import chi2

    grid, above, bound = np.asarray(values, np.float64), np.asarray(rise, np.float64), float(chi2.ppf(level, 1))
    middle = int(np.argmin(np.abs(grid - best)))
    low = _crossed(grid[middle::-1], above[middle::-1], bound)
    return Profile(grid, above, float(best), low, _crossed(grid[middle:], above[middle:], bound))


def _crossed(values: FloatArray, rise: FloatArray, bound: float) -> float:
    """Value at which the rise of chi^2 from the best value passes the bound; NaN where it does not."""
    over = np.flatnonzero(rise > bound)
    if len(over) == 0 or over[0] == 0:
        return float("nan")
    i = int(over[0])
    part = (bound - rise[i - 1]) / (rise[i] - rise[i - 1])
    return float(values[i - 1] + part * (values[i] - values[i - 1]))


_STEP = 0.5  # of a standard uncertainty
_STEPS = 16  # on either side, at most
_ENOUGH = 5.0  # rise of chi^2 beyond which no limit at 95 % lies
METHOD = (
    "profile likelihood: the unknown is held while all others and the starts follow; the limits are where chi^2, over "
    "the residuals' own correlation, has risen by 3.84 (Wilks 1938)"
)


def profiled(
    grown: Grown, names: list[str], normal: FloatArray, covariance: FloatArray, synthetic: bool, watched: Progress
) -> list[Finding]:
    """A finding for each of these unknowns.

    Parameters
    ----------
    normal : array (p, p)
        The normal matrix, priors included; its inverse would be the covariance of white residuals.
    covariance : array (p, p)
        That of the fit, by which the rise of chi^2 is scaled.
    """
    import xarray as xr

    u, white, found = grown.problem.unknowns, np.diag(inverted(normal)[0]), []
    with progress(2 * len(names), "profiles", watched) as advance:
        for name in names:
            i = u.names.index(name)
            error = float(np.sqrt(covariance[i, i]))
            above: list[tuple[float, float]] = []
            for sign in (-1.0, 1.0):
                above += _side(grown, i, sign * error, float(white[i] / covariance[i, i]))
                advance()
            rows = np.array(sorted([*above, (float(grown.theta[i]), 0.0)]))
            least = int(np.argmin(rows[:, 1]))  # a better fit than the best, where the sum of squares has corners
            profile = profile_of(rows[:, 0], rows[:, 1] - rows[least, 1], rows[least, 0])
            estimate = Estimate(float(grown.theta[i]), error, u.units[i])
            ends = {"low": profile.low, "high": profile.high}
            low, high = (f"{end:.4g}" if np.isfinite(end) else "no limit" for end in ends.values())
            by_error = " to ".join(f"{end:.4g}" for end in estimate.interval())
            note = f"{name}: 95 % limits {low} to {high} by its profile; {by_error} by its standard uncertainty"
            if not np.isfinite(list(ends.values())).all():
                note += "; the record does not bound it on both sides"
            data = xr.Dataset(
                {"cost": ("value", profile.cost), "best": ((), profile.best), **{k: ((), v) for k, v in ends.items()}},
                {"value": ("value", profile.values, {"units": estimate.unit})},
                {"parameter": name, "units": estimate.unit, "synthetic": "yes" if synthetic else "no"},
            )
            used = grown.readings, grown.runs, (note,)
            found.append(Finding(f"{name}, profile", estimate, METHOD, *used, data=data, plot="profile"))
    return found


def _side(grown: Grown, i: int, step: float, scale: float) -> list[tuple[float, float]]:
    """Values of an unknown on one side and the rise of chi^2 there, up to where it is enough."""
    problem, u = grown.problem, grown.problem.unknowns
    theta, starts, least = grown.theta, grown.starts, problem.cost(grown.theta, grown.starts)
    rows: list[tuple[float, float]] = []
    for k in range(1, _STEPS + 1):
        value = grown.theta[i] + k * _STEP * step
        if not u.low[i] <= value <= u.high[i]:
            break
        theta = np.where(np.arange(len(theta)) == i, value, theta)
        held = np.where(np.arange(len(theta)) == i, value, [u.low, u.high])
        try:
            theta, starts, _ = settle(replace(problem, unknowns=replace(u, low=held[0], high=held[1])), theta, starts)
        except Unsettled as reason:
            theta, starts = reason.values, reason.starts
        rise = (problem.cost(theta, starts) - least) * scale
        if not np.isfinite(rise):
            break
        rows.append((float(value), rise))
        if rise > _ENOUGH:
            break
    return rows
