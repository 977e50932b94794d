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
from nonsmooth.results.schema import (
    Column,
    columns,
    dataset,
    floats,
    parameter_coords,
    quantity_attributes,
    start_coords,
    state_coords,
    table,
    varied,
)
from nonsmooth.results.statuses import status_attributes

__all__ = ["attractor_variables", "basin_fractions", "basins", "chart"]

SHOWN = 4000  # section points kept of one attractor
LABEL = "attractor (-1: not converged, -2: diverged)"

#: Of a chart behind its plane; without "start" where there was one.
_CHART = table(
    ("period_number", "start", "own", "period number (0: none found)"),
    ("crossings_per_period", "start", "own", "transitions per return"),
    ("contacts_per_period", "start", "own", "entries into contact per return"),
    ("maximum", "start state", "own", "largest value on the attractor"),
    ("minimum", "start state", "own", "smallest value on the attractor"),
    ("n_attractors", "", "own", "number of attractors that the starts reached"),
    ("confidence", "", "own", "probability that the label is right"),
    ("lyapunov", "start", "rate", "largest Lyapunov exponent"),
    ("lyapunov_error", "start", "rate", "standard error of the largest Lyapunov exponent"),
    ("computed", "", "own", "1 where the point was computed, 0 where its label was inferred"),
    ("status", "start", "status", ""),
)
_ATTRACTOR = (
    Column("period_number", "period_number", (), "place", "period number (0: no cycle)"),
    Column("name", "name", (), "text", "what the attractor is"),
    Column("confirmed", "confirmed", (), "yes", "1 where Newton's method has found the cycle"),
    Column("chaotic", "chaotic", (), "yes", "1 where the largest exponent is above zero beyond its error"),
    Column("lyapunov", "exponent", (), "rate", "largest Lyapunov exponent"),
    Column("lyapunov_error", "exponent_error", (), "rate", "standard error of the largest Lyapunov exponent"),
    Column("multiplier", "multiplier", (), "", "largest modulus of the cycle's multipliers"),
    Column("maximum", "maximum", ("state",), "", "largest value on the attractor"),
    Column("minimum", "minimum", ("state",), "", "smallest value on the attractor"),
)
#: Of the share of each attractor, of basins as a whole, and over a parameter.
_SHARES = table(
    ("fraction", "", "own", "share of the starts"),
    ("fraction_error", "", "own", "binomial standard error of the share"),
    ("minimal_shock", "", "own", "least jump from the section to another basin, in the states' scales"),
    ("entropy", "", "own", "basin entropy"),
    ("boundary_entropy", "", "own", "basin entropy of the boxes with more than one label"),
    ("boundary_dimension", "", "own", "dimension of the boundary"),
    ("n_starts_99", "", "own", "random starts that meet every attractor with 99 %"),
    ("uncertain", "", "own", "share of starts with another label at this distance"),
    ("period_number", "", "own", "period number (0: no cycle, -1: not there)"),
    ("section", "", "own", "a section point"),
    ("not_converged", "", "own", "share of starts that had not converged"),
    ("diverged", "", "own", "share of starts that diverged"),
    ("failed", "", "own", "share of starts that could not be followed (among those not converged)"),
    *((column.name, "", "rate" if column.rule == "rate" else "own", column.words) for column in _ATTRACTOR[1:]),
)


def chart(
    labels: Labels, attrs: Mapping[str, str], grid: Mapping[str, ArrayLike], arrays: Mapping[str, Any], *,
    starts: ArrayLike, one_start: bool, loads: Mapping[str, tuple[str, str]] | None = None,
) -> xr.Dataset:  # fmt: skip
    """The result of ``chart``: everything known per point of the plane of two parameters; ``loads`` are the long names
    and units of those among the arrays."""
    plane = tuple(grid)
    known = [*_CHART, *(Column(name, name, ("start",), "own", words) for name, (words, _) in (loads or {}).items())]
    if one_start:
        known = [one._replace(dims=tuple(dim for dim in one.dims if dim != "start")) for one in known]
    variables = columns(labels, known, arrays, *plane)
    for name, (_, unit) in (loads or {}).items():
        variables[name][2]["units"] = unit
    coords: dict[str, Any] = parameter_coords(labels, without=plane)
    for name, values in grid.items():
        coords |= varied(labels, name, values)
    coords |= state_coords(labels)
    result = dataset(variables, coords | start_coords(starts), attrs)
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
    variables |= columns(labels, _SHARES, per_attractor, "attractor") | columns(labels, _SHARES, measures)
    variables |= columns(labels, _SHARES, {"uncertain": uncertain[1]}, "distance")
    coords: dict[str, Any] = parameter_coords(labels) | state_coords(labels)
    for name, values in grid.items():
        coords[name] = (name, floats(values), quantity_attributes(name, labels.states[name]))
    for name, value in fixed.items():
        coords[name] = ((), float(value), quantity_attributes(name, labels.states[name]))
    coords["distance"] = ("distance", uncertain[0], {"long_name": "distance in grid steps"})
    coords["attractor"] = ("attractor", np.arange(len(attractors)), {"long_name": "attractor"})
    return dataset(variables, coords, attrs)


def attractor_variables(labels: Labels, attractors: Sequence[Any]) -> dict[str, Any]:
    """Properties of each attractor; their section points one after the other over ``section_point``."""
    n = len(labels.states)
    points = [item.points[:SHOWN] for item in attractors]
    names = [column.field for column in _ATTRACTOR]
    fields: dict[str, Any] = {name: [getattr(item, name) for item in attractors] for name in names}
    fields |= {name: np.array(fields[name], float).reshape(-1, n) for name in ("maximum", "minimum")}
    owner = np.repeat(np.arange(len(points)), [len(item) for item in points]).astype(np.int64)
    return columns(labels, _ATTRACTOR, fields, "attractor") | {
        "section": (
            ("attractor", "state"), np.array([item[0] for item in points], float).reshape(-1, n),
            {"long_name": "a section point"},
        ),
        "section_points": (
            ("section_point", "state"), np.concatenate([np.zeros((0, n)), *points]), {"long_name": "section points"},
        ),
        "point_attractor": ("section_point", owner, {"long_name": "attractor to which the point belongs"}),
    }  # fmt: skip


def basin_fractions(
    labels: Labels, attrs: Mapping[str, str], parameter: str, values: ArrayLike, arrays: Mapping[str, Any]
) -> xr.Dataset:
    """The result of ``basin_fractions``: arrays over (parameter, attractor), (..., state) or the parameter alone."""
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        variables |= columns(labels, _SHARES, {name: array}, *(parameter, "attractor", "state")[: np.ndim(array)])
    coords: dict[str, Any] = parameter_coords(labels, without=parameter) | state_coords(labels)
    coords |= varied(labels, parameter, values)
    coords["attractor"] = ("attractor", np.arange(np.shape(arrays["fraction"])[1]), {"long_name": "attractor"})
    return dataset(variables, coords, attrs)
