r"""The gap, referred to the car's mean position under the drive.

The string moves the driven end by :math:`a\cos\varphi + L - \sqrt{L^2 - a^2 \sin^2\varphi}`, whose mean is
:math:`a^2/(4L)` and not zero; the car's mean position moves by half of it, :math:`a^2/(8L)`: 0.4 mm at Fig. 13 with
L = 0.5 m, a quarter of the gap, to the side where the motor is. A motor that turns unevenly,
:math:`\varphi = \omega t + \epsilon \sin(\omega t + \beta)`, moves it by :math:`-a\,\epsilon \cos\beta/4` more
(:func:`mean_of_drive` derives both).
The model's drive, :math:`\rho\cos\omega t`, has no mean: its gap must be counted from where the car swings about. Both
parts are read off the mean positions of steady runs without contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.studies.savi2007.identification.steady import Steady

__all__ = ["MeanShift", "grazing_amplitude", "mean_of_drive", "mean_shift"]


_CLEAR = 4.0  # standard uncertainties by which a sign, or a contradiction, is taken as seen


class MeanShift(NamedTuple):
    r"""Place of the car over crank length, in the sensor's count: at rest, and about which it swings.

    .. math:: \bar x(a) = r + s(a), \qquad s(a) = \alpha a^2 + \beta a

    Three places are told apart: where the sensor counts zero, where the springs balance (``rest``; a car with dry
    friction stops within F_C/2k of it, and a sensor is zeroed where the car happens to stand), and the mean position
    under the drive. ``covariance`` is that of (rest, alpha, beta), ``by_zero`` how they move with the place of rest
    that the taps tell; number of ``runs``; ``side``: 1 where the motor pulls from the support's side, -1 from the
    other, 0 where the runs do not tell; ``notes`` on what the runs say of the string.
    """

    rest: float
    alpha: float
    beta: float
    covariance: FloatArray
    by_zero: FloatArray
    runs: int
    string_length: float | None = None
    side: int = 0
    notes: tuple[str, ...] = ()

    def at(self, crank_length: float) -> tuple[float, float]:
        """The shift s (m) from the place of rest at a crank length, and its standard uncertainty."""
        return self._of(self.row(crank_length))

    def place(self, crank_length: float) -> tuple[float, float]:
        """The mean position (m) in the sensor's count at a crank length, and its standard uncertainty."""
        return self._of(self.row(crank_length) + np.array([1.0, 0.0, 0.0]))

    def row(self, crank_length: float) -> FloatArray:
        """Derivatives of the shift in (rest, alpha, beta)."""
        further = 3 * crank_length**2 / (16 * self.string_length**2) if self.string_length else 0.0
        return np.array([0.0, crank_length**2 * (1 + further), crank_length])

    def _of(self, row: FloatArray) -> tuple[float, float]:
        return float(row @ [self.rest, self.alpha, self.beta]), float(np.sqrt(row @ self.covariance @ row))


def mean_of_drive(crank_length: float, string_length: float, ripple: float = 0.0, ripple_phase: float = 0.0) -> float:
    r"""Mean of the driven end over a turn (m), string and uneven turning to their lowest orders.

    .. math::

        \langle d \rangle = \frac{a^2}{4L}\left(1 + \frac{3a^2}{16L^2}\right) - \frac{a\,\epsilon}{2}\cos\beta

    since (with the means 1/2, 3/8 and :math:`\cos\beta/2`)

    .. math::

        L - \sqrt{L^2 - a^2\sin^2\varphi} = \frac{a^2\sin^2\varphi}{2L} + \frac{a^4\sin^4\varphi}{8L^3} + \ldots, \qquad
        \cos(\theta + \epsilon\sin(\theta + \beta)) \approx \cos\theta - \epsilon \sin\theta \sin(\theta + \beta) .

    The car between two equal springs moves by half.
    """
    a = crank_length
    string = a**2 / (4 * string_length) * (1 + 3 * a**2 / (16 * string_length**2))
    return string - 0.5 * a * ripple * float(np.cos(ripple_phase))


def mean_shift(
    seen: Steady, zero: float, zero_error: float, *, string_length: float | None, string_error: float = 0.0,
    dry: float = 0.0,
) -> MeanShift:  # fmt: skip
    r"""Fit the mean positions of steady runs without contact, together with the place of rest.

    The string's length says how large :math:`\alpha = \pm 1/(8L)` is and not which sign it has: the motor pulls the
    mean position to its own side, which the runs show where they have two crank lengths or more. Dry friction holds a
    car that goes longer one way than the other off its place, by :math:`F_C/2k` times the mean sign of its velocity:
    some micrometres, which are taken out.

    Parameters
    ----------
    seen : Steady
        Steady runs; without any, what is known of string and motor alone bounds the shift.
    zero, zero_error : float
        Where the car rests in the sensor's count (m), from the free decay; without taps, where the sensor was zeroed
        and how far that may be from rest.
    string_length, string_error : float, optional
        Length of the string.
    dry : float
        F_C/2k (m).
    """
    size = 1 / (8 * string_length) if string_length else 0.1
    told = max(string_error, 1e-4 * string_length) / (8 * string_length**2) if string_length else 0.0
    free = _fitted(seen, zero, zero_error, None, 0.0, 2 * size if string_length else 0.25, dry)
    side, notes = 0, []
    error = float(np.sqrt(free.covariance[1, 1]))
    if abs(free.alpha) > _CLEAR * error:
        side = int(np.sign(free.alpha))
    if not side:
        several = f"the {len(seen)} runs without the support do not tell"
        notes.append(
            f"{several if len(seen) else 'no run without the support tells'} on which side the motor is, and with it "
            "which way its string moves the mean position: the gap is uncertain by as much at other crank lengths than "
            "theirs. Record such runs (response, no gap) at two crank lengths or more, and taps of the car (impulse)"
        )
        return _fitted(seen, zero, zero_error, string_length, 0.0, size, dry)._replace(notes=tuple(notes))
    where = "the support's side" if side > 0 else "the side away from the support"
    if not string_length:
        return free._replace(side=side)
    off = abs(free.alpha - side * size) / float(np.hypot(error, told))
    if off > _CLEAR:
        notes.append(
            f"the mean positions say a string of {1 / (8 * abs(free.alpha)):.3g} m, the notebook {string_length:.3g} "
            f"m ({off:.0f} uncertainties apart): string_length is not used. Measure it from crank to driven spring"
        )
        return free._replace(side=side, notes=tuple(notes))
    if side < 0:
        notes.append(f"the motor pulls from {where}: its string moves the mean position away from the support")
    found = _fitted(seen, zero, zero_error, string_length, side * size, told, dry)
    return found._replace(side=side, notes=tuple(notes))


def _fitted(
    seen: Steady, zero: float, zero_error: float, string_length: float | None, alpha: float, alpha_error: float,
    dry: float,
) -> MeanShift:  # fmt: skip
    """Rest, alpha and beta by least squares; alpha is known beforehand to its error, beta to a ripple of 0.03 rad."""
    # of the string's term the next order too, 0.1 % at a = 39 mm and L = 0.5 m
    further = 3 * seen.crank**2 / (16 * string_length**2) if string_length else np.zeros(len(seen))
    matrix = np.column_stack([np.ones(len(seen)), seen.crank**2 * (1 + further), seen.crank])
    y = seen.mean + dry * seen.lean
    known = np.array([max(zero_error, 1e-9), alpha_error, 0.03 / 4]) ** -2.0
    before = known * [zero, alpha, 0.0]
    spread = 1e-5
    for _ in range(3):  # the scatter of the means from what the fit leaves of them
        normal, right = matrix.T @ matrix / spread**2 + np.diag(known), matrix.T @ y / spread**2 + before
        found = np.linalg.solve(normal, right)
        covariance = np.linalg.inv(normal)
        left = y - matrix @ found
        spread = max(float(np.sqrt(left @ left / max(len(y) - 2, 1))), 1e-6)
    rest, curved, straight = (float(value) for value in found)
    return MeanShift(
        rest, curved, straight, np.asarray(covariance, dtype=np.float64), covariance[:, 0] * known[0], len(y),
        string_length,
    )  # fmt: skip


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
