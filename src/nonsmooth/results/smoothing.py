"""Builder of the labelled result of ``smoothing_report``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment

from nonsmooth.arrays import FloatArray
from nonsmooth.results.labels import Labels
from nonsmooth.results.schema import columns, dataset, floats, parameter_coords, state_coords, strings, table
from nonsmooth.results.statuses import status_attributes

__all__ = ["report"]


_ORBIT = table(
    ("section", "state", "", "state at phase 0, or in the middle of the first segment (autonomous)"),
    ("maximum", "state", "", "largest value along the orbit"),
    ("minimum", "state", "", "least value along the orbit"),
    ("period", "", "time", "period"),
    ("floquet_multipliers", "multiplier", "complex", "Floquet multipliers"),
    ("stable", "", "flag", "all multipliers inside the unit circle"),
    ("exponents", "exponent", "", "Lyapunov exponents"),
)
_NONE = {"complex": complex(np.nan, np.nan), "flag": False}  # what stands where there is no orbit; else NaN
_COUNTS = {
    "n_attractors": "number of attractors that the starts reach",
    "missing": "attractors of the event-driven system without a counterpart",
    "spurious": "attractors without a counterpart in the event-driven system",
}
_DIFFERENCES = {
    "state": "largest difference of the states, in units of their scales",
    "multiplier": "largest difference of the multipliers",
    "exponent": "largest difference of the exponents that are finite without a band",
    "period": "relative difference of the periods",
}


def report(
    labels: Labels, attrs: Mapping[str, str], bands: Sequence[str], etas: FloatArray, reference: Mapping[str, Any],
    rows: Mapping[tuple[int, int], Mapping[str, Any]], *, scale: FloatArray, forced: bool,
) -> xr.Dataset:  # fmt: skip
    """The result of ``smoothing_report``: ``rows`` by (band, eta), with the names of the variables."""
    n, shape = len(labels.states), (len(bands), len(etas))
    variables: dict[str, Any] = {}
    for column in _ORBIT:
        name, empty = column.name, _NONE.get(column.rule, np.nan)
        size = [n] * len(column.dims)
        values, own = np.full((*shape, *size), empty), np.full(size, empty)
        for place, row in rows.items():
            values[place] = row.get(name, empty)
        own[...] = reference.get(name, empty)
        sharp = column._replace(name=f"reference_{name}", words=f"{column.words}, event-driven")
        variables |= columns(labels, [column], {name: values}, "band", "eta") | columns(labels, [sharp], {name: own})
    for key, far in _differences(variables, scale, forced).items():
        variables[f"{key}_difference"] = (("band", "eta"), far, {"long_name": _DIFFERENCES[key]})
        words = {"long_name": f"order of {key}_difference in eta, against the next smaller one"}
        variables[f"{key}_order"] = (("band", "eta"), _orders(etas, far), words)
    if "n_attractors" in reference:
        for name, long_name in _COUNTS.items():
            counts = np.array([[rows[i, j][name] for j in range(shape[1])] for i in range(shape[0])], np.int64)
            variables[name] = (("band", "eta"), counts, {"long_name": long_name})
        variables["reference_n_attractors"] = (
            (),
            np.int64(reference["n_attractors"]),
            {"long_name": f"{_COUNTS['n_attractors']}, event-driven"},
        )
    status = [[rows[i, j]["status"] for j in range(shape[1])] for i in range(shape[0])]
    notes = [rows[i, j]["note"] for i in range(shape[0]) for j in range(shape[1])]
    variables["status"] = (("band", "eta"), np.array(status, np.int8), status_attributes())
    variables["note"] = (("band", "eta"), strings(notes).reshape(shape), {"long_name": "why there is no such orbit"})
    coords: dict[str, Any] = {
        "band": ("band", strings(bands), {"long_name": "shape of the bands"}),
        "eta": ("eta", floats(etas), {"long_name": "half width of the bands"}),
        "exponent": ("exponent", np.arange(1, n + 1), {"long_name": "number of the exponent"}),
        **state_coords(labels),
        **parameter_coords(labels, without=["band", *variables]),
    }
    return dataset(variables, coords, attrs)


def _differences(variables: Mapping[str, Any], scale: FloatArray, forced: bool) -> dict[str, FloatArray]:
    """Distances to the event-driven orbit, (band, eta)."""

    def both(name: str) -> tuple[Any, Any]:
        return variables[name][1], variables[f"reference_{name}"][1]

    keys = ("section",) if forced else ("maximum", "minimum")
    state = np.max([np.abs((a - b) / scale).max(axis=-1) for a, b in map(both, keys)], axis=0)
    exponents, reference = both("exponents")
    finite = np.isfinite(reference)
    if finite.any():
        exponent = np.abs(exponents[..., finite] - reference[finite]).max(axis=-1)
    else:
        exponent = np.full(state.shape, np.nan)
    period, known = both("period")
    return {
        "state": state,
        "multiplier": _of_multipliers(*both("floquet_multipliers")),
        "exponent": exponent,
        "period": np.abs(period / known - 1),
    }


def _of_multipliers(values: Any, reference: Any) -> FloatArray:
    """The largest distance of two sets of multipliers, each paired with one of the other so that the sum is least."""
    found = np.full(values.shape[:-1], np.nan)
    for place in np.ndindex(found.shape):
        gaps = np.abs(values[place][:, None] - reference[None, :])
        if np.isfinite(gaps).all():
            found[place] = gaps[linear_sum_assignment(gaps)].max()
    return found


def _orders(etas: FloatArray, far: FloatArray) -> FloatArray:
    """Slopes of the logarithm of a distance over that of log eta, against the next smaller eta; NaN at the smallest."""
    orders = np.full(far.shape, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        orders[:, 1:] = np.diff(np.log(far), axis=1) / np.diff(np.log(etas))
    orders[~np.isfinite(orders)] = np.nan
    return orders
