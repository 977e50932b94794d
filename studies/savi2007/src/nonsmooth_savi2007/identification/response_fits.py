r"""Damping from the steady response over frequency, by maximum amplitude as in Fig. 6, with and without dry friction.

Dry friction :math:`F_C` takes per cycle what a viscous damper :math:`4 F_C/(\pi \omega A)` would take. A viscous fit
adds it to c: at resonance, with 36 mm, 5 mN look like 0.04 N s/m (4.5 % of 0.87), and off resonance, where A is
smaller, like more. :func:`viscous_bias` says by how much such a fit is off, for any rig and any crank: in inverse
proportion to the forcing. So the fit of Fig. 6 gives an equivalent c, not the damper's. The fit with friction balances
the first harmonic only: 0.25 % of the amplitude at 0.7 of the natural frequency with 10 mN, less above.

The frequency response fitted as a complex curve: amplitude and phase against the crank together.

.. math::

    X = \frac{\tfrac12 \omega_0^2\, s\, a\, e^{i\theta}}{\omega_0^2 - \omega^2 + i\,[b\,\omega + 4 f/(\pi |X|)]}

The phase tells the natural frequency from the damping without a decay: at :math:`\omega_0` the car lags by a quarter of
a turn whatever the damping is. The photogate's mark, :math:`\theta`, and the drive's size, s, are fitted too; s = 1
says that the driven spring has half of the stiffness and that the crank's length is right. Friction is in first
harmonic, and two crank lengths tell it from damping.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from nonsmooth import SolveError
from nonsmooth.arrays import ComplexArray, FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.evidence import picture_data
from nonsmooth_savi2007.identification.free_decay import DecayFit
from nonsmooth_savi2007.identification.steady import Steady

#: Frequencies relative to the natural one over which Fig. 6 is fitted, where no others are given.
RANGE = (0.55, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.3, 1.45, 1.7)
LEAST, LEAST_COMPLEX = 5, 8  # runs


def grazing_amplitude(omega: Any, crank_length: Any, omega_0: float, b: float, f: float = 0.0) -> FloatArray:
    r"""Amplitude of the steady motion without contact, dry friction in its first harmonic.

    .. math::

        [(\omega_0^2 - \omega^2) A]^2 + [b\,\omega A + 4 f/\pi]^2 = (\tfrac12 \omega_0^2 a)^2

    Where it reaches the gap, the car grazes. Zero where friction holds the car.
    """
    w, a = np.asarray(omega, float), np.asarray(crank_length, float)
    stiff, damp, dry, push = omega_0**2 - w**2, b * w, 4 * f / np.pi, 0.5 * omega_0**2 * a
    square, half = stiff**2 + damp**2, damp * dry
    size = (-half + np.sqrt(np.maximum(half**2 - square * (dry**2 - push**2), 0.0))) / square
    return np.where(push > dry, np.maximum(size, 0.0), 0.0)


def amplitude_fit(seen: Steady, decay: DecayFit, mass: Quantity) -> list[Finding]:
    r"""Fit c to the amplitudes over frequency: viscous only (the paper's way), and with dry friction.

    Parameters
    ----------
    seen : Steady
        Frequency steps without support.
    decay : DecayFit
        Gives :math:`\omega_0` and the start of the fit; c and friction are fitted here.
    mass : Quantity
        Mass (kg) with its standard uncertainty.

    Returns
    -------
    list of Finding
        ``c_viscous_only`` and ``c_response``.

    Raises
    ------
    ValueError
        If there are fewer than five runs.
    """
    _enough(seen, LEAST)
    natural, b, f = decay.law
    # transients, steps of the encoder, the harmonic balance itself: some tenths of a percent of the amplitude
    spread = np.hypot(seen.error, 3e-3 * seen.amplitude)
    both, viscous = (
        _fit(seen.omega, seen.crank, seen.amplitude, spread, natural, start) for start in ((b, max(f, 1e-4)), (b,))
    )
    (c_both, dry), (c_viscous,) = (
        [
            Estimate(*row).times(mass.value, mass.uncertainty, unit)
            for row, unit in zip(fit, ("N s/m", "N"), strict=False)
        ]
        for fit in (both, viscous)
    )
    some = seen.only(seen.crank == np.min(seen.crank))
    fine = np.linspace(some.omega.min(), some.omega.max(), 300)
    joint, plain = (
        grazing_amplitude(fine, some.crank[0], natural, *(value for value, _ in fit)) for fit in (both, viscous)
    )
    data = picture_data(
        some.runs,
        {
            "run": {
                "omega": some.omega,
                "amplitude": some.amplitude,
                "amplitude_error": some.error,
                "direction": [str(run.settings.get("direction", "up")) for run in some.runs],
            },
            "omega_fine": {"omega_fine": fine, "joint_amplitude": joint, "viscous_amplitude": plain},
        },
        c_joint=c_both,
        c_viscous=c_viscous,
    )
    bias = 100 * (c_viscous.value / (mass.value * b) - 1)
    alone = {a: viscous_bias(natural, b, f, a, seen.omega[seen.crank == a]) for a in np.unique(seen.crank).tolist()}
    expected = [f"{1e3 * a:.1f} mm {100 * off:+.1f} %" for a, off in alone.items()]
    return [
        Finding(
            "c_viscous_only",
            c_viscous,
            "maximum amplitude over frequency, viscous only (Fig. 6)",
            seen.samples,
            seen.names,
            (
                f"an equivalent, not the damper's c: dry friction of {1e3 * mass.value * f:.1f} mN adds "
                f"4 F_C/(pi omega A) to it; {bias:+.1f} % against the free decay",
                f"what friction of this size does to such a fit by itself, at a crank of: {', '.join(expected)}",
            ),
            data=data,
            plot="amplitude_fit",
        ),
        Finding(
            "c_response",
            c_both,
            "amplitude over frequency, viscous damping and dry friction in first harmonic",
            seen.samples,
            seen.names,
            others={"friction": dry},
            data=data,
            plot="amplitude_fit",
        ),
    ]


def viscous_bias(omega_0: float, b: float, f: float, crank_length: float, omega: Any = None) -> float:
    r"""Relative error of c in a viscous-only fit of the amplitudes, as Fig. 6, by dry friction alone.

    Parameters
    ----------
    omega_0, b, f : float
        Natural frequency (rad/s), c/m (1/s), friction over mass (N/kg).
    crank_length : float
        Length of the crank (m), :math:`\rho = k a`.
    omega : array, optional
        Frequencies of the fit (rad/s); 0.55 to 1.7 of the natural one where not given.

    Notes
    -----
    The amplitudes are those of the harmonic balance of friction, without noise; every one has the same relative weight.
    """
    at = np.asarray([r * omega_0 for r in RANGE] if omega is None else omega, float)
    amplitude = grazing_amplitude(at, crank_length, omega_0, b, f)
    moving = amplitude > 0
    if not moving.any():
        raise ValueError("this friction holds the car at all frequencies: the crank is too short")
    ((fitted, _),) = _fit(at[moving], crank_length, amplitude[moving], 3e-3 * amplitude[moving], omega_0, (b,))
    return fitted / b - 1


def _fit(
    omega: FloatArray, crank: Any, amplitude: FloatArray, spread: FloatArray, natural: float, start: tuple[float, ...]
) -> list[tuple[float, float]]:
    """Values of b, and of f where the start has one, each with its standard error."""
    fitted = nonlinear_fit(
        lambda p: (grazing_amplitude(omega, crank, natural, *p) - amplitude) / spread,
        start,
        (1e-6, -np.inf)[: len(start)],
    )
    if fitted is None:
        raise SolveError("the fit of the amplitudes did not settle; look at them over frequency")
    values, covariance = fitted
    return list(zip(values.tolist(), np.sqrt(np.diag(covariance)).tolist(), strict=True))


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
    w = np.asarray(omega, float)
    size = grazing_amplitude(w, scale * crank_length, omega_0, b, f)
    # in phase with -x the springs and the inertia, in phase with -v the losses
    lag = np.arctan2(b * w * size + 4 * f / np.pi, (omega_0**2 - w**2) * size)
    return size * np.exp(1j * (mark - lag))


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
    _enough(seen, LEAST_COMPLEX)
    longest = seen.crank == seen.crank.max()
    values, covariance = _complex_fit(seen, decay)
    doubt = ""
    if not longest.all() and np.count_nonzero(longest) >= LEAST_COMPLEX:
        # friction matters least at the longest crank: how far the estimate moves with it alone is what its law is worth
        moved = _complex_fit(seen.only(longest), decay)[0] - values
        covariance = covariance + np.outer(moved, moved)
        doubt = "; how far the fit moves with the longest crank alone is added to it"
    b, natural, *others = values.tolist()
    fine, lengths = np.linspace(seen.omega.min(), seen.omega.max(), 400), np.unique(seen.crank)
    curves = np.array([receptance(fine, a, natural, b, *others) / a for a in lengths])
    ratio = seen.response / seen.crank
    factor = np.array([mass.value, 1.0, mass.value, 1.0, 1.0])
    by_mass = mass.uncertainty * values * [1, 0, 1, 0, 0]
    values, covariance = factor * values, covariance * np.outer(factor, factor) + np.outer(by_mass, by_mass)
    errors = np.sqrt(np.diag(covariance))
    units = ("N s/m", "rad/s", "N", "", "rad")
    rows = [Estimate(*row) for row in zip(values, errors, units, strict=True)]
    return Finding(
        "c_frequency_response",
        rows[0],
        "complex frequency response, amplitude and phase against the photogate, with dry friction",
        seen.samples,
        seen.names,
        (
            f"the drive is {values[3]:.4f} times what the crank's length says, its mark stands at {values[4]:+.4f} rad",
            f"uncertainty by the residuals' own scatter; friction in first harmonic only{doubt}",
        ),
        dict(zip(("omega_0", "friction", "drive_scale", "mark"), rows[1:], strict=True)),
        covariance,
        picture_data(
            seen.runs,
            {
                "run": {"crank": seen.crank, "real": ratio.real, "imaginary": ratio.imag},
                ("crank_length", "omega_fine"): {"fitted_real": curves.real, "fitted_imaginary": curves.imag},
                "crank_length": {"crank_length": lengths},
            },
            omega_0=rows[1],
            c=rows[0],
        ),
        "nyquist",
    )


def _complex_fit(seen: Steady, decay: DecayFit) -> tuple[FloatArray, FloatArray]:
    """Values and covariance of b, omega_0, f, scale and mark."""
    # the balance of friction leaves out its third harmonic; transients leave some tenths of a percent
    spread = np.hypot(seen.error, 1e-3 * seen.amplitude)
    natural, b, f = decay.law

    def residual(p: FloatArray) -> FloatArray:
        b, natural, *others = p
        left = (seen.response - receptance(seen.omega, seen.crank, natural, b, *others)) / spread
        return np.concatenate([left.real, left.imag])

    start = (b, natural, max(f, 1e-4), 1.0, crank_mark(seen, decay))
    fitted = nonlinear_fit(residual, start, (1e-6, 1e-6, -0.1, 0.1, -np.inf))
    if fitted is None or not np.isfinite(fitted[1]).all():
        raise SolveError("the fit of the complex response did not settle; look at the runs' amplitudes over frequency")
    return fitted


def nonlinear_fit(
    residual: Callable[[FloatArray], FloatArray], start: Any, lower: Any
) -> tuple[FloatArray, FloatArray] | None:
    r"""Values and covariance of parameters, by weighted residuals whose common scale is taken from themselves.

    .. math::

        C = (J^T J)^{-1} \frac{r^T r}{n - p}

    Parameters
    ----------
    residual : callable
        The n residuals, each over its standard uncertainty (or in proportion to it), at values of the p parameters.
    start, lower : array (p,)
        Where to begin, and lower bounds (-inf: none).

    Returns
    -------
    tuple of array (p,) and array (p, p), or None
        None where the iteration does not converge. Variances are infinite where the data do not tell the parameters
        apart.
    """
    begin = np.asarray(start, float)
    size = np.where(begin != 0, np.abs(begin), 1.0)  # the steps of its differences are relative to numbers of order 1
    found = least_squares(
        lambda scaled: residual(scaled * size),
        begin / size,
        jac="3-point",
        bounds=(np.asarray(lower) / size, np.inf),
        x_scale="jac",
        ftol=1e-12,
        xtol=1e-12,
        gtol=1e-12,
    )
    n, p = found.jac.shape
    if not found.success or n <= p:
        return None
    scale = np.linalg.norm(found.jac, axis=0)
    if not np.all(scale > 0) or np.linalg.cond(found.jac / scale) > 1 / np.sqrt(np.finfo(float).eps):
        return found.x * size, np.diag(np.full(p, np.inf))
    inverse = np.linalg.pinv(found.jac / scale)
    covariance = inverse @ inverse.T / np.outer(scale, scale) * (2 * found.cost / (n - p))
    return found.x * size, covariance * np.outer(size, size)


def crank_mark(seen: Steady, decay: DecayFit) -> float:
    """Return the crank's angle at the photogate (rad): the mean angle between what is seen and what 0 would give.

    Angles count from where the crank pulls the car towards the support. A motor on the other side has the same mark at
    half a turn.
    """
    return np.angle(np.sum(seen.response * np.conj(receptance(seen.omega, seen.crank, *decay.law))))


def _enough(seen: Steady, least: int) -> None:
    if len(seen) < least:
        raise ValueError(f"{len(seen)} runs of the response are too few to fit a damping to; {least} are needed")
