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
from nonsmooth.results.schema import columns, dataset, floats, quantity_attributes, table, varied

SHOWN = 4000  # section points kept of one attractor

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
_ATTRACTOR = table(
    ("period_number", "", "place", "period number (0: no cycle)"),
    ("name", "", "text", "what the attractor is"),
    ("confirmed", "", "yes", "1 where Newton's method has found the cycle"),
    ("chaotic", "", "yes", "1 where the largest exponent is above zero beyond its error"),
    ("lyapunov", "", "rate", "largest Lyapunov exponent", "exponent"),
    ("lyapunov_error", "", "rate", "standard error of the largest Lyapunov exponent", "exponent_error"),
    ("multiplier", "", "", "largest modulus of the cycle's multipliers"),
    ("maximum", "state", "", "largest value on the attractor"),
    ("minimum", "state", "", "smallest value on the attractor"),
)
_POINTS = table(
    ("section", "attractor state", "", "a section point"),
    ("section_points", "section_point state", "", "section points"),
    ("point_attractor", "section_point", "place", "attractor to which the point belongs"),
)
_LABEL = table(("label", "", "id", "attractor (-1: not converged, -2: diverged)"), ("status", "", "status", ""))
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
    labels: Labels,
    attrs: Mapping[str, str],
    grid: Mapping[str, ArrayLike],
    arrays: Mapping[str, Any],
    *,
    starts: ArrayLike,
    one_start: bool,
    loads: Mapping[str, tuple[str, str]] | None = None,
) -> xr.Dataset:
    """The result of ``chart``: everything known per point of the plane of two parameters; ``loads`` are the long names
    and units of those among the arrays."""
    known = [*_CHART, *table(*((name, "start", "own", words) for name, (words, _) in (loads or {}).items()))]
    if one_start:
        known = [one._replace(dims=tuple(dim for dim in one.dims if dim != "start")) for one in known]
    variables = columns(labels, known, arrays, *grid)
    for name, (_, unit) in (loads or {}).items():
        variables[name][2]["units"] = unit
    plane = {name: one for key, values in grid.items() for name, one in varied(labels, key, values).items()}
    result = dataset(labels, attrs, variables, starts, **plane)
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
    variables = columns(labels, _LABEL, {"label": label, "status": status}, *grid)
    variables |= attractor_variables(labels, attractors)
    variables |= columns(labels, _SHARES, per_attractor, "attractor") | columns(labels, _SHARES, measures)
    variables |= columns(labels, _SHARES, {"uncertain": uncertain[1]}, "distance")
    named = {name: quantity_attributes(name, quantity) for name, quantity in labels.states.items()}
    along: dict[str, Any] = {name: (name, floats(values), named[name]) for name, values in grid.items()}
    along |= {name: ((), float(value), named[name]) for name, value in fixed.items()}
    along |= {"distance": uncertain[0], "attractor": np.arange(len(attractors))}
    return dataset(labels, attrs, variables, **along)


def attractor_variables(labels: Labels, attractors: Sequence[Any]) -> dict[str, Any]:
    """Properties of each attractor; their section points one after the other over ``section_point``."""
    n = len(labels.states)
    points = [item.points[:SHOWN] for item in attractors]
    fields: dict[str, Any] = {one.field: [getattr(item, one.field) for item in attractors] for one in _ATTRACTOR}
    fields |= {name: np.array(fields[name], float).reshape(-1, n) for name in ("maximum", "minimum")}
    owner = np.repeat(np.arange(len(points)), [len(item) for item in points])
    first = np.array([item[0] for item in points], float).reshape(-1, n)
    every = {"section": first, "section_points": np.concatenate([np.zeros((0, n)), *points]), "point_attractor": owner}
    return columns(labels, _ATTRACTOR, fields, "attractor") | columns(labels, _POINTS, every)


def basin_fractions(
    labels: Labels, attrs: Mapping[str, str], parameter: str, values: ArrayLike, arrays: Mapping[str, Any]
) -> xr.Dataset:
    """The result of ``basin_fractions``: arrays over (parameter, attractor), (..., state) or the parameter alone."""
    variables: dict[str, Any] = {}
    for name, array in arrays.items():
        variables |= columns(labels, _SHARES, {name: array}, *(parameter, "attractor", "state")[: np.ndim(array)])
    attractors = np.arange(np.shape(arrays["fraction"])[1])
    return dataset(labels, attrs, variables, **varied(labels, parameter, values), attractor=attractors)
