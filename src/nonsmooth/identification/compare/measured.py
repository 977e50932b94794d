"""From a sampled position, or a recorded run of a rig, to a motion over the drive's phase, which ``compare`` takes."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.identification.finding import Estimate
from nonsmooth.recordings.recording import Recording
from nonsmooth.results.labels import labelled
from nonsmooth.system.system import System

if TYPE_CHECKING:
    from nonsmooth.identification.fit.records import Record
    from nonsmooth.identification.fit.sensors import Sensor

LONG = 150.0  # s: of a longer record the support and the smoother's intensity are found in its middle
PIECE = 75.0  # s


def motion_of(
    time: ArrayLike,
    x: Any,
    phase: ArrayLike,
    *,
    states: tuple[str, str] = ("x", "v"),
    resolution: float | None = None,
    **smoothing: Any,
) -> xr.Dataset:
    r"""The motion of any oscillator of which a position was sampled, with its rate and the errors of both.

    Parameters
    ----------
    time, x : array_like, shape (N,)
        Times and positions in the units of the model; a unit in ``x.attrs["units"]`` is kept.
    phase : array_like, shape (N,)
        Phase of the drive in forcing periods, counting on: :math:`\omega t / 2 \pi` of a known frequency, or that of
        :func:`nonsmooth.recordings.signals.phase.drive_phase`.
    states : (str, str)
        Names of the position and of its rate in the model.
    resolution : float, optional
        The step of the sensor; the error of a sample is found from the record where not given.
    **smoothing
        Further options of :func:`nonsmooth.recordings.signals.smoothing.smooth`: times of ``impacts``, ``contacts``.

    Returns
    -------
    xarray.Dataset
        As :func:`measured_motion` gives, without frequency.

    Raises
    ------
    ValueError
        Phases of another number than the samples, or what ``smooth`` refuses.
    """
    from nonsmooth.recordings.signals.checks import whose
    from nonsmooth.recordings.signals.smoothing import smooth

    smoothed = smooth(time, x, resolution=resolution, **smoothing)
    turns = np.asarray(phase, float)
    if turns.shape != (smoothed.sizes["time"],) or not np.isfinite(turns).all():
        raise ValueError(
            f"{whose(x)}: phase must be one finite number for each of {smoothed.sizes['time']} samples (omega t / 2 pi "
            f"in forcing periods), got an array of shape {turns.shape}"
        )
    return _motion(smoothed, turns, states)


def _motion(smoothed: xr.Dataset, phase: FloatArray, states: tuple[str, str] = ("x", "v")) -> xr.Dataset:
    """Position and velocity as the states of a model, over time and the phase of the drive."""
    columns = {name: np.column_stack([smoothed[k + name].values for k in "xv"]) for name in ("", "_error")}
    units = [smoothed[k].attrs["units"] for k in "xv"]
    return xr.Dataset(
        {
            "u": labelled(("time", "state"), columns[""], "measured state"),
            "u_error": labelled(("time", "state"), columns["_error"], "standard error of the measured state"),
            "phase": labelled("time", phase, "phase of the drive", "forcing periods"),
        },
        {
            "time": labelled("time", smoothed["time"].values, "time", "s"),
            "state": ("state", list(states)),
            "state_unit": ("state", units),
        },
    )


def only_run(records: list[Record]) -> Record:
    """The run that is compared; ValueError where there are several."""
    if len(records) > 1:
        raise ValueError(
            f"compare lays one run over the model: run = ... one of {', '.join(record.name for record in records)}"
        )
    return records[0]


def told_sensors(
    sensors: Mapping[str, Sensor], record: Record, found: Mapping[str, Estimate], system: System
) -> tuple[dict[str, Sensor], dict[str, float]]:
    """Sensors with the gain, offset and delay that a fit found of those given by their channel alone; and what it found
    of this run's clock and phase, and of the noise of each quantity (NaN: nothing)."""
    found = {key: one for key, one in found.items() if key.split(",")[0] not in system.values}

    def told(name: str, known: float) -> float:
        one = found.get(name, found.get(f"{name}, {record.name}"))
        if one is None and any(key.startswith(f"{name}, ") for key in found):
            warnings.warn(
                f"the fit found {name!r} of its runs, but none of run {record.name!r}: it is taken as {known:g}",
                stacklevel=7,
            )
        return one.value if one else known

    as_read: dict[str, Sensor] = {}
    for q, sensor in sensors.items():
        gain, offset = told(q + ".gain", sensor.gain), told(q + ".offset", sensor.offset)
        read = replace(sensor, gain=gain, offset=offset, delay=told(q + ".delay", sensor.delay))
        by_name = sensor == type(sensor)(sensor.channel)
        as_read[q] = read if by_name else sensor
        if not by_name and read != sensor:
            warnings.warn(
                f"{sensor} of {q} stands; the fit found {read}: give the channel's name alone to read it so",
                stacklevel=6,
            )
    beside = {"clock": 1.0, "phase": 0.0, **{f"{q}.noise": np.nan for q in sensors}}
    for name, known in beside.items():
        beside[name] = told(name, known)
    return as_read, beside


def recorded_motion(
    recording: Any, system: System, channels: Any, run: str | None, found: Mapping[str, Estimate]
) -> xr.Dataset:
    """The readings of states as a motion over the drive's phase, their errors from the record's own irregularity.

    ``system`` is at its parameters, with the forcing period of the run. ``found`` are unknowns beside them that a fit
    has found, of all runs or of this one: the phase of the forcing at t = 0, the clock, and gain, offset and delay of
    a channel that is given by its name alone.
    """
    from nonsmooth.identification.fit.records import irregularity, read_records

    sensors, records, _ = read_records(system, recording, {"measured": channels, "runs": run})
    record, period = only_run(records), system.period()
    if period is None:
        raise ValueError(f"{system.name!r} has no forcing period; compare takes forced systems")
    if outputs := [name for name in sensors if name not in system.states]:
        raise ValueError(f"{', '.join(outputs)}: no state of {system.name!r}; compare lays states over the model")
    sensors, told = told_sensors(sensors, record, found, system)
    if len({sensor.delay for sensor in sensors.values()}) > 1 or np.isnan(record.values).any(axis=1).mean() > 0.5:
        raise ValueError("the channels have clocks or delays of their own: compare them one by one, channels={...}")
    scale = np.array([sensor.gain for sensor in sensors.values()])
    error = [
        max(irregularity(y), sensor.floor) if sensor.noise is None else np.hypot(sensor.noise, sensor.floor)
        for sensor, y in zip(sensors.values(), record.values.T, strict=True)
    ]
    u = (record.values - [sensor.offset for sensor in sensors.values()]) / scale
    time = told["clock"] * record.time - next(iter(sensors.values())).delay
    synthetic = "yes" if getattr(recording, "synthetic", False) else "no"
    return xr.Dataset(
        {
            "u": (("time", "state"), u),
            "u_error": (("time", "state"), np.broadcast_to(error / np.abs(scale), u.shape)),
            "phase": ("time", time / period + told["phase"]),
        },
        {"time": time, "state": list(sensors)},
        {"synthetic": synthetic, "title": record.name},
    )


def measured_motion(
    recording: Recording,
    run: str | None = None,
    *,
    distance_per_turn: float,
    counts_per_turn: int = 1440,
    zero: float = 0.0,
    mark: float = 0.0,
    support: bool = True,
    angle: str = "Angle",
    turn: str = "Turn",
) -> xr.Dataset:
    r"""The motion of one run: position and velocity with their errors, over time and the phase of the drive.

    The rotary sensor's angle becomes a position; a Kalman smoother gives the velocity, contacts with the support being
    found first so that nothing is smoothed across their ends; the photogate's turns give the phase.

    Parameters
    ----------
    recording : Recording
    run : str, optional
        Needed where there are several.
    distance_per_turn : float
        Travel per turn of the sensor's wheel (m); negative where it counts away from the support.
    counts_per_turn : int
        Counts of the encoder per turn.
    zero : float
        Position (m) that becomes x = 0: the car's mean position under the drive. A string of length L lets it move by
        :math:`a^2 / (8 L)` from where it rested, and the model knows nothing of this.
    mark : float
        The crank's angle (rad) at which the photogate sees it; 0 where it pulls the car towards the support.
    support : bool
        Whether the support was mounted.
    angle, turn : str
        Names of the channels; ``turn`` has one row for each turn of the crank, at phase 0.

    Returns
    -------
    xarray.Dataset
        ``u(time, state)``, ``u_error(time, state)`` with the states ``x`` and ``v``; ``phase(time)`` in forcing
        periods; scalars ``omega`` and ``omega_error``; attributes ``synthetic``, ``title``, ``run``.

    Raises
    ------
    ValueError
        A channel that is missing, too short or in another unit; the message names run and channel.
    """
    from nonsmooth.recordings.signals.checks import take
    from nonsmooth.recordings.signals.displacement import position, resolution
    from nonsmooth.recordings.signals.phase import drive_phase

    name = run if run is not None else recording.runs[0]
    turned = take(recording, angle, run, samples=64)
    gate = take(recording, turn, run, samples=3)
    turns = gate[gate.dims[0]].values
    x = position(turned, distance_per_turn=distance_per_turn, zero=zero)
    time = x[x.dims[0]].values
    drive = drive_phase(turns, span=(float(time[0]), float(time[-1])))
    step = resolution(distance_per_turn=abs(distance_per_turn), counts_per_turn=counts_per_turn)
    smoothed = _smoothed(time, x, step, drive.omega, support)
    # Beyond the first and last turn the phase would be a guess.
    inside = (time >= turns[0]) & (time <= turns[-1])
    phase = (drive.phase(time[inside]) + mark % (2 * np.pi)) / (2 * np.pi)
    source = recording.source
    attrs = {
        "synthetic": "yes" if recording.synthetic else "no",
        "title": f"{source.get('file') or 'in memory'}, {name}",
        "run": name,
        "file": str(source.get("file", "")),
        "sha256": str(source.get("sha256", "")),
    }
    return (
        _motion(smoothed.isel(time=inside), phase)
        .assign_attrs(attrs)
        .assign_coords(
            omega=labelled((), drive.omega, "frequency of the drive", "rad/s"),
            omega_error=labelled((), drive.omega_error, "standard error of it", "rad/s"),
        )
    )


def _smoothed(time: Any, x: xr.DataArray, step: float, omega: float, support: bool) -> xr.Dataset:
    """The motion by the Kalman smoother, contacts with the support told apart.

    Of a long record a piece in the middle tells the support's place and the intensities of the smoother's noise; to
    find them in the whole would take ten passes over it.
    """
    from nonsmooth.recordings.signals.contacts import contacts, intervals
    from nonsmooth.recordings.signals.smoothing import smooth

    # Without a support the motion is smooth: no contact is an answer that the smoother takes, too.
    def touching(t: Any, values: Any) -> Any:
        return contacts(t, values, resolution=step, omega=omega) if support else ((), ())

    if time[-1] - time[0] <= LONG:
        return smooth(time, x, resolution=step, contacts=touching(time, x))
    middle = 0.5 * (time[0] + time[-1])
    inside = np.abs(time - middle) <= PIECE / 2
    piece = x.isel({x.dims[0]: inside})
    found = touching(time[inside], piece)
    quiet = smooth(time[inside], piece, resolution=step, contacts=found).attrs
    if not support:
        return smooth(time, x, resolution=step, contacts=((), ()), intensity=quiet["intensity"])
    if not found.sizes["contact"]:
        return smooth(time, x, resolution=step, contacts=touching(time, x))
    gap = float(found["gap"])
    rough = smooth(time[inside], piece, resolution=step).attrs["intensity"]
    first = smooth(time, x, resolution=step, intensity=rough)
    levels = (quiet["intensity"], quiet["intensity_in_contact"])
    return smooth(time, x, resolution=step, contacts=intervals(first, gap)[:2], intensity=levels)
