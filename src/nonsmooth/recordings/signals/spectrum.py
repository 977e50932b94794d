"""Discrete Fourier transform with windows, and the frequency of a peak between its lines.

A record of length T has lines 1/T apart (0.0999 Hz for 10 s), and the largest of them is off by up to half of that.
Interpolation finds the peak between the lines; what bias remains is stated with each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.signals.checks import even_rate, signal, unit_of, whose
from nonsmooth.results.labels import labelled
from nonsmooth.system.arguments import checked
from nonsmooth.system.kinds import Natural, Positive

FINE = 32  # points per line in the table of a window's transform; a cubic between them is right to 1e-7


@dataclass(frozen=True)
class Peak:
    """A peak of a spectrum.

    Attributes
    ----------
    frequency, error : float
        Hz, with the standard error from the noise floor beside the peak.
    bias : float
        Bound in Hz of what the interpolation itself is off for a steady sinusoid, at any place between lines.
    grid_step : float
        Distance of independent lines in Hz, 1 / T.
    amplitude : float
        Of the sinusoid, in the unit of the signal.
    interpolation : {"window", "parabola", "none"}
    """

    frequency: float
    error: float
    bias: float
    grid_step: float
    amplitude: float
    interpolation: str

    @property
    def omega(self) -> float:
        """Angular frequency in rad/s."""
        return 2.0 * math.pi * self.frequency

    @property
    def omega_error(self) -> float:
        """Standard error of omega in rad/s."""
        return 2.0 * math.pi * self.error


@checked
def spectrum(
    x: Any,
    rate: Positive | None = None,
    *,
    window: Any = "hann",
    padding: Natural = 1,
    detrend: Literal["constant", "linear", None] = "constant",
) -> xr.Dataset:
    """One-sided spectrum of an evenly sampled signal.

    A sinusoid of amplitude A on a line has ``amplitude`` A there, whatever the window:
    ``amplitude_k = 2 |sum of w_j x_j exp(-2 pi i j k / N)| / sum of w_j``.

    Parameters
    ----------
    x : array_like, shape (N,)
        The signal; a DataArray over ``time`` brings its own rate, which must be one.
    rate : float, optional
        Sample rate in Hz.
    window : str or tuple
        As ``scipy.signal.get_window`` takes it: ``"boxcar"``, ``"hann"``, ``("kaiser", 8.6)``, ...
    padding : int
        Lines per independent line: the record is followed by ``padding - 1`` times its length of zeros.
    detrend : {"constant", "linear", None}
        What is taken off first.

    Returns
    -------
    Dataset
        Over ``frequency`` in Hz: ``amplitude``, ``phase`` (rad, of a cosine at the first sample), ``density``
        (power per Hz, one-sided).

    Raises
    ------
    ValueError
        If the record is shorter than 16 samples, has missing values, or its rate is not even.
    """
    from scipy import fft
    from scipy import signal as scipy_signal

    if rate is None:
        if not hasattr(x, "dims") or x.ndim != 1 or x.dims[0] not in x.coords:
            raise ValueError("rate is needed: the sample rate in Hz, or a DataArray with its time")
        times = x[x.dims[0]]
    else:
        times = np.arange(np.size(x)) / rate
    t, values = signal(times, x, least=16, purpose="a spectrum")
    rate = even_rate(t, x, "a spectrum") if rate is None else rate
    n = len(values)
    weights = scipy_signal.get_window(window, n)
    if detrend is not None:
        values = scipy_signal.detrend(values, type=detrend)
    lines = fft.rfft(values * weights, n * padding)
    frequency = fft.rfftfreq(n * padding, 1.0 / rate)
    amplitude = 2.0 * np.abs(lines) / weights.sum()
    density = 2.0 * np.abs(lines) ** 2 / (rate * (weights @ weights))
    alone = [0] if n * padding % 2 else [0, -1]  # the lines at 0 and at half the sample rate have no mirror image
    for one_sided in (amplitude, density):
        one_sided[alone] *= 0.5
    unit = unit_of(x, "")
    name = window if isinstance(window, str) else repr(window)
    return xr.Dataset(
        {
            "amplitude": labelled("frequency", amplitude, "amplitude", unit),
            "phase": labelled("frequency", np.angle(lines), "phase", "rad"),
            "density": labelled("frequency", density, "power density", f"({unit or 1})^2/Hz"),
        },
        {"frequency": labelled("frequency", frequency, "frequency", "Hz")},
        {
            "window": name,
            "rate": float(rate),
            "samples": n,
            "padding": padding,
            "grid_step": rate / n,
            "signal": whose(x, ""),
        },
    )


@checked
def peak(
    spectrum: xr.Dataset,
    *,
    low: float | None = None,
    high: float | None = None,
    interpolation: Literal["window", "parabola", "none"] = "window",
) -> Peak:
    """The largest peak of a spectrum between ``low`` and ``high`` Hz.

    Parameters
    ----------
    spectrum : Dataset
        As :func:`spectrum` gives.
    low, high : float, optional
        Bounds in Hz; default is the second line and the highest.
    interpolation : {"window", "parabola", "none"}
        ``"window"``: where the window's own transform has the three lines' ratios, which for one steady sinusoid is
        right but for its mirror image at negative frequency; wrong for a decay or two close peaks.
        ``"parabola"``: through the logarithms of the three largest lines, for any smooth peak; its bias for a steady
        sinusoid depends on the window. ``"none"``: the largest line itself, off by up to half the spacing.

    Returns
    -------
    Peak
        The error is that of white noise of the level seen beside the peak (for ``"none"``: of rounding to a line).
        Where leakage stands above the noise, as with ``"boxcar"``, it is the leakage that is seen there.

    Raises
    ------
    ValueError
        If the band holds fewer than three lines, or its largest line is at its edge (no peak inside).

    Notes
    -----
    No method can have a smaller error than sqrt(6) sigma / (pi A T sqrt(N)) for a sinusoid of amplitude A in white
    noise sigma, N samples over the time T: Rife and Boorstyn, IEEE Trans. Information Theory 20 (1974) 591-598.
    """
    frequency, amplitude = spectrum.frequency.values, spectrum.amplitude.values
    padding = spectrum.attrs["padding"]
    first = np.searchsorted(frequency, low) if low is not None else min(2 * padding, len(frequency) - 1)
    last = np.searchsorted(frequency, high, side="right") if high is not None else len(frequency)
    if last - first < 3:
        raise ValueError(
            f"the band {low} to {high} Hz holds {max(last - first, 0)} lines of this spectrum, {frequency[1]:.4g} Hz "
            "apart; at least 3 are needed: widen it, record longer, or pad"
        )
    k = int(first + np.argmax(amplitude[first:last]))
    if not 0 < k < len(frequency) - 1 or amplitude[k] < max(amplitude[k - 1], amplitude[k + 1]):
        raise ValueError(
            f"the largest line of the band stands at its edge, {frequency[k]:.4g} Hz: no peak inside; widen the band"
        )
    shape = _Shape(spectrum)
    # three neighbouring lines, referred to the middle of the record, in phase with the middle one
    turn = np.array([-1.0, 0.0, 1.0]) * np.pi * (shape.n - 1) / (shape.n * shape.padding)
    phase = spectrum.phase.values
    three = amplitude[k - 1 : k + 2] * np.cos(phase[k - 1 : k + 2] + turn - phase[k])
    delta, height = shape.interpolate(three, interpolation)
    spacing, step = float(frequency[1]), float(spectrum.attrs["grid_step"])
    if interpolation == "none":
        error = spacing / math.sqrt(12.0)
    else:
        error = spacing * shape.spread(three, _noise(spectrum, k), interpolation)
    place = float(frequency[k]) + delta * spacing
    return Peak(place, error, spacing * shape.bias(place / spacing, interpolation), step, height, interpolation)


def largest_line(t: FloatArray, values: FloatArray) -> float:
    """Angular frequency of the largest line; evenly interpolated, since this is only a start."""
    even = np.linspace(t[0], t[-1], len(t))
    return peak(spectrum(np.interp(even, t, values), (len(t) - 1) / (t[-1] - t[0]))).omega


def correlation_times(residuals: ArrayLike) -> float:
    r"""Number of samples that share one independent error: :math:`\tau = 1 + 2 \sum \rho_k`, at least 1.

    The sum stops at the first lag that is not positive (Geyer's initial sequence, Statist. Sci. 7 (1992) 473).
    """
    r = np.asarray(residuals, float)
    r = r - r.mean()
    n = len(r)
    if n < 4 or not r.any():
        return 1.0
    rho = np.fft.irfft(np.abs(np.fft.rfft(r, 2 * n)) ** 2, 2 * n)
    rho = rho[1 : 1 + n // 4] / rho[0]
    return float(1.0 + 2.0 * rho[: np.append(np.flatnonzero(rho <= 0), len(rho))[0]].sum())


class _Shape:
    """Transform of the window about its middle, in units of the lines' spacing; 1 at the peak, real."""

    def __init__(self, spectrum: xr.Dataset) -> None:
        import ast

        from scipy.signal import get_window

        self.n, self.padding = spectrum.attrs["samples"], spectrum.attrs["padding"]
        name = spectrum.attrs["window"]
        self.weights = get_window(ast.literal_eval(name) if name.startswith("(") else name, self.n)
        self.total = self.weights.sum()

    def _lines(self, weights: FloatArray) -> FloatArray:
        """Transform of weights about the middle of the record at offsets k / FINE, k = 0, 1, ...; real part."""
        from scipy import fft

        length = self.n * self.padding * FINE
        lines = fft.rfft(weights, length)
        return (lines * np.exp(1j * np.pi * (self.n - 1) * np.arange(len(lines)) / length)).real

    @cached_property
    def _all(self) -> FloatArray:
        return self._lines(self.weights) / self.total

    @cached_property
    def _near(self) -> Any:
        from scipy.interpolate import CubicSpline

        near = self._all[: 3 * FINE + 4]
        return CubicSpline(np.arange(len(near)) / FINE, near, bc_type=((1, 0.0), "not-a-knot"))

    def at(self, offset: ArrayLike) -> FloatArray:
        """Value at these distances from the peak, up to 3 spacings."""
        return self._near(np.abs(offset))

    def image(self, place: float) -> float:
        """Largest modulus within an independent line of the mirror image, 2 ``place`` spacings away."""
        low, high = (round((2.0 * place + side * self.padding) * FINE) for side in (-1, 1))
        return float(np.abs(self._all[max(low, 0) : min(high, len(self._all)) + 1]).max(initial=0.0))

    def interpolate(self, three: FloatArray, interpolation: str) -> tuple[float, float]:
        """Place of the peak from the middle line, in spacings, and its height."""
        from scipy.optimize import brentq

        if interpolation == "none" or three[1] == 0:
            return 0.0, float(three[1])
        if interpolation == "parabola":
            a, b, c = np.log(np.maximum(np.abs(three), 1e-12 * abs(three[1])))
            bend = a - 2 * b + c
            delta = 0.5 * (a - c) / bend if bend < 0 else 0.0
            return float(delta), float(np.exp(b - 0.25 * (a - c) * delta))
        wanted = (three[2] - three[0]) / three[1]

        def misfit(delta: float) -> float:
            left, middle, right = self.at([-1.0 - delta, -delta, 1.0 - delta])
            return (right - left) / middle - wanted

        ends = misfit(-0.75), misfit(0.75)
        if ends[0] * ends[1] >= 0:
            delta = 0.75 if abs(ends[1]) < abs(ends[0]) else -0.75
        else:
            delta = float(brentq(misfit, -0.75, 0.75, xtol=1e-12))
        return delta, float(three[1] / self.at(-delta))

    def spread(self, three: FloatArray, variance: float, interpolation: str) -> float:
        """Standard error of the place, in spacings, from white noise of this variance per sample."""
        if not math.isfinite(variance) or three[1] == 0:
            return math.nan
        step = 1e-5 * abs(three[1])
        ahead, behind = (
            np.array([self.interpolate(three + e, interpolation)[0] for e in side * np.eye(3)])
            for side in (step, -step)
        )
        slope = (ahead - behind) / (2 * step)
        lag = np.arange(3)
        squares = self._lines(self.weights**2)[::FINE][np.abs(np.subtract.outer(lag, lag))]
        C = 2.0 * variance / self.total**2 * squares
        return math.sqrt(max(slope @ C @ slope, 0.0))

    def bias(self, place: float, interpolation: str) -> float:
        """Bound for a steady sinusoid, in spacings: of the interpolation alone, and by the image at -frequency."""
        near = np.array([-1.0, 0.0, 1.0])
        own = 0.5 if interpolation == "none" else 0.0
        places = np.linspace(-0.5, 0.5, 11)
        threes = self.at(near - places[:, None])
        if interpolation == "parabola":
            own = max(abs(self.interpolate(three, "parabola")[0] - p) for three, p in zip(threes, places, strict=True))
        # The image's leakage may add to one neighbouring line and take from the other.
        leak = self.image(place)
        how = "window" if interpolation == "none" else interpolation
        moved = [
            abs(self.interpolate(three + leak * e, how)[0] - self.interpolate(three, how)[0])
            for three in threes[::5]
            for e in np.array([[1.0, 0, -1], [1, -1, 1], [-1, 1, -1]])
        ]
        return own + min(max(moved), 0.5)


def _noise(spectrum: xr.Dataset, k: int) -> float:
    """Variance per sample of white noise, from the median density between 4 and 40 independent lines from the peak."""
    density = spectrum.density.values[1:]
    away = np.abs(np.arange(1, len(density) + 1) - k) / spectrum.attrs["padding"]
    beside = density[(away > 4) & (away < 40)]
    if len(beside) == 0:
        return math.nan
    # The mean of an exponential distribution from its median; half the sample rate is the band.
    return np.median(beside) / math.log(2.0) * spectrum.attrs["rate"] / 2.0
