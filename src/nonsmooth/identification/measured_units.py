"""Units that a measurement states, beside those of the model: nothing is converted, so where they differ it is said."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
import xarray as xr

from nonsmooth.system.system import System
from nonsmooth.system.units import power_between, read_unit

CALIBRATES = 5.0  # a gain farther than this factor from that of two units is none of a calibration
TURNS = ("Hz", "rad")  # of two units of a frequency these differ by 2 pi, though both are 1/s


def compare_units(what: str, theirs: str, ours: str, remedy: str, gain: float = 1.0) -> None:
    """Warn where two units are known, and differ by another factor than the gain. Beside units of other things any gain
    but 1 is one."""
    one, other = read_unit(theirs), read_unit(ours)
    if one is None or other is None:
        return
    power = power_between(ours, theirs)
    turns = any(a in theirs and b in ours for a, b in (TURNS, TURNS[::-1]))
    if (one != other or turns) and gain == 1.0:
        said = "numbers are compared as they are"
    elif power is not None and not 1 / CALIBRATES < abs(gain) / 10.0**power < CALIBRATES:
        said = f"that is {10.0**power:g} of the former to one of the latter, and the gain is {gain:.6g}"
    else:
        return
    warnings.warn(f"{what} is in {theirs}, the model in {ours}, and {said}; give {remedy}", stacklevel=5)


def units_of(theory: System | xr.Dataset) -> dict[str, str]:
    """The units of states and parameters (and outputs), of a system or of a result."""
    if not isinstance(theory, xr.Dataset):
        return (
            dict(theory.outputs)
            | dict(theory.states)
            | {name: one.unit or "" for name, one in theory.parameters.items()}
        )
    states = zip(theory["state"].values.tolist(), theory["state_unit"].values.tolist(), strict=True)
    return dict(states) | {str(name): str(one.attrs.get("units", "")) for name, one in theory.coords.items()}


def compare_units_of_readings(readings: xr.Dataset, ours: Mapping[str, str]) -> None:
    """The same of steady readings, of a motion or of sections as a Dataset: their states and what their runs are set
    to; ``ours`` are the units of the model's states and parameters."""
    states = np.atleast_1d(readings["state"].values).tolist() if "state" in readings.coords else ()
    units = np.atleast_1d(readings["state_unit"].values).tolist() if "state_unit" in readings.coords else ()
    theirs = dict(zip(states, units, strict=False))
    if "amplitude" in readings:
        theirs |= dict.fromkeys(states if len(states) else list(ours)[:1], readings["amplitude"].attrs.get("units", ""))
    theirs |= {str(key): one.attrs.get("units", "") for key, one in readings.variables.items() if key not in states}
    for name in [name for name in theirs if name in ours]:
        compare_units(f"measured {name!r}", str(theirs[name]), ours[name], "the measurement in that unit")
