"""Values of a system's outputs along a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray

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
        columns = (time[here], *u[here].T, *memory[here].T, *parameters)
        for i, function in enumerate(_functions(traced, int(m))):
            result[here, i] = function(*columns)
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
    from sympy import lambdify

    rows = None if decider.rows is None else decider.rows.rows_at(parameters)
    for m in np.unique(mode):
        here = np.flatnonzero(mode == m)

        def value(law: Any, here: Any = here) -> FloatArray:
            if rows is not None:
                found: FloatArray = rows.augmented_all(u[here], time[here]) @ law.values
                return found
            of = lambdify([traced.t, *traced.u, *traced.m, *traced.p], law, modules="numpy")
            return np.broadcast_to(of(time[here], *u[here].T, *memory[here].T, *parameters), here.shape)

        forces[here] = (rows or decider.make).shared(*decider.modes[int(m)], forces[here], value)
    return forces


def out_of_bounds(traced: Traced, points: FloatArray, high: FloatArray, low: FloatArray) -> Any:
    """Marks of the extremes (..., P, O) of forces that a kernel does not know.

    Elements that bear one load together share it by least norm within their bounds; kernels know nothing of these."""
    from sympy import lambdify

    found = np.zeros(high.shape, dtype=bool)
    known = traced.patterns or traced.decider
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
            bound = lambdify([traced.p], most, modules="numpy")(points.T) * np.ones(len(points))
            beyond |= np.maximum(high[..., i], -low[..., i]) > (1.0 + ROUNDING) * bound
    found[..., list(of.values())] = beyond[..., None]
    return found


@lru_cache(maxsize=128)
def _functions(traced: Traced, mode: int) -> tuple[Callable[..., Any], ...]:
    """The outputs in one mode, of time, states, memory and parameters; to write them costs more than a short run."""
    from sympy import lambdify

    arguments = [traced.t, *traced.u, *traced.m, *traced.p]
    return tuple(lambdify(arguments, output[mode], modules="numpy", cse=True) for output in traced.outputs)
