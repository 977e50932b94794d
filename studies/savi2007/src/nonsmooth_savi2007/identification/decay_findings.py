r"""Findings of free decays: the natural frequency (Fig. 5), the car's damping, and the support's (Fig. 7).

**Natural frequency.** The paper reads 0.732 Hz, 4.60 rad/s, off the DFT's largest value, against 4.50 rad/s from
stiffness and mass. 0.732 Hz is the 15th value of a DFT of 2048 samples at 100 Hz, whose values stand 0.0488 Hz,
0.307 rad/s, apart: those beside 4.50 rad/s are 4.295 and 4.602, nothing between the two could have been read, and the
reading is 4.60 +- 0.15 rad/s. Between the grid's values the transform of the whole record is known too. Its peak is
not the natural frequency either: that of a tap,
:math:`|X| \propto [(\omega_0^2 - \omega^2)^2 + b^2\omega^2]^{-1/2}`, stands at :math:`\sqrt{\omega_0^2 - b^2/2}`,
1.3 % below for the paper's damping (and the grid's largest value at 4.295); that of a car let go from a displacement,
:math:`|X| \propto [(\omega^2 + b^2)/\ldots]^{1/2}`, within 0.1 % of :math:`\omega_0` (and the grid's largest at 4.602,
as the paper has it). Dry friction moves it further, 0.6 % down for 5 mN and a tap. So the value stated is that of the
fit in the time domain.

**Damping, viscous and dry.** From a height h the car swings about :math:`\pm\delta`, :math:`\delta = f/\omega_0^2`, and
turns at :math:`q (h - \delta) - \delta` on the other side, :math:`q = e^{-\pi b/(2\omega_d)}`. The heights lie on

.. math::

    h(t) = (h_0 + h_*)\, e^{-b t/2} - h_*, \qquad h_* = \delta\,\frac{1 + q}{1 - q},

a straight line in the logarithm where there is no friction, bent down towards the end where there is.

**The support's damping** by logarithmic decrement over many cycles of a test mass on its spring,

.. math::

    \ln|x_n| = \ln x_0 - \frac{c_s}{2M} t_n, \qquad \xi_s = \frac{c_s}{2\sqrt{k_s M}}

The paper compares two successive peaks; here the logarithms of all of them are fitted by a line, each with the error
that one count makes of it, and beside it the whole decay in the time domain, which also tells :math:`\omega_s`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import zoom_fft

from nonsmooth import SolveError
from nonsmooth.arrays import FloatArray
from nonsmooth.identification import Estimate, Finding
from nonsmooth.recordings import Quantity
from nonsmooth_savi2007.identification.evidence import Run, picture_data
from nonsmooth_savi2007.identification.free_decay import Decay, DecayFit, free_decay

_SLOWEST = 0.02  # m/s, of the slowest half swing of the test mass that is used
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
    at = minimize_scalar(
        lambda f: -abs(np.exp(-2j * np.pi * f * time) @ x), bounds=(about - step, about + step), options={"xatol": 1e-9}
    ).x
    wave = np.exp(-2j * np.pi * at * time)
    value, first, second = (np.sum((-2j * np.pi * time) ** n * x * wave) for n in range(3))
    bend = 2 * ((np.conj(value) * second).real + abs(first) ** 2)
    delay = (1j * first / value).real / (2 * np.pi)
    own = 2 * np.pi * noise * np.sqrt(np.sum((time - delay) ** 2))
    return at, np.sqrt(2) * abs(value) * own / abs(bend)


def natural_frequency(decay: DecayFit) -> Finding:
    r"""The undamped natural frequency by decay, with the DFT's peak, its grid and its interpolation beside it.

    Parameters
    ----------
    decay : DecayFit
        Of the taps.

    Returns
    -------
    Finding
        :math:`\omega_0` (rad/s). ``others``: ``dft_grid``, the largest value of a DFT of 2048 samples, known to half a
        step; ``dft_peak``, its peak by interpolation; ``dft_undamped``, :math:`\sqrt{\omega_p^2 + b^2/2}` from it.
    """
    largest = max(range(len(decay.parts)), key=lambda i: np.ptp(decay.parts[i].run.positions))
    run, begin, end = decay.parts[largest]
    time, x = run.time, run.positions - decay.rest
    rate = (len(time) - 1) / (time[-1] - time[0])
    magnitude = np.abs(np.fft.rfft(x, GRID)) / rate
    frequency = np.fft.rfftfreq(GRID, 1 / rate)
    grid_step = rate / GRID
    top = 1 + int(np.argmax(magnitude[1:]))
    peak, spread = spectral_peak(time, x, frequency[top], grid_step, decay.noise)
    (value, b, _), error = decay.law, decay.error("omega_0")
    fitted = np.full(len(x), np.nan)
    fitted[begin:end] = decay.fitted(largest) - decay.rest
    grid = 2 * np.pi * grid_step
    at_peak, peak_error = 2 * np.pi * peak, 2 * np.pi * spread
    undamped = np.sqrt(at_peak**2 + b**2 / 2)
    below = grid * np.floor(value / grid)
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
    ends = frequency[[max(top - 12, 1), top + 12]]
    between = np.abs(zoom_fft(x, ends, m=FINE, fs=rate, endpoint=True)) / rate
    data = picture_data(
        [run],
        {
            "time": {"time": time, "x": x, "fitted": fitted},
            "frequency": {"frequency": frequency, "magnitude": magnitude},
            "fine_frequency": {"fine_frequency": np.linspace(ends[0], ends[1], FINE), "fine_magnitude": between},
        },
        grid_step=grid_step,
        grid_peak=frequency[top],
        peak_frequency=Estimate(peak, spread, "Hz"),
        decay_frequency=Estimate(value, error).times(1 / (2 * np.pi), unit="Hz"),
    )
    return Finding(
        "omega_0",
        Estimate(value, error, "rad/s"),
        "free decay in the time domain, viscous damping and dry friction",
        decay.samples,
        decay.runs,
        notes,
        {
            "dft_grid": Estimate(2 * np.pi * frequency[top], grid / np.sqrt(12), "rad/s", half_width=grid / 2),
            "dft_peak": Estimate(at_peak, peak_error, "rad/s"),
            "dft_undamped": Estimate(undamped, peak_error * at_peak / undamped, "rad/s"),
        },
        data=data,
        plot="impulse_response",
    )


def envelope(time: FloatArray, first: float, omega_0: float, b: float, f: float) -> FloatArray:
    """Heights of the turning points of a free decay (m) over the time since the first of height ``first``.

    Zero from where friction holds the car.
    """
    q = np.exp(-np.pi * b / (2 * np.sqrt(omega_0**2 - b**2 / 4)))
    below = f / omega_0**2 * (1 + q) / (1 - q)
    return np.maximum((first + below) * np.exp(-b * time / 2) - below, 0.0)


def decay_damping(decay: DecayFit, mass: Quantity) -> Finding:
    r"""Viscous damping and dry friction from the shape of free decays, with the decrement of the same decays beside it.

    Parameters
    ----------
    decay : DecayFit
        Of the taps, by `free_decay`.
    mass : Quantity
        Mass (kg) with its standard uncertainty.

    Returns
    -------
    Finding
        c (N s/m). ``others``: ``friction`` (N), ``c_viscous_only`` by the logarithmic decrement of the same
        decays; ``covariance`` is that of c and friction.
    """
    # the first turning point lies within a sample of where the fit begins
    peaks = [log_decrement(part._replace(first=max(part.first - 3, 0)), decay.rest) for part in decay.parts]
    lines = [decay_rate(*row) for row in peaks if len(row[0]) > 2]
    if not lines:
        raise SolveError(
            f"no tap has three turning points that stand {decay.parts[0].run.resolution:g} m apart, so its decrement "
            "is not known: a motion that does not decay, or a length on the pulley that is wrong"
        )
    plain = _damping(lines, mass)
    own = mass.value**2 * decay.covariance[1:3, 1:3]
    covariance = own + mass.uncertainty**2 * np.outer(decay.values[1:3], decay.values[1:3])
    c, friction = (
        Estimate(mass.value * value, np.sqrt(variance), unit)
        for value, variance, unit in zip(decay.law[1:], np.diag(covariance), ("N s/m", "N"), strict=True)
    )
    related = own[0, 1] / np.sqrt(own[0, 0] * own[1, 1]) if own[1, 1] else 0.0
    widest = max(range(len(peaks)), key=lambda i: np.ptp(decay.parts[i].x))
    at, height, error = peaks[widest]
    slope, intercept, _ = decay_rate(at, height, error)
    fine = np.linspace(0.0, at[-1] - at[0], 200)
    data = picture_data(
        [decay.parts[widest].run],
        {
            "peak": {"peak_time": at - at[0], "peak_height": height, "peak_height_error": error},
            "fine_time": {
                "fine_time": fine,
                "envelope_both": envelope(fine, height[0], *decay.law),
                "envelope_viscous": np.exp(intercept + slope * (at[0] + fine)),
            },
        },
        c=c,
        friction_force=friction,
    )
    return Finding(
        "c_decay",
        c,
        "free decays, viscous damping and dry friction at once",
        decay.samples,
        decay.runs,
        (
            f"by their logarithmic decrement, without friction, the same decays give {plain.value:.4g} N s/m, "
            f"{100 * (plain.value / c.value - 1):+.1f} %",
            f"c and the dry friction are told apart by the shape; correlation {related:+.2f}",
            *decay.notes,
        ),
        {"friction": friction, "c_viscous_only": plain},
        covariance,
        data,
        "free_decay",
    )


def log_decrement(part: Decay, rest: float) -> tuple[FloatArray, ...]:
    """Times, heights and errors of the turning points of a decay, each by a parabola through five samples.

    Only points higher than ten counts are taken.
    """
    time, away, resolution = part.time, part.x - rest, part.run.resolution
    size = np.abs(away)
    top = (size[2:-2] >= size[1:-3]) & (size[2:-2] > size[3:-1]) & (size[2:-2] >= 10 * resolution)
    rows = []
    for i in np.flatnonzero(top) + 2:
        t = time[i - 2 : i + 3] - time[i]
        c0, c1, c2 = np.polynomial.polynomial.polyfit(t, away[i - 2 : i + 3], 2)
        if c2 * c0 >= 0:
            continue
        at = -c1 / (2 * c2)
        if abs(at) <= t[-1]:
            rows.append((time[i] + at, abs(c0 + c1 * at + c2 * at**2)))
    found = np.array(rows).reshape(-1, 2)
    # a parabola through five samples has 0.7 of one sample's error at its top
    return *found.T, np.full(len(found), 0.7 * resolution / np.sqrt(12))


def decay_rate(t: FloatArray, height: FloatArray, error: FloatArray) -> tuple[float, float, float]:
    """Slope (1/s) and intercept of the line through the logarithms of the heights, and the slope's variance."""
    line, covariance = np.polyfit(t, np.log(height), 1, w=height / error, cov=True)
    return *line.tolist(), covariance[0, 0]


def _damping(lines: Sequence[tuple[float, float, float]], mass: Quantity, spread: float = 0.0) -> Estimate:
    """Damping constant by lines through the logarithms of heights; its rate is known no better than to ``spread``."""
    slopes, _, variances = np.transpose(lines)
    error = max(2 / np.sqrt(np.sum(1 / variances)), spread)
    rate = Estimate(-2 * np.average(slopes, weights=1 / variances), error)
    return rate.times(mass.value, mass.uncertainty, "N s/m")


def support_damping(runs: Sequence[Run], *, test_mass: Quantity) -> tuple[Finding, DecayFit]:
    """Damping of the support with a test mass on it, and the fit of the whole decays.

    Parameters
    ----------
    runs : sequence of Run
        Free decays of the test mass.
    test_mass : Quantity
        Its mass (kg).
    """
    decay = free_decay(runs, slowest=_SLOWEST, friction=False)
    notes, lines = list(decay.notes), []
    for part in decay.parts:
        peaks = log_decrement(part, decay.rest)
        if len(peaks[0]) < 4:
            notes.append(
                f"run {part.run.name!r}: no logarithmic decrement, {len(peaks[0])} turning points above ten counts"
            )
        else:
            lines.append((part.run, peaks, decay_rate(*peaks)))
    if not lines:
        raise ValueError("no drop has four turning points above ten counts: drop it from higher, or record longer")
    mass, natural = test_mass.value, decay.law[0]
    rates = [line for _, _, line in lines]
    spread = 2 * (np.std([slope for slope, *_ in rates], ddof=1) / np.sqrt(len(rates))) if len(rates) > 1 else 0.0
    c_s, ratio = _damping(rates, test_mass, spread), _damping(rates, Quantity(0.5 / natural), spread)
    run, (t, height, error), (slope, intercept, variance) = lines[0]
    data = picture_data(
        [run],
        {
            "time": {"time": run.time, "x": run.positions - decay.rest},
            "peak": {
                "peak_time": t,
                "peak_height": height,
                "log_height": np.log(height),
                "log_height_error": error / height,
            },
        },
        intercept=intercept,
        slope=Estimate(slope, np.sqrt(variance), "1/s"),
        damping_ratio=Estimate(-slope / natural, np.sqrt(variance) / natural),
    )
    finding = Finding(
        "c_s_drop",
        replace(c_s, logarithmic=c_s.value > 0),
        "logarithmic decrement, regression over all turning points (Fig. 7)",
        decay.samples,
        decay.runs,
        tuple(notes),
        others={
            "c_s_fit": Estimate(decay.law[1], decay.error("b")).times(mass, test_mass.uncertainty, "N s/m"),
            "omega_s": Estimate(natural, decay.error("omega_0"), "rad/s"),
            "damping_ratio": replace(ratio, unit=""),
        },
        data=data,
        plot="drop_decay",
    )
    return finding, decay
