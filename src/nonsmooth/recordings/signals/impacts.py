"""Hard impacts found in a record: they last for less than a sample and show as a kink of the position."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.recordings.signals.checks import signal, whose
from nonsmooth.recordings.signals.smoothing import smooth

if TYPE_CHECKING:
    import xarray as xr


def impacts(
    time: ArrayLike,
    x: Any,
    *,
    resolution: float | None = None,
    noise: float = 0.0,
    significance: float = 5.0,
    window: int = 6,
) -> xr.Dataset:
    """Instants at which the velocity jumps between two samples (hard impacts).

    About each step a polynomial of order 3 is fitted to ``window`` samples on either side, without and with a kink; the
    step at which the kink lowers the sum of squares most is taken, the neighbours are fitted again with windows that
    end there, and so on. Then all kinks found are free velocities of one smoothing: the least significant jump
    is given up, again and again, until all are significant.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds and position.
    resolution : float, optional
        The step of the sensor; without it the variance of a sample is found from the record.
    noise : float
        Standard deviation of a sample beside its step.
    significance : float
        The least jump of the velocity, in its own standard errors.
    window : int
        Samples on either side, at least 4.

    Returns
    -------
    Dataset
        Over ``impact``: ``impact_time``, ``impact_time_error``, ``impact_x``, ``v_before``, ``v_after`` and their
        errors, ``significance``.

    Raises
    ------
    ValueError
        If values are missing, or the record is shorter than two windows.
    """
    if window < 4:
        raise ValueError(f"window must be at least 4 samples on either side, got {window}")
    t, values = signal(time, x, least=2 * window, purpose="finding impacts")
    if resolution is None:
        # Fourth differences of a smooth motion are noise; a few kinks do not move their median.
        variance = (1.4826 * float(np.median(np.abs(np.diff(values, 4))))) ** 2 / 70.0
        variance = max(variance, (1e-9 * float(np.ptp(values))) ** 2)
    else:
        variance = resolution**2 / 12.0 + noise**2
    taken = _forward(t, values, variance, significance, window)
    while True:
        when = np.array([place for place, _ in taken])
        result = smooth(t, x, resolution=resolution, noise=noise, impacts=when, model="white_jerk")
        jump = result["v_after"].values - result["v_before"].values
        size = np.abs(jump) / np.hypot(result["v_after_error"].values, result["v_before_error"].values)
        if len(size) == 0 or size.min() >= significance:
            break
        # Half of the insignificant ones at once, while there are many.
        weak = np.flatnonzero(size < significance)
        drop = set(weak[np.argsort(size[weak])][: max(1, len(weak) // 2)].tolist())
        taken = [kink for k, kink in enumerate(taken) if k not in drop]
    names = ["impact_time", "impact_x", "impact_x_error"] + [
        f"v_{side}{error}" for side in ("before", "after") for error in ("", "_error")
    ]
    kept = result[names]
    kept["impact_time_error"] = ("impact", np.array([error for _, error in taken]), {"units": "s"})
    kept["significance"] = ("impact", size, {"long_name": "jump of the velocity in its standard errors"})
    kept.attrs = {"signal": whose(x, ""), "sample_error": result.attrs["sample_error"]}
    return kept


def _forward(
    t: FloatArray, x: FloatArray, variance: float, significance: float, window: int
) -> list[tuple[float, float]]:
    """Times of kinks and their errors, in order; more rather than fewer."""
    gain, place, error = (np.zeros(len(t) - 1) for _ in range(3))
    taken: dict[int, tuple[float, float]] = {}
    todo = list(range(2, len(t) - 3))
    while True:
        for i in todo:
            # A window ends at the neighbouring kinks.
            low = max([i - window + 1, 0] + [j + 1 for j in taken if j < i])
            high = min([i + window + 1, len(t)] + [j + 1 for j in taken if j > i])
            gain[i], place[i], error[i] = _kink(t, x, i, low, high, variance)
        if gain.size == 0 or gain.max() <= significance**2:
            return [taken[i] for i in sorted(taken)]
        i = int(np.argmax(gain))
        taken[i] = (float(place[i]), float(error[i]))
        near = range(max(2, i - window), min(len(t) - 3, i + window + 1))
        gain[max(i - 1, 0) : i + 2] = 0.0
        todo = [k for k in near if all(abs(k - j) > 1 for j in taken)]


def _kink(t: FloatArray, x: FloatArray, i: int, low: int, high: int, variance: float) -> tuple[float, float, float]:
    """Fall of the sum of squares by a kink between samples i and i + 1, its time, and the error of that."""
    none = (0.0, math.nan, math.nan)
    if i - low < 1 or high - i < 3 or high - low < 7:
        return none
    from scipy.optimize import minimize_scalar

    s, y = t[low:high] - t[i], x[low:high]
    A = np.vander(s / (s[-1] - s[0]), 4, increasing=True)
    plain = _squares(A, y)
    if plain <= 25.0 * variance:
        return none
    h = t[i + 1] - t[i]

    def squares(tau: float) -> float:
        return _squares(np.column_stack([A, np.maximum(s - tau, 0.0)]), y)

    grid = h * np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    values = [squares(tau) for tau in grid]
    k = int(np.argmin(values))
    bounds = (grid[max(k - 1, 0)], grid[min(k + 1, 4)])
    found = minimize_scalar(squares, bounds=bounds, method="bounded", options={"xatol": 1e-3 * h, "maxiter": 40})
    if not found.success:
        raise SolveError(f"the instant of a kink near t = {t[i]:.6g} s was not found: {found.message}")
    tau = float(np.clip(found.x, 1e-3 * h, 0.999 * h))
    step = 0.1 * h
    bend = (squares(tau + step) - 2 * squares(tau) + squares(tau - step)) / step**2
    error = math.sqrt(2.0 * variance / bend) if bend > 0 else math.inf
    return (plain - float(found.fun)) / variance, t[i] + tau, min(error, h / math.sqrt(12.0))


def _squares(A: FloatArray, y: FloatArray) -> float:
    """Sum of squares that a fit leaves."""
    R = np.asarray(np.linalg.qr(np.column_stack([A, y]), mode="r"))
    return float(R[-1, -1] ** 2)
