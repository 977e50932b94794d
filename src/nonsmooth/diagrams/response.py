"""``frequency_response``: amplitude over a parameter, up and down, with its jumps as numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nonsmooth.diagrams.sweep import sweep
from nonsmooth.errors import Interrupted, unknown
from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.system.arguments import checked

if TYPE_CHECKING:
    import xarray as xr

    from nonsmooth.system.system import System

STEEPER = 5.0  # a jump's step in amplitude exceeds both neighbouring steps by this factor
LEAST = 5e-3  # and this fraction of the amplitude


@checked(of=sweep)
def frequency_response(
    system: System,
    values: Any,
    *,
    parameter: str | None = None,
    direction: Literal["up", "down", "both", None] = "both",
    **options: Any,
) -> xr.Dataset:
    r"""Amplitude over the forcing frequency (or another parameter), carried along up and down.

    The amplitude of a state is half its true range, :math:`a = (\max x - \min x) / 2`, over the kept returns.

    Parameters
    ----------
    system : System
    values : array (P,)
        Values of the parameter.
    parameter : str, optional
        Where not given the one that sets the forcing period; of several, or none, ``"omega"``.

    Returns
    -------
    xarray.Dataset
        The sweep with ``amplitude`` and, over ``jump``: ``jump_variable`` (the state or output whose amplitude jumps,
        the states first, in their order), ``jump_value`` (the middle of the step in which it does), ``jump_step`` (its
        width, the uncertainty), ``jump_direction``, ``jump_start``, ``jump_before`` and ``jump_after`` (amplitudes in
        the order of the sweep).

    Notes
    -----
    A jump is a step between neighbouring values in which the amplitude changes by more than 0.5 %, and more than five
    times as fast as in the steps before and after it. Points without an amplitude (the run failed) are passed over: the
    step across them is as wide as they leave it. Each state and output is asked by itself, so
    that a jump may stand for some of them only; between points whose ``period_number`` is 0 it may be the scatter of
    chaos.
    """
    if not options["extremes"]:
        raise ValueError("amplitudes are those of extremes: leave extremes=False out, or take sweep")
    if parameter is None:
        parameter = forcing_parameter(system)
    if parameter not in system.parameters:
        raise ValueError(
            unknown(parameter, "a parameter", repr(system.name), system.parameters) + "; choose one with parameter="
        )
    try:
        return _response(system, sweep(system, parameter, values, direction=direction, **options), parameter)
    except Interrupted as error:
        raise Interrupted(str(error), _response(system, error.result, parameter)) from error


def forcing_parameters(system: System) -> list[str]:
    """The parameters on which the forcing period depends."""
    t = system.traced
    return [name for name, p in zip(t.parameter_names, t.p, strict=True) if t.period and t.period.has(p)]


def forcing_parameter(system: System) -> str:
    """The parameter that sets the forcing period; of several, or none, ``"omega"``."""
    known = forcing_parameters(system)
    return known[0] if len(known) == 1 else "omega"


def _response(system: System, swept: xr.Dataset, parameter: str) -> xr.Dataset:
    """The sweep with its amplitudes and jumps."""
    from nonsmooth.results.provenance import attribute, read_provenance, with_short_record
    from nonsmooth.results.schema import response

    def half(prefix: str = "") -> FloatArray:
        """Half a range over directions, starts and values, also where the sweep has one direction or start."""
        size = 0.5 * (swept[f"{prefix}maximum"] - swept[f"{prefix}minimum"])
        added = [dim for dim in ("direction", "start") if dim not in size.dims]
        return np.asarray(size.expand_dims(added).transpose("direction", "start", parameter, ...).values)

    heights = dict(zip(swept["state"].values.tolist(), np.moveaxis(half(), -1, 0), strict=True))
    heights |= {output: half(f"{output}_") for output in system.outputs if f"{output}_maximum" in swept}
    x = np.asarray(swept[parameter].values, dtype=float)
    jumps = [
        {
            "variable": name,
            "value": 0.5 * (x[a] + x[b]),
            "step": abs(x[b] - x[a]),
            "direction": str(word),
            "start": k,
            "before": height[d, k, a],
            "after": height[d, k, b],
        }
        for name, height in heights.items()
        for d, word in enumerate(np.atleast_1d(swept["direction"].values))
        for k in range(height.shape[1])
        for order in [np.argsort(-x if word == "down" else x, kind="stable")]
        for i, j in jumps_in(x[order], height[d, k, order])
        for a, b in [(order[i], order[j])]
    ]
    record = read_provenance(swept) | {"verb": "frequency_response"}
    return with_short_record(response(swept, jumps).assign_attrs(attribute(record)))


def jumps_in(x: FloatArray, amplitude: FloatArray) -> list[tuple[int, int]]:
    """Neighbouring points (P,) between which the amplitude jumps; those without an amplitude are passed over."""
    known = np.flatnonzero(np.isfinite(amplitude))
    a = amplitude[known]
    change, width = np.abs(np.diff(a)), np.maximum(np.abs(np.diff(np.asarray(x, float)[known])), 1e-300)
    found = []
    for i, slope in enumerate(slopes := change / width):
        beside = [slopes[j] for j in (i - 1, i + 1) if 0 <= j < len(slopes)]
        if beside and change[i] > LEAST * max(abs(a[i : i + 2])) and slope > STEEPER * max(beside):
            found.append((int(known[i]), int(known[i + 1])))
    return found
