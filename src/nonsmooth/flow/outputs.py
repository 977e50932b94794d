"""Values of a system's outputs along a trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray
from nonsmooth.system.symbolic.numeric import numeric

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

ROUNDING = 1e-9  # of a force, by which it may seem beyond its bound


def output_values(
    traced: Traced, parameters: FloatArray, time: FloatArray, u: FloatArray, memory: FloatArray, mode: Any
) -> FloatArray:
    """Outputs (N, n_outputs) at N samples, each by the expression of the sample's mode."""
    if traced.patterns is not None:
        forces = traced.patterns.forces(parameters, time, u, mode)
        own = output_values(traced.patterns.plain, parameters, time, u, memory, np.zeros(len(time), dtype=int))
        return np.hstack([own, forces])
    result = np.full((len(time), len(traced.output_names)), np.nan)
    for m in np.unique(mode):
        here = np.flatnonzero(mode == m)
        shown = numeric(traced, tuple(output[int(m)] for output in traced.outputs))
        result[here] = shown(parameters, time[here], u[here], memory[here])
    names = [] if traced.decider is None else [f"{part.name}_force" for part in traced.decider.make.parts]
    if names and len(result) and all(name in traced.output_names for name in names):
        forces = np.array([traced.output_names.index(name) for name in names])
        result[:, forces] = _shared(traced, traced.decider, parameters, time, u, memory, mode, result[:, forces])
    return result


def _shared(
    traced: Traced,
    decider: Any,
    parameters: FloatArray,
    time: FloatArray,
    u: FloatArray,
    memory: FloatArray,
    mode: Any,
    forces: FloatArray,
) -> FloatArray:
    """The forces of elements (N, elements), those that are not unique within their bounds."""
    rows = None if decider.rows is None else decider.rows.rows_at(parameters)
    for m in np.unique(mode):
        here = np.flatnonzero(mode == m)

        def value(law: Any, here: Any = here) -> FloatArray:
            if rows is not None:
                found: FloatArray = rows.augmented(u[here], time[here]) @ law.values
                return found
            of: FloatArray = numeric(traced, (law,))(parameters, time[here], u[here], memory[here])[:, 0]
            return of

        forces[here] = (rows or decider.make).shared(*decider.modes[int(m)], forces[here], value)
    return forces


def out_of_bounds(traced: Traced, points: FloatArray, high: FloatArray, low: FloatArray) -> Any:
    """Marks of the extremes (..., P, O) of forces that a kernel does not know.

    Elements that bear one load together share it by least norm within their bounds; kernels know nothing of these."""
    found = np.zeros(high.shape, dtype=bool)
    known = traced.known
    if known is None or known.make.rubbing:
        return found
    make, mode = known.make, next(iter(known.make.fields))
    of = {k: traced.output_names.index(f"{make.parts[k].name}_force") for k in make.sharing(mode)}
    beyond = np.zeros(high.shape[:-1], dtype=bool)
    for k, i in of.items():
        element = make.parts[k].element
        pattern = tuple(element.phases.index(element.held[0]) if j == k else 0 for j in range(len(make.parts)))
        most = element.most(make.place(k, mode, pattern))
        if most is None:
            beyond |= low[..., i] < -ROUNDING * np.abs(high[..., i])
        elif element.exceeds or not most.free_symbols <= set(traced.p):
            beyond |= True
        else:
            bound = numeric(traced, (most,))(points)[:, 0]
            beyond |= np.maximum(high[..., i], -low[..., i]) > (1.0 + ROUNDING) * bound
    found[..., list(of.values())] = beyond[..., None]
    return found
