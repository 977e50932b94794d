"""Builders of the labelled results: plain arrays and a description in, an ``xarray.Dataset`` out.

How to call them (``n`` states, ``I`` indicators, ``O`` outputs)::

    d = labels_of(system)                                     # results/labels.py: once per call of a verb
    attrs = provenance(d, "sweep", {"parameter": ..., ...}, method="exact")     # results/provenance.py

    trajectory(d, attrs, time=(N,), u=(N, n), mode=(N,), segment=(N,), crossing_time=(C,), crossing_transition=(C,),
        u_before=(C, n), u_after=(C, n), touch_time=(K,), touch_indicator=(K,), touch_u=(K, n), touch_clearance=(K,),
        outputs=(N, O) or None, memory=(N, n_memory) or None, status=int)
        # ``time`` already holds each crossing twice; flow/simulate.py merges samples and crossings so.

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
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.results.labels import EQUILIBRIA, Labels, QuantityLabel, flag_attributes, labelled, status_attributes
from nonsmooth.results.provenance import with_short_record


class Column(NamedTuple):
    """A variable of a result: its name, its dims beside those of the result, the rule for its numbers and their unit,
    its long name, and the field of what holds it."""

    name: str
    dims: tuple[str, ...]
    rule: str
    words: str
    field: str


#: Types of the numbers by rule; None: as they come. "time" and "rate" have units, integers of a name a table of words.
_TYPES: dict[str, Any] = {
    **dict.fromkeys(("", "time", "rate"), float),
    **dict.fromkeys(("mode", "transition", "indicator"), np.int16),
    **dict.fromkeys(("status", "equilibrium", "yes"), np.int8),
    "complex": complex,
    "flag": bool,
    "text": str,
    "place": np.int64,
    "id": np.int32,
    "own": None,
}


def table(*rows: tuple[str, ...], before: str = "") -> tuple[Column, ...]:
    """Columns of (name, dims, rule, words, field): the field is the name where it is not given, without the word
    ``before`` with which all names begin."""
    return tuple(
        Column(before + name, tuple(dims.split()), rule, words, field[0] if field else name)
        for name, dims, rule, words, *field in rows
    )


def typed(column: Column, values: Any) -> NDArray[Any]:
    """A copy of the values in the type of the column, also where there are none."""
    return np.array(values, dtype=_TYPES[column.rule])


def attributes(labels: Labels, column: Column) -> dict[str, Any]:
    """Long name, unit and table of words of a column."""
    words = {"long_name": column.words.replace("forcing period", labels.turn)}
    match column.rule:
        case "status":
            return status_attributes()
        case "time":
            return words | {"units": labels.time_unit}
        case "rate":
            return words | {"units": "1" if labels.time_unit == "1" else f"1/{labels.time_unit}"}
        case "equilibrium":
            return words | flag_attributes(EQUILIBRIA)
        case "mode" | "indicator" | "transition" as rule:
            named = {"mode": "modes", "indicator": "indicators", "transition": "transition_labels"}[rule]
            return words | flag_attributes(getattr(labels, named), dtype=_TYPES[rule])
    return words


def columns(labels: Labels, known: Sequence[Column], arrays: Mapping[str, Any], *lead: str) -> dict[str, Any]:
    """Variables of a table for those of its fields that there are; their dims come behind ``lead``."""
    return {
        column.name: ((*lead, *column.dims), typed(column, arrays[column.field]), attributes(labels, column))
        for column in known
        if column.field in arrays
    }


def chosen(dim: str, words: Sequence[str], known: Sequence[str], long_name: str) -> tuple[str, NDArray[np.int8], Any]:
    """A variable of words, each one of those ``known``, as integers with their table."""
    codes = np.array([known.index(word) for word in words], dtype=np.int8)
    return dim, codes, {"long_name": long_name, **flag_attributes(known)}


#: Coordinates that several results have.
_ALONG = table(
    ("attractor", "attractor", "own", "attractor"),
    ("band", "band", "text", "shape of the bands"),
    ("direction", "direction", "text", "direction of the sweep"),
    ("distance", "distance", "own", "distance in grid steps"),
    ("end", "end", "text", "end"),
    ("eta", "eta", "", "half width of the bands"),
    ("exponent", "exponent", "own", "number of the exponent"),
    ("indicator", "indicator", "text", "indicator"),
    ("segment", "time", "place", "number of crossings before this sample"),
    ("start", "start", "own", "index of the start"),
    ("start_state", "start state", "", "state at the start"),
)


def dataset(
    labels: Labels,
    attrs: Mapping[str, Any],
    variables: Mapping[str, Any],
    starts: ArrayLike | None = None,
    /,
    **along: Any,
) -> xr.Dataset:
    """A result, its record without what the coordinates hold.

    Its coordinates are those ``along`` its dims, as values of the common table or whole, the ``starts`` (S, n), the
    states where something is over them, and the parameters that are not varied.
    """
    if starts is not None:
        states = np.atleast_2d(floats(starts))
        along |= {"start": np.arange(len(states)), "start_state": states}
    whole = {name: one for name, one in along.items() if isinstance(one, tuple)}
    coords = whole | columns(labels, _ALONG, {name: one for name, one in along.items() if name not in whole})
    dims = {dim for one in (*variables.values(), *coords.values()) for dim in np.atleast_1d(one[0])}
    if "state" in dims and "state" not in coords:
        coords |= state_coords(labels)
    coords |= parameter_coords(labels, without=[*variables, *coords, *dims])
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


_TRAJECTORY = table(
    ("u", "time state", "", "state"),
    ("mode", "time", "mode", "mode"),
    ("crossing_time", "crossing", "time", "time of the crossing"),
    ("crossing_transition", "crossing", "transition", "transition"),
    ("u_before", "crossing state", "", "state before the crossing"),
    ("u_after", "crossing state", "", "state after the crossing"),
    ("touch_time", "touch", "time", "time of the touch"),
    ("touch_indicator", "touch", "indicator", "indicator"),
    ("touch_u", "touch state", "", "state at the touch"),
    ("touch_clearance", "touch", "", "distance left to the crossing"),
    ("status", "", "status", ""),
)
#: Behind (direction, start, parameter).
_SWEEP = table(
    ("section", "iterate state", "own", "section points"),
    ("maximum", "state", "own", "largest value over the kept returns"),
    ("minimum", "state", "own", "smallest value over the kept returns"),
    ("period_number", "", "own", "period number (0: none found)"),
    ("residual", "", "own", "scaled distance between a point and its period_number-th return"),
    ("crossings_per_period", "", "own", "transitions per return"),
    ("contacts_per_period", "", "own", "entries into contact per return"),
    ("clearance", "indicator", "own", "smallest distance kept from the indicator's zero (negative: crossed)"),
    ("equilibrium", "", "own", "what the point stands at (empty: it moves)"),
    ("equilibrium_minimum", "state", "own", "smallest value over the set of equilibria"),
    ("equilibrium_maximum", "state", "own", "largest value over the set of equilibria"),
    ("status", "", "status", ""),
    ("density", "state bin", "own", "section points in each bin"),
    ("outside", "state", "own", "section points beyond the bins"),
)
_POINTS = table(
    ("section", "start iterate state", "", "section points"),
    ("time", "start iterate", "time", "time of the return"),
    ("mode", "start iterate", "mode", "mode"),
    ("status", "start", "status", ""),
)
_JUMP = table(
    ("variable", "jump", "text", "state or output whose amplitude jumps"),
    ("value", "jump", "", "value at the jump"),
    ("step", "jump", "", "step at the jump"),
    ("direction", "jump", "text", "direction in which the jump is met"),
    ("start", "jump", "place", "start of the jump"),
    ("before", "jump", "", "before of the jump"),
    ("after", "jump", "", "after of the jump"),
    before="jump_",
)


def trajectory(
    labels: Labels,
    attrs: Mapping[str, str],
    *,
    time: ArrayLike,
    segment: ArrayLike,
    outputs: ArrayLike | None = None,
    memory: ArrayLike | None = None,
    status: int = 0,
    **arrays: Any,
) -> xr.Dataset:
    """The result of ``simulate``: samples over ``time``, crossings and touches as flat lists."""
    variables = columns(labels, _TRAJECTORY, {**arrays, "status": status})
    for names, found in ((labels.outputs, outputs), (labels.memory, memory)):
        if found is not None:
            for (name, quantity), column in zip(names.items(), floats(found).T, strict=True):
                variables[name] = ("time", column, quantity_attributes(name, quantity))
    along = {"long_name": "time", "units": labels.time_unit, **({"symbol": "n"} if labels.is_map else {})}
    return dataset(labels, attrs, variables, time=("time", floats(time), along), segment=segment)


def with_impacts(
    run: xr.Dataset, quantities: Mapping[str, tuple[str, str]], columns: Sequence[NDArray[np.float64]]
) -> xr.Dataset:
    """The result of ``simulate`` with quantities of impacts over ``crossing``: long names and units; ``columns`` (C, S)
    each, those of an element one after the other."""
    table = np.stack(columns, axis=2).reshape(run.sizes["crossing"], len(quantities))
    told = zip(quantities.items(), table.T, strict=True)
    return run.assign({name: labelled("crossing", floats(values), *named) for (name, named), values in told})


def sweep(
    labels: Labels,
    attrs: Mapping[str, str],
    parameter: str,
    values: ArrayLike,
    arrays: Mapping[str, Any],
    *,
    directions: Sequence[str],
    starts: ArrayLike,
    squeeze: Sequence[str] = (),
    edges: ArrayLike | None = None,
    loads: Mapping[str, tuple[ArrayLike, str, str]] | None = None,
) -> xr.Dataset:
    """The result of ``sweep``: everything known per point of the swept parameter.

    ``directions`` holds "up", "down" or "none"; ``starts`` (S, n) the first states; ``loads`` arrays (D, S, P) with
    their long names and units. See the module's text.
    """
    leading = ("direction", "start", parameter)
    stems = {"output_maximum": "maximum", "output_minimum": "minimum"}
    known = [*(column.name for column in _SWEEP), *stems]
    if unknown := set(arrays) - set(known):
        raise ValueError(f"no such array in a sweep: {sorted(unknown)}; known: {sorted(known)}")
    variables = columns(labels, _SWEEP, arrays, *leading)
    for i, (output, quantity) in enumerate(labels.outputs.items()):
        for name, stem in stems.items():
            if name in arrays:
                told = f"{stem} of {output}", quantity.unit
                variables[f"{output}_{stem}"] = labelled(leading, floats(arrays[name][..., i]), *told)
    for name, (load, words, unit) in (loads or {}).items():
        dims, known_by_now, told = variables.get(name, labelled(leading, floats(load), words, unit))
        variables[name] = dims, np.where(np.isnan(known_by_now), load, known_by_now), told
    along: dict[str, Any] = {**varied(labels, parameter, values), "direction": [*directions]}
    if edges is not None:
        variables["bin_edge"] = (("state", "edge"), floats(edges), {"long_name": "edges of the bins, per state"})
    if "clearance" in arrays:
        along["indicator"] = [*labels.indicators]
    result = dataset(labels, attrs, variables, starts, **along)
    return result.transpose(parameter, "direction", "start", ...).squeeze(list(squeeze))


def with_amplitude(result: xr.Dataset) -> xr.Dataset:
    """The result with half the difference of its extremes, where it has these alone."""
    if "amplitude" in result or "maximum" not in result or "minimum" not in result:
        return result
    half = 0.5 * (result["maximum"] - result["minimum"])
    return result.assign(amplitude=half.assign_attrs(long_name="half the peak-to-peak value"))


def response(swept: xr.Dataset, jumps: Sequence[Mapping[str, Any]]) -> xr.Dataset:
    """The result of ``frequency_response``: the sweep with its amplitudes and jumps."""
    parameter = swept[swept["maximum"].dims[0]]
    variables: dict[str, Any] = {"amplitude": with_amplitude(swept)["amplitude"]}
    for column in _JUMP:
        of_parameter = column.field in ("value", "step")
        words = f"{parameter.name}, {column.words}" if of_parameter else column.words
        unit = parameter.attrs.get("units", "1") if of_parameter else None
        values = typed(column, [jump[column.field] for jump in jumps])
        variables[column.name] = labelled(column.dims, values, words, unit)
    return swept.assign(variables)


def section_points(
    labels: Labels, attrs: Mapping[str, str], *, starts: ArrayLike, squeeze: Sequence[str] = (), **arrays: Any
) -> xr.Dataset:
    """The result of ``poincare``: the points in which trajectories meet the section, one trajectory per start."""
    return dataset(labels, attrs, columns(labels, _POINTS, arrays), starts).squeeze(list(squeeze))


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


def quantity_attributes(name: str, quantity: QuantityLabel) -> dict[str, str]:
    """Long name, unit and symbol of a quantity."""
    attributes = {"long_name": name, "units": quantity.unit}
    return attributes | ({"symbol": quantity.symbol} if quantity.symbol else {})


def strings(words: Any) -> NDArray[np.str_]:
    """Words as an array of text, also where there are none."""
    return np.array(list(words), dtype=str)


def floats(values: ArrayLike) -> NDArray[np.float64]:
    """A copy, so that a kernel's buffer that is used again does not change a result."""
    return np.array(values, dtype=np.float64)
