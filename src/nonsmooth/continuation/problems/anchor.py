"""Section of an autonomous orbit: in the middle of its longest visit, or across the flow."""

from __future__ import annotations

import numpy as np

from nonsmooth.arrays import FloatArray
from nonsmooth.continuation.problems.signature import Signature, Visit
from nonsmooth.flow.variational import VariationalFlow

__all__ = ["anchored", "plane_across"]


def anchored(
    flow: VariationalFlow, values: FloatArray, signature: Signature, times: FloatArray, states: FloatArray,
    period: float,
) -> tuple[Signature, FloatArray, FloatArray]:  # fmt: skip
    """The same orbit read from the middle of its longest visit (times of crossings; states at section, after them)."""
    m = len(times)
    lengths = np.append(np.diff(times), times[0] + period - times[-1])  # of the visit after crossing i
    i = int(lengths.argmax())
    crossings = signature.crossings
    after = crossings[(i + 1) % m]
    z = flow.segments(values, [after.mode], [0.0], [0.5 * lengths[i]], states[i + 1][None, :]).z
    order = [(i + 1 + j) % m for j in range(m)]
    begin = times[i] + 0.5 * lengths[i]
    moved = np.array([(times[j] - begin) % period for j in order])
    moved[-1] = period - 0.5 * lengths[i]
    visits = (*(crossings[j] for j in order), Visit(after.mode))
    return Signature(visits), moved, np.concatenate([z, states[1:][order]])


def plane_across(z: FloatArray, field: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(z_ref, f_ref) of the plane f_ref . (u - z_ref) = 0 through z across the flow, in states divided by ``size``."""
    weighted = field / size**2
    return z.copy(), weighted / max(float(np.abs(weighted * size).max()), 1e-300)
