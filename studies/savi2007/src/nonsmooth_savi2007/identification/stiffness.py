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
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.identification import Estimate, Finding, uniform
from nonsmooth.recordings.signals.savitzky_golay import savitzky_golay
from nonsmooth_savi2007.arrays import FloatArray
from nonsmooth_savi2007.identification.evidence import Run
from nonsmooth_savi2007.identification.least_squares import linear_law
from nonsmooth_savi2007.identification.picture_data import picture_data

if TYPE_CHECKING:
    import xarray as xr

_WINDOW, _ORDER = 21, 4  # samples: follows a hand's tremor, 3 Hz, to 1 %


def stiffness(
    runs: Sequence[Run],
    *,
    resolution: float,
    mass: float = 0.0,
    gain_limit: float = 0.01,
    friction: bool = True,
    name: str = "stiffness",
) -> Finding:
    r"""Slope of force against displacement, over all runs together.

    Parameters
    ----------
    runs : sequence of Run
        Each with ``x`` and ``force`` over the same times.
    resolution : float
        Length of a count (m); its variance is that of :math:`\delta^2 / 12`, projected by the slope.
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
    rows = [_columns(run, resolution, mass, friction) for run in runs]
    lengths = [len(row[1]) for row in rows]
    width = 2 + friction  # slope, damping, friction; then one intercept per run
    columns = np.zeros((sum(lengths), width + len(rows)))
    force = np.concatenate([row[1] for row in rows])
    begin = 0
    for i, (part, _) in enumerate(rows):
        columns[begin : begin + lengths[i], :width] = part
        columns[begin : begin + lengths[i], width + i] = 1.0
        begin += lengths[i]
    if np.ptp(columns[:, 0]) < 50 * resolution:
        raise ValueError(f"{name}: the displacement changes by less than 50 counts in all runs; pull farther")
    noise, slope = 1.0, 0.0
    law = linear_law(columns, force, noise, lengths)
    for _ in range(3):
        slope = float(law.values[0])
        # the force's own variance is what its residuals leave after the count's, projected by the slope
        projected = slope**2 * resolution**2 / 12
        noise = max(float(np.var(law.residuals)) - projected, 0.1 * float(np.var(law.residuals)))
        law = linear_law(columns, force, noise + projected, lengths)
    slope, error = float(law.values[0]), float(np.sqrt(law.covariance[0, 0]))
    half = gain_limit * slope
    others = {
        "slope_a": Estimate(slope, error, "N/m"),
        "damping": Estimate(float(law.values[1]), float(np.sqrt(law.covariance[1, 1])), "N s/m"),
    }
    if friction:
        others["friction_force"] = Estimate(float(law.values[2]), float(np.sqrt(law.covariance[2, 2])), "N")
    notes = [
        f"type A {error:.2g} N/m; type B {uniform(half):.2g} N/m, the sensor's gain within ±{100 * gain_limit:g} %, "
        "common to all forces of this sensor",
    ]
    if mass:
        notes.append(f"the inertia of {mass:.4g} kg under the hand is put back")
    return Finding(
        name,
        Estimate(slope, float(np.hypot(error, uniform(half))), "N/m", half_width=half),
        "force against displacement, errors in both axes by effective variance, loop and inertia as terms (Fig. 4)",
        len(force),
        tuple(run.name for run in runs),
        tuple(notes),
        others,
        data=_data(runs, rows, law.values, law.covariance, width, friction),
        plot="force_displacement",
    )


def _columns(run: Run, resolution: float, mass: float, friction: bool) -> tuple[FloatArray, FloatArray]:
    time, force_time = run.time, np.asarray(run.force["time"].values, dtype=np.float64)
    if len(time) != len(force_time) or np.max(np.abs(time - force_time)) > 1e-6:
        raise ValueError(
            f"{run.label}: channels 'Angle' and 'Force' are not over the same times; record both at one rate"
        )
    smooth = savitzky_golay(time, run.x, resolution=resolution, window=_WINDOW, order=_ORDER)
    v, a = smooth["v"].values, smooth["a"].values
    force = np.asarray(run.force.values, dtype=np.float64) - mass * a
    parts = [run.positions, v]
    inside = np.ones(len(time), dtype=bool)
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


def _data(
    runs: Sequence[Run], rows: Any, values: FloatArray, covariance: FloatArray, width: int, friction: bool
) -> xr.Dataset:

    x = np.concatenate([part[:, 0] for part, _ in rows])
    pull = np.concatenate([np.sign(part[:, 1]) for part, _ in rows])
    number = np.concatenate([np.full(len(force), i) for i, (_, force) in enumerate(rows)])
    force = np.concatenate([force for _, force in rows])
    lines = [(i, s) for i in range(len(rows)) for s in ((1.0, -1.0) if friction else (0.0,))]
    loop = float(values[2]) if friction else 0.0
    return picture_data(
        runs,
        {
            "sample": {"displacement": x, "force": force, "run": number, "pull": pull},
            "line": {
                "slope": np.full(len(lines), values[0]),
                "slope_error": np.full(len(lines), np.sqrt(covariance[0, 0])),
                "intercept": np.array([values[width + i] + s * loop for i, s in lines]),
                "line_run": np.array([i for i, _ in lines]),
                "line_pull": np.array([s for _, s in lines]),
            },
        },
        **({"friction_force": Estimate(loop, float(np.sqrt(covariance[2, 2])), "N")} if friction else {}),
    )
