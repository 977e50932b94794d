"""Nonlinear least squares with the covariance of what is fitted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray

__all__ = ["nonlinear_fit"]


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
