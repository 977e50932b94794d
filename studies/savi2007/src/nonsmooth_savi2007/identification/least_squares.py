"""Least squares: lines through scattered points, linear laws with further terms, nonlinear laws with their covariance.

Reference: J. Orear, Am. J. Phys. 50 (1982) 912.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from nonsmooth.identification import correlated
from nonsmooth_savi2007.arrays import FloatArray


class StraightLine(NamedTuple):
    """y = intercept + slope x, the covariance (2, 2) of slope and intercept, and chi^2 per degree of freedom."""

    slope: float
    intercept: float
    covariance: FloatArray
    reduced: float


def scattered_line(x: FloatArray, y: FloatArray, error: FloatArray) -> tuple[StraightLine, float]:
    """The weighted line through points that scatter more than their errors say: with the scatter they have in common.

    Returns the line and that scatter, the standard deviation s in y which, added to every error, brings chi^2 to its
    expectation; 0 where the errors do. Widening all errors by one factor instead would leave the weight with the points
    whose own errors are smallest.

    References: R.C. Paule and J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377.
    """

    def fitted(s: float) -> StraightLine:
        weight = 1.0 / np.hypot(error, s)
        (slope, intercept), covariance = np.polyfit(x, y, 1, w=weight, cov="unscaled")
        chi2 = float(np.sum((weight * (y - intercept - slope * x)) ** 2))
        return StraightLine(float(slope), float(intercept), covariance, chi2 / max(len(x) - 2, 1))

    line = fitted(0.0)
    if len(y) < 3 or line.reduced <= 1:
        return line, 0.0
    from scipy.optimize import brentq

    high = float(np.std(y - np.polyval(np.polyfit(x, y, 1), x))) * np.sqrt(len(y)) + float(error.max())
    s = float(brentq(lambda s: fitted(s).reduced - 1.0, 0.0, high, xtol=1e-4 * high))
    return fitted(s), s


class LinearLaw(NamedTuple):
    """Coefficients, their covariance and the residuals of a linear law; ``reduced`` is chi^2 per degree of freedom."""

    values: FloatArray
    covariance: FloatArray
    residuals: FloatArray
    reduced: float


def linear_law(columns: Any, y: Any, variance: Any, pieces: Any) -> LinearLaw:
    """Weighted least squares with the covariance of residuals that are correlated within each record.

    Parameters
    ----------
    columns : array (n, p)
    y : array (n,)
    variance : float or array (n,)
        Variance of y, with the effective part from an error in x.
    pieces : sequence of int
        Lengths of the records that follow one another.
    """
    a, b = np.asarray(columns, dtype=np.float64), np.asarray(y, dtype=np.float64)
    weight = 1.0 / np.sqrt(np.broadcast_to(np.asarray(variance, dtype=np.float64), b.shape))
    values, *_ = np.linalg.lstsq(a * weight[:, None], b * weight, rcond=None)
    residuals = b - a @ values
    weighted = residuals * weight
    covariance = correlated(a * weight[:, None], weighted, pieces)
    reduced = float(weighted @ weighted) / max(len(b) - a.shape[1], 1)
    return LinearLaw(np.asarray(values, dtype=np.float64), covariance, residuals, reduced)


def nonlinear_fit(
    residual: Callable[[FloatArray], FloatArray], start: Any, lower: Any
) -> tuple[FloatArray, FloatArray] | None:
    r"""Values and covariance of parameters, by weighted residuals whose common scale is taken from themselves.

    .. math::

        C = (J^T J)^{-1} \frac{r^T r}{n - p}

    Parameters
    ----------
    residual : callable
        The n residuals, each over its standard uncertainty (or in proportion to it), at values of the p parameters.
    start, lower : array (p,)
        Where to begin, and lower bounds (-inf: none).

    Returns
    -------
    tuple of array (p,) and array (p, p), or None
        None where the iteration does not converge. Variances are infinite where the data do not tell the parameters
        apart.
    """
    from scipy.optimize import least_squares

    begin = np.asarray(start, dtype=np.float64)
    size = np.where(begin != 0, np.abs(begin), 1.0)  # the steps of its differences are relative to numbers of order 1
    found = least_squares(
        lambda scaled: residual(scaled * size),
        begin / size,
        jac="3-point",
        bounds=(np.asarray(lower) / size, np.inf),
        x_scale="jac",
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
    )
    n, p = found.jac.shape
    if not found.success or n <= p:
        return None
    scale = np.linalg.norm(found.jac, axis=0)
    if not np.all(scale > 0) or np.linalg.cond(found.jac / scale) > 1 / np.sqrt(np.finfo(float).eps):
        return found.x * size, np.diag(np.full(p, np.inf))
    inverse = np.linalg.pinv(found.jac / scale)
    covariance = inverse @ inverse.T / np.outer(scale, scale) * (2 * found.cost / (n - p))
    return found.x * size, covariance * np.outer(size, size)
