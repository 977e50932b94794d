"""The phase of the drive: from a photogate that sees each turn of the crank, or by a fit to what it moves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray, IntArray
from nonsmooth.recordings.signals.checks import signal, warn, whose

TURN = 2.0 * math.pi


@dataclass(frozen=True, eq=False)
class DrivePhase:
    """Phase of the drive over time.

    Attributes
    ----------
    omega, omega_error : float
        Mean angular frequency in rad/s with its standard error.
    t_0, t_0_error : float
        A time at which the phase is a multiple of 2 pi (the first turn, or the first maximum of the fundamental). By
        gate its error is that of any instant of a phase: by how far one turn lies off its neighbours, as the gate's
        noise and a motor that is uneven from turn to turn make it, and no less than the gate's resolution.
    scatter : float
        Root mean square of the turn times about the straight line through them, in seconds: the gate's resolution,
        and how unevenly the motor runs from turn to turn. By fit: that of the signal about its fundamental, as a time.
    method : {"photogate", "fit"}
    turn_times : ndarray
        The times at which the phase passed a multiple of 2 pi (by fit: computed ones).
    turns : ndarray of int
        Their numbers; a turn that the gate missed is a gap in them.
    span : (float, float)
        The first and the last time at which the phase is known.
    """

    omega: float
    omega_error: float
    t_0: float
    t_0_error: float
    scatter: float
    method: str
    turn_times: FloatArray = field(repr=False)
    turns: IntArray = field(repr=False)
    span: tuple[float, float]

    @property
    def period(self) -> float:
        """Mean duration of a turn in seconds."""
        return TURN / self.omega

    def phase(self, time: ArrayLike) -> FloatArray:
        """Unwrapped phase in rad, 0 at ``t_0``; straight between turns, and with the mean frequency beyond them."""
        return _straight(np.asarray(time, float), self.turn_times, TURN * self.turns, self.omega)

    @property
    def coarser(self) -> DrivePhase:
        """The same drive known from every other turn only: how far its phase differs is what a turn may hide."""
        return replace(self, turn_times=self.turn_times[::2], turns=self.turns[::2])

    def wander(self, resolution: float = 1e-4) -> tuple[float, bool]:
        """Relative standard deviation of the frequency from turn to turn, and whether chance explains it.

        The part that a gate of this ``resolution`` (s) makes is taken out. What repeats with every turn does not show.
        """
        from scipy.stats import chi2

        steps = np.diff(self.turn_times) / np.diff(self.turns)
        seen, gate = steps.var(ddof=1), resolution**2 / 6
        steady = bool(chi2.sf(seen / gate * (len(steps) - 1), len(steps) - 1) > 1e-4)
        return float(np.sqrt(max(seen - gate, 0.0)) / np.mean(steps)), steady

    def times(self, phase: float = 0.0) -> FloatArray:
        """The instants within ``span`` at which the phase is ``phase`` (in turns, 0 to 1) plus a whole number."""
        low, high = self.span
        first, last = self.phase(np.array([low, high])) / TURN - phase
        wanted = np.arange(math.ceil(first - 1e-12), math.floor(last + 1e-12) + 1) + phase
        return np.clip(_straight(wanted, self.turns, self.turn_times, self.period), low, high)


def _straight(at: FloatArray, x: Any, y: Any, slope: float) -> FloatArray:
    """Straight from point to point, and with this slope beyond the first and the last."""
    beyond = np.minimum(at - x[0], 0.0) + np.maximum(at - x[-1], 0.0)
    return np.interp(at, x, y) + slope * beyond


def drive_phase(
    time: ArrayLike,
    x: Any = None,
    *,
    omega: float | None = None,
    resolution: float = 1e-4,
    span: tuple[float, float] | None = None,
) -> DrivePhase:
    """Phase of the drive, from the times of its turns or, with ``x``, by a fit to the motion.

    With a photogate the frequency is the slope of the straight line through turn number over time,
    t_j = t_0 + 2 pi j / omega, and the phase itself runs straight from each turn to the next: a slow drift is
    followed, an unevenness within a turn is not seen. By fit, omega is that which a mean, a fundamental and two
    harmonics fit best, and the phase is 0 at the maxima of the fundamental of ``x``: it lags behind the drive's
    own phase by the angle of the response.

    Parameters
    ----------
    time : array_like
        Times of the turns (a photogate's ``Turn`` channel: its axis); with ``x``, those of the samples.
    x : array_like, optional
        Position or force.
    omega : float, optional
        By fit: about the drive's angular frequency. Without it that of the largest peak of the spectrum is taken,
        which is not the drive's where the motion is subharmonic or chaotic.
    resolution : float
        Of the photogate's times in seconds; it keeps the errors from being understated.
    span : (float, float), optional
        First and last time of the record; default is that of the first and last turn, or of the samples.

    Returns
    -------
    DrivePhase

    Raises
    ------
    ValueError
        If there are fewer than three turns, or the record holds fewer than three of them.
    """
    if x is None:
        return _by_gate(time, resolution, span)
    from nonsmooth.recordings.signals import harmonics
    from nonsmooth.recordings.signals.spectrum import largest_line

    t, values = signal(time, x, least=16, purpose="finding the drive's phase")
    omega = largest_line(t, values) if omega is None else omega
    if omega * (t[-1] - t[0]) < 3 * TURN:
        raise ValueError(
            f"{whose(x)}: {t[-1] - t[0]:.4g} s hold fewer than three turns at {omega:.4g} rad/s: record longer"
        )
    found = harmonics.fit(t, x, omega, 3, refine=True)
    t_0 = t[0] + ((float(found.phases[0]) - found.omega * t[0]) % TURN) / found.omega
    turns = np.arange(math.floor((t[-1] - t_0) / found.period) + 1)
    # Phase and frequency are correlated; the error of the phase is least in the middle of the record.
    error = float(found.phase_errors[0]) / found.omega
    scatter = found.residual / (found.omega * float(found.amplitudes[0]))
    return DrivePhase(
        found.omega,
        found.omega_error,
        t_0,
        error,
        scatter,
        "fit",
        t_0 + turns * found.period,
        turns,
        (float(t[0]), float(t[-1])) if span is None else span,
    )


def _by_gate(time: Any, resolution: float, span: tuple[float, float] | None) -> DrivePhase:
    times = np.asarray(time, float)
    # A channel over its own axis: its times are what counts.
    if hasattr(time, "dims") and time.ndim == 1 and "time" in time.coords:
        times = np.asarray(time["time"], float)
    if times.ndim != 1 or len(times) < 3:
        raise ValueError(f"{whose(time)}: {times.size} turns are too few for a frequency; at least 3 are needed")
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise ValueError(f"{whose(time)}: the times of the turns must be finite and increase")
    steps = np.diff(times)
    typical = np.median(steps)
    counts = np.maximum(np.rint(steps / typical), 1).astype(np.int64)
    if len(short := np.flatnonzero(steps < 0.6 * typical)):
        i = short[0]
        raise ValueError(
            f"{whose(time)}: two turns only {steps[i]:.4g} s apart at t = {times[i]:.6g} s, where a turn takes "
            f"{typical:.4g} s; if the motor's speed was changed there, split the record, else remove the false one"
        )
    if len(missed := np.flatnonzero(counts > 1)):
        first = times[missed[0]]
        warn(time, f"the gate missed {(counts - 1).sum()} turns, the first after t = {first:.6g} s; they are counted")
    turns = np.concatenate([[0], np.cumsum(counts)])
    line, covariance = np.polyfit(turns, times, 1, cov="unscaled")
    residual = times - np.polyval(line, turns)
    scatter = float(np.sqrt(residual @ residual / (len(times) - 2)))
    gate = resolution / math.sqrt(12.0)
    period, period_error = float(line[0]), max(scatter, gate) * float(np.sqrt(covariance[0, 0]))
    share = counts[:-1] / (counts[:-1] + counts[1:])  # where a turn lies between its neighbours, straight between them
    off = times[1:-1] - times[:-2] - share * (times[2:] - times[:-2])
    one = float(np.sqrt(np.mean(off**2 / (1.0 + share**2 + (1.0 - share) ** 2))))
    return DrivePhase(
        TURN / period,
        TURN / period * period_error / period,
        float(times[0]),
        max(one, gate),
        scatter,
        "photogate",
        times,
        turns,
        (float(times[0]), float(times[-1])) if span is None else span,
    )
