"""Builders of the results that span a plane: charts over two parameters, basins over two states.

::

    chart(d, attrs, {"omega": (A,), "rho": (B,)}, arrays, starts=(S, n), one_start=True)
        # arrays: leading dims (A, B), or (A, B, S) where several starts were given; maximum and minimum end in (n,).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import (
    floats,
    parameter_coords,
    quantity_attributes,
    start_coords,
    state_coords,
    varied,
)
from nonsmooth.results.statuses import status_attributes

__all__ = ["attractor_variables", "basin_fractions", "basins", "chart"]

SHOWN = 4000  # section points kept of one attractor
LABEL = "attractor (-1: not converged, -2: diverged)"

_LONG_NAMES = {
    "period_number": "period number (0: none found)",
    "crossings_per_period": "transitions per return",
    "contacts_per_period": "entries into contact per return",
    "maximum": "largest value on the attractor",
    "minimum": "smallest value on the attractor",
    "n_attractors": "number of attractors that the starts reached",
    "confidence": "probability that the label is right",
    "fraction": "share of the starts",
    "fraction_error": "binomial standard error of the share",
    "minimal_shock": "least jump from the section to another basin, in the states' scales",
    "entropy": "basin entropy",
    "boundary_entropy": "basin entropy of the boxes with more than one label",
    "boundary_dimension": "dimension of the boundary",
    "n_starts_99": "random starts that meet every attractor with 99 %",
    "uncertain": "share of starts with another label at this distance",
    "lyapunov": "largest Lyapunov exponent",
    "lyapunov_error": "standard error of the largest Lyapunov exponent",
    "name": "what the attractor is",
    "chaotic": "1 where the largest exponent is above zero beyond its error",
    "section": "a section point",
    "not_converged": "share of starts that had not converged",
    "diverged": "share of starts that diverged",
    "failed": "share of starts that could not be followed (among those not converged)",
    "computed": "1 where the point was computed, 0 where its label was inferred",
}


def chart(
    labels: Labels,
    attrs: Mapping[str, str],
    grid: Mapping[str, ArrayLike],
    arrays: Mapping[str, Any],
    *,
    starts: ArrayLike,
    one_start: bool,
) -> xr.Dataset:
    """The result of ``chart``: everything known per point of the plane of two parameters."""
    plane = tuple(grid)
    each = plane if one_start else (*plane, "start")
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        dims: tuple[str, ...] = each
        if name in ("maximum", "minimum"):
            dims = (*each, "state")
        elif name in ("n_attractors", "confidence", "computed"):
            dims = plane
        if name == "status":
            attributes: dict[str, Any] = status_attributes()
        elif name.startswith("lyapunov"):
            words = "standard error of the largest" if name.endswith("error") else "largest"
            attributes = {"long_name": f"{words} Lyapunov exponent", "units": f"1/{labels.time_unit}"}
        else:
            attributes = {"long_name": _LONG_NAMES[name]}
        variables[name] = (dims, array, attributes)
    coords: dict[str, Any] = parameter_coords(labels, without=plane)
    for name, values in grid.items():
        coords |= varied(labels, name, values)
    coords |= state_coords(labels)
    result = with_short_record(xr.Dataset(variables, coords | start_coords(starts), dict(attrs)))
    return result.squeeze("start") if one_start else result


def basins(
    labels: Labels,
    attrs: Mapping[str, str],
    grid: Mapping[str, ArrayLike],
    label: ArrayLike,
    attractors: Sequence[Any],
    *,
    fixed: Mapping[str, float],
    per_attractor: Mapping[str, Any],
    measures: Mapping[str, float],
    uncertain: tuple[Any, Any],
    status: ArrayLike,
) -> xr.Dataset:
    """The result of ``basins``. ``attractors`` have the fields of ``attractors.basins_attractors.Attractor``."""
    plane = tuple(grid)
    variables: dict[str, Any] = {"label": (plane, np.asarray(label, np.int32), {"long_name": LABEL})}
    variables["status"] = (plane, np.asarray(status, np.int8), status_attributes())
    variables |= attractor_variables(labels, attractors)
    for name, values in per_attractor.items():
        variables[name] = ("attractor", values, {"long_name": _LONG_NAMES[name]})
    for name, value in measures.items():
        variables[name] = ((), value, {"long_name": _LONG_NAMES[name]})
    variables["uncertain"] = ("distance", uncertain[1], {"long_name": _LONG_NAMES["uncertain"]})
    coords: dict[str, Any] = parameter_coords(labels) | state_coords(labels)
    for name, values in grid.items():
        coords[name] = (name, floats(values), quantity_attributes(name, labels.states[name]))
    for name, value in fixed.items():
        coords[name] = ((), float(value), quantity_attributes(name, labels.states[name]))
    coords["distance"] = ("distance", uncertain[0], {"long_name": "distance in grid steps"})
    coords["attractor"] = ("attractor", np.arange(len(attractors)), {"long_name": "attractor"})
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


def attractor_variables(labels: Labels, attractors: Sequence[Any]) -> dict[str, Any]:
    """Properties of each attractor; their section points one after the other over ``section_point``."""
    n = len(labels.states)
    rows = {name: [getattr(item, name) for item in attractors] for name in ("maximum", "minimum", "points")}
    points = [item[:SHOWN] for item in rows["points"]]
    per = f"1/{labels.time_unit}"
    return {
        "period_number": (
            "attractor", np.array([item.period_number for item in attractors], np.int64),
            {"long_name": "period number (0: no cycle)"},
        ),
        "name": ("attractor", np.array([item.name for item in attractors], str), {"long_name": _LONG_NAMES["name"]}),
        "confirmed": (
            "attractor", np.array([item.confirmed for item in attractors], np.int8),
            {"long_name": "1 where Newton's method has found the cycle"},
        ),
        "chaotic": (
            "attractor", np.array([item.chaotic for item in attractors], np.int8),
            {"long_name": _LONG_NAMES["chaotic"]},
        ),
        "lyapunov": (
            "attractor", np.array([item.exponent for item in attractors], float),
            {"long_name": "largest Lyapunov exponent", "units": per},
        ),
        "lyapunov_error": (
            "attractor", np.array([item.exponent_error for item in attractors], float),
            {"long_name": "standard error of the largest Lyapunov exponent", "units": per},
        ),
        "multiplier": (
            "attractor", np.array([item.multiplier for item in attractors], float),
            {"long_name": "largest modulus of the cycle's multipliers"},
        ),
        "maximum": (
            ("attractor", "state"), np.array(rows["maximum"], float).reshape(-1, n),
            {"long_name": _LONG_NAMES["maximum"]},
        ),
        "minimum": (
            ("attractor", "state"), np.array(rows["minimum"], float).reshape(-1, n),
            {"long_name": _LONG_NAMES["minimum"]},
        ),
        "section": (
            ("attractor", "state"), np.array([item[0] for item in points], float).reshape(-1, n),
            {"long_name": "a section point"},
        ),
        "section_points": (
            ("section_point", "state"), np.concatenate([np.zeros((0, n)), *points]), {"long_name": "section points"},
        ),
        "point_attractor": (
            "section_point", np.repeat(np.arange(len(points)), [len(item) for item in points]).astype(np.int64),
            {"long_name": "attractor to which the point belongs"},
        ),
    }  # fmt: skip


def basin_fractions(
    labels: Labels, attrs: Mapping[str, str], parameter: str, values: ArrayLike, arrays: Mapping[str, Any]
) -> xr.Dataset:
    """The result of ``basin_fractions``: arrays over (parameter, attractor), (..., state) or the parameter alone."""
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        dims: tuple[str, ...] = (parameter, "attractor", "state")[: np.ndim(array)]
        variables[name] = (dims, array, {"long_name": _LONG_NAMES[name]})
    variables["period_number"][2]["long_name"] = "period number (0: no cycle, -1: not there)"
    for name in ("lyapunov", "lyapunov_error"):
        variables[name][2]["units"] = f"1/{labels.time_unit}"
    coords: dict[str, Any] = parameter_coords(labels, without=parameter) | state_coords(labels)
    coords |= varied(labels, parameter, values)
    coords["attractor"] = ("attractor", np.arange(np.shape(arrays["fraction"])[1]), {"long_name": "attractor"})
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))
