"""Savitzky-Golay smoothing by SciPy, with the result form of ``smooth``, and with what is noise and what is bias."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.recordings.signals.checks import even_rate, signal, whose
from nonsmooth.recordings.signals.smoothing import labelled_motion

if TYPE_CHECKING:
    import xarray as xr


def savitzky_golay(
    time: ArrayLike,
    x: Any,
    *,
    resolution: float,
    window: int = 9,
    order: int = 4,
    impacts: ArrayLike = (),
) -> xr.Dataset:
    """Position, velocity and acceleration from a polynomial fitted to each sample's neighbours.

    Between two impacts the record is filtered by itself (``scipy.signal.savgol_filter``, ``mode="interp"``); its ends
    take the values of the polynomial fitted to the first and last ``window`` samples.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds at an even rate, and the position; no missing values.
    resolution : float
        The step of the sensor; a sample has the variance resolution^2 / 12.
    window, order : int
        Samples that the polynomial is fitted to (odd), and its order (2 or more, below ``window``).
    impacts : array_like
        Times at which the velocity jumps.

    Returns
    -------
    Dataset
        As :func:`~nonsmooth.recordings.signals.smoothing.smooth` gives, without what concerns impacts. The errors
        are those of the counts alone, sigma times the norm of the filter's weights; the largest difference from the
        same filter of order + 2, which shows what the polynomial cannot follow, stands in the attributes
        ``x_bias``, ``v_bias`` and ``a_bias`` (root mean squares).

    Raises
    ------
    ValueError
        If the rate is not even, values are missing, or a piece between impacts is shorter than the window.
    """
    from scipy.signal import savgol_coeffs, savgol_filter

    if window % 2 == 0 or not 2 <= order < window - 2:
        raise ValueError(f"window must be odd and order from 2 to window - 3, got window={window}, order={order}")
    if not (math.isfinite(resolution) and resolution > 0):
        raise ValueError(f"{whose(x)}: resolution must be a positive length, got {resolution!r}")
    t, values = signal(time, x, least=window, purpose="Savitzky-Golay smoothing")
    step = 1.0 / even_rate(t, x, "Savitzky-Golay smoothing")
    hits = np.unique(np.asarray(impacts, np.float64).ravel())
    segment = np.searchsorted(hits, t, side="left")
    states, errors = np.empty((3, len(t))), np.empty((3, len(t)))
    attrs: dict[str, Any] = {"method": "Savitzky-Golay", "window": window, "order": order}
    half = window // 2
    for k, name in enumerate("xva"):
        bias = []
        # Weights of each place in the window; the middle ones serve everywhere but at the ends.
        norms = [float(np.linalg.norm(savgol_coeffs(window, order, k, step, pos=i))) for i in range(window)]
        for part in np.unique(segment):
            here = np.flatnonzero(segment == part)
            if len(here) < window:
                raise ValueError(
                    f"{whose(x)}: only {len(here)} samples between impacts from t = {t[here[0]]:.9g} s on, and the "
                    f"window has {window}: take a shorter one, or smooth()"
                )
            piece = values[here]
            states[k, here] = savgol_filter(piece, window, order, deriv=k, delta=step)
            place = np.minimum(np.minimum(np.arange(len(here)), np.arange(len(here))[::-1]), half)
            errors[k, here] = np.array(norms)[place] * resolution / math.sqrt(12.0)
            finer = savgol_filter(piece, window, min(order + 2, window - 1), deriv=k, delta=step)
            bias.append(finer[half:-half] - states[k, here][half:-half])
        attrs[f"{name}_bias"] = float(np.sqrt(np.mean(np.concatenate(bias) ** 2)))
    return labelled_motion(t, states, errors, hits, x).assign_attrs(attrs)
