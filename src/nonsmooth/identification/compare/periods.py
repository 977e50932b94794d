r"""The period number of a measured section cloud whose noise is known, and the flips along a slow rise.

A measured return is never exact. With a standard error :math:`\sigma_i` of each coordinate, the scaled return

.. math:: r_p^2 = \Big\langle \tfrac{(s_{k+p} - s_k)_i^2}{2 \sigma_i^2} \Big\rangle_{k, i}

is 1 for a motion of period p and larger for any other. The period number is the smallest p with r_p below a bound;
0 where there is none: chaos, or a motion that has not settled. A period-doubled orbit whose points are closer together
than the noise cannot be told from the one before the doubling.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nonsmooth.arrays import FloatArray

__all__ = ["BOUND", "MeasuredPeriod", "flips", "measured_period", "period_numbers"]


BOUND = 2.0  # of r_p: the stated noise may be wrong by as much before a period is lost
FEWEST_RETURNS = 4


@dataclass(frozen=True)
class MeasuredPeriod:
    """Period number (0: none found) with the scaled returns r_1, r_2, ... it rests on."""

    number: int
    returns: FloatArray


def measured_period(
    points: ArrayLike, noise: ArrayLike, *, max_period: int = 16, bound: float = BOUND, drifting: bool = False
) -> MeasuredPeriod:
    r"""The period number of successive section points with known noise.

    Parameters
    ----------
    points : array (n, states)
        In the order in which they came.
    noise : array (states,)
        Standard error of a point in each state; positive.
    max_period : int
        The longest searched; at least four returns of it must be there.
    bound : float
        Largest scaled return that counts.
    drifting : bool
        Judge second differences, :math:`s_{k+2p} - 2 s_{k+p} + s_k` over :math:`\sqrt{6} \sigma`, which a motion of
        period p that drifts evenly leaves at 1, too.

    Raises
    ------
    ValueError
        Too few points for any period, or a noise that is not positive.
    """
    cloud, sigma = np.asarray(points, dtype=float), np.asarray(noise, dtype=float)
    if not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise ValueError(f"noise must be a positive standard error for each state, got {sigma.tolist()}")
    order = 2 if drifting else 1
    longest = min(max_period, (len(cloud) - FEWEST_RETURNS) // order)
    if longest < 1:
        raise ValueError(
            f"{len(cloud)} section points are too few for a period number; at least {FEWEST_RETURNS + 1} are needed"
        )
    scaled = cloud / (np.sqrt(6.0 if drifting else 2.0) * sigma)
    returns = np.empty(longest)
    for p in range(1, longest + 1):
        change = scaled[p:] - scaled[:-p]
        returns[p - 1] = np.sqrt(np.mean((change[p:] - change[:-p] if drifting else change) ** 2))
    found = np.flatnonzero(returns <= bound)
    return MeasuredPeriod(int(found[0]) + 1 if len(found) else 0, returns)


def period_numbers(
    points: ArrayLike, noise: ArrayLike, *, window: int = 24, max_period: int = 8, bound: float = BOUND
) -> NDArray[np.int64]:
    """The period number in a window that moves along a slow rise of a parameter, one for each point.

    The points of an orbit drift with the parameter: an even drift within the window is no return's fault.
    Points within half a window of an end have that of the first and last whole window.
    """
    cloud = np.asarray(points, dtype=float)
    if len(cloud) < window:
        raise ValueError(f"{len(cloud)} section points are fewer than one window of {window}")
    count = len(cloud) - window + 1
    numbers = np.array(
        [
            measured_period(cloud[i : i + window], noise, max_period=max_period, bound=bound, drifting=True).number
            for i in range(count)
        ]
    )
    return np.pad(numbers, (window // 2, window - 1 - window // 2), mode="edge").astype(np.int64)


def flips(values: ArrayLike, numbers: ArrayLike, *, last: int = 4) -> dict[str, float]:
    """Values at which the period number doubles: ``{"1-2": value, "2-4": value, ...}`` up to period ``last``.

    Parameters
    ----------
    values : array (n,)
        The parameter, in either order of time.
    numbers : array (n,)
        The period number at each; 0 where none was found.
    last : int
        The longest period asked for.

    Notes
    -----
    Between the two numbers there may be values where none is found (the motion is slow near a flip, and passes through
    it with a delay when the parameter moves); the value given is the one that separates the two numbers with the fewest
    points on the wrong side.
    """
    order = np.argsort(np.asarray(values, dtype=float), kind="stable")
    x, n = np.asarray(values, dtype=float)[order], np.asarray(numbers)[order]
    found = {}
    p = 1
    while 2 * p <= last:
        is_single, is_double = n == p, n == 2 * p
        if is_single.any() and is_double.any():
            found[f"{p}-{2 * p}"] = _parting(x, is_single, is_double)
        p *= 2
    return found


def _parting(x: FloatArray, single: NDArray[np.bool_], double: NDArray[np.bool_]) -> float:
    """The value with the fewest singles on the doubles' side and the other way round; in the middle of a tie."""
    below = np.concatenate([[0], np.cumsum(single)]) + (double.sum() - np.concatenate([[0], np.cumsum(double)]))
    above = np.concatenate([[0], np.cumsum(double)]) + (single.sum() - np.concatenate([[0], np.cumsum(single)]))
    # `below`: misplaced points if doubles lie below the cut and singles above it; `above` the other way round.
    wrong = below if below.min() <= above.min() else above
    best = np.flatnonzero(wrong == wrong.min())
    edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]])
    return float(0.5 * (edges[best[0]] + edges[best[-1]]))
