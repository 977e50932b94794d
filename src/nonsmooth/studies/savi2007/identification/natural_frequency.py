r"""Natural frequency from an impulse response: the DFT's peak, interpolated, and the decay itself (Fig. 5).

The paper reads 0.732 Hz, 4.60 rad/s, off the DFT's largest value, against 4.50 rad/s from stiffness and mass. 0.732 Hz
is the 15th value of a DFT of 2048 samples at 100 Hz, whose values stand 0.0488 Hz, 0.307 rad/s, apart: those beside
4.50 rad/s are 4.295 and 4.602, nothing between the two could have been read, and the reading is 4.60 +- 0.15 rad/s.

Between the grid's values the transform of the whole record is known too. Its peak is not the natural frequency
either: that of a tap, :math:`|X| \propto [(\omega_0^2 - \omega^2)^2 + b^2\omega^2]^{-1/2}`, stands at
:math:`\sqrt{\omega_0^2 - b^2/2}`, 1.3 % below for the paper's damping (and the grid's largest value at 4.295); that of
a car let go from a displacement, :math:`|X| \propto [(\omega^2 + b^2)/\ldots]^{1/2}`, within 0.1 % of :math:`\omega_0`
(and the grid's largest at 4.602, as the paper has it). Dry friction moves it further, 0.6 % down for 5 mN and a tap.
So the value stated is that of the fit in the time domain.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.studies.savi2007.identification.evidence import Run
from nonsmooth.studies.savi2007.identification.free_decay import DecayFit

__all__ = ["natural_frequency", "spectral_peak"]


GRID = 2048  # samples of the paper's DFT: 100 Hz / 2048 * 15 = 0.732 Hz
FINE = 400  # frequencies between its values about the peak


def spectral_peak(time: FloatArray, x: FloatArray, about: float, step: float, noise: float) -> tuple[float, float]:
    r"""Frequency (Hz) at which the transform of a record is largest, and what noise makes of it.

    Parameters
    ----------
    time, x : array (n,)
        The record, at rest at both ends.
    about, step : float
        It is sought within ``step`` of ``about`` (Hz).
    noise : float
        Standard deviation of a sample.

    Notes
    -----
    With :math:`S = |X|^2` the peak errs by :math:`\sqrt 2\, |X| \sigma_{X'} / |S''|`, where the noise of :math:`X'` is
    :math:`2\pi\sigma` times the root of :math:`\sum (t - \bar t)^2`, :math:`\bar t` the delay of the peak.
    """
    low, high = about - step, about + step
    for _ in range(3):
        f, magnitude = _between(time, x, low, high)
        top = int(np.clip(np.argmax(magnitude), 1, FINE - 2))
        low, high = float(f[top - 1]), float(f[top + 1])
    at = 0.5 * (low + high)
    wave = np.exp(-2j * np.pi * at * time)
    value, first, second = (np.sum((-2j * np.pi * time) ** n * x * wave) for n in range(3))
    bend = 2 * float((np.conj(value) * second).real + abs(first) ** 2)
    delay = float((1j * first / value).real) / (2 * np.pi)
    own = 2 * np.pi * noise * float(np.sqrt(np.sum((time - delay) ** 2)))
    return at, float(np.sqrt(2) * abs(value) * own / abs(bend))


def _between(time: FloatArray, x: FloatArray, low: float, high: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies between two (Hz), and the modulus of the sum of the samples there."""
    from scipy.signal import zoom_fft

    rate = (len(time) - 1) / float(time[-1] - time[0])
    lines = zoom_fft(x, [low, high], m=FINE, fs=rate, endpoint=True)
    return np.linspace(low, high, FINE), np.abs(lines)


def natural_frequency(runs: Sequence[Run], decay: DecayFit) -> Finding:
    r"""The undamped natural frequency by decay, with the DFT's peak, its grid and its interpolation beside it.

    Parameters
    ----------
    runs : sequence of Run
        The taps.
    decay : DecayFit
        Their free decays.

    Returns
    -------
    Finding
        :math:`\omega_0` (rad/s). ``others``: ``dft_grid``, the largest value of a DFT of 2048 samples, known to half a
        step; ``dft_peak``, its peak by interpolation; ``dft_undamped``, :math:`\sqrt{\omega_p^2 + b^2/2}` from it.
    """
    import xarray as xr

    used = [runs[i] for i in decay.runs]
    largest = max(range(len(used)), key=lambda i: float(np.ptp(used[i].positions)))
    run = used[largest]
    time, x = run.time, run.positions - decay.values[3]
    rate = (len(time) - 1) / float(time[-1] - time[0])
    record = np.zeros(max(GRID, len(x)))
    record[: len(x)] = x
    magnitude = np.abs(np.fft.rfft(record[:GRID])) / rate
    frequency = np.fft.rfftfreq(GRID, 1 / rate)
    grid_step = rate / GRID
    top = 1 + int(np.argmax(magnitude[1:]))
    peak, spread = spectral_peak(time, x, float(frequency[top]), grid_step, decay.noise)
    value, error, b = float(decay.values[0]), decay.error("omega_0"), float(decay.values[1])
    begin, end = decay.spans[largest]
    fitted = np.full(len(x), np.nan)
    fitted[begin:end] = decay.fitted(largest) - decay.values[3]
    grid = 2 * np.pi * grid_step
    at_peak, peak_error = 2 * np.pi * peak, 2 * np.pi * spread
    undamped = float(np.sqrt(at_peak**2 + b**2 / 2))
    below = 2 * np.pi * grid_step * np.floor(value / grid)
    notes = (
        f"the largest value of a DFT of {GRID} samples stands at {frequency[top]:.4f} Hz, "
        f"{2 * np.pi * frequency[top]:.3f} rad/s, on a grid of {grid_step:.4f} Hz = {grid:.3f} rad/s: it says no more "
        f"than ±{grid / 2:.2f} rad/s; beside {value:.3f} it could only be {below:.3f} or {below + grid:.3f}",
        "so the paper's 4.60 rad/s (0.732 Hz, the 15th value of such a grid at 100 Hz) does not contradict its 4.50 "
        "from stiffness and mass: the neighbours of 4.50 are 4.295 and 4.602",
        f"between the grid's values the peak stands at {at_peak:.3f} rad/s; the damping of a tapped car moves it to "
        f"sqrt(omega_0^2 - b^2/2), so that it stands for {undamped:.3f} rad/s, where {value:.3f} is found in the time "
        "domain: the rest is dry friction's",
        *decay.notes,
    )
    data = xr.Dataset(
        {
            "x": ("time", x, {"units": "m"}), "fitted": ("time", fitted, {"units": "m"}),
            "magnitude": ("frequency", magnitude, {"units": "m s"}),
            "peak_frequency": ((), peak, {"units": "Hz"}), "peak_frequency_error": ((), spread, {"units": "Hz"}),
            "grid_step": ((), grid_step, {"units": "Hz"}), "grid_peak": ((), frequency[top], {"units": "Hz"}),
            "decay_frequency": ((), value / (2 * np.pi), {"units": "Hz"}),
            "decay_frequency_error": ((), error / (2 * np.pi), {"units": "Hz"}),
        },
        {"time": time, "frequency": frequency}, {"synthetic": "yes" if run.synthetic else "no"},
    )  # fmt: skip
    fine, between = _between(time, x, float(frequency[max(top - 12, 1)]), float(frequency[top + 12]))
    data["fine_magnitude"] = ("fine_frequency", between / rate)
    data["fine_frequency"] = ("fine_frequency", fine, {"units": "Hz"})
    return Finding(
        "omega_0", Estimate(value, error, "rad/s"), "free decay in the time domain, viscous damping and dry friction",
        decay.samples, tuple(r.name for r in used), notes,
        {
            "dft_grid": Estimate(2 * np.pi * float(frequency[top]), grid / np.sqrt(12), "rad/s", half_width=grid / 2),
            "dft_peak": Estimate(at_peak, peak_error, "rad/s"),
            "dft_undamped": Estimate(undamped, peak_error * at_peak / undamped, "rad/s"),
        },
        data=data, plot="impulse_response",
    )  # fmt: skip
