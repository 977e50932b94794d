"""Builders of results that say how a motion varies: ``sensitivity``, ``lyapunov``, and ``smoothing_report``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.arrays import FloatArray
from nonsmooth.results.labels import Labels
from nonsmooth.results.schema import Column, columns, dataset, table, varied

_SENSITIVITY = table(
    ("Phi", "state initial_state", "", "derivative of the end in the start"),
    ("P", "state parameter", "", "derivative of the end in the parameters"),
    ("end", "state", "", "state at the end"),
    ("crossing_time", "crossing", "time", "time of the crossing"),
    ("crossing_transition", "crossing", "transition", "transition"),
    ("saltation", "crossing state initial_state", "", "saltation matrix"),
    ("log_det_saltation", "crossing", "", "log|det S|"),
    ("transversality", "crossing", "", "|h'| / (|h_z| |f|)"),
    ("log_det", "", "", "log|det Phi|"),
    ("divergence", "", "", "integral of div f"),
    ("trace_defect", "", "", "log|det Phi| less what the trace identity demands"),
    ("status", "", "status", ""),
)
_SPECTRUM = table(
    ("exponents", "exponent", "rate", "Lyapunov exponent"),
    ("standard_error", "exponent", "rate", "standard error"),
    ("running", "batch exponent", "rate", "estimate after each batch"),
    ("trace_defect", "", "rate", "sum less what the trace demands"),
    ("kaplan_yorke", "", "", "Kaplan-Yorke dimension"),
    ("nearest_graze", "", "", "least |h'| / (|h_u| |u'|) of all crossings"),
    ("elapsed", "", "time", "length of the run"),
    ("equilibrium", "", "equilibrium", "equilibrium at which the run stayed"),
    ("status", "", "status", ""),
)


def derivatives_of_run(
    labels: Labels, attrs: Mapping[str, str], parameters: Sequence[str], *, log_det: float, trace: float, **arrays: Any
) -> xr.Dataset:
    """The result of ``sensitivity``; the memory's names follow those of the states."""
    names = np.array([*labels.states, *labels.memory], dtype=str)
    defect = 0.0 if log_det == trace else log_det - trace  # both may be minus infinity
    return dataset(
        labels,
        attrs,
        columns(labels, _SENSITIVITY, {**arrays, "log_det": log_det, "trace_defect": defect}),
        state=("state", names, {"long_name": "state, then memory"}),
        initial_state=("initial_state", names, {"long_name": "state at the start, then memory"}),
        parameter=("parameter", np.array(list(parameters), dtype=str), {}),
    )


def spectrum(
    labels: Labels, attrs: Mapping[str, str], parameter: str | None, values: ArrayLike | None, **arrays: Any
) -> xr.Dataset:
    """The result of ``lyapunov``. All arrays have the points as leading dim, also where there is one."""
    variables = columns(labels, _SPECTRUM, arrays, parameter or "point")
    over = {} if parameter is None else varied(labels, parameter, () if values is None else values)
    made = dataset(labels, attrs, variables, **over, exponent=np.arange(1, np.shape(arrays["running"])[-1] + 1))
    return made.isel(point=0) if parameter is None else made


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
_COUNTS = table(
    ("n_attractors", "", "place", "number of attractors that the starts reach"),
    ("missing", "", "place", "attractors of the event-driven system without a counterpart"),
    ("spurious", "", "place", "attractors without a counterpart in the event-driven system"),
)
_ENDED = table(("status", "", "status", ""), ("note", "", "text", "why there is no such orbit"))
_DIFFERENCES = table(
    ("state_difference", "", "", "largest difference of the states, in units of their scales"),
    ("multiplier_difference", "", "", "largest difference of the multipliers"),
    ("exponent_difference", "", "", "largest difference of the exponents that are finite without a band"),
    ("period_difference", "", "", "relative difference of the periods"),
)


def report(
    labels: Labels,
    attrs: Mapping[str, str],
    bands: Sequence[str],
    etas: FloatArray,
    reference: Mapping[str, Any],
    rows: Mapping[tuple[int, int], Mapping[str, Any]],
    *,
    scale: FloatArray,
    forced: bool,
) -> xr.Dataset:
    """The result of ``smoothing_report``: ``rows`` by (band, eta), with the names of the variables."""
    shape, n = (len(bands), len(etas)), len(labels.states)
    variables: dict[str, Any] = {}

    def put(column: Column, values: Any, own: Any = None) -> None:
        """A variable over the bands, and that of the event-driven orbit."""
        variables.update(columns(labels, [column], {column.name: values}, "band", "eta"))
        if own is not None:
            name, words = f"reference_{column.name}", f"{column.words}, event-driven"
            variables.update(columns(labels, [column._replace(name=name, words=words)], {column.name: own}))

    for column in _ORBIT:
        empty = _NONE.get(column.rule, np.nan)
        size = [n] * len(column.dims)
        values, own = np.full((*shape, *size), empty), np.full(size, empty)
        for place, row in rows.items():
            values[place] = row.get(column.name, empty)
        own[...] = reference.get(column.name, empty)
        put(column, values, own)
    for column, far in zip(_DIFFERENCES, _differences(variables, scale, forced), strict=True):
        put(column, far)
        words = f"order of {column.name} in eta, against the next smaller one"
        name = column.name.replace("difference", "order")
        put(Column(name, (), "", words, name), _orders(etas, far))
    for column in (*(_COUNTS if "n_attractors" in reference else ()), *_ENDED):
        counted = [[rows[i, j][column.name] for j in range(shape[1])] for i in range(shape[0])]
        put(column, counted, reference["n_attractors"] if column.name == "n_attractors" else None)
    return dataset(labels, attrs, variables, band=[*bands], eta=etas, exponent=np.arange(1, n + 1))


def _differences(variables: Mapping[str, Any], scale: FloatArray, forced: bool) -> list[FloatArray]:
    """Distances to the event-driven orbit, (band, eta), as in the table."""

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
    return [state, _of_multipliers(*both("floquet_multipliers")), exponent, np.abs(period / known - 1)]


def _of_multipliers(values: Any, reference: Any) -> FloatArray:
    """The largest distance of two sets of multipliers, each paired with one of the other so that the sum is least."""
    from scipy.optimize import linear_sum_assignment

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
