"""Profile likelihood: what data say of one parameter when the others may follow, without assuming a parabola.

The limits of an interval are where chi^2 has risen by the quantile of chi^2 with one degree of freedom, 3.84 for 95 %
(S.S. Wilks, Ann. Math. Statist. 9 (1938) 60). On a side where it does not, nothing bounds the parameter.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray

__all__ = ["Profile", "profile_of"]


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
