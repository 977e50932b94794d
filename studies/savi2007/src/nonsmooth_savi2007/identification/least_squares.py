r"""Least squares: lines with errors in both axes, linear laws with further terms, nonlinear laws with their covariance.

The effective variance of a point, :math:`\sigma_y^2 + b^2 \sigma_x^2`, depends on the slope b; York's solution moves
each point along its error ellipse and so has no bias from the error in x.

References: D. York, N.M. Evensen, M.L. Martinez, J. De Basabe Delgado, Am. J. Phys. 72 (2004) 367, Eqs. 13 and
appendix; J. Orear, Am. J. Phys. 50 (1982) 912.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from nonsmooth import SolveError
from nonsmooth.identification.uncertainty import correlated
from nonsmooth_savi2007.arrays import FloatArray

__all__ = ["LinearLaw", "StraightLine", "linear_law", "nonlinear_fit", "scattered_line", "york"]


class StraightLine(NamedTuple):
    """y = intercept + slope x, the covariance (2, 2) of slope and intercept, and chi^2 per degree of freedom."""

    slope: float
    intercept: float
    covariance: FloatArray
    reduced: float


def york(x: Any, y: Any, x_error: Any, y_error: Any) -> StraightLine:
    """The line through points with independent errors in both axes.

    Parameters
    ----------
    x, y : array (n,)
    x_error, y_error : array (n,) or float
        Standard uncertainties; one of them may be zero.

    Raises
    ------
    ValueError
        If there are fewer than two points, or a point has no error in either axis.
    """
    xs, ys = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if len(xs) < 2 or xs.shape != ys.shape:
        raise ValueError(f"a line needs two points or more with both coordinates, got {xs.shape} and {ys.shape}")
    vx = np.broadcast_to(np.asarray(x_error, dtype=np.float64) ** 2, xs.shape)
    vy = np.broadcast_to(np.asarray(y_error, dtype=np.float64) ** 2, ys.shape)
    if np.any(vx + vy <= 0):
        raise ValueError("every point needs a positive error in x or in y")
    slope = float(np.polyfit(xs, ys, 1)[0])
    for _ in range(100):
        weight = 1.0 / (vy + slope**2 * vx)
        x_mean, y_mean = np.average(xs, weights=weight), np.average(ys, weights=weight)
        u, w = xs - x_mean, ys - y_mean
        beta = weight * (u * vy + slope * w * vx)
        new = float(np.sum(weight * beta * w) / np.sum(weight * beta * u))
        change, slope = abs(new - slope), new
        if change <= 1e-14 * abs(slope):
            break
    else:
        if change > 1e-9 * abs(slope):
            raise SolveError(
                f"the slope of the line still changes by {change / abs(slope):.1g} of itself after 100 rounds: the "
                "points do not lie along a line; look at them"
            )
    adjusted = x_mean + beta
    centre = np.average(adjusted, weights=weight)
    slope_var = 1.0 / float(np.sum(weight * (adjusted - centre) ** 2))
    intercept = float(y_mean - slope * x_mean)
    intercept_var = 1.0 / float(np.sum(weight)) + centre**2 * slope_var
    chi2 = float(np.sum(weight * (ys - intercept - slope * xs) ** 2))
    covariance = np.array([[slope_var, -centre * slope_var], [-centre * slope_var, intercept_var]])
    return StraightLine(slope, intercept, covariance, chi2 / max(len(xs) - 2, 1))


def scattered_line(x: Any, y: Any, x_error: Any, y_error: Any) -> tuple[StraightLine, float]:
    """The line through points that scatter more than their errors say: with the scatter that all have in common.

    Returns the line and that scatter, the standard deviation s in y which, added to every error, brings chi^2 to its
    expectation; 0 where the errors do. Widening all errors by one factor instead would leave the weight with the points
    whose own errors are smallest.

    References: R.C. Paule and J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377.
    """
    ys = np.asarray(y, dtype=np.float64)
    own = np.broadcast_to(np.asarray(y_error, dtype=np.float64), ys.shape)

    def fitted(s: float) -> StraightLine:
        return york(x, ys, x_error, np.hypot(own, s))

    line = fitted(0.0)
    if len(ys) < 3 or line.reduced <= 1:
        return line, 0.0
    from scipy.optimize import brentq

    high = float(np.std(ys - np.polyval(np.polyfit(x, ys, 1), x))) * np.sqrt(len(ys)) + float(own.max())
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
        lambda scaled: residual(scaled * size), begin / size, jac="3-point", bounds=(np.asarray(lower) / size, np.inf),
        x_scale="jac", ftol=1e-12, xtol=1e-12, gtol=1e-12,
    )  # fmt: skip
    n, p = found.jac.shape
    if not found.success or n <= p:
        return None
    scale = np.linalg.norm(found.jac, axis=0)
    if not np.all(scale > 0) or np.linalg.cond(found.jac / scale) > 1 / np.sqrt(np.finfo(float).eps):
        return found.x * size, np.diag(np.full(p, np.inf))
    inverse = np.linalg.pinv(found.jac / scale)
    covariance = inverse @ inverse.T / np.outer(scale, scale) * (2 * found.cost / (n - p))
    return found.x * size, covariance * np.outer(size, size)
