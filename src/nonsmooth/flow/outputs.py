"""Values of a system's outputs along a trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nonsmooth.flow.engine import FloatArray

if TYPE_CHECKING:
    from nonsmooth.system.traced import Traced

__all__ = ["output_values"]


def output_values(
    traced: Traced, parameters: FloatArray, time: FloatArray, u: FloatArray, memory: FloatArray, mode: Any
) -> FloatArray:
    """Outputs (N, n_outputs) at N samples, each by the expression of the sample's mode."""
    from sympy import lambdify

    result = np.full((len(time), len(traced.output_names)), np.nan)
    arguments = [traced.t, *traced.u, *traced.m, *traced.p]
    for m in np.unique(mode):
        here = np.flatnonzero(mode == m)
        for i, output in enumerate(traced.outputs):
            function = lambdify(arguments, output[m], modules="numpy", cse=True)
            values = function(time[here], *u[here].T, *memory[here].T, *parameters)
            result[here, i] = values
    return result
