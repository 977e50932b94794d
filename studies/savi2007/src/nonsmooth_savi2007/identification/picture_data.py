"""Data of the findings' pictures: each variable in the unit that it has wherever it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import xarray as xr

from nonsmooth.identification import Estimate
from nonsmooth_savi2007.identification.evidence import Run

#: Variables by unit; those that are not here are ratios, counts or logarithms.
_MEASURED = {
    "m": (
        "amplitude",
        "crank",
        "crank_length",
        "displacement",
        "envelope_both",
        "envelope_viscous",
        "fitted",
        "gap",
        "joint_amplitude",
        "largest",
        "mean",
        "peak_height",
        "residual",
        "viscous_amplitude",
        "x",
    ),
    "m s": ("magnitude", "fine_magnitude"),
    "rad/s": (
        "grazing_high",
        "grazing_low",
        "grazing_setting",
        "omega",
        "omega_fine",
        "omega_high",
        "omega_low",
        "setting",
    ),
    "Hz": ("fine_frequency", "grid_peak", "grid_step"),
    "s": ("peak_time",),
    "N": ("force",),
}
_UNITS = {name: unit for unit, names in _MEASURED.items() for name in names}
_WORDS = {"setting": "frequency", "force": "force without the hand's inertia"}


def picture_data(runs: Iterable[Run], over: Mapping[Any, Mapping[str, Any]], **numbers: float | Estimate) -> xr.Dataset:
    """Return variables over dims, and numbers; an estimate stands in its own unit, with its error beside it."""
    data: dict[str, Any] = {}

    def put(name: str, dim: Any, values: Any, unit: str) -> None:
        told = {"units": unit, "long_name": _WORDS.get(name, "")}
        data[name] = dim, values, {key: text for key, text in told.items() if text}

    for dim, columns in over.items():
        for name, values in columns.items():
            put(name, dim, values, _UNITS.get(name.removesuffix("_error"), ""))
    for name, one in numbers.items():
        if isinstance(one, Estimate):
            put(name, (), one.value, one.unit)
            put(f"{name}_error", (), one.uncertainty, one.unit)
        else:
            put(name, (), one, _UNITS.get(name, ""))
    return xr.Dataset(data, attrs={"synthetic": "yes" if any(run.synthetic for run in runs) else "no"})
