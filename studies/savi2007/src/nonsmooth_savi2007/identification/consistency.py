r"""Consistency of repeated measurements: which of them agree, and what to do with those that do not.

Each run tells the same quantities :math:`\theta_i` with its own covariance :math:`C_i`. About their weighted mean

.. math::

    \bar\theta = \Big(\sum_i C_i^{-1}\Big)^{-1} \sum_i C_i^{-1} \theta_i, \qquad
    \chi^2 = \sum_i (\theta_i - \bar\theta)^T C_i^{-1} (\theta_i - \bar\theta)

has :math:`(n - 1)\,p` degrees of freedom, and the Birge ratio is :math:`\sqrt{\chi^2/(n-1)p}`. Where it is too large to
be chance, the run without which the others agree best is left out, and so on, as long as a majority is kept. Where no
majority agrees, none is left out, and the scatter of the measurements is the uncertainty of their mean.

References: R.T. Birge, Phys. Rev. 40 (1932) 207; M.G. Cox, Metrologia 44 (2007) 187 (largest consistent subset).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as distribution

from nonsmooth_savi2007.arrays import FloatArray

#: Probability of a chi^2 this large by chance, below which measurements disagree.
CHANCE = 1e-4


class Consistent(NamedTuple):
    """Measurements that agree with each other.

    Attributes
    ----------
    used : array of bool (n,)
        All of them where no majority agrees.
    birge : float
        Birge ratio of those used; NaN for a single one.
    agree : bool
        Whether those used agree.
    mean, covariance : array (p,), (p, p)
        Weighted mean of those used, and its covariance by the stated uncertainties.
    scatter : array (p, p)
        Covariance of a single one of those used, by how they differ: the uncertainty of the mean where they disagree,
        since a fault that several share does not average out.
    """

    used: NDArray[np.bool_]
    birge: float
    agree: bool
    mean: FloatArray
    covariance: FloatArray
    scatter: FloatArray

    def off(self, value: Any, covariance: Any) -> FloatArray:
        """Distance of another measurement from the mean, in the combined standard uncertainties, one per quantity."""
        return np.asarray((value - self.mean) / np.sqrt(np.diag(np.asarray(covariance) + self.covariance)))


def birge_ratio(chi2: float, freedom: int) -> tuple[float, bool]:
    """Root of chi^2 per degree of freedom, and whether chance explains it; NaN and True without any freedom."""

    if freedom < 1:
        return float("nan"), True
    return float(np.sqrt(chi2 / freedom)), bool(distribution.sf(chi2, freedom) >= CHANCE)


def consistent(values: Any, covariances: Any) -> Consistent:
    """Largest set of measurements that agree, found by leaving out one after another.

    Parameters
    ----------
    values : sequence of array (p,)
    covariances : sequence of array (p, p)

    Examples
    --------
    >>> from nonsmooth_savi2007.identification.consistency import consistent
    >>> found = consistent([[1.0], [1.1], [0.9], [7.0]], [[[0.01]]] * 4)
    >>> found.used
    array([ True,  True,  True, False])
    """
    given = np.asarray(values, dtype=np.float64)
    known = np.asarray(covariances, dtype=np.float64)
    size = np.sqrt(np.mean(np.diagonal(known, axis1=1, axis2=2), axis=0))
    scaled, weights = given / size, np.linalg.inv(known / np.outer(size, size))
    n, p = given.shape

    def chi2(rows: list[int]) -> tuple[float, FloatArray, FloatArray]:
        covariance = np.linalg.inv(weights[rows].sum(axis=0))
        mean = covariance @ np.einsum("ijk,ik->j", weights[rows], scaled[rows])
        off = scaled[rows] - mean
        return float(np.einsum("ij,ijk,ik->", off, weights[rows], off)), mean, covariance

    rows = list(range(n))
    while True:
        total, mean, covariance = chi2(rows)
        birge, agree = birge_ratio(total, (len(rows) - 1) * p)
        if agree:
            break
        if 2 * (len(rows) - 1) <= n:  # one fewer would be no majority
            rows = list(range(n))
            total, mean, covariance = chi2(rows)
            birge = birge_ratio(total, (n - 1) * p)[0]
            break
        rows = min(([i for i in rows if i != out] for out in rows), key=lambda kept: chi2(kept)[0])
    used = np.zeros(n, dtype=bool)
    used[rows] = True
    share = 1.0 / np.trace(np.linalg.inv(weights[rows]), axis1=1, axis2=2)
    off = scaled[rows] - mean
    scatter = np.einsum("i,ij,ik->jk", share / share.sum(), off, off) * len(rows) / max(len(rows) - 1, 1)
    unit = np.outer(size, size)
    return Consistent(used, birge, agree, mean * size, covariance * unit, scatter * unit)
