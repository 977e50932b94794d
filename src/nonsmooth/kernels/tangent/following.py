"""A frame of small changes that follows a march of the series, which calls these kernels by their addresses.

It goes by its own Taylor series, taken as in ``legs``, at the march's accuracy."""

from math import fabs, inf

from numba import types

from nonsmooth.kernels.compile.cache import kernel
from nonsmooth.kernels.compile.pointers import stored
from nonsmooth.kernels.hybrid.records import GROWTH
from nonsmooth.kernels.tangent.frame import straighten
from nonsmooth.kernels.tangent.legs import (
    EQUATIONS,
    MOST_STEPS,
    STEPS,
    add,
    begin,
    field_at,
    instant_of,
    jet_at,
    jump_at,
    meet_again,
    step_along,
)

_i, _f = types.int64, types.float64
FOLLOWER = types.Tuple((EQUATIONS, GROWTH, STEPS, _f[::1]))  # ...; u and q of growth are those of the steps; ``switch``
_put_follower, follower_at = stored(FOLLOWER)


@kernel(types.void(_i, FOLLOWER))
def put_follower(address, record):
    """Write a frame that follows to an address."""
    _put_follower(address, record)


@kernel(_f(_i, _i, _f, _f, _f, _i))
def frame_along(follower, mode, t0, tau, guess, unit):
    """Carry state and frame over the time tau of a unit of time. Returns how far a step reaches; -1: it diverges."""
    equations, seen, work, _ = follower_at(follower)
    jet, field = jet_at(equations.functions[0]), field_at(equations.functions[1])
    X, Q, scale, n_u, done = work.X, seen.frame, seen.scale, work.u.shape[0], 0.0
    n, columns = Q.shape
    reach = guess if guess > 0.0 else tau
    for _ in range(MOST_STEPS):
        remaining = tau - done
        if remaining <= 0.0:
            return reach
        for c in range(columns):
            for i in range(n):
                work.D[0, i, c] = scale[i] * Q[i, c]
        h, divergence, reach = step_along(jet, field, mode, t0 + done, remaining, 1.0, False, equations, work, reach)
        if not (h > 1e-15 * tau):
            return -1.0
        part = divergence - seen.sums[4]  # Kahan's sum: what rounding has added stands in the last place
        whole = seen.sums[0] + part
        seen.sums[4], seen.sums[0] = (whole - seen.sums[0]) - part, whole
        for c in range(columns):
            for i in range(n_u):
                Q[i, c] = X[i, c] / scale[i]
                if not (fabs(Q[i, c]) < inf):
                    return -1.0
        straighten(Q, n, columns, seen.lengths, False, False, seen.growth[unit], seen.scratch)
        done = tau if h >= remaining else done + h
    return -1.0


@kernel(types.void(_i, _i, _f, _i))
def frame_across(follower, k, t, jumps):
    """Transition k, after ``jumps`` others of its instant, where the frame was carried: into ``step``."""
    equations, seen, work, out = follower_at(follower)
    n = seen.scale.shape[0]
    jump_at(k, t, n, equations, seen, out, work)
    if jumps == 0:
        begin(seen)
        _, steep = instant_of(equations.transitions[k, 2], -1, seen.scale, out[:0], seen, out)
        for i in range(n):
            seen.fields[3, i] = seen.fields[0, i]
    else:
        steep = meet_again(equations.transitions[k, 2], seen.scale, seen, out)
        seen.sums[5] += 1.0 if steep < inf else 0.0
    seen.sums[3] = min(seen.sums[3], steep)
    add(seen)
