"""Least-squares fit of a mean and harmonics, with a covariance that knows when residuals are not independent."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.recordings.signals.checks import signal, whose
from nonsmooth.recordings.signals.spectrum import correlation_times
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Natural, Positive


@dataclass(frozen=True, eq=False)
class HarmonicFit:
    """x(t) = mean + sum over j of amplitudes[j-1] cos(j omega t - phases[j-1]).

    Attributes
    ----------
    omega, omega_error : float
        Angular frequency in rad/s; the error is 0 where it was given and not fitted.
    mean : float
    amplitudes, phases : ndarray, shape (n,)
        Phases in rad, 0 to 2 pi. With ``subharmonic=p``, j counts p-ths of omega.
    covariance : DataArray
        Over ``parameter`` and ``parameter_2``: mean, cos_1, sin_1, ..., and omega where it was fitted.
    residual : float
        Standard deviation of what is left.
    correlation : float
        How many neighbouring residuals say as much as one (1: independent); the covariance holds this factor.
    """

    omega: float
    omega_error: float
    mean: float
    amplitudes: FloatArray
    phases: FloatArray
    covariance: xr.DataArray = field(repr=False)
    residual: float
    correlation: float
    subharmonic: int = 1

    @property
    def period(self) -> float:
        """2 pi / omega in seconds."""
        return 2.0 * math.pi / self.omega

    @property
    def mean_error(self) -> float:
        """Standard error of the mean."""
        return float(np.sqrt(self.covariance.values[0, 0]))

    @property
    def amplitude_errors(self) -> FloatArray:
        """Standard errors of the amplitudes, to first order."""
        return self._errors(np.cos(self.phases), np.sin(self.phases))

    @property
    def phase_errors(self) -> FloatArray:
        """Standard errors of the phases in rad, to first order."""
        size = np.maximum(self.amplitudes, np.finfo(float).tiny)
        return self._errors(-np.sin(self.phases) / size, np.cos(self.phases) / size)

    def _errors(self, by_cos: FloatArray, by_sin: FloatArray) -> FloatArray:
        own, both = (np.diag(self.covariance.values, k) for k in (0, 1))
        cos = 1 + 2 * np.arange(len(by_cos))
        found = by_cos**2 * own[cos] + 2 * by_cos * by_sin * both[cos] + by_sin**2 * own[cos + 1]
        return np.sqrt(np.maximum(found, 0.0))

    def evaluate(self, time: ArrayLike) -> FloatArray:
        """The fitted signal at these times."""
        t = np.asarray(time, float)
        j = np.arange(1, len(self.amplitudes) + 1)
        angle = np.multiply.outer(t, j * self.omega / self.subharmonic) - self.phases
        return self.mean + np.cos(angle) @ self.amplitudes


@checked
def fit(
    time: ArrayLike, x: Any, omega: Positive, n: Natural = 3, *, refine: bool = False, subharmonic: Natural = 1
) -> HarmonicFit:
    """Fit a mean and ``n`` harmonics of ``omega`` to a signal; times may be uneven.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds and values.
    omega : float
        Angular frequency of the drive in rad/s.
    n : int
        Harmonics.
    refine : bool
        Fit omega too (variable projection: the linear part is solved at each omega).
    subharmonic : int
        The motion repeats after so many periods of the drive: the harmonics are those of omega / subharmonic.

    Returns
    -------
    HarmonicFit

    Raises
    ------
    ValueError
        If the record is shorter than one period, has too few samples, or too low a rate for the highest harmonic.
    """
    t, values = signal(time, x, least=2 * n + 4, purpose=f"a fit of {n} harmonics")
    base = omega / subharmonic
    length = t[-1] - t[0]
    if base * length < 2 * math.pi:
        raise ValueError(
            f"{whose(x)}: lasts {length:.4g} s, less than one period of {2 * math.pi / base:.4g} s: record longer"
        )
    rate = (len(t) - 1) / length
    if n * base > math.pi * rate:
        raise ValueError(
            f"{whose(x)}: harmonic {n} lies at {n * base / (2 * math.pi):.4g} Hz, above half the sample rate of "
            f"{rate:.4g} Hz; fit fewer"
        )
    if refine:  # about the record's middle, where frequency and phase are independent
        base = _best(t - 0.5 * (t[0] + t[-1]), values, base, n, length)
    A, solution, left = _fitted(t, values, base, n)
    cos, sin = solution[1::2], solution[2::2]
    names = ["mean"] + [f"{f}_{j}" for j in range(1, n + 1) for f in ("cos", "sin")]
    if refine:
        A = np.column_stack([A, _slope(t, A, solution) / subharmonic])
        names.append("omega")
    variance = (left @ left) / max(len(t) - A.shape[1], 1)
    correlation = correlation_times(left)
    inverse = np.linalg.inv(np.linalg.qr(A, mode="r"))
    C = variance * correlation * inverse @ inverse.T
    covariance = xr.DataArray(
        C, {"parameter": names, "parameter_2": names}, ("parameter", "parameter_2"), name="covariance"
    )
    return HarmonicFit(
        base * subharmonic,
        math.sqrt(C[-1, -1]) if refine else 0.0,
        float(solution[0]),
        np.hypot(cos, sin),
        np.mod(np.arctan2(sin, cos), 2 * math.pi),
        covariance,
        math.sqrt(variance),
        correlation,
        subharmonic,
    )


def _fitted(tau: FloatArray, values: FloatArray, omega: float, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean, cosines and sines in columns, their coefficients of the least squares, and what is left."""
    angle = np.multiply.outer(tau, omega * np.arange(1, n + 1))
    A = np.ones((len(tau), 2 * n + 1))
    A[:, 1::2], A[:, 2::2] = np.cos(angle), np.sin(angle)
    p, *_ = np.linalg.lstsq(A, values, rcond=None)
    return A, np.asarray(p, float), values - A @ p


def _slope(tau: FloatArray, A: FloatArray, p: FloatArray) -> FloatArray:
    """Derivative of the fitted signal in the frequency."""
    return tau * ((A[:, 1::2] * p[2::2] - A[:, 2::2] * p[1::2]) @ np.arange(1, len(p) // 2 + 1))


def _best(tau: FloatArray, values: FloatArray, omega: float, n: int, length: float) -> float:
    """The frequency of the least squares near ``omega``: the sum has a valley about 2 pi / length wide there.

    A few are tried, then Gauss-Newton steps change frequency and amplitudes together.
    """
    grid = omega + math.pi / length * np.linspace(-1.0, 1.0, 7)
    best = float(grid[np.argmin([np.linalg.norm(_fitted(tau, values, w, n)[2]) for w in grid])])
    for _ in range(20):
        A, p, left = _fitted(tau, values, best, n)
        change, *_ = np.linalg.lstsq(np.column_stack([A, _slope(tau, A, p)]), left, rcond=None)
        step = float(np.clip(change[-1], -math.pi / length, math.pi / length))
        best += step
        if abs(step) < 1e-13 * omega:
            break
    else:
        if abs(step) > 1e-6 * math.pi / length:
            raise SolveError(
                f"no frequency near {omega:.6g} rad/s fits best: the search still moves by {abs(step):.2g} rad/s after "
                "20 steps; give one that is nearer, or a longer record"
            )
    return best
