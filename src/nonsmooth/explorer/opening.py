"""First view of a page that opens on a study file or a result: its model, parameters, range and initial state."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.explorer.catalogue import GIVEN, first_state
from nonsmooth.explorer.state import changed, to_query, within

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System


def opened_study(system: System, options: Mapping[str, Any], output: Mapping[str, str]) -> tuple[System | None, str]:
    """The system of a study and the query of its view; no system where it is one of ``nonsmooth.models``."""
    name, states = _name_of(system), list(system.states)
    state = first_state(name, system)
    for parameter, values in _ranges(options):
        low, high = float(np.min(values, initial=np.inf)), float(np.max(values, initial=-np.inf))
        if parameter in state.values and low < high:
            state = replace(state, over=parameter, low=low, high=high)
            break
    section, start = options.get("section"), options.get("start")
    if isinstance(start, Mapping):
        start = [start.get(one, 0.0) for one in states] if set(start) <= set(states) else None
    found: dict[str, Any] = {field: options.get(field) for field in ("direction", "method")} | {"start": start}
    found |= {
        field: within(field, options[field]) for field in ("transient", "keep") if isinstance(options.get(field), int)
    }
    found["phase"] = section.get("phase") if isinstance(section, Mapping) else getattr(section, "phase", None)
    plane = {"x", "y"} <= output.keys()
    found |= {field if plane else "shown": chosen for field, chosen in output.items() if field in ("x", "y")}
    for field, value in found.items():
        with suppress(ValueError, TypeError):  # what no page shows stays as it is
            state = changed(state, field, value, states)
    return (None if name != GIVEN else system), to_query(state)


def opened_result(result: xr.Dataset) -> tuple[System | None, str]:
    """The system of a result and the query of its view; no system where it is one of ``nonsmooth.models``.

    Raises
    ------
    ValueError
        A Dataset that was not made from a system.
    """
    from nonsmooth.results.provenance import read_provenance
    from nonsmooth.system.origin import system_of

    system, options = system_of(result), dict(read_provenance(result).get("options", {}))
    for name in system.parameters:
        if name in result.dims:
            options |= {"parameter": name, "values": result[name].values}
            break
    return opened_study(system, options, {})


def _ranges(options: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Parameters that a verb varies, with their values or their range."""
    grid = options.get("grid")
    pairs = list(grid.items()) if isinstance(grid, Mapping) else []
    values = options.get("values", options.get("range"))
    if isinstance(values, np.ndarray | list | tuple):
        pairs.insert(0, (str(options.get("parameter", "omega")), values))
    return [(name, one) for name, one in pairs if isinstance(one, np.ndarray | list | tuple)]


def _name_of(system: System) -> str:
    """The model of the gallery that this system is, at any values of its parameters."""
    from nonsmooth import models

    name = system.name.replace(" ", "_")
    if name in models.names():
        model = getattr(models, name)()
        if list(model.parameters) == list(system.parameters) and model.with_parameters(system.values) == system:
            return name
    return GIVEN
