r"""Damping from free decays, viscous and dry told apart: the finding and the heights of its turning points.

From a height h the car swings about :math:`\pm\delta`, :math:`\delta = f/\omega_0^2`, and turns at
:math:`q (h - \delta) - \delta` on the other side, :math:`q = e^{-\pi b/(2\omega_d)}`. The heights therefore lie on

.. math::

    h(t) = (h_0 + h_*)\, e^{-b t/2} - h_*, \qquad h_* = \delta\,\frac{1 + q}{1 - q},

a straight line in the logarithm where there is no friction, bent down towards the end where there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth.studies.savi2007.identification.evidence import Run
from nonsmooth.studies.savi2007.identification.free_decay import DecayFit
from nonsmooth.studies.savi2007.identification.support_damping import decay_rate, log_decrement

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["decay_damping", "envelope"]


def envelope(time: FloatArray, first: float, omega_0: float, b: float, f: float) -> FloatArray:
    """Heights of the turning points of a free decay (m) over the time since the first of height ``first``.

    Zero from where friction holds the car.
    """
    q = np.exp(-np.pi * b / (2 * np.sqrt(omega_0**2 - b**2 / 4)))
    below = f / omega_0**2 * (1 + q) / (1 - q)
    return np.maximum((first + below) * np.exp(-b * np.asarray(time) / 2) - below, 0.0)


def decay_damping(runs: Sequence[Run], decay: DecayFit, mass: Quantity, *, resolution: float) -> Finding:
    r"""Viscous damping and dry friction from the shape of free decays, with the decrement of the same decays beside it.

    Parameters
    ----------
    runs : sequence of Run
        The taps.
    decay : DecayFit
        Their fit, by `free_decay`.
    mass : Quantity
        Mass (kg) with its standard uncertainty.
    resolution : float
        Length of a count (m).

    Returns
    -------
    Finding
        c (N s/m). ``others``: ``friction`` (N), ``c_viscous_only`` by the logarithmic decrement of the same
        decays; ``covariance`` is that of c and friction.
    """
    peaks = [_peaks(runs[i], span, decay, resolution) for i, span in zip(decay.runs, decay.spans, strict=True)]
    viscous = np.array([decay_rate(*row) for row in peaks if len(row[0]) > 2]).reshape(-1, 3)
    weight = 1.0 / viscous[:, 2]
    rate = -2 * float(np.average(viscous[:, 0], weights=weight))
    rate_error = 2 * float(np.sqrt(1 / np.sum(weight)))
    c, friction = mass.value * float(decay.values[1]), mass.value * float(decay.values[2])
    plain = mass.value * rate
    own = mass.value**2 * decay.covariance[1:3, 1:3]
    covariance = own + mass.uncertainty**2 * np.outer(decay.values[1:3], decay.values[1:3])
    c_error, friction_error = (float(e) for e in np.sqrt(np.diag(covariance)))
    related = float(own[0, 1] / np.sqrt(own[0, 0] * own[1, 1])) if own[1, 1] else 0.0
    notes = [
        f"by their logarithmic decrement, without friction, the same decays give {plain:.4g} N s/m, "
        f"{100 * (plain / c - 1):+.1f} %",
        f"c and the dry friction are told apart by the shape; correlation {related:+.2f}",
        *decay.notes,
    ]
    return Finding(
        "c_decay", Estimate(c, c_error, "N s/m"), "free decays, viscous damping and dry friction at once",
        decay.samples, tuple(runs[i].name for i in decay.runs), tuple(notes),
        {
            "friction": Estimate(friction, friction_error, "N"),
            "c_viscous_only": Estimate(rate, rate_error).times(mass.value, mass.uncertainty, "N s/m"),
        },
        covariance, _data(runs, decay, peaks, (c, c_error, friction, friction_error)), "free_decay",
    )  # fmt: skip


def _peaks(run: Run, span: tuple[int, int], decay: DecayFit, resolution: float) -> tuple[FloatArray, ...]:
    """Turning points of the part that is used; the first lies within a sample of where the fit begins."""
    early = slice(max(span[0] - 3, 0), span[1])
    return log_decrement(run.time[early], run.positions[early], float(decay.values[3]), resolution=resolution)


def _data(
    runs: Sequence[Run], decay: DecayFit, peaks: Sequence[tuple[FloatArray, ...]], numbers: tuple[float, ...]
) -> xr.Dataset:
    import xarray as xr

    natural, b, f, rest = (float(v) for v in decay.values)
    widths = [np.ptp(runs[i].positions[slice(*at)]) for i, at in zip(decay.runs, decay.spans, strict=True)]
    which = int(np.argmax(widths))
    run, (begin, end) = runs[decay.runs[which]], decay.spans[which]
    time, x = run.time[begin:end], run.positions[begin:end]
    at, height, error = peaks[which]
    # the first turning point after the first fitted sample, and its height, to second order
    first, v = decay.begins(which)
    late = v / (natural**2 * first)
    slope, intercept, _ = decay_rate(*peaks[which])
    begun = time[0] + late
    at = at - begun
    fine = np.linspace(0.0, float(at[-1]), 200)
    plain = np.exp(intercept + slope * (begun + fine))
    fitted = decay.fitted(which) - rest
    both = envelope(fine, float(abs(first) * (1 + (natural * late) ** 2 / 2)), natural, b, f)
    return xr.Dataset(
        {
            "peak_time": ("peak", at, {"units": "s"}), "peak_height": ("peak", height, {"units": "m"}),
            "peak_height_error": ("peak", error, {"units": "m"}),
            "x": ("time", x - rest, {"units": "m"}), "fitted": ("time", fitted, {"units": "m"}),
            "envelope_both": ("fine_time", both, {"units": "m"}),
            "envelope_viscous": ("fine_time", plain, {"units": "m"}),
            "c": ((), numbers[0], {"units": "N s/m"}), "c_error": ((), numbers[1], {"units": "N s/m"}),
            "friction_force": ((), numbers[2], {"units": "N"}),
            "friction_force_error": ((), numbers[3], {"units": "N"}),
        },
        {"time": time - time[0], "fine_time": fine}, {"synthetic": "yes" if run.synthetic else "no"},
    )  # fmt: skip
