"""Growth of small changes along a trajectory of any system: what Lyapunov exponents are.

The trajectory comes in pieces: smooth motion from a recorded state to the next sample or crossing, and the transitions
at its end; where there are none, of one motion that goes on from piece to piece. The frame is marched with the state by
one Taylor series, and made orthonormal after every step and transition (see ``frame``).
"""

from __future__ import annotations

from math import fabs, inf
from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.hybrid.codes import DIVERGED, NO_CONVERGENCE, OK
from nonsmooth.kernels.hybrid.records import GROWTH, type_of
from nonsmooth.kernels.series.taylor import step_length
from nonsmooth.kernels.tangent.frame import log_determinant, multiply, straighten
from nonsmooth.kernels.tangent.legs import (
    EQUATIONS,
    MOST_STEPS,
    STEPS,
    add,
    begin,
    instant_of,
    jet_at,
    jump_at,
    put,
    step_end,
)

_i, _f = types.int64, types.float64
_f1, _f2, _i1 = _f[::1], _f[:, ::1], _i[::1]


class Pieces(NamedTuple):
    """A trajectory in pieces, each with the transitions at its end."""

    mode: Any
    t0: Any
    tau: Any
    z0: Any  # (pieces, n); where rows are missing a piece goes on from the end of the one before
    unit: Any  # row of ``growth``
    first_jump: Any  # (pieces + 1,) places in ``jumps``
    jumps: Any  # transitions
    before: Any  # (pieces, n) state in which the first of them is taken


class Pace(NamedTuple):
    """Accuracy with which a frame is carried on."""

    order: Any
    log_tolerance: Any  # of the last two terms of a series, relative
    weight: Any  # (n_u,) added to a state's size where errors are judged
    sizes: Any  # of the rows of ``Steps.C`` behind the states: the scale of a small change, 0 of an entry
    limit: Any  # (n_u,) sizes beyond which a state has diverged


PIECES = type_of(Pieces, _i1, _f1, _f1, _f2, _i1, _i1, _i1, _f2)
PACE = type_of(Pace, _i, _f, _f1, _f1, _f1)


@device
def largest(C, D, first, n_u, columns, order):
    """Rows ``first + i`` of C: the largest coefficients of the small changes of number i.

    Of the last two orders, or of all where these vanish (see ``taylor.step_length``)."""
    begin, whole = order - 1, 0.0
    while whole == 0.0 and begin > 0:
        for i in range(n_u):
            for k in range(begin, order + 1):
                top = 0.0
                for c in range(columns):
                    top = max(top, fabs(D[k, i, c]))
                C[first + i, k] = top
                whole = max(whole, top)
        begin = 1 if begin > 1 else 0


@device
def upright(size, remaining, unit, seen):
    """The frame orthonormal again, after a step (``size`` 0) or transitions with this log|det S|."""
    n, columns = seen.frame.shape
    straighten(seen.frame, n, columns, seen.lengths, size == -inf, remaining <= 0.0, seen.growth[unit])


@device
def frame_along(jet, mode, t0, tau, unit, equations, pace, seen, work):
    """March state and frame over the time tau, into the row ``unit`` of ``growth``. Returns a status."""
    C, D, X, u, Q, scale = work.C, work.D, work.X, work.u, seen.frame, seen.scale
    n, columns, n_u, order, entries = Q.shape[0], Q.shape[1], u.shape[0], pace.order, equations.entries.shape[0]
    done = 0.0
    for _ in range(MOST_STEPS):
        remaining = tau - done
        if remaining <= 0.0:
            return OK
        for i in range(n):
            for c in range(columns):
                D[0, i, c] = scale[i] * Q[i, c]
        jet(mode, order, t0 + done, u, work.q, C, work.W, D)
        largest(C, D, n_u + entries, n_u, columns, order)
        h = step_length(C, order, n_u, entries + n_u, u, pace.weight, pace.sizes, pace.log_tolerance)
        if not (h > 1e-15 * tau):
            return DIVERGED
        if h < remaining:
            h = remaining / float(int(remaining / h) + 1)  # equal steps to the end, were all alike
        else:
            h = remaining
        seen.sums[0] += step_end(C, D, equations, mode, order, h, u, X)
        for i in range(n_u):
            if not (fabs(u[i]) <= pace.limit[i]):
                return DIVERGED
            for c in range(columns):
                Q[i, c] = X[i, c] / scale[i]
                if not (fabs(Q[i, c]) < inf):
                    return DIVERGED
        done = tau if h >= remaining else done + h
        upright(0.0, tau - done, unit, seen)
    return NO_CONVERGENCE


@device
def transitions_at(m, t, pieces, equations, out, seen, work):
    """The transitions at the end of piece m act on the frame."""
    n, scale, S = seen.scale.shape[0], seen.scale, seen.step
    begin(seen)
    put(pieces.before[m], n, work.u, work.q)
    for at in range(pieces.first_jump[m], pieces.first_jump[m + 1]):
        k = pieces.jumps[at]
        jump_at(k, t, n, equations, seen, out, work)
        if at == pieces.first_jump[m]:
            _, steep = instant_of(equations.transitions[k, 2], -1, scale, out[:0], seen, out)
            seen.sums[3] = min(seen.sums[3], steep)
        add(seen)
        seen.sums[2] += 1
    for i in range(n):
        for c in range(n):
            S[i, c] *= scale[c] / scale[i]
    size = log_determinant(S, n, seen.matrix)
    seen.sums[1] += size
    multiply(S, seen.frame, n, seen.frame.shape[1], seen.scratch)
    upright(size, 0.0, pieces.unit[m], seen)


@kernel(types.int64(EQUATIONS, PIECES, PACE, _f1, GROWTH, _f1, STEPS))
def grow(equations, pieces, pace, values, seen, out, work):
    """The pieces of a trajectory one after the other, with the frame. Returns a status.

    ``seen.sums[4]``: the largest distance between the end of a piece and the record, relative to the state and its
    scale. ``out``: scratch of ``switch``."""
    jet, u, q = jet_at(equations.functions[0]), work.u, work.q
    n, n_u, recorded = seen.scale.shape[0], work.u.shape[0], pieces.z0.shape[0]
    for j in range(values.shape[0]):
        q[j] = values[j]
    for m in range(pieces.mode.shape[0]):
        if m < recorded:
            put(pieces.z0[m], n, u, q)
        t0, tau = pieces.t0[m], pieces.tau[m]
        status = frame_along(jet, pieces.mode[m], t0, tau, pieces.unit[m], equations, pace, seen, work)
        if status != OK:
            return status
        crossed = pieces.first_jump[m + 1] > pieces.first_jump[m]
        if crossed or m + 1 < recorded:
            there = pieces.before[m] if crossed else pieces.z0[m + 1]
            for i in range(n_u):
                seen.sums[4] = max(seen.sums[4], fabs(u[i] - there[i]) / (fabs(there[i]) + seen.scale[i]))
        if crossed:
            transitions_at(m, t0 + tau, pieces, equations, out, seen, work)
    return OK
