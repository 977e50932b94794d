"""Builders of the labelled results: plain arrays and a description in, an ``xarray.Dataset`` out.

How to call them (``n`` states, ``I`` indicators, ``O`` outputs)::

    d = labels_of(system)                                     # results/labels.py: once per call of a verb
    attrs = provenance(d, "sweep", {"parameter": ..., ...}, method="exact")     # results/provenance.py

    trajectory(d, attrs, time=(N,), u=(N, n), mode=(N,), segment=(N,), crossing_time=(C,), crossing_transition=(C,),
        u_before=(C, n), u_after=(C, n), touch_time=(K,), touch_indicator=(K,), touch_u=(K, n), touch_clearance=(K,),
        outputs=(N, O) or None, memory=(N, n_memory) or None, status=int)
        # ``time`` already holds each crossing twice; results/segments.py merges samples and crossings so.

    sweep(d, attrs, parameter, values, arrays, directions=("up", "down"), starts=(S, n), squeeze=("start",))
        # arrays, leading dims always (direction D, start S, point P), points in the order of ``values``:
        # section (D,S,P,keep,n), maximum, minimum (D,S,P,n), period_number, residual, crossings_per_period,
        # contacts_per_period, status (D,S,P), clearance (D,S,P,I), output_maximum, output_minimum (D,S,P,O).
        # of a density diagram in place of section: density (D,S,P,n,bins), outside (D,S,P,n), and edges=(n, bins + 1).
        # squeeze: which of "direction", "start" become scalar (the argument was one string, one state).
    response(sweep_dataset, amplitude=(D,S,P,n), jumps={"value": (J,), "direction": (J,) of str, ...})
    section_points(d, attrs, section=(S, N, n), time=(S, N), mode=(S, N), status=(S,), starts=(S, n), squeeze=())

Every dim carries its coordinate with unit and long name; all parameters are scalar coordinates (the swept
one is a dim). The dims of the Datasets come in the order of the schema: parameter, direction, start, iterate, state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.results.labels import Labels, Quantity
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.statuses import flag_attributes, status_attributes

__all__ = [
    "floats", "parameter_coords", "quantity_attributes", "response", "section_points", "start_coords", "state_coords",
    "strings", "sweep", "trajectory", "varied",
]  # fmt: skip

#: Trailing dims of each array a sweep may bring, after (direction, start, parameter).
_SWEEP_ARRAYS: dict[str, tuple[str, ...]] = {
    "section": ("iterate", "state"),
    "maximum": ("state",),
    "minimum": ("state",),
    "period_number": (),
    "residual": (),
    "crossings_per_period": (),
    "contacts_per_period": (),
    "clearance": ("indicator",),
    "output_maximum": ("output",),
    "output_minimum": ("output",),
    "equilibrium": (),
    "equilibrium_minimum": ("state",),
    "equilibrium_maximum": ("state",),
    "status": (),
    "density": ("state", "bin"),
    "outside": ("state",),
}

_LONG_NAMES = {
    "section": "section points",
    "maximum": "largest value over the kept returns",
    "minimum": "smallest value over the kept returns",
    "period_number": "period number (0: none found)",
    "residual": "scaled distance between a point and its period_number-th return",
    "crossings_per_period": "transitions per return",
    "contacts_per_period": "entries into contact per return",
    "density": "section points in each bin",
    "outside": "section points beyond the bins",
    "equilibrium": "what the point stands at (empty: it moves)",
    "equilibrium_minimum": "smallest value over the set of equilibria",
    "equilibrium_maximum": "largest value over the set of equilibria",
    "clearance": "smallest distance kept from the indicator's zero (negative: crossed)",
}


def trajectory(
    labels: Labels,
    attrs: Mapping[str, str],
    *,
    time: ArrayLike,
    u: ArrayLike,
    mode: ArrayLike,
    segment: ArrayLike,
    crossing_time: ArrayLike,
    crossing_transition: ArrayLike,
    u_before: ArrayLike,
    u_after: ArrayLike,
    touch_time: ArrayLike,
    touch_indicator: ArrayLike,
    touch_u: ArrayLike,
    touch_clearance: ArrayLike,
    outputs: ArrayLike | None = None,
    memory: ArrayLike | None = None,
    status: int = 0,
) -> xr.Dataset:
    """The result of ``simulate``: samples over ``time``, crossings and touches as flat lists."""
    d = labels
    t_unit = {"units": d.time_unit}
    modes = flag_attributes(d.modes, dtype=np.int16)
    transitions = flag_attributes(d.transition_labels, dtype=np.int16)
    indicators = flag_attributes(d.indicators, dtype=np.int16)
    variables: dict[str, Any] = {
        "u": (("time", "state"), floats(u), {"long_name": "state"}),
        "mode": ("time", np.asarray(mode, np.int16), {"long_name": "mode", **modes}),
        "crossing_time": ("crossing", floats(crossing_time), {"long_name": "time of the crossing", **t_unit}),
        "crossing_transition": (
            "crossing", np.asarray(crossing_transition, np.int16), {"long_name": "transition", **transitions},
        ),
        "u_before": (("crossing", "state"), floats(u_before), {"long_name": "state before the crossing"}),
        "u_after": (("crossing", "state"), floats(u_after), {"long_name": "state after the crossing"}),
        "touch_time": ("touch", floats(touch_time), {"long_name": "time of the touch", **t_unit}),
        "touch_indicator": ("touch", np.asarray(touch_indicator, np.int16), {"long_name": "indicator", **indicators}),
        "touch_u": (("touch", "state"), floats(touch_u), {"long_name": "state at the touch"}),
        "touch_clearance": ("touch", floats(touch_clearance), {"long_name": "distance left to the crossing"}),
        "status": ((), np.int8(status), status_attributes()),
    }  # fmt: skip
    for names, columns in ((d.outputs, outputs), (d.memory, memory)):
        if columns is None:
            continue
        table = floats(columns)
        for i, (name, quantity) in enumerate(names.items()):
            variables[name] = ("time", table[:, i], quantity_attributes(name, quantity))
    coords: dict[str, Any] = {
        "time": ("time", floats(time), {"long_name": "time", **t_unit, **({"symbol": "n"} if d.is_map else {})}),
        "segment": ("time", np.asarray(segment, np.int64), {"long_name": "number of crossings before this sample"}),
        **state_coords(d),
        **parameter_coords(d),
    }
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


def sweep(
    labels: Labels,
    attrs: Mapping[str, str],
    parameter: str,
    values: ArrayLike,
    arrays: Mapping[str, ArrayLike],
    *,
    directions: Sequence[str],
    starts: ArrayLike,
    squeeze: Sequence[str] = (),
    edges: ArrayLike | None = None,
) -> xr.Dataset:
    """The result of ``sweep``: everything known per point of the swept parameter.

    ``directions`` holds "up", "down" or "none"; ``starts`` (S, n) the first states. See the module's text.
    """
    d = labels
    unknown = set(arrays) - set(_SWEEP_ARRAYS)
    if unknown:
        raise ValueError(f"no such array in a sweep: {sorted(unknown)}; known: {sorted(_SWEEP_ARRAYS)}")
    leading = ("direction", "start", parameter)
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        dims = leading + _SWEEP_ARRAYS[name]
        if name.startswith("output_"):
            stem = name.removeprefix("output_")
            for i, (output, quantity) in enumerate(d.outputs.items()):
                attributes = {"long_name": f"{stem} of {output}", "units": quantity.unit}
                variables[f"{output}_{stem}"] = (leading, np.asarray(array)[..., i], attributes)
        elif name == "status":
            variables[name] = (dims, np.asarray(array, np.int8), status_attributes())
        else:
            variables[name] = (dims, _own(array), {"long_name": _LONG_NAMES[name]})
    coords: dict[str, Any] = {
        **varied(d, parameter, values),
        "direction": ("direction", strings(directions), {"long_name": "direction of the sweep"}),
        **start_coords(starts),
        **state_coords(d),
        **parameter_coords(d, without=parameter),
    }
    if edges is not None:
        variables["bin_edge"] = (("state", "edge"), floats(edges), {"long_name": "edges of the bins, per state"})
    if "clearance" in arrays:
        coords["indicator"] = ("indicator", strings(d.indicators), {"long_name": "indicator"})
    result = with_short_record(xr.Dataset(variables, coords, dict(attrs)))
    order = (parameter, "direction", "start", ...)
    return result.transpose(*order).squeeze(list(squeeze))


def response(swept: xr.Dataset, *, amplitude: ArrayLike, jumps: Mapping[str, ArrayLike]) -> xr.Dataset:
    """The result of ``frequency_response``: the sweep with ``amplitude`` and its jumps.

    ``amplitude`` has the dims of ``maximum``, in the sweep's builder order (direction, start, parameter, state).
    ``jumps`` holds ``value`` (J,) and ``direction`` (J,), and may hold further numbers per jump, such as
    ``before`` and ``after`` (amplitudes on its two sides): they become ``jump_value``, ``jump_direction``, ...
    """
    maximum = swept["maximum"]
    parameter = str(maximum.dims[0])
    full = ("direction", "start", parameter, "state")
    amplitudes = floats(amplitude)
    dropped = tuple(i for i, dim in enumerate(full) if dim not in maximum.dims)
    labelled = xr.DataArray(amplitudes.squeeze(dropped), dims=[dim for dim in full if dim in maximum.dims])
    variables: dict[str, Any] = {
        "amplitude": labelled.transpose(*maximum.dims).assign_attrs(long_name="half the peak-to-peak value")
    }
    for name, values in jumps.items():
        if name == "direction":
            attributes = {"long_name": "direction in which the jump is met"}
            variables["jump_direction"] = ("jump", strings(np.asarray(values, dtype=str)), attributes)
        elif name == "value":
            attributes = {"long_name": f"{parameter} at the jump", "units": swept[parameter].attrs.get("units", "1")}
            variables["jump_value"] = ("jump", floats(values), attributes)
        elif name == "variable":
            attributes = {"long_name": "state or output whose amplitude jumps"}
            variables["jump_variable"] = ("jump", strings(np.asarray(values, dtype=str)), attributes)
        else:
            variables[f"jump_{name}"] = ("jump", np.asarray(values))
    return swept.assign(variables)


def section_points(
    labels: Labels,
    attrs: Mapping[str, str],
    *,
    section: ArrayLike,
    time: ArrayLike,
    mode: ArrayLike,
    status: ArrayLike,
    starts: ArrayLike,
    squeeze: Sequence[str] = (),
) -> xr.Dataset:
    """The result of ``poincare``: the points in which trajectories meet the section, one trajectory per start."""
    d = labels
    modes = flag_attributes(d.modes, dtype=np.int16)
    variables: dict[str, Any] = {
        "section": (("start", "iterate", "state"), floats(section), {"long_name": _LONG_NAMES["section"]}),
        "time": (("start", "iterate"), floats(time), {"long_name": "time of the return", "units": d.time_unit}),
        "mode": (("start", "iterate"), np.asarray(mode, np.int16), {"long_name": "mode", **modes}),
        "status": ("start", np.asarray(status, np.int8), status_attributes()),
    }
    coords = {**start_coords(starts), **state_coords(d), **parameter_coords(d)}
    return with_short_record(xr.Dataset(variables, coords, dict(attrs))).squeeze(list(squeeze))


@lru_cache(maxsize=64)
def _state_index(names: tuple[str, ...]) -> xr.IndexVariable:
    """The index of the states' names, made once: a Dataset takes a copy whose attributes are its own."""
    return xr.IndexVariable("state", strings(names), {"long_name": "state"})


def state_coords(d: Labels) -> dict[str, Any]:
    """The states' names, with their units and symbols beside them (each state has its own)."""
    coords: dict[str, Any] = {
        "state": _state_index(tuple(d.states)),
        "state_unit": ("state", strings(q.unit for q in d.states.values()), {"long_name": "unit"}),
    }
    if any(q.symbol for q in d.states.values()):
        symbols = strings(q.symbol or name for name, q in d.states.items())
        coords["state_symbol"] = ("state", symbols, {"long_name": "symbol"})
    return coords


def parameter_coords(d: Labels, without: str | Sequence[str] = ()) -> dict[str, Any]:
    """The parameters that are not varied, as scalars with their units."""
    left_out = (without,) if isinstance(without, str) else without
    return {
        name: ((), np.float64(np.nan if q.value is None else q.value), quantity_attributes(name, q))
        for name, q in d.parameters.items()
        if name not in left_out
    }


def varied(d: Labels, name: str, values: ArrayLike, dim: str | None = None) -> dict[str, Any]:
    """The coordinate of a parameter that is varied, over the dim of its own name or another one."""
    return {name: (dim or name, floats(values), quantity_attributes(name, d.parameters[name]))}


def start_coords(starts: ArrayLike) -> dict[str, Any]:
    states = np.atleast_2d(floats(starts))
    return {
        "start": ("start", np.arange(len(states)), {"long_name": "index of the start"}),
        "start_state": (("start", "state"), states, {"long_name": "state at the start"}),
    }


def quantity_attributes(name: str, quantity: Quantity) -> dict[str, str]:
    """Long name, unit and symbol of a quantity."""
    attributes = {"long_name": name, "units": quantity.unit}
    return attributes | ({"symbol": quantity.symbol} if quantity.symbol else {})


def strings(words: Any) -> NDArray[np.str_]:
    """Words as an array of text, also where there are none."""
    return np.array(list(words), dtype=str)


def floats(values: ArrayLike) -> NDArray[np.float64]:
    """A copy, so that a kernel's buffer that is used again does not change a result."""
    return np.array(values, dtype=np.float64)


def _own(values: ArrayLike) -> NDArray[Any]:
    return np.array(values)
