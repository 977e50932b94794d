r"""A sampled motion folded by the phase of its drive, and the distance of two closed orbits.

Measured samples fall anywhere in a period. Folded, a motion stands on equal grids of phase, period after period;
between samples each state is interpolated by the cubic through the four samples nearest by: of fourth order where the
motion is smooth, and a kink that an impact leaves reaches no further than two samples.

Two orbits are given on equal grids of phase, over the same whole number of forcing periods. With s_i the root mean
square size of state i about its mean (of both orbits together),

.. math:: d(\delta)^2 = \frac1n \sum_i \Big\langle \frac{(a_i(\varphi) - b_i(\varphi - \delta))^2}{s_i^2} \Big\rangle

is 0 for equal orbits, about :math:`\sqrt 2` for unrelated ones of equal size, and :math:`2 |\sin(\delta / 2)|` for two
harmonic ones that are :math:`\delta` apart. Where the drive's phase is known, only shifts by whole forcing periods are
free (which of p alike points is called the first); modulo phase, all are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray

FEWEST_SAMPLES = 8  # per forcing period: fewer do not show an orbit


def fold(phase: ArrayLike, u: ArrayLike, grid: int) -> FloatArray:
    """The motion on ``grid`` equal steps of phase in each whole forcing period: (periods, grid, states).

    Parameters
    ----------
    phase : array (samples,)
        In forcing periods, rising through all of them.
    u : array (samples, states)
        NaN where a sample is missing; a period that touches one is NaN, or an interval of more than a quarter of a
        period without samples.
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
    turns, lost = turns[good], turns[~good]
    folded = _cubic(turns, values[good], np.clip(at, turns[0], turns[-1])).reshape(-1, grid, values.shape[1])
    step = np.diff(turns)[np.clip(np.searchsorted(turns, at), 1, len(turns) - 1) - 1]
    for missing in np.unique(np.floor(np.append(lost, at[step > 2 / FEWEST_SAMPLES])).astype(int) - first):
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


@dataclass(frozen=True)
class OrbitDistance:
    """Distances of two orbits.

    Attributes
    ----------
    distance : float
        The least over shifts by whole forcing periods.
    any_phase : float
        The least over all shifts.
    whole_shift : int
        The periods by which the second orbit leads in ``distance``.
    phase_shift : float
        Forcing periods, in -1/2 ... 1/2, by which the second orbit leads the first beyond whole ones in
        ``any_phase``.
    """

    distance: float
    any_phase: float
    whole_shift: int
    phase_shift: float


def orbit_distance(a: ArrayLike, b: ArrayLike, periods: int) -> OrbitDistance:
    """Normalised distance of two orbits, each (periods * grid, states) on equal grids of phase.

    Raises
    ------
    ValueError
        Orbits of different shape, or a number of samples that is no multiple of the periods.
    """
    from scipy.optimize import minimize_scalar

    x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if x.shape != y.shape or x.ndim != 2 or len(x) % periods:
        raise ValueError(
            f"two orbits over {periods} forcing periods must have equal shapes (samples, states), the samples a "
            f"multiple of the periods; got {x.shape} and {y.shape}"
        )
    size = np.sqrt(0.5 * (x.var(axis=0) + y.var(axis=0)))
    size = np.where(size > 0, size, 1.0)
    n, states = x.shape
    fx, fy = np.fft.fft(x / size, axis=0) / n, np.fft.fft(y / size, axis=0) / n
    order = np.fft.fftfreq(n, 1 / n)
    power = float((np.abs(fx) ** 2 + np.abs(fy) ** 2).sum())
    cross = (np.conj(fx) * fy).sum(axis=1)

    def distance(lead: float) -> float:
        """``y`` led by this part of the whole length, against ``x``."""
        likeness = float((cross * np.exp(-2j * np.pi * order * lead)).real.sum())
        return float(np.sqrt(max(power - 2 * likeness, 0.0) / states))

    # At the n leads i / n the likeness is one Fourier sum.
    grid = np.sqrt(np.maximum(power - 2 * np.fft.fft(cross).real, 0.0) / states)
    whole = grid[:: n // periods]
    best = int(np.argmin(whole))
    near = int(np.argmin(grid)) / n
    found = minimize_scalar(distance, bounds=(near - 1 / n, near + 1 / n), method="bounded", options={"xatol": 1e-10})
    lead = float(found.x) if found.fun <= grid.min() else near
    shift = (lead * periods + 0.5) % 1.0 - 0.5
    return OrbitDistance(float(whole[best]), min(float(found.fun), float(grid.min())), best, shift)


def common_length(orbit: ArrayLike, periods: int, length: int) -> FloatArray:
    """An orbit over ``periods`` repeated to ``length`` forcing periods, a multiple of them."""
    values = np.asarray(orbit, dtype=float)
    return np.tile(values, (length // periods, 1))
