r"""Distance of two closed orbits, with the phase known and modulo phase.

Both orbits are given on equal grids of phase, over the same whole number of forcing periods. With s_i the root mean
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
from nonsmooth.errors import SolveError

__all__ = ["OrbitDistance", "common_length", "orbit_distance"]


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
    fx, fy = np.fft.rfft(x / size, axis=0) / n, np.fft.rfft(y / size, axis=0) / n
    weight = np.full(len(fx), 2.0)
    weight[0] = 1.0
    if n % 2 == 0:
        weight[-1] = 1.0
    order = np.arange(len(fx))
    power = float((weight[:, None] * (np.abs(fx) ** 2 + np.abs(fy) ** 2)).sum())
    cross = weight * (np.conj(fx) * fy).sum(axis=1)

    def distance(lead: float) -> float:
        """``y`` led by this part of the whole length, against ``x``."""
        likeness = float((cross * np.exp(-2j * np.pi * order * lead)).real.sum())
        return float(np.sqrt(max(power - 2 * likeness, 0.0) / states))

    # At the n leads i / n the likeness is one Fourier sum.
    grid = np.sqrt(np.maximum(power - 2 * np.fft.fft(cross, n).real, 0.0) / states)
    whole = grid[:: n // periods]
    best = int(np.argmin(whole))
    near = int(np.argmin(grid)) / n
    found = minimize_scalar(distance, bounds=(near - 1 / n, near + 1 / n), method="bounded", options={"xatol": 1e-10})
    if not found.success:
        raise SolveError(f"the shift between two orbits was not found: {found.message}")
    lead = float(found.x) if found.fun <= grid.min() else near
    shift = (lead * periods + 0.5) % 1.0 - 0.5
    return OrbitDistance(float(whole[best]), min(float(found.fun), float(grid.min())), best, shift)


def common_length(orbit: ArrayLike, periods: int, length: int) -> FloatArray:
    """An orbit over ``periods`` repeated to ``length`` forcing periods, a multiple of them."""
    values = np.asarray(orbit, dtype=float)
    return np.tile(values, (length // periods, 1))
