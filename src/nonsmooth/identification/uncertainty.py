"""Uncertainty by the guide's rules: type A from scatter, type B from knowledge, combined, and stated as intervals.

Residuals of an encoder are not white: where the car is slow the same rounding error stays for many samples. So a fit's
covariance is scaled by the residuals' own correlation (:func:`correlated`), never by the number of samples alone.

References: JCGM 100:2008 (GUM), 4.3.7 for limits without a distribution, 5.2.2 for correlated inputs; JCGM 101:2008.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.signals.spectrum import correlation_times


def uniform(half_width: float) -> float:
    r"""Standard uncertainty (type B) of a quantity known to lie within +- ``half_width``: :math:`a / \sqrt 3`.

    Raises
    ------
    ValueError
        If the half width is negative or not finite.
    """
    if not 0 <= half_width < np.inf:
        raise ValueError(f"half_width = {half_width!r} must be finite and not negative")
    return float(half_width) / np.sqrt(3.0)


def coverage_factor(level: float = 0.95) -> float:
    """Number of standard uncertainties that hold a normal quantity with this probability: 1.96 for 0.95."""
    from scipy.special import ndtri

    if not 0 < level < 1:
        raise ValueError(f"level = {level!r} must lie between 0 and 1, as 0.95")
    return float(ndtri(0.5 + level / 2))


def interval(value: float, normal: float, half_width: float = 0.0, level: float = 0.95) -> tuple[float, float]:
    """Symmetric interval of a normal quantity plus an independent uniform one, from their exact convolution.

    Parameters
    ----------
    value : float
        The estimate.
    normal : float
        Standard uncertainty of the normal part.
    half_width : float
        Half width of the uniform part; 0: none.
    level : float
        Probability of the interval.

    Notes
    -----
    With z = r/s, w = a/s: P(|.| < r) = [M(z + w) - M(z - w)] / w - 1 with M(u) = u Phi(u) + phi(u), the integral of
    the normal distribution function.
    """
    from scipy.optimize import brentq
    from scipy.special import ndtr

    if half_width < 1e-6 * normal or half_width == 0:
        reach = coverage_factor(level) * normal
    elif normal < 1e-6 * half_width:
        reach = level * half_width
    else:
        w = half_width / normal

        def integral(u: float) -> float:
            return u * float(ndtr(u)) + float(np.exp(-u * u / 2)) / np.sqrt(2 * np.pi)

        def excess(z: float) -> float:
            return (integral(z + w) - integral(z - w)) / w - 1.0 - level

        reach = normal * float(brentq(excess, 0.0, w + 10.0, xtol=1e-10))
    return value - reach, value + reach


def factor_interval(value: float, relative: float, level: float = 0.95) -> tuple[float, float, float]:
    """Interval of a positive quantity whose logarithm is normal: (low, high, factor), low = value / factor.

    ``relative`` is the standard uncertainty of the logarithm.
    """
    if value <= 0:
        raise ValueError(f"value = {value!r}: only a positive quantity can be known to a factor")
    factor = float(np.exp(coverage_factor(level) * relative))
    return value / factor, value * factor, factor


def normal_draws(mean: Any, covariance: FloatArray, n: int, seed: Any, logarithmic: Any = False) -> FloatArray:
    """``n`` rows drawn from a normal law; of a quantity that is ``logarithmic`` the logarithm is normal."""
    mean, sizes = np.asarray(mean, float), np.sqrt(np.diag(covariance))
    if np.isinf(sizes).any():
        raise ValueError(
            "a quantity with an infinite uncertainty has no law to draw from: give its value, and take the others by "
            "found.only([...])"
        )
    scale = np.where(sizes > 0, sizes, 1.0)  # parameters differ by 10^5 in size: draw in units of their own errors
    unit = np.random.default_rng(seed).multivariate_normal(
        np.zeros(len(mean)), covariance / np.outer(scale, scale), n, method="eigh"
    )
    relative = np.where(logarithmic, scale / np.where(logarithmic, mean, 1.0), 0.0)  # d ln x = dx / x
    return np.where(logarithmic, mean * np.exp(unit * relative), mean + unit * scale)


def newey_west(scores: FloatArray, times: float) -> FloatArray:
    """Sum of the scores' products (p, p) up to a lag of a few correlation ``times``, with Bartlett's weights."""
    found = scores.T @ scores
    lags = min(len(scores) - 1, int(np.ceil(4 * times)) + 2)
    for k in range(1, lags + 1):
        cross = scores[k:].T @ scores[:-k]
        found += (1.0 - k / (lags + 1)) * (cross + cross.T)
    return found


def not_below(covariance: FloatArray, least: FloatArray) -> FloatArray:
    """The covariance with no variance below that of ``least``, its correlations as they are.

    A short record can make a sum of few products small by chance.
    """
    ratio = np.sqrt(np.maximum(np.diag(least), 1e-300) / np.maximum(np.diag(covariance), 1e-300))
    raised = np.maximum(ratio, 1.0)
    return covariance * np.outer(raised, raised)


def correlated(jacobian: Any, residuals: Any, pieces: Sequence[int] | None = None) -> FloatArray:
    r"""Covariance of a least-squares estimate whose residuals are correlated in time.

    .. math::

        C = H^{-1} \left[\sum_{|k| \le K} w_k \sum_i J_i r_i \, r_{i+k} J_{i+k}^T\right] H^{-1}, \qquad H = J^T J

    with Bartlett's weights (Newey and West, Econometrica 55 (1987) 703) and K from the residuals' own correlation.

    Parameters
    ----------
    jacobian : array (n, p)
        Derivatives of the weighted residuals.
    residuals : array (n,)
        Weighted residuals, in the order of time.
    pieces : sequence of int, optional
        Lengths of independent records that follow one another; no correlation is assumed across them.

    Returns
    -------
    array (p, p)
        Never smaller, along any parameter, than the covariance of white residuals of the same size.
    """
    j = np.asarray(jacobian, float)
    r = np.asarray(residuals, float)
    n, p = j.shape
    lengths = [n] if pieces is None else list(map(int, pieces))
    if sum(lengths) != n or len(r) != n:
        raise ValueError(f"pieces {lengths} must add up to the {n} rows of the Jacobian and the {len(r)} residuals")
    scale = np.linalg.norm(j, axis=0)
    scale[scale == 0] = 1.0
    inverse = np.linalg.pinv((j / scale).T @ (j / scale))
    white = inverse * float(r @ r) / max(n - p, 1)
    meat, ends = np.zeros((p, p)), np.cumsum(lengths)[:-1]
    for left, score in zip(np.split(r, ends), np.split(j / scale * r[:, None], ends), strict=True):
        meat += newey_west(score, correlation_times(left))
    found = not_below(inverse @ meat @ inverse * n / max(n - p, 1), white)
    result: FloatArray = found / np.outer(scale, scale)
    return result
