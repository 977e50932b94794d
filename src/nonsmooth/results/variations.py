"""Builders of the labelled results that are made of derivatives: ``sensitivity`` and ``lyapunov``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from nonsmooth.results.labels import Labels
from nonsmooth.results.provenance import with_short_record
from nonsmooth.results.schema import floats, parameter_coords, varied
from nonsmooth.results.statuses import EQUILIBRIA, flag_attributes, status_attributes

__all__ = ["derivatives_of_run", "spectrum"]


def derivatives_of_run(
    labels: Labels, attrs: Mapping[str, str], parameters: Sequence[str], *, Phi: ArrayLike, P: ArrayLike,
    end: ArrayLike, crossing_time: ArrayLike, crossing_transition: ArrayLike, saltation: ArrayLike,
    log_det_saltation: ArrayLike, transversality: ArrayLike, log_det: float, divergence: float, trace: float,
    status: int = 0,
) -> xr.Dataset:  # fmt: skip
    """The result of ``sensitivity``; the memory's names follow those of the states."""
    d = labels
    names = np.array([*d.states, *d.memory], dtype=str)
    transitions = flag_attributes(d.transition_labels, dtype=np.int16)
    jumps = np.asarray(crossing_transition, np.int16)
    matrix = ("crossing", "state", "initial_state")
    defect = 0.0 if log_det == trace else log_det - trace  # both may be minus infinity
    variables: dict[str, Any] = {
        "Phi": (("state", "initial_state"), floats(Phi), {"long_name": "derivative of the end in the start"}),
        "P": (("state", "parameter"), floats(P), {"long_name": "derivative of the end in the parameters"}),
        "end": ("state", floats(end), {"long_name": "state at the end"}),
        "crossing_time": ("crossing", floats(crossing_time), {"long_name": "time of the crossing",
                                                               "units": d.time_unit}),
        "crossing_transition": ("crossing", jumps, {"long_name": "transition", **transitions}),
        "saltation": (matrix, floats(saltation), {"long_name": "saltation matrix"}),
        "log_det_saltation": ("crossing", floats(log_det_saltation), {"long_name": "log|det S|"}),
        "transversality": ("crossing", floats(transversality), {"long_name": "|h'| / (|h_z| |f|)"}),
        "log_det": ((), log_det, {"long_name": "log|det Phi|"}),
        "divergence": ((), divergence, {"long_name": "integral of div f"}),
        "trace_defect": ((), defect, {"long_name": "log|det Phi| less what the trace identity demands"}),
        "status": ((), np.int8(status), status_attributes()),
    }  # fmt: skip
    coords: dict[str, Any] = {
        "state": ("state", names, {"long_name": "state, then memory"}),
        "initial_state": ("initial_state", names, {"long_name": "state at the start, then memory"}),
        "parameter": ("parameter", np.array(list(parameters), dtype=str)),
        **parameter_coords(d, without=[*variables, "parameter", "initial_state"]),
    }
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))


def spectrum(
    labels: Labels, attrs: Mapping[str, str], parameter: str | None, values: ArrayLike | None, *,
    exponents: ArrayLike, standard_error: ArrayLike, running: ArrayLike, trace_defect: ArrayLike,
    kaplan_yorke: ArrayLike, nearest_graze: ArrayLike, elapsed: ArrayLike, equilibrium: ArrayLike, status: ArrayLike,
) -> xr.Dataset:  # fmt: skip
    """The result of ``lyapunov``. All arrays have the points as leading dim, also where there is one."""
    d = labels
    rate = {"units": f"1/{d.time_unit}" if d.time_unit != "1" else "1"}
    point = parameter or "point"
    table = floats(running)
    graze = "least |h'| / (|h_u| |u'|) of all crossings"
    variables: dict[str, Any] = {
        "exponents": ((point, "exponent"), floats(exponents), {"long_name": "Lyapunov exponent", **rate}),
        "standard_error": ((point, "exponent"), floats(standard_error), {"long_name": "standard error", **rate}),
        "running": ((point, "batch", "exponent"), table, {"long_name": "estimate after each batch", **rate}),
        "trace_defect": (point, floats(trace_defect), {"long_name": "sum less what the trace demands", **rate}),
        "kaplan_yorke": (point, floats(kaplan_yorke), {"long_name": "Kaplan-Yorke dimension"}),
        "nearest_graze": (point, floats(nearest_graze), {"long_name": graze}),
        "elapsed": (point, floats(elapsed), {"long_name": "length of the run", "units": d.time_unit}),
        "equilibrium": (
            point, np.asarray(equilibrium, np.int8),
            {"long_name": "equilibrium at which the run stayed", **flag_attributes(EQUILIBRIA)},
        ),
        "status": (point, np.asarray(status, np.int8), status_attributes()),
    }  # fmt: skip
    coords: dict[str, Any] = {
        "exponent": ("exponent", np.arange(1, table.shape[-1] + 1), {"long_name": "number of the exponent"}),
        **parameter_coords(d, without=[*variables, "batch", parameter or ""]),
    }
    if parameter is None:
        return with_short_record(xr.Dataset(variables, coords, dict(attrs))).isel(point=0)
    coords |= varied(d, parameter, () if values is None else values)
    return with_short_record(xr.Dataset(variables, coords, dict(attrs)))
