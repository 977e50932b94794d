"""Builders of the labelled results of continuation: a branch of orbits, a curve of special points."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import floats, parameter_coords, quantity_attributes, state_coords, strings, varied
from nonsmooth.results.statuses import flag_attributes, status_attributes

__all__ = ["branch", "curve", "diagram", "equilibria"]

#: Dims and long names of what a branch holds for every point, and for every special point.
_BRANCH_ARRAYS: dict[str, tuple[tuple[str, ...], str]] = {
    "section": (("state",), "state at the section"),
    "maximum": (("state",), "largest value along the orbit"),
    "minimum": (("state",), "smallest value along the orbit"),
    "period": ((), "period"),
    "floquet_multipliers": (("multiplier",), "Floquet multipliers"),
    "stable": ((), "all multipliers inside the unit circle"),
    "virtual": ((), "the path goes through a boundary that it should obey"),
    "signature": ((), "signature"),
    "mode": ((), "mode at the section"),
    "crossings_per_period": ((), "transitions per forcing period (autonomous: once round)"),
    "contacts_per_period": ((), "entries into contact per forcing period (autonomous: once round)"),
    "clearance": (("indicator",), "least distance to a transition that does not happen"),
    "layout": ((), "signature as it begins at the section (attribute layouts)"),
    "unknowns": (("unknown",), "unknowns of multiple shooting: state at the section, instants and states of crossings"),
    "tangent": (("unknown",), "direction of the branch"),
}
_MARKS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "kind": ("special_kind", (), "kind of the special point"),
    "place": ("special_point", (), "its place among the points"),
    "indicator": ("special_indicator", (), "indicator that is touched"),
    "grazing": ("special_grazing", (), "what happens at the graze (Feigin)"),
    "sliding": ("special_sliding", (), "sliding bifurcation"),
    "bounded": ("special_bounded", (), "multipliers stay bounded at the graze"),
    "doubled": ("special_doubled", (), "an orbit of twice the period branches off at the graze"),
    "contact": ("special_contact_multipliers", ("multiplier",), "multipliers with the contact, in the limit"),
    "determinants": (
        "special_determinant", ("matrix",), "det(I - M-), det(I - M+), det(I + M-), det(I + M+) at the graze",
    ),
}  # fmt: skip


def branch(
    labels: Labels,
    attrs: Mapping[str, Any],
    parameter: str,
    values: ArrayLike,
    arrays: Mapping[str, ArrayLike],
    marks: Mapping[str, Any],
    *,
    period_number: int,
    signatures: Sequence[str],
    endings: Sequence[str],
    ended: Sequence[str],
    sentences: Sequence[str],
) -> xr.Dataset:
    """The result of ``continue_orbit``: orbits over ``point`` in order along the branch, marks over ``special``.

    ``signatures`` are the texts of the ids in ``arrays["signature"]``; ``ended`` the outcome at both ends, of
    ``endings``, with their sentences.
    """
    d = labels
    variables: dict[str, Any] = {}
    for name, (dims, long_name) in _BRANCH_ARRAYS.items():
        words = long_name.replace("forcing period", d.turn)
        variables[name] = (("point", *dims), np.asarray(arrays[name]), {"long_name": words})
    variables["period"][2]["units"] = d.time_unit
    variables["mode"] = ("point", np.asarray(arrays["mode"], np.int16), {
        "long_name": "mode at the section", **flag_attributes(d.modes, dtype=np.int16)})  # fmt: skip
    variables["signature"] = ("point", np.asarray(arrays["signature"], np.int32), {
        "long_name": "signature", **flag_attributes(signatures, dtype=np.int32)})  # fmt: skip
    variables["layout"] = ("point", np.asarray(arrays["layout"], np.int32), variables["layout"][2])
    along = floats(values)
    variables["status"] = ("point", np.zeros(len(along), np.int8), status_attributes())
    for name, (stem, dims, long_name) in _MARKS.items():
        column = marks[name]
        array = strings(column) if name in ("kind", "indicator", "grazing", "sliding") else np.asarray(column)
        variables[stem] = (("special", *dims), array, {"long_name": long_name})
    variables["special_value"] = _special_value(d, parameter, along, marks["place"])
    variables["period_number"] = ((), np.int64(period_number), {"long_name": f"{d.turn}s (0: autonomous)"})
    coords = _coords(d, {parameter: values})
    coords["indicator"] = ("indicator", strings(d.indicators), {"long_name": "indicator"})
    variables |= _ends(endings, ended, sentences)
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


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
    texts: dict[str, int] = {}
    layouts: dict[str, int] = {}
    width = max(one.sizes["unknown"] for one in branches)
    longest = max(points.shape[1] for points in returns)
    parts, offset = [], 0
    for k, (one, points) in enumerate(zip(branches, returns, strict=True)):
        own = str(one["signature"].attrs["flag_meanings"]).split()
        ids = np.array([texts.setdefault(text, len(texts)) for text in own], dtype=np.int32)
        tables = [json.dumps(table) for table in json.loads(one.attrs["layouts"])]
        kept = np.array([layouts.setdefault(table, len(layouts)) for table in tables], dtype=np.int32)
        number = int(one["period_number"])
        room = {"unknown": (0, width - one.sizes["unknown"])}
        part = one[[*_BRANCH_ARRAYS, "status", *(stem for stem, _, _ in _MARKS.values()), "special_value"]]
        part = part.pad(room, constant_values=np.nan)
        part["signature"] = ("point", ids[one["signature"].values])
        part["layout"] = ("point", kept[one["layout"].values])
        part["special_point"] = ("special", one["special_point"].values + offset)
        part["branch"] = ("point", np.full(one.sizes["point"], k))
        part["special_branch"] = ("special", np.full(one.sizes["special"], k))
        part["special_period_number"] = ("special", np.full(one.sizes["special"], number))
        all_returns = np.full((len(points), longest, points.shape[2]), np.nan)
        all_returns[:, : points.shape[1]] = points
        part["returns"] = (("point", "return", "state"), all_returns)
        parts.append(part)
        offset += one.sizes["point"]
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
    result["signature"].attrs |= flag_attributes(list(texts), dtype=np.int32)
    for name, words in (
        ("branch", "branch"), ("special_branch", "branch of the special point"), ("returns", "section points"),
        ("special_period_number", "period number of the special point's orbit"),
    ):  # fmt: skip
        result[name].attrs["long_name"] = words
    column = {name: swept[name].transpose("direction", parameter, ...) for name in ("section", "period_number")}
    result = result.assign({
        "period_number": ("branch_id", [int(one["period_number"]) for one in branches], {"long_name": "period number"}),
        "parent": ("branch_id", np.array(parents), {"long_name": "branch that it leaves (-1: found in a sweep)"}),
        "ended": (("branch_id", "end"), [one["ended"].values for one in branches], branches[0]["ended"].attrs),
        "ended_because": (("branch_id", "end"), _sentences(branches), branches[0]["ended_because"].attrs),
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
    result.attrs = dict(attrs) | {"parameter": parameter, "layouts": f"[{', '.join(layouts)}]"}
    return with_short_record(result)


def _sentences(branches: Sequence[xr.Dataset]) -> NDArray[np.str_]:
    """Endings in words of several branches (branch, end)."""
    return strings(str(text) for one in branches for text in one["ended_because"].values).reshape(-1, 2)


def curve(
    labels: Labels,
    attrs: Mapping[str, Any],
    parameters: Mapping[str, ArrayLike],
    arrays: Mapping[str, ArrayLike],
    special: Sequence[tuple[str, int]],
    *,
    kind: str,
    period_number: int,
    signature: str,
    endings: Mapping[str, str],
    ended: Sequence[str],
) -> xr.Dataset:
    """The result of ``continue_curve``: two parameters over ``point``, points of codimension two over ``special``."""
    d = labels
    variables: dict[str, Any] = {
        name: (("point", *_BRANCH_ARRAYS[name][0]), np.asarray(array), {"long_name": _BRANCH_ARRAYS[name][1]})
        for name, array in arrays.items()
    }
    variables["period"][2]["units"] = d.time_unit
    variables["kind"] = ((), kind, {"long_name": "kind of the special point that is followed"})
    variables["period_number"] = ((), np.int64(period_number), {"long_name": f"{d.turn}s (0: autonomous)"})
    variables["signature"] = ((), signature, {"long_name": "signature"})
    variables["special_kind"] = ("special", strings(name for name, _ in special), {"long_name": "codimension two"})
    variables["special_point"] = _places(special)
    variables |= _ends(list(endings), ended, [endings[word] for word in ended])
    return with_short_record(xr.Dataset(variables, _coords(d, parameters), dict(attrs)))


def equilibria(
    labels: Labels,
    attrs: Mapping[str, Any],
    parameter: str,
    values: ArrayLike,
    arrays: Mapping[str, ArrayLike],
    special: Sequence[tuple[str, int]],
    *,
    endings: Mapping[str, str],
    ended: Sequence[str],
) -> xr.Dataset:
    """The result of ``continue_equilibrium``: equilibria over ``point``, marks over ``special``."""
    d = labels
    modes = flag_attributes(d.modes, dtype=np.int16)
    variables: dict[str, Any] = {
        "u": (("point", "state"), np.asarray(arrays["u"]), {"long_name": "equilibrium"}),
        "eigenvalues": (("point", "eigenvalue"), np.asarray(arrays["eigenvalues"]), {"long_name": "eigenvalues"}),
        "stable": ("point", np.asarray(arrays["stable"]), {"long_name": "all real parts negative"}),
        "mode": ("point", np.asarray(arrays["mode"], np.int16), {"long_name": "mode", **modes}),
        "special_kind": ("special", strings(kind for kind, _ in special), {"long_name": "kind of the special point"}),
        "special_point": _places(special),
        "special_value": _special_value(d, parameter, floats(values), [place for _, place in special]),
        **_ends(list(endings), ended, [endings[word] for word in ended]),
    }
    return with_short_record(xr.Dataset(variables, _coords(d, {parameter: values}), dict(attrs)))


def _places(special: Sequence[tuple[str, int]]) -> tuple[Any, ...]:
    places = np.array([place for _, place in special], dtype=np.int64)
    return "special", places, {"long_name": "its place among the points"}


def _special_value(d: Labels, parameter: str, along: NDArray[np.float64], places: Any) -> tuple[Any, ...]:
    return "special", along[np.asarray(places, dtype=np.int64)], quantity_attributes(parameter, d.parameters[parameter])


def _ends(endings: Sequence[str], ended: Sequence[str], sentences: Sequence[str]) -> dict[str, Any]:
    """Endings of both ends: one of ``endings``, and a sentence."""
    codes = np.array([endings.index(word) for word in ended], dtype=np.int8)
    return {
        "ended": ("end", codes, {"long_name": "how it ends", **flag_attributes(endings)}),
        "ended_because": ("end", strings(sentences), {"long_name": "sentence"}),
    }


def _coords(d: Labels, parameters: Mapping[str, ArrayLike]) -> dict[str, Any]:
    """The parameters that vary over ``point``, the states, the other parameters, and the two ends."""
    coords: dict[str, Any] = {}
    for name, values in parameters.items():
        coords |= varied(d, name, values, "point")
    coords |= state_coords(d) | parameter_coords(d, without=tuple(parameters))
    return coords | {"end": ("end", strings(["first", "last"]), {"long_name": "end"})}
