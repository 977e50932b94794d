"""Sizes by which neighbours of motions are told apart, and exponents from the growth of their distance."""

from __future__ import annotations

import numpy as np

from nonsmooth.attractors.settled import ROUNDED
from nonsmooth.flow.engines.engine import FloatArray, IntArray
from nonsmooth.kernels.hybrid import codes

USUAL = 1.5  # powers of ten: a motion this near to its scale is taken to have that size
SLENDER = 1e-6  # a state whose motion is smaller than this, beside the largest of the others, is at rest
RESTING = 1e-9  # in units of the scales: a motion that has come to rest in all states
AT_REST = 1e-3


def separation_sizes(maximum: FloatArray, minimum: FloatArray, scale: FloatArray) -> FloatArray:
    """Sizes (J, n) by which neighbours of J motions are told apart: those of the motions, in powers of ten.

    The states' ``scale`` will not do: neighbours of a motion in micrometres would be as far apart as it is wide, and
    those of a motion in pascals equal within rounding. Extremes that are not known (NaN) give the scale.
    """
    half = np.nan_to_num(0.5 * (maximum - minimum)) / scale
    value = np.nan_to_num(np.maximum(np.abs(maximum), np.abs(minimum))) / scale
    widest = half.max(axis=1, keepdims=True, initial=0.0)
    size = np.maximum(half, SLENDER * widest)
    size = np.maximum(np.where(widest < RESTING, AT_REST, size), ROUNDED * value)
    power = np.log10(size)
    power = np.where((np.abs(power) < USUAL) | np.isnan(maximum).all(axis=1, keepdims=True), 0.0, np.rint(power))
    return np.asarray(scale * 10.0**power)


def rates(sums: FloatArray, status: IntArray) -> tuple[FloatArray, FloatArray]:
    """Exponents per unit time and their standard errors (J,) from the sums of J jobs; NaN where a run failed."""
    from nonsmooth.kernels.judging.exponent import BATCHES, MEAN_RATE, SQUARED_RATES

    good = np.isin(status, (codes.OK, codes.NOT_GUARANTEED))
    error = np.sqrt(sums[:, SQUARED_RATES] / (BATCHES * (BATCHES - 1)))
    return np.where(good, sums[:, MEAN_RATE], np.nan), np.where(good, error, np.nan)
