"""Surfaces that coincide, as entry and exit of a support without a damper do, in the equations of shooting."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from nonsmooth.arrays import FloatArray

if TYPE_CHECKING:
    from nonsmooth.continuation.problems.shooting import Shooting

__all__ = ["divide", "look_at_surfaces"]

SHORT = 1e-6  # of the period: a visit shorter than this is divided by its series
SAME = 1e-12  # of their sizes: gradients and values of one surface


def look_at_surfaces(shooting: Shooting, X: FloatArray) -> None:
    """Find surfaces that coincide at X.

    Exits through the surface of the entry are ``divided``: a visit of no length solves their equations too. Rows of one
    condition that vanish together leave the crossing ``alone``: they are no corner of it.
    """
    visits = shooting.signature.visits
    times, z = shooting.split(X)
    values = shooting.parameters(X)
    traced = shooting.system.traced
    for i, (k, row, at, _) in enumerate(shooting.jumps):
        n_rows = len(traced.transitions[k].rows)
        if at is None and n_rows > 1 and not shooting.at_once[i]:
            found = [shooting.flow.jump(values, k, float(times[i]), z[i + 1], r) for r in range(n_rows)]
            signs = [r.sign for r in traced.transitions[k].rows]
            shooting.alone[i] = all(
                _coincide(signs[row] * found[row].h_z, signs[row] * found[row].h, signs[r] * one.h_z,
                          signs[r] * one.h, z[i + 1])
                for r, one in enumerate(found) if r != row
            )  # fmt: skip
    for i in range(1, shooting.m):
        k, row, at, _ = shooting.jumps[i]
        k0, row0, at0, _ = shooting.jumps[i - 1]
        if at is not None or at0 is not None or shooting.at_once[i]:
            continue
        entry = shooting.flow.jump(values, k0, float(times[i - 1]), z[i], row0)
        leave = shooting.flow.jump(values, k, float(times[i - 1]), z[i], row)
        side = 1.0 if visits[i].mode == visits[i - 1].mode else -1.0  # from impact to impact, or in and out
        kept = _coincide(entry.h_z, entry.h, entry.h_z @ entry.R[: shooting.n, : shooting.n], entry.h, z[i])
        shooting.divided[i] = kept and _coincide(entry.h_z, entry.h, side * leave.h_z, side * leave.h, z[i])


def divide(
    shooting: Shooting, i: int, F: FloatArray, J: FloatArray, r: int, values: FloatArray, times: FloatArray,
    z: FloatArray,
) -> None:  # fmt: skip
    """Divide row r, the equation of the exit i through the surface of the entry, by the length of the visit.

    h(end) / tau = (h(end) - h(begin)) / tau, with h(begin) = 0 by the entry's own equation: the root tau = 0, where
    the visit has not begun, is taken out. For a short visit it is the series L_f h + tau L_f^2 h / 2.
    """
    n, size = shooting.n, shooting.size
    k, row, _, _ = shooting.jumps[i]
    indicator = shooting.system.traced.transitions[k].rows[row].indicator
    mode, t0, tau = int(shooting.modes[i]), float(times[i]), float(times[i + 1] - times[i])
    touch = shooting.flow.indicator(values, indicator, mode, t0, z[i])
    ti, tb, zb = shooting.t_at[i], shooting.t_at[i - 1], shooting.z_at[i]
    if abs(tau) < SHORT * (times[-1] or 1.0):
        F[r] = touch.L + 0.5 * tau * touch.L2
        J[r] = 0.0
        J[r, zb : zb + n] = touch.L_z
        J[r, tb] = touch.L_t - 0.5 * touch.L2
        J[r, ti] = 0.5 * touch.L2
        J[r, size:] = touch.L_p
        return
    F[r] = (F[r] - touch.h) / tau
    J[r, zb : zb + n] -= touch.h_z
    J[r, tb] -= touch.h_t
    J[r, size:] -= touch.h_p
    J[r] /= tau
    J[r, ti] -= F[r] / tau
    J[r, tb] += F[r] / tau


def _coincide(a: FloatArray, h: float, b: FloatArray, g: float, z: FloatArray) -> bool:
    """Return whether two indicators with gradients a, b and values h, g near z are one, but for a positive factor."""
    size = float(np.sqrt((a @ a) * (b @ b)))
    if size == 0.0 or float(a @ b) < (1.0 - SAME) * size:
        return False
    ratio = float(np.sqrt((b @ b) / (a @ a)))
    return bool(abs(g - ratio * h) <= SAME * (np.abs(b * z).max() + abs(g)))
