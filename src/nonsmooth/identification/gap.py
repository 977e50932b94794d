r"""The gap, referred to the car's mean position under the drive.

The string moves the driven end by :math:`a\cos\varphi + L - \sqrt{L^2 - a^2 \sin^2\varphi}`, whose mean is
:math:`a^2/(4L)` and not zero; the car's mean position moves by half of it, :math:`a^2/(8L)`: 0.4 mm at Fig. 13 with
L = 0.5 m, a quarter of the gap. A motor that turns unevenly,
:math:`\varphi = \omega t + \epsilon \sin(\omega t + \beta)`, moves it by :math:`-a\,\epsilon \cos\beta/4` more.
The model's drive, :math:`\rho\cos\omega t`, has no mean: its gap must be counted from where the car swings about. Both
parts are read off the mean positions of steady runs without contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.experiment.signals.harmonics import fit as harmonic_fit
from nonsmooth.experiment.signals.phase import drive_phase
from nonsmooth.identification.evidence import Run

__all__ = ["MeanShift", "grazing_amplitude", "mean_shift"]

FloatArray = NDArray[np.float64]


class MeanShift(NamedTuple):
    r"""Mean position over crank length: :math:`\alpha a^2 + \beta a`, covariance of (alpha, beta), number of runs."""

    alpha: float
    beta: float
    covariance: FloatArray
    runs: int

    def at(self, crank_length: float) -> tuple[float, float]:
        """The shift (m) and its standard uncertainty at a crank length."""
        row = np.array([crank_length**2, crank_length])
        return float(row @ [self.alpha, self.beta]), float(np.sqrt(row @ self.covariance @ row))


def mean_shift(
    runs: Sequence[Run], zero: float, zero_error: float, *, string_length: float | None, string_error: float = 0.0
) -> MeanShift:
    """Fit the mean positions of steady runs without contact.

    Parameters
    ----------
    runs : sequence of Run
        Steady, with ``x``, ``turns`` and the setting ``crank_length``.
    zero, zero_error : float
        Where the car rests (m), from the free decay.
    string_length, string_error : float, optional
        Length of the string: alpha = 1/(8 L) is known from it.
    """
    rows, values, weights = [], [], []
    for run in runs:
        a = float(run.settings["crank_length"])
        drive = drive_phase(run.passages)
        time, x = run.time, run.positions
        whole = int(np.floor((time[-1] - time[0]) / drive.period))
        inside = time <= time[0] + whole * drive.period
        fitted = harmonic_fit(time[inside], x[inside], drive.omega, 3)
        rows.append([a**2, a])
        values.append(float(fitted.mean) - zero)
        weights.append(1.0)
    matrix, y = np.array(rows).reshape(-1, 2), np.array(values)
    normal, right = np.zeros((2, 2)), np.zeros(2)
    if len(y):
        spread = 1e-5  # m: of a run's mean, replaced below by what the means show
        for _ in range(2):
            normal = matrix.T @ matrix / spread**2
            right = matrix.T @ y / spread**2
            full, known = _with_string(normal, right, string_length, string_error)
            found = np.linalg.solve(full, known)
            spread = max(float(np.sqrt(np.mean((y - matrix @ found) ** 2))), 1e-6)
    full, known = _with_string(normal, right, string_length, string_error)
    found, covariance = np.linalg.solve(full, known), np.linalg.inv(full)
    if len(y):  # the zero is common to all
        pull = covariance @ matrix.T @ np.ones(len(y)) / spread**2
        covariance = covariance + np.outer(pull, pull) * zero_error**2
    return MeanShift(float(found[0]), float(found[1]), np.asarray(covariance, dtype=np.float64), len(y))


def _with_string(
    normal: FloatArray, right: FloatArray, length: float | None, error: float
) -> tuple[FloatArray, FloatArray]:
    """What is known beforehand: alpha from the string, beta within a ripple of 0.03 rad."""
    full, known = normal.copy(), right.copy()
    alpha, spread = (1 / (8 * length), max(error, 1e-4 * length) / (8 * length**2)) if length else (0.1, 0.1)
    full[0, 0] += spread**-2.0
    known[0] += alpha * spread**-2.0
    full[1, 1] += (0.03 / 4) ** -2.0
    return full, known


def grazing_amplitude(omega: float, omega_0: float, b: float, f: float, crank_length: float) -> float:
    r"""Amplitude of the steady motion without contact, dry friction in its first harmonic.

    .. math::

        [(\omega_0^2 - \omega^2) A]^2 + [b\,\omega A + 4 f/\pi]^2 = (\tfrac12 \omega_0^2 a)^2

    Where it reaches the gap, the car grazes. Zero where friction holds the car.
    """
    stiff, damp, dry, push = omega_0**2 - omega**2, b * omega, 4 * f / np.pi, 0.5 * omega_0**2 * crank_length
    square = stiff**2 + damp**2
    half = damp * dry
    inside = half**2 - square * (dry**2 - push**2)
    return max(float((-half + np.sqrt(max(inside, 0.0))) / square), 0.0) if push > dry else 0.0
