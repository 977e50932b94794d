r"""The gap, referred to the car's mean position under the drive.

The string moves the driven end by :math:`a\cos\varphi + L - \sqrt{L^2 - a^2 \sin^2\varphi}`, whose mean is
:math:`a^2/(4L)` and not zero; the car's mean position moves by half of it, :math:`a^2/(8L)`: 0.4 mm at Fig. 13 with
L = 0.5 m, a quarter of the gap. A motor that turns unevenly,
:math:`\varphi = \omega t + \epsilon \sin(\omega t + \beta)`, moves it by :math:`-a\,\epsilon \cos\beta/4` more
(:func:`mean_of_drive` derives both).
The model's drive, :math:`\rho\cos\omega t`, has no mean: its gap must be counted from where the car swings about. Both
parts are read off the mean positions of steady runs without contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nonsmooth.identification.steady import Steady

__all__ = ["MeanShift", "grazing_amplitude", "mean_of_drive", "mean_shift"]

FloatArray = NDArray[np.float64]


class MeanShift(NamedTuple):
    r"""Mean position over crank length: :math:`\alpha a^2 + \beta a`.

    ``covariance`` of (alpha, beta) without the zero's part; ``by_zero``, how they move with the place of rest, whose
    standard uncertainty is ``zero_error``; number of ``runs``.
    """

    alpha: float
    beta: float
    covariance: FloatArray
    by_zero: FloatArray
    zero_error: float
    runs: int
    string_length: float | None = None

    def at(self, crank_length: float) -> tuple[float, float]:
        """The shift (m) and its standard uncertainty at a crank length."""
        value, own, slope = self.parts(crank_length)
        return value, float(np.hypot(own, slope * self.zero_error))

    def parts(self, crank_length: float) -> tuple[float, float, float]:
        """The shift (m), its standard uncertainty without the zero's, and how much it moves with the zero."""
        further = 3 * crank_length**2 / (16 * self.string_length**2) if self.string_length else 0.0
        row = np.array([crank_length**2 * (1 + further), crank_length])
        own = float(np.sqrt(row @ self.covariance @ row))
        return float(row @ [self.alpha, self.beta]), own, float(row @ self.by_zero)


def mean_of_drive(crank_length: float, string_length: float, ripple: float = 0.0, ripple_phase: float = 0.0) -> float:
    r"""Mean of the driven end over a turn (m), string and uneven turning to their lowest orders.

    .. math::

        \langle d \rangle = \frac{a^2}{4L}\Big(1 + \frac{3a^2}{16L^2}\Big) - \frac{a\,\epsilon}{2}\cos\beta

    since :math:`L - \sqrt{L^2 - a^2\sin^2\varphi} = a^2\sin^2\varphi/2L + a^4\sin^4\varphi/8L^3 + \ldots` with the
    means 1/2 and 3/8, and :math:`\cos(\theta + \epsilon\sin(\theta + \beta)) \approx \cos\theta - \epsilon \sin\theta
    \sin(\theta + \beta)`, whose mean is :math:`-\epsilon\cos\beta/2`. The car between two equal springs moves by half.
    """
    a = crank_length
    string = a**2 / (4 * string_length) * (1 + 3 * a**2 / (16 * string_length**2))
    return string - 0.5 * a * ripple * float(np.cos(ripple_phase))


def mean_shift(
    seen: Steady, zero: float, zero_error: float, *, string_length: float | None, string_error: float = 0.0,
    dry: float = 0.0,
) -> MeanShift:  # fmt: skip
    r"""Fit the mean positions of steady runs without contact.

    Dry friction holds a car that goes longer one way than the other off its place, by :math:`F_C/2k` times the mean
    sign of its velocity: some micrometres, which are taken out.

    Parameters
    ----------
    seen : Steady
        Steady runs; without any, the string's length alone tells.
    zero, zero_error : float
        Where the car rests (m), from the free decay.
    string_length, string_error : float, optional
        Length of the string: alpha = 1/(8 L) is known from it.
    dry : float
        F_C/2k (m).
    """
    # of the string's term the next order too, 0.1 % at a = 39 mm and L = 0.5 m
    further = 3 * seen.crank**2 / (16 * string_length**2) if string_length else np.zeros(len(seen))
    matrix, y = np.column_stack([seen.crank**2 * (1 + further), seen.crank]), seen.mean - zero + dry * seen.lean
    normal, right, spread = np.zeros((2, 2)), np.zeros(2), 1e-5
    if len(y):
        for _ in range(2):  # the scatter of the means from what the fit leaves of them
            normal, right = matrix.T @ matrix / spread**2, matrix.T @ y / spread**2
            full, known = _with_string(normal, right, string_length, string_error)
            found = np.linalg.solve(full, known)
            left = y - matrix @ found
            spread = max(float(np.sqrt(left @ left / max(len(y) - 2, 1))), 1e-6)
        normal, right = matrix.T @ matrix / spread**2, matrix.T @ y / spread**2
    full, known = _with_string(normal, right, string_length, string_error)
    found, covariance = np.linalg.solve(full, known), np.linalg.inv(full)
    by_zero = -covariance @ matrix.T @ np.ones(len(y)) / spread**2 if len(y) else np.zeros(2)
    return MeanShift(
        float(found[0]), float(found[1]), np.asarray(covariance, dtype=np.float64),
        np.asarray(by_zero, dtype=np.float64), zero_error, len(y), string_length,
    )  # fmt: skip


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
