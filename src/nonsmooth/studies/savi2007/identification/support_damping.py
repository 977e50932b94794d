r"""Support damping from the free decay of a test mass on its spring: logarithmic decrement over many cycles.

.. math::

    \ln|x_n| = \ln x_0 - \frac{c_s}{2M} t_n, \qquad \xi_s = \frac{c_s}{2\sqrt{k_s M}}

The paper compares two successive peaks; here the logarithms of all of them are fitted by a line, each with the error
that one count makes of it, and beside it the whole decay in the time domain, which also tells :math:`\omega_s`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth.studies.savi2007.identification.evidence import Run
from nonsmooth.studies.savi2007.identification.free_decay import DecayFit, free_decay

__all__ = ["decay_rate", "log_decrement", "support_damping"]


def log_decrement(time: FloatArray, x: FloatArray, rest: float, *, resolution: float) -> tuple[FloatArray, ...]:
    """Times, heights and errors of the turning points of a decay, each by a parabola through five samples.

    Only points higher than ten counts are taken.
    """
    away = x - rest
    index = np.flatnonzero((np.abs(away[2:-2]) >= np.abs(away[1:-3])) & (np.abs(away[2:-2]) > np.abs(away[3:-1]))) + 2
    rows = []
    for i in index:
        if abs(away[i]) < 10 * resolution:
            continue
        t = time[i - 2 : i + 3] - time[i]
        c0, c1, c2 = np.polynomial.polynomial.polyfit(t, away[i - 2 : i + 3], 2)
        if c2 * c0 >= 0:
            continue
        at = -c1 / (2 * c2)
        if abs(at) <= t[-1]:
            rows.append((time[i] + at, abs(c0 + c1 * at + c2 * at**2)))
    found = np.array(rows).reshape(-1, 2)
    # a parabola through five samples has 0.7 of one sample's error at its top
    return found[:, 0], found[:, 1], np.full(len(found), 0.7 * resolution / np.sqrt(12))


def decay_rate(t: FloatArray, height: FloatArray, error: FloatArray) -> tuple[float, float, float]:
    """Slope (1/s) and intercept of the line through the logarithms of the heights, and the slope's variance."""
    line, covariance = np.polyfit(t, np.log(height), 1, w=height / error, cov=True)
    return float(line[0]), float(line[1]), float(covariance[0, 0])


def support_damping(
    runs: Sequence[Run], *, resolution: float, test_mass: Quantity, slowest: float = 0.02
) -> tuple[Finding, DecayFit]:
    """Damping of the support with a test mass on it, and the fit of the whole decays.

    Parameters
    ----------
    runs : sequence of Run
        Free decays of the test mass.
    resolution : float
        Length of a count (m).
    test_mass : Quantity
        Its mass (kg).
    slowest : float
        Speed (m/s) of the slowest half swing that is used.
    """
    import xarray as xr

    decay = free_decay(
        [(run.time, run.positions) for run in runs], resolution=resolution, slowest=slowest, friction=False,
        names=[run.name for run in runs],
    )  # fmt: skip
    slopes, weights, data = [], [], None
    notes = list(decay.notes)
    for i, (begin, end) in zip(decay.runs, decay.spans, strict=True):
        time, x = runs[i].time[begin:end], runs[i].positions[begin:end]
        t, height, error = log_decrement(time, x, float(decay.values[3]), resolution=resolution)
        if len(t) < 4:
            notes.append(f"run {runs[i].name!r}: no logarithmic decrement, {len(t)} turning points above ten counts")
            continue
        slope, intercept, variance = decay_rate(t, height, error)
        slopes.append(slope)
        weights.append(1 / variance)
        if data is None:
            ratio = -slope / decay.values[0]
            data = xr.Dataset(
                {
                    "x": ("time", runs[i].positions - decay.values[3], {"units": "m"}),
                    "peak_time": ("peak", t, {"units": "s"}), "peak_height": ("peak", height, {"units": "m"}),
                    "log_height": ("peak", np.log(height)), "log_height_error": ("peak", error / height),
                    "used": ("peak", np.ones(len(t), dtype=np.int8)), "slope": ((), slope, {"units": "1/s"}),
                    "intercept": ((), intercept), "damping_ratio": ((), ratio),
                    "damping_ratio_error": ((), float(np.sqrt(variance)) / decay.values[0]),
                },
                {"time": runs[i].time}, {"synthetic": "yes" if runs[i].synthetic else "no"},
            )  # fmt: skip
    mass = test_mass.value
    if not slopes:
        raise ValueError("no drop has four turning points above ten counts: drop it from higher, or record longer")
    rate = float(np.average(slopes, weights=weights))
    spread = float(np.std(slopes, ddof=1) / np.sqrt(len(slopes))) if len(slopes) > 1 else 0.0
    rate_error = max(float(1 / np.sqrt(np.sum(weights))), spread)
    value = -2 * mass * rate
    error_total = abs(value) * float(np.hypot(rate_error / rate, test_mass.uncertainty / mass))
    finding = Finding(
        "c_s_drop", Estimate(value, error_total, "N s/m", logarithmic=value > 0),
        "logarithmic decrement, regression over all turning points (Fig. 7)", decay.samples,
        tuple(runs[i].name for i in decay.runs), tuple(notes),
        others={
            "c_s_fit": Estimate(float(decay.values[1]), decay.error("b")).times(mass, test_mass.uncertainty, "N s/m"),
            "omega_s": Estimate(float(decay.values[0]), decay.error("omega_0"), "rad/s"),
            "damping_ratio": Estimate(-rate / float(decay.values[0]), rate_error / float(decay.values[0])),
        },
        data=data, plot="drop_decay",
    )  # fmt: skip
    return finding, decay
