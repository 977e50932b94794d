"""A sampled motion folded by the phase of its drive: equal grids of phase, period after period.

Measured samples fall anywhere in a period. Between samples each state is interpolated by the cubic through the four
samples nearest by: of fourth order where the motion is smooth, and a kink that an impact leaves reaches no further than
two samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray

__all__ = ["fold", "mean_orbit"]


FEWEST_SAMPLES = 8  # per forcing period: fewer do not show an orbit


def fold(phase: ArrayLike, u: ArrayLike, grid: int) -> FloatArray:
    """The motion on ``grid`` equal steps of phase in each whole forcing period: (periods, grid, states).

    Parameters
    ----------
    phase : array (samples,)
        In forcing periods, rising through all of them.
    u : array (samples, states)
        NaN where a sample is missing; a period that touches one is NaN.
    grid : int
        Samples per forcing period in the result; the first is at phase 0.

    Raises
    ------
    ValueError
        A phase that does not rise, no whole period, or fewer than eight samples in one.
    """
    turns, values = np.asarray(phase, dtype=float), np.asarray(u, dtype=float)
    rises = np.diff(turns)
    if (rises < 0).any():
        i = int(np.argmax(rises < 0))
        raise ValueError(
            f"the phase goes back from {turns[i]:.6g} to {turns[i + 1]:.6g} forcing periods (sample {i + 1})"
        )
    keep = np.concatenate([[True], rises > 0])  # a crossing stands twice in a trajectory
    turns, values = turns[keep], values[keep]
    first, last = int(np.ceil(turns[0] - 1e-9)), int(np.floor(turns[-1] + 1e-9))
    if last <= first:
        raise ValueError(
            f"the record covers {turns[-1] - turns[0]:.3g} forcing periods; at least one whole one is needed"
        )
    rate = len(turns) / (turns[-1] - turns[0])
    if rate < FEWEST_SAMPLES:
        raise ValueError(f"{rate:.3g} samples per forcing period are too few; at least {FEWEST_SAMPLES} are needed")
    at = first + np.arange((last - first) * grid) / grid
    good = np.isfinite(values).all(axis=1)
    inside = np.clip(at, turns[good][0], turns[good][-1])
    folded = _cubic(turns[good], values[good], inside).reshape(-1, grid, values.shape[1])
    for missing in np.unique(np.floor(turns[~good]).astype(int) - first):
        if 0 <= missing < len(folded):
            folded[missing] = np.nan
    return folded


def _cubic(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Lagrange's cubic through the four samples about each place."""
    first = np.clip(np.searchsorted(x, at, side="right") - 2, 0, max(len(x) - 4, 0))
    nodes = first[:, None] + np.arange(4)
    away = at[:, None] - x[nodes]
    apart = x[nodes][:, :, None] - x[nodes][:, None, :]
    apart[:, np.arange(4), np.arange(4)] = 1.0
    products = np.stack([np.delete(away, i, axis=1).prod(axis=1) for i in range(4)], axis=1)
    return np.einsum("ij,ijk->ik", products / apart.prod(axis=2), y[nodes])


def mean_orbit(folded: ArrayLike, period_number: int) -> tuple[FloatArray, FloatArray]:
    """The orbit over ``period_number`` forcing periods, averaged over the record, and the scatter about it.

    Parameters
    ----------
    folded : array (periods, grid, states)
    period_number : int

    Returns
    -------
    orbit, scatter : array (period_number * grid, states)
        Mean, and standard deviation of one pass about it (NaN from a single pass).
    """
    values = np.asarray(folded, dtype=float)
    passes = len(values) // period_number
    if not passes:
        raise ValueError(f"{len(values)} forcing periods do not hold an orbit of period {period_number}")
    stacked = values[: passes * period_number].reshape(passes, period_number * values.shape[1], values.shape[2])
    stacked = stacked[np.isfinite(stacked).all(axis=(1, 2))]
    if not len(stacked):
        raise ValueError("no pass of the orbit is without missing samples")
    scatter = stacked.std(axis=0, ddof=1) if len(stacked) > 1 else np.full(stacked.shape[1:], np.nan)
    return stacked.mean(axis=0), scatter
