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

__all__ = ["CONTACT", "DRIVE", "OSCILLATOR", "march"]


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
def _place(phi, drive):
    """D at the crank's angle; where nothing drives, no cosine is computed."""
    if drive[0] == 0.0 and drive[1] == 0.0 and drive[2] == 0.0 and drive[3] == 0.0:
        return 0.0
    c, s = cos(phi), sin(phi)
    return drive[0] * c + drive[1] * s + drive[2] * (c * c - s * s) + drive[3] * (2 * s * c)


@njit(cache=True)
def _rate(d, x, v, sign, touching, oscillator, contact):
    w2 = oscillator[0] * oscillator[0]
    a = w2 * (0.5 * d - (x - oscillator[3])) - oscillator[1] * v - sign * oscillator[2]
    if touching:
        a -= contact[0] * (x - contact[2]) + contact[1] * v
    return a


@njit(cache=True)
def _step(h, d, phi, turning, x, v, sign, touching, oscillator, drive, contact):
    """x, v, and D where it ends, of a Runge-Kutta step of order 4 with fixed direction of friction and fixed mode."""
    middle, end = _place(phi + 0.5 * h * turning, drive), _place(phi + h * turning, drive)
    a1 = _rate(d, x, v, sign, touching, oscillator, contact)
    v2 = v + 0.5 * h * a1
    a2 = _rate(middle, x + 0.5 * h * v, v2, sign, touching, oscillator, contact)
    v3 = v + 0.5 * h * a2
    a3 = _rate(middle, x + 0.5 * h * v2, v3, sign, touching, oscillator, contact)
    v4 = v + h * a3
    a4 = _rate(end, x + h * v3, v4, sign, touching, oscillator, contact)
    return x + h * (v + 2 * v2 + 2 * v3 + v4) / 6, v + h * (a1 + 2 * a2 + 2 * a3 + a4) / 6, end


@njit(cache=True)
def _beyond(x, v, sign, touching, contact):
    """Return whether a state lies beyond its mode: the velocity has turned, contact has begun, or it has ended."""
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
    d = _place(phase[0], drive)  # where the present step begins
    if v == 0.0:
        net = _rate(d, x, 0.0, 0.0, touching, oscillator, contact)
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
                    net = _rate(d, x, 0.0, 0.0, touching, oscillator, contact)
                    if abs(net) <= oscillator[2]:
                        d = _place(phi + turning * left, drive)
                        break
                    stuck = False
                    sign = 1.0 if net > 0 else -1.0
                x1, v1, d1 = _step(left, d, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                if not _beyond(x1, v1, sign, touching, contact):
                    x, v, d = x1, v1, d1
                    break
                low, high = 0.0, left
                for _ in range(_HALVINGS):
                    middle = 0.5 * (low + high)
                    x1, v1, _ = _step(middle, d, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                    if _beyond(x1, v1, sign, touching, contact):
                        high = middle
                    else:
                        low = middle
                    if high - low < 1e-9:
                        break
                x, v, d = _step(high, d, phi, turning, x, v, sign, touching, oscillator, drive, contact)
                done += high
                if sign * v < 0:
                    net = _rate(d, x, 0.0, 0.0, touching, oscillator, contact)
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
