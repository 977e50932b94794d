r"""One mode whose natural frequency and damping depend on its amplitude, and the forced responses that it makes.

With the displacement :math:`x = a \cos(\Omega t + \varphi)` under the force :math:`F \cos \Omega t`,

.. math::

    (\omega_n^2(a) - \Omega^2 + 2 i \zeta(a) \omega_n(a) \Omega)\, a e^{i\varphi} = F / m ,
    \qquad
    (\omega_n^2 - \Omega^2)^2 a^2 + (2 \zeta \omega_n \Omega a)^2 = (F/m)^2 .

The force is one function of amplitude and frequency; the amplitude at a given force and frequency may be three, and
that in the middle is unstable. So a forced response is described along its curve, by a: for each a there are at
most two frequencies,

.. math::

    \Omega^2 = \omega_n^2 - D^2/2 \pm \sqrt{(F / m a)^2 - D^2 \omega_n^2 + D^4 / 4}, \qquad D = 2 \zeta \omega_n .

What other modes add to the measured motion near this one is in phase with the force and grows with it alone: the
residual R, so that what is measured is :math:`a e^{i\varphi} + R F`.

References: W. Szemplinska-Stupnicka, J. Sound Vib. 63 (1979) 475; M. Scheel, S. Peter, R.I. Leine and M. Krack,
J. Sound Vib. 435 (2018) 346; T. Karaagacli and H.N. Ozguven, Mech. Syst. Signal Process. 146 (2021) 107023.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import ComplexArray, FloatArray

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class NonlinearMode:
    """A mode by its values at some amplitudes; between them a cubic spline, outside of them the nearest value.

    Attributes
    ----------
    knots : array (K,)
        Amplitudes of displacement (m), increasing.
    squares : array (K,)
        omega_n^2 there (rad^2/s^2).
    log_damping : array (K,)
        ln D there, D = 2 zeta omega_n (1/s).
    mass : float
        Modal mass as seen from drive and sensor (kg); 1 where forces are given by mass.
    residual : complex
        What all other modes add to the displacement, per force (m/N).
    """

    knots: FloatArray
    squares: FloatArray
    log_damping: FloatArray
    mass: float = 1.0
    residual: complex = 0.0

    def square(self, amplitude: ArrayLike) -> FloatArray:
        """omega_n^2 at these amplitudes (rad^2/s^2)."""
        return np.asarray(interpolation(self.knots, amplitude) @ self.squares)

    def damping(self, amplitude: ArrayLike) -> FloatArray:
        """D = 2 zeta omega_n at these amplitudes (1/s)."""
        return np.asarray(np.exp(interpolation(self.knots, amplitude) @ self.log_damping))

    def natural_frequency(self, amplitude: ArrayLike) -> FloatArray:
        """omega_n / 2 pi at these amplitudes (Hz)."""
        return np.asarray(np.sqrt(self.square(amplitude)) / (2 * np.pi))

    def damping_ratio(self, amplitude: ArrayLike) -> FloatArray:
        """zeta at these amplitudes."""
        return np.asarray(self.damping(amplitude) / (2 * np.sqrt(self.square(amplitude))))

    def stiffness(self, amplitude: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Force by displacement, m (omega_n^2 - Omega^2 + i D Omega), N/m."""
        w = np.asarray(omega, dtype=np.float64)
        return np.asarray(self.mass * (self.square(amplitude) - w**2 + 1j * self.damping(amplitude) * w))

    def slope(self, amplitude: ArrayLike, omega: ArrayLike) -> FloatArray:
        r"""d ln F / d ln a at a fixed frequency: 1 if linear, 0 at a fold, negative on the unstable middle part."""
        a, w = np.asarray(amplitude, dtype=np.float64), np.asarray(omega, dtype=np.float64)
        G, D, change = self.square(a), self.damping(a), interpolation(self.knots, a, 1)
        turn = change @ self.squares + 1j * w * D * (change @ self.log_damping)
        return np.asarray(1.0 + np.real(a * turn / (G - w**2 + 1j * w * D)))

    def response(self, force: float, *, points: int = 400, low: float | None = None) -> xr.Dataset:
        """The response to a force of constant amplitude, along its curve: up one side, over the top, down the other.

        Parameters
        ----------
        force : float
            Amplitude of the force (N).
        points : int
            Points on each side.
        low : float, optional
            The least amplitude (m); the first knot where not given.

        Returns
        -------
        Dataset
            Over ``point``: ``frequency`` (Hz), ``modal_amplitude`` and ``amplitude`` (m, that of the mode and with the
            residual), ``phase`` (rad), ``stable``. Empty where the force cannot reach the least amplitude.
        """
        import xarray as xr

        least = float(self.knots[0]) if low is None else low
        u = np.sin(np.linspace(0.0, np.pi / 2, points))  # dense near the top, where both sides meet
        top = self._top(force, least)
        a = least + (top - least) * u if top > least else np.zeros(0)
        square, D = self.square(a), self.damping(a)
        root = np.sqrt(np.maximum((force / (self.mass * np.maximum(a, 1e-300))) ** 2 - D**2 * square + D**4 / 4, 0.0))
        below, above = square - D**2 / 2 - root, square - D**2 / 2 + root
        here = below > 0
        omega = np.sqrt(np.concatenate([below[here], above[::-1]]))
        size = np.concatenate([a[here], a[::-1]])
        mode = force / self.stiffness(size, omega)
        total = mode + self.residual * force
        return xr.Dataset(
            {
                "frequency": ("point", omega / (2 * np.pi), {"units": "Hz"}),
                "modal_amplitude": ("point", size, {"units": "m"}),
                "amplitude": ("point", np.abs(total), {"units": "m"}),
                "phase": ("point", np.angle(total), {"units": "rad"}),
                "stable": ("point", self.slope(size, omega) > 0),
            },
            attrs={"force": force},
        )

    def _top(self, force: float, least: float) -> float:
        """The largest amplitude that the force reaches, at phase resonance: F = m a D(a) sqrt(omega_n^2 - D^2/4)."""
        a = np.linspace(least, float(self.knots[-1]), 2001)
        D = self.damping(a)
        room = force - self.mass * a * D * np.sqrt(np.maximum(self.square(a) - D**2 / 4, 0.0))
        if room[0] < 0:
            return least
        if not (room < 0).any():
            return float(a[-1])
        k = int(np.argmax(room < 0))
        return float(a[k - 1] + (a[k] - a[k - 1]) * room[k - 1] / (room[k - 1] - room[k]))


def interpolation(knots: FloatArray, amplitude: ArrayLike, derivative: int = 0) -> FloatArray:
    """Matrix that takes values at the knots to values (or a derivative) at the amplitudes; cubics are met exactly.

    Outside of the knots the nearest knot's value: nothing was measured there.
    """
    from scipy.interpolate import CubicSpline

    at = np.asarray(amplitude, dtype=np.float64)
    a: Any = np.clip(at, knots[0], knots[-1])
    if len(knots) == 1:
        return np.full((*at.shape, 1), float(derivative == 0))
    found = np.asarray(CubicSpline(knots, np.eye(len(knots)), bc_type="not-a-knot")(a, derivative))
    return np.where((a == at)[..., None], found, 0.0) if derivative else found
