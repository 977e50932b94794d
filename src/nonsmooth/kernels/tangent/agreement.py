"""The test of a step of the variational flow: its series against the equations at instants between its ends."""

from math import fabs, inf

from nonsmooth.kernels.compile.cache import device
from nonsmooth.kernels.series.crossing import NOISE

AGREES = 1e-11  # of a state's size: by how much its series may miss the equations on a step
PLACES = 3  # on a step where they are compared


@device
def fits(field, mode, t, s, work):
    """Return whether the series of the states satisfy the equations on a step s, where they are asked.

    A layer (of a steep tanh) that the step reaches far from its begin shows in none of their terms. What rounding does
    to the equations does not count: where they balance, a state is all rounding."""
    C, at, f = work.C, work.X[0], work.Y[0]
    n_u, order = work.u.shape[0], C.shape[1] - 1
    for place in range(1, PLACES + 1):
        x = s * place / PLACES
        for i in range(n_u):
            v = C[i, order]
            for k in range(order - 1, -1, -1):
                v = v * x + C[i, k]
            at[i] = v
        field(mode, t + x, at, work.q, f)
        for i in range(n_u):
            slope, top = 0.0, 0.0
            for k in range(order, 0, -1):
                slope = slope * x + k * C[i, k]
            for k in range(order // 2):
                top = max(top, fabs(C[i, k]) * work.powers[k])
            if fabs((slope - f[i]) * s) <= AGREES * top:
                continue
            if not (fabs(slope - f[i]) <= rounding(field, mode, t + x, i, work) < inf):
                return False
    return True


@device
def rounding(field, mode, t, i, work):
    """Size of what rounding of time, states, parameters and memory does to f_i where the equations are asked."""
    at, f, q = work.X[0], work.Y[0], work.q
    here = f[i]
    total = NOISE * fabs(here)
    for j in range(work.u.shape[0]):
        kept = at[j]
        at[j] = kept * (1.0 + NOISE)
        field(mode, t, at, q, f)
        total += fabs(f[i] - here)
        at[j] = kept
    for j in range(q.shape[0]):  # states of 1e-15 between forces that balance: the rounding is that of the forces
        kept = q[j]
        q[j] = kept * (1.0 + NOISE)
        field(mode, t, at, q, f)
        total += fabs(f[i] - here)
        q[j] = kept
    field(mode, t * (1.0 + NOISE), at, q, f)
    total += fabs(f[i] - here)
    field(mode, t, at, q, f)
    return total
