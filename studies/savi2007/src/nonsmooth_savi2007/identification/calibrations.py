r"""Calibrations of the drive (Fig. 8): the motor's frequency over its voltage, the force over the crank's length.

A motor turns from an offset on, :math:`\omega = s\,(V - V_0)`: friction in it takes the first volt. The car held still
feels :math:`k\,d(\varphi)`, whose fundamental is :math:`k a`: a string of length L adds to the mean and to the second
harmonic only, uneven turning :math:`\epsilon` changes the fundamental by :math:`\epsilon^2/4` and by
:math:`a\,\epsilon/(4L)` of it, 0.1 % together at worst (:math:`\epsilon` = 0.02, a = 60 mm, L = 0.5 m). A crank's
length that is counted from a wrong zero shows as an intercept.

Both are straight lines with errors in both axes: what the notebook's voltages and lengths are rounded to is theirs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ndtri

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth_savi2007.identification.evidence import Run
from nonsmooth_savi2007.identification.steady import harmonics_of


def scattered_line(x: FloatArray, y: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """The weighted line through points that scatter more than their errors say: with the scatter they have in common.

    Returns slope and intercept, their covariance, and that scatter, the standard deviation s in y which, added to every
    error, brings chi^2 to its expectation; 0 where the errors do. Widening all errors by one factor instead would leave
    the weight with the points whose own errors are smallest.

    References: R.C. Paule and J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377.
    """

    def fitted(s: float) -> tuple[FloatArray, FloatArray, float]:
        weight = 1.0 / np.hypot(error, s)
        line, covariance = np.polyfit(x, y, 1, w=weight, cov="unscaled")
        return line, covariance, np.sum((weight * (y - np.polyval(line, x))) ** 2) / max(len(x) - 2, 1) - 1.0

    line, covariance, excess = fitted(0.0)
    if len(y) < 3 or excess <= 0:
        return line, covariance, 0.0
    high = np.std(y - np.polyval(np.polyfit(x, y, 1), x)) * np.sqrt(len(y)) + error.max()
    s = brentq(lambda s: fitted(s)[2], 0.0, high, xtol=1e-4 * high)
    return *fitted(s)[:2], s


def voltage_frequency(runs: Sequence[Run]) -> Finding:
    r"""The law :math:`\omega = s (V - V_0)` of the motor, from runs with a photogate at several voltages (Fig. 8a).

    Parameters
    ----------
    runs : sequence of Run
        Each with ``turns`` and the setting ``voltage`` (V).

    Returns
    -------
    Finding
        The slope s in rad/(s V). ``others``: ``offset`` (V), where the motor begins to turn, and ``intercept``
        (rad/s). ``covariance`` is that of slope, offset and intercept.

    Raises
    ------
    ValueError
        If there are fewer than three different voltages.
    """
    volts = np.array([run.settings["voltage"] for run in runs])
    drives = [run.drive for run in runs]
    omega = np.array([drive.omega for drive in drives])
    error = np.array([drive.omega_error for drive in drives])
    (slope, intercept), known, scattered, data = _calibrated(
        "voltages", runs, volts, omega, error, ("motor voltage", "V"), ("frequency", "rad/s")
    )
    offset = -intercept / slope
    # of slope, offset and intercept
    jacobian = np.array([[1.0, 0.0], [intercept / slope**2, -1 / slope], [0.0, 1.0]])
    covariance = jacobian @ known @ jacobian.T
    errors = np.sqrt(np.diag(covariance))
    notes = [f"the motor turns from {offset:.3f} V on; omega = {slope:.5g} rad/(s V) x (V - {offset:.4g} V)"]
    return Finding(
        "voltage_frequency",
        Estimate(slope, errors[0], "rad/(s V)"),
        "straight line with an offset through the frequencies that the photogate tells (Fig. 8a)",
        sum(len(run.passages) for run in runs),
        tuple(run.name for run in runs),
        (*notes, *scattered),
        {
            "offset": Estimate(offset, errors[1], "V"),
            "intercept": Estimate(intercept, errors[2], "rad/s"),
        },
        covariance,
        data,
        "calibration",
    )


def crank_force(runs: Sequence[Run], *, gain_limit: float = 0.01, k: Estimate | None = None) -> Finding:
    r"""The forcing over the crank's length, :math:`\rho = k a`: its slope is the driven spring's stiffness (Fig. 8b).

    Parameters
    ----------
    runs : sequence of Run
        Car held still by the force sensor; each with ``force``, ``turns`` and the setting ``crank_length`` (m).
    gain_limit : float
        The sensor's gain lies within 1 +- this, evenly (type B).
    k : Estimate, optional
        The stiffness from elsewhere: a note says whether the two agree.

    Returns
    -------
    Finding
        The slope in N/m. ``others``: ``slope_a``, with its type-A uncertainty only, and ``intercept`` (N).

    Raises
    ------
    ValueError
        If there are fewer than three different lengths, or a run is shorter than two turns.
    """
    length = np.array([run.crank for run in runs])
    force, error = np.zeros(len(runs)), np.zeros(len(runs))
    for i, run in enumerate(runs):
        fitted, *_ = harmonics_of(run, run.force)
        force[i], error[i] = fitted.amplitudes[0], fitted.amplitude_errors[0]
    (slope, intercept), known, scattered, data = _calibrated(
        "crank lengths", runs, length, force, error, ("crank length", "m"), ("forcing amplitude", "N")
    )
    (type_a, type_b), half = np.sqrt(np.diag(known)), gain_limit * slope
    total = np.hypot(type_a, uniform(half))
    notes = [
        f"type A {type_a:.2g} N/m; type B {uniform(half):.2g} N/m, the sensor's gain within ±{100 * gain_limit:g} %",
        f"rho = 0.14 N is a crank of {1e3 * (0.14 - intercept) / slope:.2f} mm",
    ]
    if k is not None:
        off = (slope - k.value) / np.hypot(total, k.uncertainty)
        notes.append(f"k = {k} from elsewhere: {100 * (slope / k.value - 1):+.2f} %, {abs(off):.1f} uncertainties")
    return Finding(
        "crank_force",
        Estimate(slope, total, "N/m", half_width=half),
        "straight line through the fundamentals of the force on the held car (Fig. 8b)",
        sum(run.force.size for run in runs),
        tuple(run.name for run in runs),
        (*notes, *scattered),
        {
            "slope_a": Estimate(slope, type_a, "N/m"),
            "intercept": Estimate(intercept, type_b, "N"),
        },
        data=data,
        plot="calibration",
    )


def _calibrated(
    settings: str,
    runs: Sequence[Run],
    setting: FloatArray,
    reading: FloatArray,
    error: FloatArray,
    named: tuple[str, str],
    read: tuple[str, str],
) -> tuple[FloatArray, FloatArray, list[str], xr.Dataset]:
    """The line with its covariance, a sentence where points scatter, and its picture: name and unit of both axes."""
    if (n := len(np.unique(setting))) < 3:
        raise ValueError(f"a calibration needs runs at three different {settings} or more, got {n}")
    line, covariance, scatter = scattered_line(setting, reading, error)
    notes = []
    if scatter > 2 * np.median(error):
        notes.append(
            f"the points scatter by {scatter:.2g} {read[1]} about the line, more than their own errors of "
            f"{np.median(error):.2g} {read[1]}; it is taken as common to all"
        )
    fine = np.linspace(min(setting.min(), 0.0), setting.max(), 200)
    rows = np.column_stack([fine, np.ones_like(fine)])
    reach = ndtri(0.975) * np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows))
    fitted, errors = rows @ line, np.sqrt(np.diag(covariance))
    unit, over = ({"units": units, "long_name": name} for name, units in (read, named))
    data = xr.Dataset(
        {
            "setting": ("run", setting, over),
            "reading": ("run", reading, unit),
            "reading_error": ("run", np.hypot(error, scatter), unit),
            "fitted": ("setting_fine", fitted, unit),
            "fitted_low": ("setting_fine", fitted - reach, unit),
            "fitted_high": ("setting_fine", fitted + reach, unit),
            "slope": ((), line[0]),
            "slope_error": ((), errors[0]),
            "intercept": ((), line[1], unit),
            "intercept_error": ((), errors[1], unit),
        },
        {"setting_fine": ("setting_fine", fine, over)},
        {"synthetic": "yes" if any(run.synthetic for run in runs) else "no"},
    )
    return line, covariance, notes, data
