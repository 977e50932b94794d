"""Numbers that describe basins: entropy, dimension of the boundary, sensitivity, shares, starts needed."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonsmooth.flow.engines.engine import FloatArray, IntArray

BOX = 5  # points along a box of the entropy, as in its definition's examples


def basin_entropy(label: IntArray, box: int = BOX) -> tuple[float, float]:
    r"""Basin entropy, and the same over boxes with more than one label.

    .. math:: S_b = \frac{1}{N} \sum_{i=1}^{N} \sum_j p_{ij} \ln \frac{1}{p_{ij}}

    over N boxes of ``box`` x ``box`` points, :math:`p_{ij}` the share of label j in box i.

    Parameters
    ----------
    label : array (A, B)

    Returns
    -------
    entropy, boundary_entropy : float
        NaN where no box fits (no box has two labels). Above ln 2 the boundary is certainly fractal.

    References
    ----------
    A. Daza, A. Wagemakers, B. Georgeot, D. Guery-Odelin, M.A.F. Sanjuan, Basin entropy: a new tool to analyze
    uncertainty in dynamical systems, Sci. Rep. 6, 31416 (2016), doi:10.1038/srep31416.
    """
    a, b = (n // box for n in label.shape)
    if not (a and b):
        return np.nan, np.nan
    boxes = label[: a * box, : b * box].reshape(a, box, b, box).swapaxes(1, 2).reshape(a * b, box * box)
    entropy = np.zeros(len(boxes))
    for value in np.unique(boxes):
        p = (boxes == value).mean(axis=1)
        entropy -= np.where(p > 0, p * np.log(np.where(p > 0, p, 1.0)), 0.0)
    mixed = entropy > 0
    return float(entropy.mean()), float(entropy[mixed].mean()) if mixed.any() else np.nan


def uncertain_part(label: IntArray) -> tuple[IntArray, FloatArray]:
    """Final-state sensitivity: the share of points with another label at a distance of 1, 2, 4, ... grid steps.

    Along either axis, in both senses. The distances go up to an eighth of the smaller side.
    """
    steps, parts = [], []
    step = 1
    while step <= max(min(label.shape) // 8, 1) and min(label.shape) > 2 * step:
        other = []
        for axis in (0, 1):
            centre = np.take(label, range(step, label.shape[axis] - step), axis=axis)
            after = np.take(label, range(2 * step, label.shape[axis]), axis=axis)
            before = np.take(label, range(label.shape[axis] - 2 * step), axis=axis)
            other.append(((after != centre) | (before != centre)).mean())
        steps.append(step)
        parts.append(max(other))
        step *= 2
    return np.array(steps, dtype=np.int64), np.array(parts)


def boundary_dimension(label: IntArray) -> float:
    r"""Dimension of the boundary between basins in the plane, from the uncertainty exponent.

    The uncertain share grows as :math:`f(\epsilon) \sim \epsilon^\alpha`, and :math:`d = 2 - \alpha`: 1 for a smooth
    boundary, 2 where labels are mixed at every scale. The fit is over the distances at which f is below a half, where
    there are two.

    Returns
    -------
    float
        NaN where there is no boundary, or too few points for a fit.

    References
    ----------
    S.W. McDonald, C. Grebogi, E. Ott, J.A. Yorke, Fractal basin boundaries, Physica D 17 (1985) 125-153.
    """
    steps, parts = uncertain_part(label)
    good = parts > 0
    if (good & (parts < 0.5)).sum() >= 2:
        good &= parts < 0.5
    if good.sum() < 2:
        return np.nan
    alpha = np.polyfit(np.log(steps[good]), np.log(parts[good]), 1)[0]
    return float(np.clip(2.0 - alpha, 1.0, 2.0))


def share_errors(count: Any, n: int) -> tuple[FloatArray, FloatArray]:
    """Shares of n starts and their binomial standard errors sqrt(f (1 - f) / n)."""
    fraction = np.asarray(count, dtype=float) / n
    return fraction, np.sqrt(fraction * (1.0 - fraction) / n)


def starts_needed(fractions: Any, certainty: float = 0.99) -> int:
    """The least number of random starts that meet every attractor of these shares with the given probability.

    The least n with sum of (1 - f_i)^n <= 1 - certainty (at most one attractor is missed that often).
    """
    shares = np.asarray(fractions, dtype=float)
    shares = shares[shares > 0]
    if not len(shares):
        return 0

    def missed(n: int) -> float:
        return float(np.sum((1.0 - shares) ** n))

    low, high = 0, 1
    while missed(high) > 1.0 - certainty:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if missed(middle) <= 1.0 - certainty else (middle, high)
    return high


def minimal_shock(
    label: IntArray, x: FloatArray, y: FloatArray, points: FloatArray, number: int, off: FloatArray | None = None
) -> float:
    """Least distance from an attractor's points to a start in another basin or one that diverges.

    In the units of ``x`` and ``y``. ``points`` (k, 2) outside the grid are left out, and so are starts of unknown fate
    (-1); NaN where nothing is left. ``off`` (k,) is the distance of the points from the plane of the starts, where
    there are more states than two: the jump has to cover it too.
    """
    inside = (points >= [x.min(), y.min()]).all(axis=1) & (points <= [x.max(), y.max()]).all(axis=1)
    rows, columns = np.nonzero((label != number) & (label != -1))
    if not inside.any() or not len(rows):
        return np.nan
    from scipy.spatial import cKDTree

    others: NDArray[np.float64] = np.column_stack([x[rows], y[columns]])
    gap, _ = cKDTree(others).query(points[inside])
    return float(np.hypot(gap, 0.0 if off is None else off[inside]).min())
