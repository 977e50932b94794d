r"""Lines through readings: calibrations of the drive (Fig. 8), stiffness from force against displacement (Fig. 4).

**Calibrations.** The motor's frequency over its voltage, the force over the crank's length.

A motor turns from an offset on, :math:`\omega = s\,(V - V_0)`: friction in it takes the first volt. The car held still
feels :math:`k\,d(\varphi)`, whose fundamental is :math:`k a`: a string of length L adds to the mean and to the second
harmonic only, uneven turning :math:`\epsilon` changes the fundamental by :math:`\epsilon^2/4` and by
:math:`a\,\epsilon/(4L)` of it, 0.1 % together at worst (:math:`\epsilon` = 0.02, a = 60 mm, L = 0.5 m). A crank's
length that is counted from a wrong zero shows as an intercept.

Both are straight lines with errors in both axes: what the notebook's voltages and lengths are rounded to is theirs.

**Stiffness.** By slow pulls, both sensors in error. The hand prescribes the motion, and the sensor feels

.. math::

    F = (1 + \gamma)\,[\,S x + F_C\, \mathrm{sign}\, v + c v + m a + F_0\,]

so a line through the points alone is wrong twice. Friction and damping open a loop, which a term for each closes. And a
pull that takes T seconds there and back, like :math:`\sin^2(\pi t/T)`, has :math:`a = -(2\pi/T)^2 (x - x_{max}/2)`: its
inertia takes :math:`m (2\pi/T)^2` off the slope, 0.23 N/m or 1.4 % for a pull of 12 s. With m from the scale and a from
the record it is put back. The gain :math:`\gamma` is common to all slopes. It enters no scatter: a type-B uncertainty,
shared by k, k_s and what is derived from them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from scipy.linalg import block_diag
from scipy.optimize import brentq
from scipy.special import ndtri

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, correlated, uniform
from nonsmooth.recordings.signals.smoothing import savitzky_golay
from nonsmooth_savi2007.identification.evidence import Run, picture_data
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
        fitted = harmonics_of(run, run.force)
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


_WINDOW, _ORDER = 21, 4  # samples: follows a hand's tremor, 3 Hz, to 1 %


def stiffness(
    runs: Sequence[Run],
    *,
    mass: float = 0.0,
    gain_limit: float = 0.01,
    friction: bool = True,
    name: str = "stiffness",
) -> Finding:
    r"""Slope of force against displacement, over all runs together.

    Parameters
    ----------
    runs : sequence of Run
        Each with ``x`` and ``force`` over the same times. All samples weigh the same: a count of the position stands
        for the same force everywhere.
    mass : float
        Mass that the hand accelerates (kg); 0 for a massless spring.
    gain_limit : float
        The sensor's gain lies within 1 +- this, evenly.
    friction : bool
        Whether dry friction acts: a term with the direction of the pull.
    name : str
        Name of the finding.

    Returns
    -------
    Finding
        The slope S in N/m. ``others``: ``slope_a``, the same with its type-A uncertainty only; ``friction_force`` (N)
        and ``damping`` (N s/m) from the loop's width.

    Raises
    ------
    ValueError
        If a run's force and displacement are not over the same times, or the pull is too short to tell a slope.
    """
    rows, resolution = [_columns(run, mass, friction) for run in runs], runs[0].resolution
    lengths = [len(force) for _, force in rows]
    terms, force = np.concatenate([part for part, _ in rows]), np.concatenate([force for _, force in rows])
    if np.ptp(terms[:, 0]) < 50 * resolution:
        raise ValueError(f"{name}: the displacement changes by less than 50 counts in all runs; pull farther")
    columns = np.hstack([terms, block_diag(*(np.ones((n, 1)) for n in lengths))])  # an intercept for each run
    values = np.asarray(np.linalg.lstsq(columns, force, rcond=None)[0])
    covariance = correlated(columns, force - columns @ values, lengths)
    errors = np.sqrt(np.diag(covariance))
    slope, error = values[0], errors[0]
    half = gain_limit * slope
    names = (("slope_a", "N/m"), ("damping", "N s/m"), ("friction_force", "N"))[: terms.shape[1]]
    others = {key: Estimate(v, e, unit) for (key, unit), v, e in zip(names, values, errors, strict=False)}
    notes = [
        f"type A {error:.2g} N/m; type B {uniform(half):.2g} N/m, the sensor's gain within ±{100 * gain_limit:g} %, "
        "common to all forces of this sensor",
    ]
    if mass:
        notes.append(f"the inertia of {mass:.4g} kg under the hand is put back")
    ways = (1.0, -1.0) if friction else (0.0,)
    loop = values[2] if friction else 0.0
    data = picture_data(
        runs,
        {
            "sample": {
                "displacement": terms[:, 0],
                "force": force,
                "pull": np.sign(terms[:, 1]),
            },
            "line": {
                "slope": np.full(len(runs) * len(ways), slope),
                "slope_error": np.full(len(runs) * len(ways), error),
                "intercept": np.add.outer(values[terms.shape[1] :], np.multiply(ways, loop)).ravel(),
            },
        },
        **{key: one for key, one in others.items() if key == "friction_force"},
    )
    return Finding(
        name,
        Estimate(slope, np.hypot(error, uniform(half)), "N/m", half_width=half),
        "force against displacement, loop and inertia as terms, residuals correlated within each record (Fig. 4)",
        len(force),
        tuple(run.name for run in runs),
        tuple(notes),
        others,
        data=data,
        plot="force_displacement",
    )


def _columns(run: Run, mass: float, friction: bool) -> tuple[FloatArray, FloatArray]:
    time, force_time = run.time, run.force["time"].values
    if len(time) != len(force_time) or np.max(np.abs(time - force_time)) > 1e-6:
        raise ValueError(
            f"{run.label}: channels 'Angle' and 'Force' are not over the same times; record both at one rate"
        )
    smooth = savitzky_golay(time, run.x, resolution=run.resolution, window=_WINDOW, order=_ORDER)
    v, a = smooth["v"].values, smooth["a"].values
    force = run.force.values - mass * a
    parts = [run.positions, v]
    inside = np.ones(len(time), bool)
    if friction:
        parts.append(np.sign(v))
        # where the hand turns, the direction is not known
        inside = np.abs(v) > 3e-3
        if np.count_nonzero(inside) < 50:
            raise ValueError(
                f"{run.label}, channel 'Angle': the hand moves faster than 3 mm/s in {np.count_nonzero(inside)} "
                "samples only, and 50 are needed: pull farther or faster, or record longer"
            )
    return np.array(parts).T[inside], force[inside]
