"""Checks of a signal before anything is computed from it; each refusal says run, channel and what to do.

Functions that take plain arrays know no names; those of a DataArray are read from its attributes, which
:func:`take` completes with the run.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.recordings.recording import Recording, RecordingWarning, examine, missing_said


def whose(x: Any, default: str = "the signal") -> str:
    """``run 'Run #1', channel 'Angle'`` as far as the attributes of ``x`` say it."""
    attrs = getattr(x, "attrs", {})
    channel = attrs.get("long_name") or getattr(x, "name", None)
    parts = [f"run {attrs['run']!r}" if attrs.get("run") else "", f"channel {channel!r}" if channel else ""]
    return ", ".join(part for part in parts if part) or default


def unit_of(x: Any, default: str = "m") -> str:
    """The unit of a signal, as far as its attributes say it."""
    return str(getattr(x, "attrs", {}).get("units", default))


def warn(x: Any, sentence: str) -> None:
    """A RecordingWarning on the signal ``x``."""
    warnings.warn(f"{whose(x)}: {sentence}", RecordingWarning, stacklevel=3)


def signal(
    time: ArrayLike, x: Any, *, least: int, purpose: str, missing: str = "error"
) -> tuple[FloatArray, FloatArray]:
    """Times (s) and values as arrays of one length, increasing and finite; ValueError that says what to do where they
    are not.

    ``purpose`` needs at least so many samples. With ``missing="keep"`` values that are not finite keep their place,
    with a warning.
    """
    name = whose(x)
    t, values = np.asarray(time, float), np.array(x, float)
    values[np.ma.getmask(x)] = np.nan
    if t.ndim != 1 or t.shape != values.shape:
        raise ValueError(f"{name}: time and values must be arrays of one length, got {t.shape} and {values.shape}")
    if not np.isfinite(t).all():
        count = np.count_nonzero(~np.isfinite(t))
        raise ValueError(f"{name}: {count} of its times are not finite numbers; remove those samples")
    back = np.flatnonzero(np.diff(t) <= 0)
    if len(back):
        i = back[0]
        what = "stands twice" if t[i + 1] == t[i] else f"goes back to {t[i + 1]:.9g} s"
        raise ValueError(
            f"{name}: time {t[i]:.9g} s {what} (sample {i + 1}); export more digits of the times, or cut there"
        )
    if sentence := missing_said(values, t):
        if missing == "error":
            raise ValueError(
                f"{name}: {sentence}; {purpose} needs all: cut the record there, or smooth it first, which bridges them"
            )
        warn(x, f"{sentence}; they are bridged, with errors that say so")
    if (usable := np.count_nonzero(np.isfinite(values))) < least:
        raise ValueError(f"{name}: too short: {usable} usable samples, and {purpose} needs {least}; record longer")
    return t, values


def even_rate(time: FloatArray, x: Any, purpose: str) -> float:
    """The one sample rate of a signal in Hz; ValueError where it changes, samples are missing, or the steps are
    uneven.
    """
    clock = examine(time)
    if clock.regular:
        return clock.rate
    why = (
        f"the samples are not evenly spaced; {purpose} needs an even rate: take smooth(), which does without, or "
        "interpolate its result"
    )
    if clock.change is not None:
        i, before, after = clock.change
        why = (
            f"the sample rate changes from {before:.6g} Hz to {after:.6g} Hz near t = {time[i]:.9g} s; "
            f"{purpose} needs one rate: split the record there"
        )
    elif clock.gaps:
        i, count = clock.gaps[0]
        why = (
            f"{count} samples are missing after t = {time[i]:.9g} s; {purpose} needs an even rate: "
            "cut the record there, or take smooth(), which does without"
        )
    raise ValueError(f"{whose(x)}: {why}")


def take(
    recording: Recording,
    channel: str,
    run: str | None = None,
    *,
    units: tuple[str, ...] | None = None,
    samples: int = 32,
    duration: float | None = None,
    missing: str = "error",
) -> xr.DataArray:
    """A channel of a run, checked, with the run's name in its attributes.

    Parameters
    ----------
    recording : Recording
    channel, run : str
        As in :meth:`Recording.channel`.
    units : tuple of str, optional
        The units that are understood.
    samples : int
        The fewest samples of use.
    duration : float, optional
        The shortest length of use, in seconds.
    missing : {"error", "keep"}
        What values that are not finite lead to: an error, or nothing, for what can do without them (``smooth`` bridges
        them and says so).

    Raises
    ------
    ValueError
        If there is no such channel, its unit is another, values are missing, or the run is too short; the message says
        which run, which channel, and what to do.
    """
    array = recording.channel(channel, run)
    array = array.assign_attrs(run=run if run is not None else recording.runs[0])
    name, unit = whose(array), unit_of(array, "")
    if units is not None and unit not in units:
        given = f"its unit is {unit!r}" if unit else "it has no unit"
        raise ValueError(
            f"{name}: {given}, needed is {' or '.join(units)}; say it with "
            f"load_recording(..., units={{{channel!r}: ...}}), or convert the values"
        )
    if array.size < samples:
        raise ValueError(f"{name}: {array.size} samples are too short to identify anything from; {samples} are needed")
    (axis,) = array.dims
    along = array[axis].values
    if (said := missing_said(np.asarray(array.values, float), along, str(axis), "")) and missing == "error":
        raise ValueError(
            f"{name}: {said}; cut the record there, leave this run out (of the notebook, where there is one), or "
            "take(..., missing='keep') and smooth it, which bridges them"
        )
    if duration is not None and (length := along[-1] - along[0]) < duration:
        raise ValueError(f"{name}: lasts {length:.4g} s, needed are {duration:.4g} s: record longer")
    return array
