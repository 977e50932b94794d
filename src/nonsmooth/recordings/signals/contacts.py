"""Contacts found in a record: hard impacts, which last for less than a sample, and those with a soft support.

A soft contact lasts for several samples (82 ms, 8 samples at 100 Hz, for the support of Savi et al. 2007): it shows as
a force that the free motion does not have.
"""

from __future__ import annotations

import math
from typing import Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import BoolArray, FloatArray
from nonsmooth.errors import SolveError
from nonsmooth.recordings.signals.checks import signal, unit_of, whose
from nonsmooth.recordings.signals.smoothing import smooth
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Positive, at_least


@checked
def impacts(
    time: ArrayLike,
    x: Any,
    *,
    resolution: Positive | None = None,
    noise: Annotated[float, at_least(0)] = 0.0,
    significance: Positive = 5.0,
    window: Annotated[int, at_least(4), "it is the number of samples on either side"] = 6,
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
    t, values = signal(time, x, least=2 * window, purpose="finding impacts")
    if resolution is None:
        # Fourth differences of a smooth motion are noise; a few kinks do not move their median.
        variance = (1.4826 * np.median(np.abs(np.diff(values, 4)))) ** 2 / 70.0
        variance = max(variance, (1e-9 * np.ptp(values)) ** 2)
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
    kept = result.drop_dims("time")
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
        taken[i] = (place[i], error[i])
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
    k = np.argmin([squares(tau) for tau in grid])
    bounds = (grid[max(k - 1, 0)], grid[min(k + 1, 4)])
    found = minimize_scalar(squares, bounds=bounds, method="bounded", options={"xatol": 1e-3 * h, "maxiter": 40})
    if not found.success:
        raise SolveError(f"the instant of a kink near t = {t[i]:.6g} s was not found: {found.message}")
    tau = np.clip(found.x, 1e-3 * h, 0.999 * h)
    step = 0.1 * h
    bend = (squares(tau + step) - 2 * squares(tau) + squares(tau - step)) / step**2
    error = math.sqrt(2.0 * variance / bend) if bend > 0 else math.inf
    return (plain - found.fun) / variance, t[i] + tau, min(error, h / math.sqrt(12.0))


def _squares(A: FloatArray, y: FloatArray) -> float:
    """Sum of squares that a fit leaves."""
    R: Any = np.linalg.qr(np.column_stack([A, y]), mode="r")
    return R[-1, -1] ** 2


_UNDECIDED = 0.01  # of the samples: at the edge of contact, of which none is used for the support


def contacts(
    time: ArrayLike,
    x: Any,
    *,
    resolution: float,
    gap: float | None = None,
    omega: float | None = None,
    least_depth: float | None = None,
) -> xr.Dataset:
    """Intervals in which the motion is pushed back by a soft support that lies above, x > gap.

    Without a gap given: the acceleration of the free motion is fitted, a = a_0 - p x - q v (and a forcing of the
    frequency ``omega``), first where x is low, then wherever it holds. What is left over is the support's, and begins
    at the gap: left(x) = -s (x - g), a straight line over x, whose zero is the gap found. The signal is then smoothed
    again with these contacts, and all is repeated.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds and position.
    resolution : float
        The step of the sensor, in the unit of ``x``.
    gap : float, optional
        Where the support begins, if known.
    omega : float, optional
        Angular frequency of the drive, which sharpens the free motion; without it, it is sought.
    least_depth : float, optional
        Shallower contacts are ``uncertain``; default is 3 resolutions.

    Returns
    -------
    Dataset
        Over ``contact``: ``begin``, ``end`` (where x passes the gap, interpolated; a damped support lets go
        c_s / k_s before that, 0.5 ms in the paper's), ``begin_error``, ``end_error``, ``depth``, ``v_begin``, ``v_end``
        and ``uncertain`` (shallow, cut off by the record's ends, or seen by fewer than two samples). Scalars: ``gap``,
        ``gap_error``, ``stiffness`` (s, that of the support by the mass, 1/s^2). No contact: an empty dim and NaN.

    Raises
    ------
    ValueError
        If the record is too short.
    """
    t, values = signal(time, x, least=32, purpose="finding contacts")
    found = smooth(t, values, resolution=resolution)
    if gap is not None:
        place = (float(gap), 0.0, math.nan)
        found = smooth(t, values, resolution=resolution, contacts=intervals(found, place[0])[:2])
    else:
        place = _support(found, omega, resolution)
        for _ in range(2):
            if math.isnan(place[0]):
                break
            inside = intervals(found, place[0])[:2]
            if len(inside[0]) == 0:
                break
            found = smooth(t, values, resolution=resolution, contacts=inside)
            place = _support(found, omega, resolution)
    gap, gap_error, stiffness = place
    position, least = found["x"].values, 3.0 * resolution if least_depth is None else least_depth
    if math.isnan(gap):
        begin, end, cut = np.zeros(0), np.zeros(0), np.zeros(0, np.bool_)
    else:
        begin, end, cut = intervals(found, gap)
    speed, own = (np.interp([begin, end], t, found[name].values) for name in ("v", "x_error"))
    errors = np.hypot(own, gap_error) / np.maximum(np.abs(speed), 1e-300)
    first, behind = np.searchsorted(t, begin), np.searchsorted(t, end, "right")
    deepest = [position[a:b].max(initial=-math.inf) - gap for a, b in zip(first, behind, strict=True)]
    depth = np.where(behind > first, deepest, 0.25 * (end - begin) * np.abs(speed[0]))
    unit = unit_of(x)
    return xr.Dataset(
        {
            "begin": labelled("contact", begin, "begin of the contact", "s"),
            "end": labelled("contact", end, "end of the contact", "s"),
            "begin_error": ("contact", errors[0], {"units": "s"}),
            "end_error": ("contact", errors[1], {"units": "s"}),
            "depth": labelled("contact", depth, "depth of the contact", unit),
            "v_begin": labelled("contact", speed[0], "velocity at the begin", f"{unit}/s"),
            "v_end": labelled("contact", speed[1], "velocity at the end", f"{unit}/s"),
            "uncertain": labelled("contact", (depth < least) | (behind - first < 2) | cut, "contact is uncertain"),
            "gap": ((), gap, {"units": unit}),
            "gap_error": ((), gap_error, {"units": unit}),
            "stiffness": labelled((), stiffness, "stiffness of the support by the mass", "1/s^2"),
        }
    )


def _support(found: xr.Dataset, omega: float | None, resolution: float) -> tuple[float, float, float]:
    """Gap, its error, and stiffness by mass; NaN where nothing pushes."""
    none = (math.nan, math.nan, math.nan)
    t, x = found["time"].values, found["x"].values
    low = x <= np.median(x)
    left, free = _beside_the_free_motion(found, omega, low)
    if omega is None and len(left):
        drive = _drive(t, left, free)
        if drive is not None:
            left, free = _beside_the_free_motion(found, drive, low)
    if len(left) == 0:
        return none
    pushed = ~free & ~low
    if np.count_nonzero(pushed) < 4:
        return none
    # A straight line over x, and of the samples near its zero none: there the smoother rounds the corner.
    deep = pushed & (left < 0.25 * np.quantile(left[pushed], 0.05))
    if np.count_nonzero(deep) < 4 or np.ptp(x[deep]) < 2.0 * resolution:
        deep = pushed
    (slope, at_zero), C = np.polyfit(x[deep], left[deep], 1, cov=True)
    if slope >= 0:
        return none
    g = -at_zero / slope
    along = np.array([g, 1.0]) / slope
    # Samples of one contact are not independent: some 4 of them say as much as one.
    return g, 2.0 * math.sqrt(along @ C @ along), -slope


def _beside_the_free_motion(found: xr.Dataset, omega: float | None, free: BoolArray) -> tuple[FloatArray, BoolArray]:
    """Acceleration that the free motion does not explain, and the samples that it does; empty if it fits nowhere."""
    t, x, v, a = (found[name].values for name in ("time", "x", "v", "a"))
    columns = [np.ones_like(x), x, v]
    if omega is not None:
        columns += [np.cos(omega * t), np.sin(omega * t)]
    A = np.column_stack(columns)
    left = a
    for _ in range(30):
        if np.count_nonzero(free) < 4 * len(columns):
            return np.zeros(0), free
        p, *_ = np.linalg.lstsq(A[free], a[free], rcond=None)
        left = a - A @ p
        spread = 1.4826 * np.median(np.abs(left[free] - np.median(left[free])))
        again = left > -max(4.0 * spread, 3.0 * np.median(found["a_error"].values))
        changed, free = np.count_nonzero(again != free), again
        if not changed:
            break
    else:
        if changed > _UNDECIDED * len(free):
            raise SolveError(
                f"which samples are free of the support cannot be told: {changed} of {len(free)} change sides from "
                "round to round; give the gap, or the drive's frequency"
            )
    return left, free


def _drive(t: FloatArray, left: FloatArray, free: BoolArray) -> float | None:
    """The frequency of a forcing in what is left of the free motion: its largest line, with zeros in the gaps."""
    from scipy import fft

    n = len(t)
    held = np.where(free, left - left[free].mean(), 0.0)
    lines = np.abs(fft.rfft(np.interp(np.linspace(t[0], t[-1], n), t, held), 8 * n)) ** 2
    low, high = 16, 2 * n  # two periods in the record; half of what the sample rate shows
    best = low + np.argmax(lines[low:high])
    # The share of the variance that the line explains; white noise does not reach it.
    share = 2.0 * lines[best] / (np.count_nonzero(free) * (held @ held)) if held.any() else 0.0
    if share < 0.05 or best in (low, high - 1):
        return None
    a, b, c = lines[best - 1 : best + 2]
    place = best + 0.5 * (a - c) / (a - 2 * b + c)
    return 2 * np.pi * place * (n - 1) / (8 * n * (t[-1] - t[0]))


def intervals(found: xr.Dataset, gap: float) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Begin and end of each interval with x > gap, and whether the record cuts it off."""
    from nonsmooth.recordings.signals.sections import poincare

    t, x = found["time"].values, found["x"].values
    motion = (t, found["x"], found["v"].values)
    begin, end = (poincare(*motion, level=gap, rising=rising)["time"].values for rising in (True, False))
    begin = np.append(t[:1][x[:1] > gap], begin)
    end = np.append(end, t[-1:][x[-1:] > gap])[: len(begin)]
    begin = begin[: len(end)]
    cut = ((begin == t[0]) & (x[0] > gap)) | ((end == t[-1]) & (x[-1] > gap))
    keep = begin < end
    return begin[keep], end[keep], cut[keep]
