r"""The car's motion as the fits compute it: Runge-Kutta steps between located switches, for one record in microseconds.

.. math::

    \ddot x + \omega_0^2 (x - x_e) + b\,\dot x + f\,\mathrm{sign}\,\dot x
        + [\kappa (x - g) + \gamma \dot x]_{\text{contact}} = \tfrac12 \omega_0^2 D(\varphi)

with everything divided by the mass: :math:`b = c/m`, :math:`f = F_C/m`, :math:`\kappa = k_s/m`, :math:`\gamma = c_s/m`.
The drive is a Fourier sum in the crank's mean angle, so that a string, a ripple and an imperfect mark are numbers in
it.
A motion tells only these ratios; the mass comes from the scale.

Not the package's own engines: those also make the virtual rig's recordings, and a fit that shared their numerics with
the rig could not see a fault of theirs.
"""

# mypy: allow-untyped-defs, allow-incomplete-defs, no-check-untyped-defs
from __future__ import annotations

from math import ceil, cos, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["CONTACT", "DRIVE", "OSCILLATOR", "march"]

FloatArray = NDArray[np.float64]

#: Order of the numbers in the vector ``oscillator``, each over the mass where it has one.
OSCILLATOR = ("omega_0", "b", "f", "x_e")
#: Order in ``drive`` (m): D = cosine cos(phi) + sine sin(phi) + cosine_2 cos(2 phi) + sine_2 sin(2 phi).
DRIVE = ("cosine", "sine", "cosine_2", "sine_2")
#: Order in ``contact``; g = inf: no support.
CONTACT = ("kappa", "gamma", "g")

_STEP = 2.5e-3  # s: (38 rad/s x 2.5 ms)^5 / 120 is 7e-8 of the amplitude per step
_HALVINGS = 60
_SWITCHES = 20  # in one step


@njit(cache=True)
def _force(phi, oscillator, drive, x):
    w2 = oscillator[0] * oscillator[0]
    d = drive[0] * cos(phi) + drive[1] * sin(phi) + drive[2] * cos(2 * phi) + drive[3] * sin(2 * phi)
    return w2 * (0.5 * d - (x - oscillator[3]))


@njit(cache=True)
def _rate(phi, x, v, sign, touching, oscillator, drive, contact):
    a = _force(phi, oscillator, drive, x) - oscillator[1] * v - sign * oscillator[2]
    if touching:
        a -= contact[0] * (x - contact[2]) + contact[1] * v
    return a


@njit(cache=True)
def _step(h, phi, turning, x, v, sign, touching, oscillator, drive, contact):
    """One Runge-Kutta step of order 4 with a fixed direction of friction and a fixed mode."""
    a1 = _rate(phi, x, v, sign, touching, oscillator, drive, contact)
    middle = phi + 0.5 * h * turning
    v2 = v + 0.5 * h * a1
    a2 = _rate(middle, x + 0.5 * h * v, v2, sign, touching, oscillator, drive, contact)
    v3 = v + 0.5 * h * a2
    a3 = _rate(middle, x + 0.5 * h * v2, v3, sign, touching, oscillator, drive, contact)
    v4 = v + h * a3
    a4 = _rate(phi + h * turning, x + h * v3, v4, sign, touching, oscillator, drive, contact)
    return x + h * (v + 2 * v2 + 2 * v3 + v4) / 6, v + h * (a1 + 2 * a2 + 2 * a3 + a4) / 6


@njit(cache=True)
def _beyond(x, v, sign, touching, contact):
    """Whether a state lies beyond its mode: the velocity has turned, contact has begun, or it has ended."""
    if sign * v < 0:
        return True
    if touching:
        return contact[0] * (x - contact[2]) + contact[1] * v < 0
    # at release x > g still and the car moves away: only an approach begins a contact
    return x > contact[2] and contact[0] * (x - contact[2]) + contact[1] * v > 0 and v > 0


@njit(cache=True)
def march(time, phase, x, v, touching, oscillator, drive, contact, out):
    """Fill ``out`` (n, 2) with x and v at the times; returns the number of contacts that began.

    NaN from where more than twenty switches fall into one step.

    Parameters
    ----------
    time, phase : array (n,)
        The times (s) and the crank's mean angle there (rad), taken as straight between them.
    x, v : float
        State at the first time.
    touching : bool
        Whether the support is in contact there.
    oscillator, drive, contact : array (4,), (4,), (3,)
        See `OSCILLATOR`, `DRIVE`, `CONTACT`.
    """
    out[0, 0], out[0, 1] = x, v
    begun = 0
    sign = 1.0 if v > 0 else -1.0
    stuck = False
    if v == 0.0:
        net = _rate(phase[0], x, 0.0, 0.0, touching, oscillator, drive, contact)
        stuck = abs(net) <= oscillator[2]
        sign = 1.0 if net > 0 else -1.0
    for i in range(1, len(time)):
        dt = time[i] - time[i - 1]
        turning = (phase[i] - phase[i - 1]) / dt
        n = ceil(dt / _STEP)
        h = dt / n
        for j in range(n):
            done = 0.0
            for switches in range(_SWITCHES):
                left = h - done
                if left <= 1e-12:
                    break
                phi = phase[i - 1] + turning * (j * h + done)
                if stuck:  # held until the springs overcome friction; judged once per step
                    net = _rate(phi, x, 0.0, 0.0, touching, oscillator, drive, contact)
                    if abs(net) <= oscillator[2]:
                        break
                    stuck = False
                    sign = 1.0 if net > 0 else -1.0
                x1, v1 = _step(left, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                if not _beyond(x1, v1, sign, touching, contact):
                    x, v = x1, v1
                    break
                low, high = 0.0, left
                for _ in range(_HALVINGS):
                    middle = 0.5 * (low + high)
                    x1, v1 = _step(middle, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                    if _beyond(x1, v1, sign, touching, contact):
                        high = middle
                    else:
                        low = middle
                    if high - low < 1e-9:
                        break
                x, v = _step(high, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                done += high
                if sign * v < 0:
                    net = _rate(phi + turning * high, x, 0.0, 0.0, touching, oscillator, drive, contact)
                    stuck = abs(net) <= oscillator[2]
                    sign = 1.0 if net > 0 else -1.0
                    if stuck or sign * v < 0:
                        v = 0.0
                elif touching:
                    touching = False
                else:
                    touching = True
                    begun += 1
                if switches == _SWITCHES - 1:  # chatter: no motion that a fit may take
                    out[i:, :] = np.nan
                    return begun
        out[i, 0], out[i, 1] = x, v
    return begun
