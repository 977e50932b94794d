"""A steady response: its frequency far below the grid of a transform, and whether its amplitude tells any decay.

A record that begins and ends with the same amplitude holds no free decay. With the drive on, the amplitude is
constant whatever the damping is; so what such a record says of damping is nothing, and this module says so from the
amplitudes it finds, in place of a number.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.recording import examine
from nonsmooth.recordings.signals.checks import signal, unit_of, whose
from nonsmooth.recordings.signals.harmonics import fit
from nonsmooth.recordings.signals.spectrum import largest_line, peak, spectrum
from nonsmooth.results.labels import labelled


@dataclass(frozen=True, eq=False)
class SteadyResponse:
    """Frequency and change of amplitude of a response at one frequency.

    Attributes
    ----------
    frequency, frequency_error : float
        Hz, in the clock of the recorder, with everything that the record itself says of the error.
    by_method : mapping of str to (frequency, error)
        ``fit`` (harmonics and frequency by least squares over the whole record), ``phase`` (slope of the phase over
        blocks of whole periods) and, at an even rate, ``spectrum`` (peak between the lines under a Hann window), Hz.
        They share the data, not the method.
    amplitude, amplitude_error : float
        Of the fundamental, in the signal's unit.
    rate, rate_error : float
        Of the envelope A exp(-rate t), 1/s, by regression of ln A over the blocks.
    decays : bool
        Whether the amplitude falls by more than its errors explain.
    blocks : Dataset
        Over ``block``: ``time``, ``amplitude``, ``phase`` (less that of the fitted frequency) and their errors.
    """

    frequency: float
    frequency_error: float
    by_method: dict[str, tuple[float, float]]
    amplitude: float
    amplitude_error: float
    rate: float
    rate_error: float
    decays: bool
    length: float
    name: str
    blocks: xr.Dataset = field(repr=False)

    @property
    def rate_bound(self) -> float:
        """A free decay in this record would be slower than this (1/s), with a confidence of 95 %."""
        from scipy.stats import t as student

        reach = float(student.ppf(0.95, max(self.blocks.sizes["block"] - 2, 1)))
        return max(self.rate, 0.0) + reach * self.rate_error

    @property
    def damping_bound(self) -> float:
        """Damping ratio of such a decay, rate_bound / (2 pi frequency)."""
        return self.rate_bound / (2.0 * math.pi * self.frequency)

    @property
    def statement(self) -> str:
        """Statement on what the record tells of damping."""
        seen = (
            f"{self.name}: the envelope changes at {-self.rate:+.2g} ± {self.rate_error:.2g} 1/s over "
            f"{self.length:.3g} s"
        )
        if self.decays:
            return f"{seen}: it decays; fit the decay itself (free_decay)"
        if self.rate < -3.0 * self.rate_error:
            return f"{seen}: it still grows, so it is no steady response; wait longer before recording"
        return (
            f"{seen}, which is none within its error: the damping cannot be identified from this record. A free decay "
            f"would be slower than {self.rate_bound:.2g} 1/s (95 %), a damping ratio below {self.damping_bound:.1g}; "
            "under a steady drive the amplitude is constant whatever the damping. Record on after the drive is "
            "switched off, or at several frequencies about the resonance"
        )

    def __str__(self) -> str:
        rows = [f"{self.name}: {self.frequency:.5f} ± {self.frequency_error:.5f} Hz"]
        rows += [f"  by {name}: {value:.5f} ± {error:.5f} Hz" for name, (value, error) in self.by_method.items()]
        return "\n".join([*rows, f"  {self.statement}"])


def steady_response(
    time: ArrayLike, x: Any, omega: float | None = None, *, harmonics: int = 6, blocks: int = 12
) -> SteadyResponse:
    r"""Frequency and envelope of a response at one frequency.

    The whole record is fitted by a mean and harmonics with their frequency free. Then each of ``blocks`` pieces of
    whole periods is fitted alone at that frequency, which gives amplitudes :math:`A_b` and phases :math:`\varphi_b`;
    their lines over time, :math:`\ln A_b = \ln A - \sigma t` and :math:`\varphi_b = \varphi - \delta t`, are the decay
    rate and a second reading of the frequency, :math:`(\omega + \delta) / 2\pi`. Errors of the lines come from the
    scatter of the blocks about them and hold what is not white within a block: side bands and drifts.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Seconds and values.
    omega : float, optional
        About where, in rad/s; without it, the largest line of the spectrum.
    harmonics : int
        Harmonics of the fit, as far as half the sample rate lets them.
    blocks : int
        Blocks, at least 5; each holds at least 3 periods.

    Returns
    -------
    SteadyResponse
        The frequency is that of the fit; its error is the largest of the fit's, the line's, and half of what all
        methods differ. The recorder's clock comes on top: 50 parts per million are common.

    Raises
    ------
    ValueError
        If the record is shorter than 15 periods, or values are missing.
    """
    t, values = signal(time, x, least=64, purpose="a steady response")
    name = whose(x)
    length = float(t[-1] - t[0])
    if omega is None:
        omega = largest_line(t, values)
    rate = (len(t) - 1) / length
    harmonics = max(1, min(harmonics, int(0.95 * math.pi * rate / omega)))
    periods = omega * length / (2.0 * math.pi)
    count = min(blocks, int(periods // 3))
    if count < 5:
        raise ValueError(
            f"{name}: holds {periods:.3g} periods; at least 15 are needed to tell whether its amplitude changes: "
            "record longer"
        )
    whole = fit(t, values, omega, harmonics, refine=True)
    per = int(periods // count) * 2.0 * math.pi / whole.omega
    rows = []
    first = t[0] + 0.5 * (length - count * per)
    for b in range(count):
        begin = first + b * per
        here = (t >= begin - 1e-9 * per) & (t < begin + per * (1.0 - 1e-9))
        # Time from the block's middle: there amplitude and phase are independent of each other.
        middle = begin + 0.5 * per
        one = fit(t[here] - middle, values[here], whole.omega, harmonics) if np.count_nonzero(here) else whole
        expected = whole.phases[0] - whole.omega * middle
        phase = math.remainder(one.phases[0] - expected, 2.0 * math.pi)
        rows.append((middle, one.amplitudes[0], phase, one.amplitude_errors[0], one.phase_errors[0]))
    middles, sizes, phases, size_errors, phase_errors = np.array(rows).T
    decay, decay_error = _slope(middles, np.log(sizes), size_errors / sizes)
    turn, turn_error = _slope(middles, phases, phase_errors)
    by_fit = whole.omega / (2.0 * math.pi)
    methods = {
        "fit": (by_fit, whole.omega_error / (2.0 * math.pi)),
        "phase": ((whole.omega - turn) / (2.0 * math.pi), turn_error / (2.0 * math.pi)),
    }
    if examine(t).regular:
        line = peak(spectrum(values, rate), low=0.9 * by_fit, high=1.1 * by_fit)
        methods["spectrum"] = (line.frequency, math.hypot(line.error, line.bias))
    found = np.array(list(methods.values()))
    error = max(float(found[:2, 1].max()), 0.5 * float(np.ptp(found[:, 0])))
    unit = unit_of(x, "")
    table = xr.Dataset(
        {
            "time": labelled("block", middles, "middle of the block", "s"),
            "amplitude": labelled("block", sizes, "amplitude of the fundamental", unit),
            "amplitude_error": ("block", size_errors, {"units": unit}),
            "phase": labelled("block", phases, "phase less that of the fitted frequency", "rad"),
            "phase_error": ("block", phase_errors, {"units": "rad"}),
        },
        attrs={"signal": name, "frequency": by_fit, "rate": -decay, "rate_error": decay_error},
    )
    return SteadyResponse(
        by_fit,
        error,
        methods,
        float(whole.amplitudes[0]),
        float(whole.amplitude_errors[0]),
        -decay,
        decay_error,
        -decay > 3.0 * decay_error,
        length,
        name,
        table,
    )


def _slope(t: FloatArray, y: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Slope of a line and its error: by the scatter about it, and at least by the errors of the points."""
    line, covariance = np.polyfit(t, y, 1, cov="unscaled")
    left = y - np.polyval(line, t)
    power = left @ left
    # Neighbouring blocks that err alike say less.
    alike = max(left[1:] @ left[:-1] / power, 0.0) if power > 0 else 0.0
    inflation = (1.0 + alike) / (1.0 - min(alike, 0.8))
    variance = max(power / (len(t) - 2) * inflation, np.mean(errors**2))
    return float(line[0]), math.sqrt(variance * covariance[0, 0])
