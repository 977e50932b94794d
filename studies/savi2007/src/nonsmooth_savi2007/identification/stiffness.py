r"""Stiffness from force against displacement, as Fig. 4 of the paper: slow pulls, both sensors in error.

The hand prescribes the motion, and the sensor feels

.. math::

    F = (1 + \gamma)\,[\,S x + F_C\, \mathrm{sign}\, v + c v + m a + F_0\,]

so a line through the points alone is wrong twice. Friction and damping open a loop, which a term for each closes. And a
pull that takes T seconds there and back, like :math:`\sin^2(\pi t/T)`, has :math:`a = -(2\pi/T)^2 (x - x_{max}/2)`: its
inertia takes :math:`m (2\pi/T)^2` off the slope, 0.23 N/m or 1.4 % for a pull of 12 s. With m from the scale and a from
the record it is put back.

The gain :math:`\gamma` is common to all slopes. It enters no scatter: a type-B uncertainty, shared by k, k_s and what
is derived from them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding, correlated, uniform
from nonsmooth.recordings.signals.smoothing import savitzky_golay
from nonsmooth_savi2007.identification.evidence import Run
from nonsmooth_savi2007.identification.picture_data import picture_data

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
    number, ways = np.arange(len(runs)), (1.0, -1.0) if friction else (0.0,)
    loop = values[2] if friction else 0.0
    data = picture_data(
        runs,
        {
            "sample": {
                "displacement": terms[:, 0],
                "force": force,
                "run": np.repeat(number, lengths),
                "pull": np.sign(terms[:, 1]),
            },
            "line": {
                "slope": np.full(len(runs) * len(ways), slope),
                "slope_error": np.full(len(runs) * len(ways), error),
                "intercept": np.add.outer(values[terms.shape[1] :], np.multiply(ways, loop)).ravel(),
                "line_run": np.repeat(number, len(ways)),
                "line_pull": np.tile(ways, len(runs)),
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
