"""Builders of the labelled results that are made of derivatives: ``sensitivity`` and ``lyapunov``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.schema import columns, dataset, table, varied

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
