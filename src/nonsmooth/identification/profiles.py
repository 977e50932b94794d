"""Profile likelihood: what data say of one parameter when the others may follow, without assuming a parabola.

The limits of an interval are where chi^2 has risen by the quantile of chi^2 with one degree of freedom, 3.84 for 95 %
(S.S. Wilks, Ann. Math. Statist. 9 (1938) 60). On a side where it does not, nothing bounds the parameter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.errors import SolveError

__all__ = ["Profile", "profile_likelihood", "profile_of"]

FloatArray = NDArray[np.float64]


class Profile(NamedTuple):
    """A parameter's profile likelihood: its values, the rise of chi^2 above its least, and the 95 % limits.

    A limit is NaN where chi^2 does not rise to 3.84 within the values: the data do not bound the parameter there.
    """

    values: FloatArray
    cost: FloatArray
    best: float
    low: float
    high: float


def profile_likelihood(
    residual: Callable[[FloatArray], FloatArray],
    start: Any,
    which: int,
    values: Any,
    *,
    level: float = 0.95,
    scale: float = 1.0,
) -> Profile:
    """Fit again with one parameter held at each value: what the data say of it, without assuming a parabola.

    Parameters
    ----------
    residual : callable
        Weighted residuals (n,) of a vector of parameters.
    start : array (p,)
        The best fit.
    which : int
        Index of the parameter that is held.
    values : array (m,)
        Where it is held, in rising order, on both sides of the best.
    level : float
        Probability of the interval.
    scale : float
        Variance of one weighted residual: 1 where the weights are right, else (with their correlation) above 1.
    """
    from scipy.optimize import least_squares

    best = np.asarray(start, dtype=np.float64)
    grid = np.asarray(values, dtype=np.float64)
    if grid.ndim != 1 or len(grid) < 3 or np.any(np.diff(grid) <= 0):
        raise ValueError("values must be at least three, in rising order")
    cost = np.empty(len(grid))
    others = [i for i in range(len(best)) if i != which]
    middle = int(np.argmin(np.abs(grid - best[which])))
    sizes = np.where(best != 0, np.abs(best), 1.0)
    for order in (range(middle, len(grid)), range(middle - 1, -1, -1)):
        now = best.copy()
        for i in order:
            now[which] = grid[i]
            if others:

                def free(part: FloatArray, full: FloatArray = now) -> FloatArray:
                    trial = full.copy()
                    trial[others] = part
                    return residual(trial)

                fitted = least_squares(free, now[others], x_scale=sizes[others])
                if not fitted.success:
                    raise SolveError(f"the fit with the parameter at {grid[i]:.6g} did not settle: {fitted.message}")
                now[others] = fitted.x
            cost[i] = float(np.sum(residual(now) ** 2))
    least = min(float(cost.min()), float(np.sum(residual(best) ** 2)))
    return profile_of(grid, (cost - least) / scale, float(best[which]), level=level)


def profile_of(values: Any, rise: Any, best: float, *, level: float = 0.95) -> Profile:
    """The profile of a rise of chi^2 that was computed elsewhere, with its limits.

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
