"""Values of a system's outputs along a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engines.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.symbolic.traced import Traced

__all__ = ["output_values"]


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
    return result


@lru_cache(maxsize=128)
def _functions(traced: Traced, mode: int) -> tuple[Callable[..., Any], ...]:
    """The outputs in one mode, of time, states, memory and parameters; to write them costs more than a short run."""
    from sympy import lambdify

    arguments = [traced.t, *traced.u, *traced.m, *traced.p]
    return tuple(lambdify(arguments, output[mode], modules="numpy", cse=True) for output in traced.outputs)
