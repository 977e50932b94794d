r"""Signals that the rig's sensors make of a motion: counts, a jittered clock, a gain error, noise, steps and limits.

Rotary sensor (PASCO CI-6538): 1440 counts per turn of its wheel, at most 30 turns per second. Force sensor
(PS-2104): +-50 N, 1 %, steps of 0.03 N. Photogate at the crank: one time per turn, to 0.1 ms. Source: Savi et al.
(2007), Section 3.

The instants of sampling jitter; the file gives the even clock of the interface, as such interfaces do.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings import RecordingWarning

if TYPE_CHECKING:
    from nonsmooth_savi2007.rig.virtual_rig import VirtualRig

RATE = 100.0  # Hz
DISTANCE_PER_TURN = 0.0789  # m
COUNTS_PER_TURN = 1440
COUNT = DISTANCE_PER_TURN / COUNTS_PER_TURN  # m
MAX_TURNS_PER_SECOND = 30.0
FORCE_RANGE = 50.0  # N
FORCE_STEP = 0.03  # N
TURN_STEP = 1e-4  # s


def instants(rig: VirtualRig, rng: np.random.Generator, duration: float) -> tuple[FloatArray, FloatArray]:
    """The times that the file gives, and the instants at which is really sampled, both from about 0 to ``duration``."""
    stamped = np.arange(int(duration * RATE) + 1) / RATE
    spread = rig.truth["clock_jitter"]
    jitter = np.clip(spread * rng.standard_normal(len(stamped)), -0.3 / RATE, 0.3 / RATE)
    jitter[0] = abs(jitter[0])  # nothing is known before the beginning
    return stamped, stamped + jitter


def angle(rig: VirtualRig, run: str, time: FloatArray, x: FloatArray, v: FloatArray) -> xr.Dataset:
    """The channel ``Angle`` (rad): whole counts of the rotary sensor on a car at ``x`` (m) with velocity ``v``.

    The encoder's zero lies anywhere within a count, the same for the whole session.

    Raises
    ------
    ValueError
        If the wheel turns faster than the sensor counts.
    """
    fastest = np.max(np.abs(v), initial=0.0) / DISTANCE_PER_TURN
    if fastest > MAX_TURNS_PER_SECOND:
        raise ValueError(
            f"{run}: the wheel of the rotary sensor would turn {fastest:.1f} times per second; it counts up to "
            f"{MAX_TURNS_PER_SECOND:.0f}: use less forcing"
        )
    counts = rig.truth["angle_sign"] * (x - rig.truth["sensor_zero"]) / COUNT
    if rig.quantisation:
        counts = np.rint(counts + rig.truth["encoder_zero"])
    return _sensor(time, "Angle", "rad", counts * (2 * np.pi / COUNTS_PER_TURN))


def force(rig: VirtualRig, rng: np.random.Generator, run: str, time: FloatArray, pulled: FloatArray) -> xr.Dataset:
    """The channel ``Force`` (N) of a sensor that is pulled with the force ``pulled``; saturation is a warning."""
    reading = rig.truth["force_gain"] * pulled + rig.truth["force_noise"] * rng.standard_normal(len(pulled))
    reading = rig.truth["force_sign"] * reading
    if rig.quantisation:
        reading = FORCE_STEP * np.rint(reading / FORCE_STEP)
    beyond = np.count_nonzero(np.abs(reading) > FORCE_RANGE)
    if beyond:
        warnings.warn(
            f"run {run!r}, channel 'Force': {beyond} of {len(reading)} samples saturate at {FORCE_RANGE:.0f} N; "
            "pull less",
            RecordingWarning,
            stacklevel=2,
        )
        reading = np.clip(reading, -FORCE_RANGE, FORCE_RANGE)
    return _sensor(time, "Force", "N", reading)


def turns(rig: VirtualRig, crossed: FloatArray) -> xr.Dataset:
    """The channel ``Turn``: the number of each passage of the crank, over the time at which the photogate saw it."""
    time = TURN_STEP * np.rint(crossed / TURN_STEP) if rig.quantisation else crossed
    return _sensor(np.round(time, 12), "Turn", "turns", rig.truth["turn_sign"] * np.arange(1.0, len(time) + 1.0))


def _sensor(time: FloatArray, name: str, unit: str, values: FloatArray) -> xr.Dataset:
    attrs = {"long_name": name, "measurement": name, "units": unit}
    rate = (len(time) - 1) / (time[-1] - time[0]) if len(time) > 1 else np.nan
    sampling = "irregular" if name == "Turn" else "regular"
    coordinate = ("time", time, {"long_name": "time", "units": "s"})
    return xr.Dataset({name: ("time", values, attrs)}, {"time": coordinate}, {"rate": rate, "sampling": sampling})
