"""Builders of the labelled results of continuation: branches of orbits, curves of special points, manifolds."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import (
    Column,
    attributes,
    columns,
    dataset,
    floats,
    parameter_coords,
    quantity_attributes,
    state_coords,
    strings,
    table,
    typed,
    varied,
)
from nonsmooth.results.statuses import flag_attributes

__all__ = [
    "CURVE",
    "EQUILIBRIUM",
    "FOUND",
    "KINDS",
    "ORBIT",
    "SPECIAL",
    "SPECIAL_EQUILIBRIUM",
    "SPECIAL_ORBIT",
    "STEMS",
    "Column",
    "attributes",
    "diagram",
    "line",
    "manifolds",
]

#: One orbit of a branch; builder, writer and reader go by these tables.
ORBIT = (
    Column("section", "section", ("state",), "", "state at the section"),
    Column("maximum", "maximum", ("state",), "", "largest value along the orbit"),
    Column("minimum", "minimum", ("state",), "", "smallest value along the orbit"),
    Column("period", "period", (), "time", "period"),
    Column("floquet_multipliers", "multipliers", ("multiplier",), "complex", "Floquet multipliers"),
    Column("stable", "stable", (), "flag", "all multipliers inside the unit circle"),
    Column("virtual", "virtual", (), "flag", "the path goes through a boundary that it should obey"),
    Column("signature", "cycle", (), "id", "signature"),
    Column("mode", "mode", (), "mode", "mode at the section"),
    Column("crossings_per_period", "crossings", (), "", "transitions per forcing period (autonomous: once round)"),
    Column("contacts_per_period", "contacts", (), "",
           "entries into contact per forcing period (autonomous: once round)"),
    Column("clearance", "clearance", ("indicator",), "", "least distance to a transition that does not happen"),
    Column("layout", "layout", (), "id", "signature as it begins at the section (attribute layouts)"),
    Column("unknowns", "X", ("unknown",), "",
           "unknowns of multiple shooting: state at the section, instants and states of crossings"),
    Column("tangent", "tangent", ("unknown",), "", "direction of the branch"),
)  # fmt: skip
SPECIAL_ORBIT = (
    Column("special_kind", "kind", (), "text", "kind of the special point"),
    Column("special_point", "point", (), "place", "its place among the points"),
    Column("special_indicator", "indicator", (), "text", "indicator that is touched"),
    Column("special_grazing", "grazing", (), "text", "what happens at the graze (Feigin)"),
    Column("special_sliding", "sliding", (), "text", "sliding bifurcation"),
    Column("special_bounded", "bounded", (), "flag", "multipliers stay bounded at the graze"),
    Column("special_doubled", "doubled", (), "flag", "an orbit of twice the period branches off at the graze"),
    Column("special_contact_multipliers", "contact", ("multiplier",), "complex",
           "multipliers with the contact, in the limit"),
    Column("special_determinant", "determinants", ("matrix",), "",
           "det(I - M-), det(I - M+), det(I + M-), det(I + M+) at the graze"),
)  # fmt: skip
#: Names in the table of special points.
STEMS = {column.name: column.name.removeprefix("special_") for column in SPECIAL_ORBIT}
STEMS |= {"special_boundary": "boundary", "special_indicator": "touched"}  # beside the dim of the clearances
CURVE = tuple(c for c in ORBIT if c.name in ("section", "maximum", "minimum", "period", "floquet_multipliers"))
EQUILIBRIUM = (
    Column("u", "u", ("state",), "", "equilibrium (the mean of the extreme points of a set)"),
    Column("u_lower", "lower", ("state",), "", "smallest value over the set of equilibria"),
    Column("u_upper", "upper", ("state",), "", "largest value over the set of equilibria"),
    Column("eigenvalues", "eigenvalues", ("eigenvalue",), "complex", "eigenvalues"),
    Column("stable", "stable", (), "flag", "all real parts negative"),
    Column("mode", "mode", (), "mode", "mode"),
)
SPECIAL = SPECIAL_ORBIT[:2]
SPECIAL_EQUILIBRIUM = (
    *SPECIAL,
    Column("special_boundary", "grazing", (), "text", "persistence or non-smooth fold at the boundary of a mode"),
)
#: What `find_orbit` gives, without a first dim.
FOUND = (
    Column("section", "u", ("state",), "", "state at the section"),
    Column("memory", "memory", ("memory",), "", "memory at the section"),
    *(column for column in ORBIT if column.name in ("maximum", "minimum", "period", "virtual")),
    Column("period_number", "period_number", (), "place", "forcing periods once round (0: autonomous)"),
    Column("mode", "mode", (), "text", "mode at the section"),
    Column("crossing_time", "crossing_times", ("crossing",), "time", "time of the crossing"),
    Column("crossing_state", "crossing_states", ("crossing", "component"), "", "state and memory after the crossing"),
    Column("monodromy_matrix", "monodromy_matrix", ("component", "column"), "", "monodromy matrix"),
    Column("floquet_multipliers", "floquet_multipliers", ("multiplier",), "complex", "Floquet multipliers"),
    Column("stable", "stable", (), "flag", "stable"),
    Column("clearance", "clearance", ("indicator",), "", "clearance"),
)


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
    codes = np.array([endings.index(word) for word in ended], dtype=np.int8)
    variables["ended"] = "end", codes, {"long_name": "how it ends", **flag_attributes(endings)}
    variables["ended_because"] = "end", strings(sentences), {"long_name": "sentence"}
    coords: dict[str, Any] = {}
    for name, values in parameters.items():
        coords |= varied(labels, name, values, "point")
    coords |= state_coords(labels) | parameter_coords(labels, without=tuple(parameters))
    coords["end"] = "end", strings(["first", "last"]), {"long_name": "end"}
    if "clearance" in variables:
        coords["indicator"] = "indicator", strings(labels.indicators), {"long_name": "indicator"}
    return dataset({**variables, **more}, coords, attrs)


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


def diagram(
    attrs: Mapping[str, Any],
    parameter: str,
    branches: Sequence[xr.Dataset],
    returns: Sequence[NDArray[np.float64]],
    parents: Sequence[int],
    swept: xr.Dataset,
    complete: bool,
) -> xr.Dataset:
    """The result of ``bifurcation_diagram``: branches one after the other over ``point``, and the sweeps.

    ``returns`` (point, period number, state): all section points of each branch; ``parents`` the branches they leave.
    """
    # Words of the branches, each once, and of a branch's own numbers those in all.
    known: dict[str, dict[str, int]] = {"signature": {}, "layout": {}}
    kept = [*(column.name for column in (*ORBIT, *SPECIAL_ORBIT)), "status", "special_value"]
    width = max(one.sizes["unknown"] for one in branches)
    longest = max(points.shape[1] for points in returns)
    parts, offset = [], 0
    for k, (one, points) in enumerate(zip(branches, returns, strict=True)):
        words = {
            "signature": str(one["signature"].attrs["flag_meanings"]).split(),
            "layout": [json.dumps(layout) for layout in json.loads(one.attrs["layouts"])],
        }
        ids = {
            name: np.array([known[name].setdefault(text, len(known[name])) for text in own], dtype=np.int32)
            for name, own in words.items()
        }
        n, special = one.sizes["point"], one.sizes["special"]
        room = {"return": (0, longest - points.shape[1]), "unknown": (0, width - one.sizes["unknown"])}
        every = xr.Variable(("point", "return", "state"), points, {"long_name": "section points"})
        parts.append(one[kept].assign({
            **{name: ("point", own[one[name].values], one[name].attrs) for name, own in ids.items()},
            "special_point": ("special", one["special_point"].values + offset, one["special_point"].attrs),
            "branch": ("point", np.full(n, k), {"long_name": "branch"}),
            "special_branch": ("special", np.full(special, k), {"long_name": "branch of the special point"}),
            "special_period_number": (
                "special", np.full(special, int(one["period_number"])),
                {"long_name": "period number of the special point's orbit"},
            ),
            "returns": every,
        }).pad(room, constant_values=np.nan))  # fmt: skip
        offset += n
    lines = [part.drop_dims("special") for part in parts]
    marks = [part[[name for name in part if "special" in part[name].dims]] for part in parts]
    result = xr.merge([
        xr.concat(lines, "point", data_vars="minimal", coords="minimal", compat="override"),
        xr.concat(marks, "special", data_vars="minimal", coords="minimal", compat="override").drop_vars(
            parameter, errors="ignore"
        ),
    ], compat="override")  # fmt: skip
    for name in result.variables:
        if name in branches[0].variables:
            result[name].attrs = dict(branches[0][name].attrs)
    result["signature"].attrs |= flag_attributes(list(known["signature"]), dtype=np.int32)
    column = {name: swept[name].transpose("direction", parameter, ...) for name in ("section", "period_number")}
    sentences = np.array([one["ended_because"].values for one in branches], dtype=str)
    result = result.assign({
        "period_number": ("branch_id", [int(one["period_number"]) for one in branches], {"long_name": "period number"}),
        "parent": ("branch_id", np.array(parents), {"long_name": "branch that it leaves (-1: found in a sweep)"}),
        "ended": (("branch_id", "end"), [one["ended"].values for one in branches], branches[0]["ended"].attrs),
        "ended_because": (("branch_id", "end"), sentences, branches[0]["ended_because"].attrs),
        "swept_value": ("sample", swept[parameter].values, dict(swept[parameter].attrs)),
        "swept_section": (
            ("direction", "sample", "iterate", "state"), column["section"].transpose(..., "iterate", "state").values,
            {"long_name": "section points of the sweeps"},
        ),
        "swept_period_number": (
            ("direction", "sample"), column["period_number"].values, {"long_name": "period number of the sweeps"}
        ),
        "complete": ((), np.int8(complete), {"long_name": "all branches were followed within the budget"}),
    })  # fmt: skip
    result = result.assign_coords(direction=swept["direction"].variable)
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
    labels: Labels, attrs: Mapping[str, Any], arrays: Mapping[str, ArrayLike], *, kinds: Sequence[str],
    sides: ArrayLike, orbit_points: ArrayLike, multipliers: ArrayLike, orbit_section: ArrayLike, scale: ArrayLike,
    endings: Mapping[str, str], ended: Sequence[str],
) -> xr.Dataset:  # fmt: skip
    """The result of ``manifolds``: points over ``point`` in order along each arc, what they are over ``arc``."""
    variables = columns(labels, _POINT, {
        **arrays, "side": sides, "orbit_point": orbit_points, "multiplier": multipliers,
        "orbit_section": orbit_section, "size": scale, "ended_because": [endings[word] for word in ended],
    })  # fmt: skip
    # The dim's own name would make an index of it.
    variables["arc_number"] = variables.pop("arc")
    for name, words, known, chosen in (
        ("manifold", "manifold", KINDS, kinds),
        ("ended", "how the arc ends", tuple(endings), ended),
    ):
        codes = np.array([known.index(word) for word in chosen], dtype=np.int8)
        variables[name] = ("arc", codes, {"long_name": words, **flag_attributes(known)})
    coords = state_coords(labels) | parameter_coords(labels)
    return dataset(variables, coords, attrs)
