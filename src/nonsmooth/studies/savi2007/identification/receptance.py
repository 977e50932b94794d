r"""The frequency response fitted as a complex curve: amplitude and phase against the crank together.

.. math::

    X = \frac{\tfrac12 \omega_0^2\, s\, a\, e^{i\theta}}{\omega_0^2 - \omega^2 + i\,[b\,\omega + 4 f/(\pi |X|)]}

The phase tells the natural frequency from the damping without a decay: at :math:`\omega_0` the car lags by a quarter of
a turn whatever the damping is. The photogate's mark, :math:`\theta`, and the drive's size, s, are fitted too; s = 1
says that the driven spring has half of the stiffness and that the crank's length is right. Friction is in first
harmonic, and two crank lengths tell it from damping.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nonsmooth import SolveError
from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth.studies.savi2007.identification.free_decay import DecayFit
from nonsmooth.studies.savi2007.identification.gap import grazing_amplitude
from nonsmooth.studies.savi2007.identification.nonlinear_fit import nonlinear_fit
from nonsmooth.studies.savi2007.identification.steady import Steady

__all__ = ["crank_mark", "receptance", "receptance_fit"]

LEAST = 8  # runs


def receptance(
    omega: Any, crank_length: Any, omega_0: float, b: float, f: float = 0.0, scale: float = 1.0, mark: float = 0.0
) -> ComplexArray:
    r"""The complex amplitude X (m) of the car, :math:`x = \mathrm{Re}\, X e^{i\omega t}`.

    Parameters
    ----------
    omega, crank_length : array (n,)
        Frequency of the drive (rad/s) and length of the crank (m).
    omega_0, b, f : float
        Natural frequency (rad/s), c/m (1/s), friction over mass (N/kg), which is balanced in first harmonic.
    scale, mark : float
        Of the drive, and the crank's angle at the photogate (rad).
    """
    w, a = np.broadcast_arrays(np.asarray(omega, dtype=np.float64), np.asarray(crank_length, dtype=np.float64))
    size = np.array([grazing_amplitude(float(u), omega_0, b, f, scale * float(v)) for u, v in zip(w, a, strict=True)])
    # in phase with -x the springs and the inertia, in phase with -v the losses
    lag = np.arctan2(b * w * size + 4 * f / np.pi, (omega_0**2 - w**2) * size)
    return np.asarray(size * np.exp(1j * (mark - lag)))


def receptance_fit(seen: Steady, decay: DecayFit, mass: Quantity) -> Finding:
    r"""Fit damping, natural frequency, dry friction, the drive's size and the mark to the complex response.

    Parameters
    ----------
    seen : Steady
        Frequency steps without support.
    decay : DecayFit
        Only the start of the fit.
    mass : Quantity
        Mass (kg) with its standard uncertainty.

    Returns
    -------
    Finding
        c (N s/m). ``others``: ``omega_0`` (rad/s), ``friction`` (N), ``drive_scale``, ``mark`` (rad); ``covariance`` is
        that of all five.

    Raises
    ------
    ValueError
        If there are fewer than eight runs.
    """
    if len(seen) < LEAST:
        raise ValueError(f"{len(seen)} runs of the response are too few for a complex fit; {LEAST} are needed")
    longest = seen.crank == seen.crank.max()
    values, covariance = _fit(seen, decay)
    doubt = ""
    if not longest.all() and np.count_nonzero(longest) >= LEAST:
        # friction matters least at the longest crank: how far the estimate moves with it alone is what its law is worth
        moved = _fit(seen.only(longest), decay)[0] - values
        covariance = covariance + np.outer(moved, moved)
        doubt = "; how far the fit moves with the longest crank alone is added to it"
    factor = np.array([mass.value, 1.0, mass.value, 1.0, 1.0])
    by_mass = mass.uncertainty * values * [1, 0, 1, 0, 0]
    values, covariance = factor * values, covariance * np.outer(factor, factor) + np.outer(by_mass, by_mass)
    errors = np.sqrt(np.diag(covariance))
    units = ("N s/m", "rad/s", "N", "", "rad")
    rows = [Estimate(float(v), float(e), unit) for v, e, unit in zip(values, errors, units, strict=True)]
    return Finding(
        "c_frequency_response", rows[0],
        "complex frequency response, amplitude and phase against the photogate, with dry friction",
        seen.samples, seen.names,
        (
            f"the drive is {values[3]:.4f} times what the crank's length says, its mark stands at {values[4]:+.4f} rad",
            f"uncertainty by the residuals' own scatter; friction in first harmonic only{doubt}",
        ),
        dict(zip(("omega_0", "friction", "drive_scale", "mark"), rows[1:], strict=True)), covariance,
        _data(seen, rows, mass.value), "nyquist",
    )  # fmt: skip


def _fit(seen: Steady, decay: DecayFit) -> tuple[FloatArray, FloatArray]:
    """Values and covariance of b, omega_0, f, scale and mark."""
    # the balance of friction leaves out its third harmonic; transients leave some tenths of a percent
    spread = np.hypot(seen.error, 1e-3 * seen.amplitude)
    natural, b, f = (float(value) for value in decay.values[:3])
    start = (b, natural, max(f, 1e-4), 1.0, crank_mark(seen, decay))

    def residual(p: FloatArray) -> FloatArray:
        b, natural, f, scale, mark = p
        left = (seen.response - receptance(seen.omega, seen.crank, natural, b, f, scale, mark)) / spread
        return np.concatenate([left.real, left.imag])

    fitted = nonlinear_fit(residual, start, (1e-6, 1e-6, -0.1, 0.1, -np.inf))
    if fitted is None or not np.isfinite(fitted[1]).all():
        raise SolveError("the fit of the complex response did not settle; look at the runs' amplitudes over frequency")
    return fitted


def crank_mark(seen: Steady, decay: DecayFit) -> float:
    """Return the crank's angle at the photogate (rad): the mean angle between what is seen and what 0 would give.

    Angles count from where the crank pulls the car towards the support. A motor on the other side has the same mark at
    half a turn.
    """
    expected = receptance(seen.omega, seen.crank, *(float(v) for v in decay.values[:3]))
    return float(np.angle(np.sum(seen.response * np.conj(expected))))


def _data(seen: Steady, rows: list[Estimate], mass: float) -> Any:
    import xarray as xr

    c, natural, friction, scale, mark = (row.value for row in rows)
    fine, lengths = np.linspace(seen.omega.min(), seen.omega.max(), 400), np.unique(seen.crank)
    curves = np.array([receptance(fine, a, natural, c / mass, friction / mass, scale, mark) / a for a in lengths])
    ratio = seen.response / seen.crank
    return xr.Dataset(
        {
            "omega": ("run", seen.omega, {"units": "rad/s"}), "crank": ("run", seen.crank, {"units": "m"}),
            "real": ("run", ratio.real), "imaginary": ("run", ratio.imag), "error": ("run", seen.error / seen.crank),
            "fitted_real": (("crank_length", "omega_fine"), curves.real),
            "fitted_imaginary": (("crank_length", "omega_fine"), curves.imag),
            "omega_0": ((), natural, {"units": "rad/s"}), "omega_0_error": ((), rows[1].uncertainty),
            "c": ((), c, {"units": "N s/m"}), "c_error": ((), rows[0].uncertainty),
        },
        {
            "omega_fine": ("omega_fine", fine, {"units": "rad/s"}),
            "crank_length": ("crank_length", lengths, {"units": "m"}),
        },
        {"synthetic": seen.synthetic},
    )  # fmt: skip
