"""Position of the car from the angle of the rotary sensor's wheel."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from nonsmooth.recordings.signals.checks import unit_of, whose

#: Turns per unit of angle.
_TURNS = {
    "rad": 0.5 / np.pi,
    "radian": 0.5 / np.pi,
    "radians": 0.5 / np.pi,
    "deg": 1 / 360,
    "°": 1 / 360,
    "degree": 1 / 360,
    "degrees": 1 / 360,
    "rev": 1.0,
    "turn": 1.0,
    "turns": 1.0,
    "rotations": 1.0,
}


def position(
    angle: xr.DataArray,
    *,
    distance_per_turn: float,
    zero: float = 0.0,
    counts_per_turn: int | None = None,
) -> xr.DataArray:
    """Position over the same axis, x = (turns of the wheel) * distance_per_turn - zero.

    Parameters
    ----------
    angle : DataArray
        Its attribute ``units`` is ``rad``, ``deg``, ``rev`` or, with ``counts_per_turn``, ``counts``.
    distance_per_turn : float
        Path of the string in metres per turn of the wheel; negative where the wheel turns the other way.
    zero : float
        The position in metres that becomes 0, where the car rested elsewhere when the sensor was zeroed.
    counts_per_turn : int, optional
        Counts of the encoder per turn.

    Returns
    -------
    DataArray
        Metres, with the other attributes of ``angle``.

    Raises
    ------
    ValueError
        If the unit of ``angle`` is none of these.
    """
    unit = unit_of(angle, "")
    if not np.isfinite(distance_per_turn) or distance_per_turn == 0:
        raise ValueError(f"distance_per_turn must be a length in metres other than 0, got {distance_per_turn!r}")
    if unit in _TURNS:
        turns = angle * _TURNS[unit]
    elif unit in ("count", "counts") and counts_per_turn is not None:
        turns = angle / counts_per_turn
    else:
        raise ValueError(
            f"{whose(angle)}: its unit is {unit!r}; an angle in rad, deg or rev is needed, or counts with "
            "counts_per_turn; say it with load_recording(..., units={channel: unit})"
        )
    x = turns * distance_per_turn - zero
    return x.rename("x").assign_attrs({**angle.attrs, "units": "m"})


def resolution(*, distance_per_turn: float, counts_per_turn: int = 1440) -> float:
    """Metres per count of the encoder; 1440 counts per turn are the 0.25 degrees of the PASCO CI-6538."""
    return abs(distance_per_turn) / counts_per_turn


def found_resolution(x: Any) -> float:
    """The step in which the values of a quantised signal are spaced, read off the values.

    The smallest difference of neighbouring values, refined over all of them; for a record that shows at least two
    neighbouring counts.

    Raises
    ------
    ValueError
        If all values are the same, or their differences are no multiples of one step.
    """
    values = np.asarray(x, float)
    distinct = np.unique(values[np.isfinite(values)])
    spacing = np.diff(distinct)
    if len(distinct):
        spacing = spacing[spacing > 1e-9 * np.ptp(distinct)]  # equal but for rounding
    if len(spacing) == 0:
        raise ValueError(f"{whose(x)}: all its values are the same; no step can be read off them")
    step = spacing.min()
    for _ in range(4):  # the count of each difference grows surer as the step gets better
        counts = np.rint(spacing / step)
        step = float((spacing @ counts) / (counts @ counts))
    if np.max(np.abs(spacing / step - np.rint(spacing / step))) > 0.1:
        raise ValueError(
            f"{whose(x)}: its values are not multiples of one step; give the resolution of the sensor, or None"
        )
    return step
