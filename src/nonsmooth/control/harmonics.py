r"""Harmonics of the drive's phase: :math:`x(\varphi) = \mathrm{Re} \sum_{h=0}^{H} c_h e^{2 \pi i h \varphi}`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nonsmooth.arrays import ComplexArray, FloatArray

SEEN = 4.0  # standard uncertainties


@dataclass(frozen=True)
class FourierSeries:
    """Coefficients c_0 ... c_H, and the standard uncertainty of each one's real and imaginary part."""

    c: ComplexArray
    u: FloatArray

    @property
    def seen(self) -> ComplexArray:
        """Coefficients that stand out of their noise, and 0 for the others, whose noise would add to extremes."""
        return np.where(np.abs(self.c) > SEEN * self.u, self.c, 0.0)


def values_at(c: ComplexArray, phase: FloatArray, derivative: int = 0) -> FloatArray:
    """Values of a series at phases (in turns), or of its derivative with respect to the angle."""
    h = np.arange(len(c))
    return np.asarray(np.real(np.exp(2j * np.pi * np.multiply.outer(phase, h)) @ ((1j * h) ** derivative * c)))


def mean_square(c: ComplexArray) -> float:
    """Mean square of a series over a turn."""
    return float(np.abs(c[0]) ** 2 + 0.5 * np.sum(np.abs(c[1:]) ** 2))


def fitted(phase: FloatArray, values: FloatArray, harmonics: int) -> FourierSeries:
    """Fit the harmonics 0 ... H to samples over whole turns, by least squares.

    The uncertainties are from the scatter between turns, so that noise of any colour, drift, and motion that does not
    repeat with each turn are all in them.
    """
    h = np.arange(1, harmonics + 1)
    angle = 2 * np.pi * np.multiply.outer(phase, h)
    design = np.hstack([np.ones((len(phase), 1)), np.cos(angle), np.sin(angle)])
    found, *_ = np.linalg.lstsq(design, values, rcond=None)
    c = np.concatenate([found[:1], found[1 : harmonics + 1] - 1j * found[harmonics + 1 :]]).astype(complex)
    left = values - design @ found
    turn = np.floor(phase - phase[0]).astype(int)
    turns = int(turn[-1]) + 1
    waves = np.exp(-2j * np.pi * np.multiply.outer(phase, np.arange(harmonics + 1))) * left[:, None]
    rows = np.array([waves[turn == k].mean(axis=0) for k in range(turns)])
    rows[:, 1:] *= 2.0
    spread = np.sqrt(np.sum(np.abs(rows) ** 2, axis=0) / max(turns - 1, 1) / turns)
    spread[1:] /= np.sqrt(2.0)  # of each part
    return FourierSeries(c, spread)
