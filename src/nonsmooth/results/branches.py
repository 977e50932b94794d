"""Builders of the labelled results of continuation: branches of orbits, curves of special points, manifolds."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels, flag_attributes
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import (
    Column,
    attributes,
    chosen,
    columns,
    dataset,
    floats,
    quantity_attributes,
    strings,
    table,
    typed,
    varied,
)

#: One orbit of a branch; builder, writer and reader go by these tables.
ORBIT = table(
    ("section", "state", "", "state at the section"),
    ("maximum", "state", "", "largest value along the orbit"),
    ("minimum", "state", "", "smallest value along the orbit"),
    ("period", "", "time", "period"),
    ("floquet_multipliers", "multiplier", "complex", "Floquet multipliers", "multipliers"),
    ("stable", "", "flag", "all multipliers inside the unit circle"),
    ("virtual", "", "flag", "the path goes through a boundary that it should obey"),
    ("signature", "", "id", "signature", "cycle"),
    ("mode", "", "mode", "mode at the section"),
    ("crossings_per_period", "", "", "transitions per forcing period (autonomous: once round)", "crossings"),
    ("contacts_per_period", "", "", "entries into contact per forcing period (autonomous: once round)", "contacts"),
    ("clearance", "indicator", "", "least distance to a transition that does not happen"),
    ("layout", "", "id", "signature as it begins at the section (attribute layouts)"),
    (
        "unknowns",
        "unknown",
        "",
        "unknowns of multiple shooting: state at the section, instants and states of crossings",
        "X",
    ),
    ("tangent", "unknown", "", "direction of the branch"),
)
SPECIAL_ORBIT = table(
    ("kind", "", "text", "kind of the special point"),
    ("point", "", "place", "its place among the points"),
    ("indicator", "", "text", "indicator that is touched"),
    ("grazing", "", "text", "what happens at the graze (Feigin)"),
    ("sliding", "", "text", "sliding bifurcation"),
    ("bounded", "", "flag", "multipliers stay bounded at the graze"),
    ("doubled", "", "flag", "an orbit of twice the period branches off at the graze"),
    ("contact_multipliers", "multiplier", "complex", "multipliers with the contact, in the limit", "contact"),
    ("determinant", "matrix", "", "det(I - M-), det(I - M+), det(I + M-), det(I + M+) at the graze", "determinants"),
    before="special_",
)
#: Names in the table of special points.
STEMS = {column.name: column.name.removeprefix("special_") for column in SPECIAL_ORBIT}
STEMS |= {"special_boundary": "boundary", "special_indicator": "touched"}  # beside the dim of the clearances
CURVE = tuple(c for c in ORBIT if c.name in ("section", "maximum", "minimum", "period", "floquet_multipliers"))
EQUILIBRIUM = table(
    ("u", "state", "", "equilibrium (the mean of the extreme points of a set)"),
    ("u_lower", "state", "", "smallest value over the set of equilibria", "lower"),
    ("u_upper", "state", "", "largest value over the set of equilibria", "upper"),
    ("eigenvalues", "eigenvalue", "complex", "eigenvalues"),
    ("stable", "", "flag", "all real parts negative"),
    ("mode", "", "mode", "mode"),
)
SPECIAL = SPECIAL_ORBIT[:2]
SPECIAL_EQUILIBRIUM = SPECIAL + table(
    ("boundary", "", "text", "persistence or non-smooth fold at the boundary of a mode", "grazing"), before="special_"
)
#: What `find_orbit` gives, without a first dim.
FOUND = (
    *table(
        ("section", "state", "", "state at the section", "u"),
        ("memory", "memory", "", "memory at the section"),
    ),
    *(column for column in ORBIT if column.name in ("maximum", "minimum", "period", "virtual")),
    *table(
        ("period_number", "", "place", "forcing periods once round (0: autonomous)"),
        ("mode", "", "text", "mode at the section"),
        ("crossing_time", "crossing", "time", "time of the crossing", "crossing_times"),
        ("crossing_state", "crossing component", "", "state and memory after the crossing", "crossing_states"),
        ("monodromy_matrix", "component column", "", "monodromy matrix"),
        ("floquet_multipliers", "multiplier", "complex", "Floquet multipliers"),
        ("stable", "", "flag", "stable"),
        ("clearance", "indicator", "", "clearance"),
    ),
)


def with_marks_in_place(branch: xr.Dataset) -> xr.Dataset:
    """The branch, of which points may have been selected, with its special points where they are now; those whose point
    is gone are left out."""
    values, own = branch[branch.attrs["parameter"]].values, branch["special_value"].values
    if np.array_equal(values.take(branch["special_point"].values.astype(int), mode="clip"), own):
        return branch
    at = np.array([next(iter(np.flatnonzero(values == one)), -1) for one in own])
    return branch.assign(special_point=branch["special_point"].copy(data=at)).isel(special=at >= 0)


def line(
    labels: Labels,
    attrs: Mapping[str, Any],
    parameters: Mapping[str, ArrayLike],
    tables: tuple[Sequence[Column], Sequence[Column]],
    points: Sequence[Any],
    special: Sequence[Any],
    ends: tuple[Sequence[str], Sequence[str], Sequence[str]],
    more: Mapping[str, Any],
) -> xr.Dataset:
    """A branch or a curve: records over ``point`` in order along it, special points over ``special``.

    ``ends``: all endings there are, that of both ends, and their sentences; ``more``: further variables.
    """
    sizes = {"matrix": 4}
    variables: dict[str, Any] = {}
    for dim, known, records in (("point", tables[0], points), ("special", tables[1], special)):
        for column in known:
            array = _array(column, [getattr(one, column.field) for one in records], sizes)
            variables[column.name] = (dim, *column.dims), array, attributes(labels, column)
    if len(parameters) == 1:
        ((name, values),) = parameters.items()
        along = floats(values)[variables["special_point"][1]]
        variables["special_value"] = "special", along, quantity_attributes(name, labels.parameters[name])
    endings, ended, sentences = ends
    variables["ended"] = chosen("end", ended, endings, "how it ends")
    variables["ended_because"] = "end", strings(sentences), {"long_name": "sentence"}
    coords: dict[str, Any] = {"end": ["first", "last"]}
    for name, values in parameters.items():
        coords |= varied(labels, name, values, "point")
    if "clearance" in variables:
        coords["indicator"] = [*labels.indicators]
    return dataset(labels, attrs, {**variables, **more}, None, **coords)


def _array(column: Column, values: list[Any], sizes: dict[str, int]) -> Any:
    """Values of a column; those of different lengths are filled with NaN, ``sizes`` are those of dims met before."""
    if not column.dims:
        return typed(column, values)
    (dim,) = column.dims
    sizes.setdefault(dim, max(map(len, values), default=0))
    array = np.full((len(values), sizes[dim]), np.nan, typed(column, ()).dtype)
    for row, value in zip(array, values, strict=True):
        row[: len(value)] = value
    return array


_BRANCHES = table(
    ("branch", "point", "own", "branch"),
    ("special_branch", "special", "own", "branch of the special point"),
    ("special_period_number", "special", "own", "period number of the special point's orbit"),
    ("period_number", "branch_id", "place", "period number"),
    ("parent", "branch_id", "own", "branch that it leaves (-1: found in a sweep)"),
    ("swept_section", "direction sample iterate state", "own", "section points of the sweeps"),
    ("swept_period_number", "direction sample", "own", "period number of the sweeps"),
    ("complete", "", "yes", "all branches were followed within the budget"),
)


def diagram(
    labels: Labels,
    attrs: Mapping[str, Any],
    parameter: str,
    branches: Sequence[xr.Dataset],
    parents: Sequence[int],
    swept: xr.Dataset,
    complete: bool,
) -> xr.Dataset:
    """The result of ``bifurcation_diagram``: branches one after the other over ``point``, and the sweeps.

    ``parents`` are the branches that they leave."""
    # Words of the branches, each once, and of a branch's own numbers those in all.
    known: dict[str, dict[str, int]] = {"signature": {}, "layout": {}}
    kept = [*(column.name for column in (*ORBIT, *SPECIAL_ORBIT)), "status", "special_value", "returns"]
    longest = {dim: max(one.sizes[dim] for one in branches) for dim in ("return", "unknown")}
    parts, offset = [], 0
    for k, one in enumerate(branches):
        n, special = one.sizes["point"], one.sizes["special"]
        words = {
            "signature": str(one["signature"].attrs["flag_meanings"]).split(),
            "layout": [json.dumps(layout) for layout in json.loads(one.attrs["layouts"])],
        }
        added: dict[str, Any] = {
            name: one[name].copy(
                data=np.array([known[name].setdefault(text, len(known[name])) for text in own], np.int32)[one[name]]
            )
            for name, own in words.items()
        }
        added["special_point"] = one["special_point"] + offset
        numbers = {
            "branch": np.full(n, k),
            "special_branch": np.full(special, k),
            "special_period_number": np.full(special, int(one["period_number"])),
        }
        whole = one[kept].assign(added | columns(labels, _BRANCHES, numbers))
        room = {dim: (0, most - whole.sizes[dim]) for dim, most in longest.items()}
        parts.append(whole.pad(room, constant_values=np.nan))
        offset += n
    joined = {
        name: xr.Variable.concat([part.variables[name] for part in parts], dim)
        for dim in ("point", "special")
        for name, one in parts[0].variables.items()
        if dim in one.dims
    }
    along = {parameter: joined.pop(parameter), **parts[0].drop_dims(["point", "special"]).coords}
    result = xr.Dataset(joined, along)
    result["signature"].attrs |= flag_attributes(list(known["signature"]), dtype=np.int32)
    result["mode"].attrs |= flag_attributes(labels.modes, dtype=result["mode"].dtype)
    of_sweeps = {name: swept[name].transpose("direction", parameter, ...) for name in ("section", "period_number")}
    given: dict[str, Any] = {
        "period_number": [int(one["period_number"]) for one in branches],
        "parent": parents,
        "swept_section": of_sweeps["section"].transpose(..., "iterate", "state"),
        "swept_period_number": of_sweeps["period_number"],
        "complete": complete,
    }
    added = columns(labels, _BRANCHES, given)
    added["swept_value"] = "sample", swept[parameter].values, dict(swept[parameter].attrs)
    for name in ("ended", "ended_because"):
        added[name] = ("branch_id", "end"), np.array([one[name].values for one in branches]), branches[0][name].attrs
    result = result.assign(added).assign_coords(direction=swept["direction"].variable)
    result.attrs = dict(attrs) | {"parameter": parameter, "layouts": f"[{', '.join(known['layout'])}]"}
    if "visited" in branches[0].attrs:
        told = [json.loads(one.attrs["visited"]) for one in branches]
        result.attrs["visited"] = json.dumps([{k: v for one in told for k, v in one[i].items()} for i in (0, 1)])
    return with_short_record(result)


KINDS = ("unstable", "stable")
_POINT = table(
    ("section", "point state", "own", "state at the section"),
    ("arc_length", "point", "own", "length from the orbit, in scaled states"),
    ("iterate", "point", "own", "which image of the first segment"),
    ("piece", "point", "own", "number of jumps of the section map before it"),
    ("arc", "point", "own", "which arc"),
    ("side", "arc", "yes", "side of the orbit"),
    ("orbit_point", "arc", "place", "point of the orbit"),
    ("multiplier", "arc", "", "multiplier once round"),
    ("orbit_section", "return state", "", "points of the orbit"),
    ("size", "state", "", "what a scaled state of 1 is"),
    ("ended_because", "arc", "text", "sentence"),
)


def manifolds(
    labels: Labels,
    attrs: Mapping[str, Any],
    arrays: Mapping[str, ArrayLike],
    *,
    kinds: Sequence[str],
    endings: Mapping[str, str],
    ended: Sequence[str],
) -> xr.Dataset:
    """The result of ``manifolds``: points over ``point`` in order along each arc, what they are over ``arc``."""
    variables = columns(labels, _POINT, {**arrays, "ended_because": [endings[word] for word in ended]})
    # The dim's own name would make an index of it.
    variables["arc_number"] = variables.pop("arc")
    variables["manifold"] = chosen("arc", kinds, KINDS, "manifold")
    variables["ended"] = chosen("arc", ended, tuple(endings), "how the arc ends")
    return dataset(labels, attrs, variables)
