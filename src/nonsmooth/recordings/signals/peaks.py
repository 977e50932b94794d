"""Maxima and minima of a sampled signal between its samples."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from nonsmooth.recordings.signals.checks import signal

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["extremes"]

Floats = NDArray[np.float64]


def extremes(
    time: ArrayLike,
    x: Any,
    *,
    resolution: float | None = None,
    kind: str = "both",
    prominence: float | None = None,
    arc: float = 0.12,
) -> xr.Dataset:
    """Maxima and minima with their times, each from a polynomial of order 4 fitted to the samples around it.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds and values.
    resolution : float, optional
        The step of the sensor; without it the error of a sample is taken from the fits' own residuals.
    kind : {"both", "maxima", "minima"}
    prominence : float, optional
        How far the signal must fall on both sides of a maximum; default is 4 resolutions, or 1 % of the range.
    arc : float
        The fit takes the samples within this part of the distance to the neighbouring extremes of the same kind on
        either side (0.12 of a period: 43 degrees), but at least 3 on either side.

    Returns
    -------
    Dataset
        Over ``extreme``: ``time``, ``time_error``, ``value``, ``value_error``, ``kind`` (1 maximum, -1 minimum). An
        extreme in the first or last three samples is left out: half of it is missing.

    Raises
    ------
    ValueError
        If values are missing or there are fewer than 16.
    """
    import xarray as xr
    from scipy.signal import find_peaks

    if kind not in ("both", "maxima", "minima"):
        raise ValueError(f"kind must be both, maxima or minima, got {kind!r}")
    t, values = signal(time, x, least=16, purpose="finding extremes")
    if prominence is None:
        prominence = max(4.0 * (resolution or 0.0), 0.01 * float(np.ptp(values)))
    rows: list[tuple[float, float, float, float, int]] = []
    for sign in (1, -1) if kind == "both" else (1,) if kind == "maxima" else (-1,):
        # A flat top of equal counts is one maximum: find_peaks takes its middle.
        found, _ = find_peaks(sign * values, prominence=prominence if prominence > 0 else None)
        found = _apart(sign * values, found, prominence)
        for i, place in enumerate(found):
            near = [abs(found[j] - place) for j in (i - 1, i + 1) if 0 <= j < len(found)]
            half = max(3, int(arc * min(near)) if near else len(t) // 8)
            low, high = place - half, place + half + 1
            if place < 3 or place > len(t) - 4:
                continue
            row = _vertex(t[max(low, 0) : high], values[max(low, 0) : high], float(t[place]), sign, resolution)
            if row is not None:
                rows.append((*row, sign))
    rows.sort()
    table = np.array(rows, np.float64).reshape(-1, 5)
    unit = str(getattr(x, "attrs", {}).get("units", ""))
    return xr.Dataset(
        {
            "time": ("extreme", table[:, 0], {"long_name": "time", "units": "s"}),
            "time_error": ("extreme", table[:, 1], {"units": "s"}),
            "value": ("extreme", table[:, 2], {"long_name": "extreme value", "units": unit}),
            "value_error": ("extreme", table[:, 3], {"units": unit}),
            "kind": ("extreme", table[:, 4].astype(np.int8), {"long_name": "1: maximum, -1: minimum"}),
        }
    )


def _apart(x: Floats, places: NDArray[np.intp], prominence: float) -> list[int]:
    """Of maxima between which the signal does not fall by ``prominence`` (tops of equal height), the first."""
    kept: list[int] = []
    for place in places:
        if kept and min(x[kept[-1]], x[place]) - x[kept[-1] : place].min() < prominence:
            continue
        kept.append(int(place))
    return kept


def _vertex(
    t: Floats, x: Floats, about: float, sign: int, resolution: float | None
) -> tuple[float, float, float, float] | None:
    """Time, its error, value, its error of the extreme of a polynomial through the samples."""
    order = 4 if len(t) >= 8 else 2
    scale = 0.5 * (t[-1] - t[0])
    s = (t - about) / scale
    A = np.vander(s, order + 1, increasing=True)
    p, *_ = np.linalg.lstsq(A, x, rcond=None)
    slope = p[1:] * np.arange(1, order + 1)
    bend = slope[1:] * np.arange(1, order)
    roots = np.roots(slope[::-1])
    level = np.real(roots[np.abs(np.imag(roots)) < 1e-9 * np.maximum(np.abs(roots), 1.0)])
    turns = level[(np.abs(level) < 1.0) & (sign * np.polynomial.polynomial.polyval(level, bend) < 0)]
    if len(turns) == 0:
        return None  # the samples bend the other way, or rise from end to end: no extreme here
    place = float(turns[np.argmin(np.abs(turns))])
    curvature = float(np.polynomial.polynomial.polyval(place, bend))
    left = x - A @ p
    variance = float(left @ left) / max(len(t) - order - 1, 1)
    if resolution is not None:
        variance = max(variance, resolution**2 / 12.0)
    C = variance * np.linalg.inv(A.T @ A)
    at = place ** np.arange(order + 1)
    along = np.concatenate([[0.0], np.arange(1, order + 1) * place ** np.arange(order)])
    time_error = math.sqrt(float(along @ C @ along)) / abs(curvature) * scale
    return about + place * scale, time_error, float(at @ p), math.sqrt(float(at @ C @ at))
