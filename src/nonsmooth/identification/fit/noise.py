r"""Noise of a fit: its size and its correlation from the residuals, and the structure that no such noise has.

The noise of a quantity is taken for an autoregressive process of the first order: two readings a time :math:`\Delta t`
apart correlate by :math:`\rho^{\Delta t / h}` in all runs, whatever their rates; h is the shortest median step. White
noise has rho = 0.
"""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.arrow import Residuals
from nonsmooth.identification.fit.windows import Windows

OUTLYING = 6.0  # noise deviations, beyond which a reading is named
_LEAST, _MOST = 0.1, 0.98  # correlation of neighbours: below it noise counts as white
_SURE = 4.0  # standard errors of a correlation
_PEAK = 12.0  # logarithm of the odds against a line of the spectrum in noise
_LINES = 0.4  # part of the residuals in such lines
_AWAY, _ODD = 0.12, 2.2  # distance of the summed spectrum from white noise's; the same times the root of its length
_LARGE = 1.5  # residuals over the record's own irregularity


def robust_size(r: FloatArray) -> float:
    """Standard deviation of normal residuals, by their median size."""
    return 1.4826 * np.median(np.abs(r)) if len(r) else 0.0


def colours(problem: Windows, state: Residuals) -> FloatArray:
    """Correlation of residuals of each quantity over its step, 0 where it is none; ``state``: not whitened."""
    return np.array([_colour(problem, c, _timed(problem, state, c)) for c in range(len(problem.sensors))])


def _colour(problem: Windows, c: int, rows: list[tuple[FloatArray, FloatArray]]) -> float:
    """The most likely correlation, where it is large and sure enough; ``rows``: times and residuals."""
    from scipy.optimize import minimize_scalar

    every = _joined(rows)
    cut = 5.0 * robust_size(every)
    cuts = [(problem.gaps(c, t), np.clip(r, -cut, cut)) for t, r in rows if len(r) > 1]
    power = np.mean(np.clip(every, -cut, cut) ** 2) if cuts else 0.0
    if not power > problem.least[c] ** 2:  # what is left is no noise
        return 0.0
    gaps, before, here = (np.concatenate(one) for one in zip(*((gap, r[:-1], r[1:]) for gap, r in cuts), strict=True))

    def unlikely(rho: float) -> float:
        """Minus twice the logarithm of the likelihood."""
        left = 1.0 - rho ** (2.0 * gaps)
        return np.sum(np.log(left) + (here - rho**gaps * before) ** 2 / (power * left))

    best = minimize_scalar(unlikely, bounds=(0.0, _MOST), method="bounded")
    return best.x if best.x > _LEAST and unlikely(0.0) - best.fun > _SURE**2 else 0.0


def strange(problem: Windows, plain: Residuals, white: Residuals, irregular: FloatArray) -> tuple[float, bool]:
    """Size of the residuals over that of noise as irregular as the record, and whether the model lacks a part.

    The size is that of one quantity, the worst, over that of noise of their correlation. A part is missing where
    residuals larger than the irregularity have a structure that no such noise has: lines of the spectrum that hold
    much of them, as those of a motion do, or another spectrum. ``plain`` and ``white``: residuals, and whitened ones.
    """
    worst, missing = 0.0, False
    for c in range(len(problem.sensors)):
        r, e = (residuals_of(problem, one, c) for one in (plain, white))
        if len(r) < 16:
            continue
        # outliers raise the one, readings that are rounded the other
        size = min(robust_size(r), np.sqrt(np.mean(r**2))) / irregular[c]
        rho = problem.colour[c] ** (problem.steps[:, c] / problem.step[c])
        # noise of this correlation over white noise of the same third differences, over all runs
        irregularity = np.sqrt(20.0 / np.mean(20.0 - 30.0 * rho + 12.0 * rho**2 - 2.0 * rho**3))
        worst = max(worst, size / irregularity)
        missing = missing or (size > _LARGE and _has_structure(r, e))
    return worst, missing


def residuals_of(problem: Windows, state: Residuals, c: int) -> FloatArray:
    """Residuals of a quantity, without the readings at a limit of the sensor."""
    return _joined(_timed(problem, state, c))


def _joined(rows: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    return np.concatenate([np.zeros(0), *(r for _, r in rows)])


def _timed(problem: Windows, state: Residuals, c: int) -> list[tuple[FloatArray, FloatArray]]:
    """The same with their times, window by window."""
    mine = [(w, r, (w.readings[1] == c) & (problem.limits(w) == 0)) for w, r in problem.rows(state)]
    return [(w.time[w.readings[0][here]], r[here]) for w, r, here in mine]


def _has_structure(r: FloatArray, e: FloatArray) -> bool:
    """Return whether residuals ``r``, whitened ``e``, are no noise of their correlation."""
    cut = [np.clip(x, -4.0 * robust_size(x), 4.0 * robust_size(x)) for x in (r, e)]
    raw, white = (np.abs(np.fft.rfft(x)[1:]) ** 2 for x in cut)
    if not white.sum() > 0.0:
        return False
    lines = white > (np.log(len(white)) + _PEAK) * white.mean()
    away = np.abs(np.cumsum(white) / white.sum() - np.arange(1, len(white) + 1) / len(white)).max()
    return bool(raw[lines].sum() > _LINES * raw.sum() or away > max(_AWAY, _ODD / np.sqrt(len(white))))
