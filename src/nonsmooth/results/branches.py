"""Builders of the labelled results of continuation: a branch of orbits, a curve of special points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import floats, parameter_coords, quantity_attributes, state_coords, strings, varied
from nonsmooth.results.statuses import flag_attributes, status_attributes

__all__ = ["branch", "curve", "equilibria"]

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
        array = strings(column) if name in ("kind", "indicator", "grazing") else np.asarray(column)
        variables[stem] = (("special", *dims), array, {"long_name": long_name})
    variables["special_value"] = _special_value(d, parameter, along, marks["place"])
    variables["period_number"] = ((), np.int64(period_number), {"long_name": f"{d.turn}s (0: autonomous)"})
    coords = _coords(d, {parameter: values})
    coords["indicator"] = ("indicator", strings(d.indicators), {"long_name": "indicator"})
    variables |= _ends(endings, ended, sentences)
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


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
