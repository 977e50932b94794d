"""Smooth motion in one mode with its first variations, and what a transition does to them.

A leg is marched by Taylor series. On every step the matrix X of the step begins afresh: the identity in the columns of
the states, zero in those of the memory and of the active parameters; its series follows from those of the Jacobians'
entries, X_(k+1) = (sum_j A_j X_(k-j) + B_k) / (k + 1). So its error can be judged without units, and the steps'
matrices are multiplied up.
"""

from math import fabs, inf

from numba import types

from .cache import device, kernel
from .codes import DIVERGED, NO_CONVERGENCE, OK
from .pointers import function_at

__all__ = ["ORDER", "cross", "march_legs", "put"]

ORDER = 24
ACCURACY = 1e-17  # of the last two terms of a series against its largest one
MOST_STEPS = 100_000  # in one leg

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1], _i[:, ::1]
JET = types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2))
FIELD = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
jet_at, field_at, switch_at = function_at(JET), function_at(FIELD), function_at(FIELD)
WORK = types.Tuple((_f2, _f2, _f3, _f2, _f2, _f2, _f1, _f1, _f1))


@device
def fundamental(C, entries, kinds, mode, n_u, D):
    """Series of the step's matrix, D[i, column, k], from those of the Jacobians' entries in the rows n_u + e of C."""
    n_c, order = D.shape[1], D.shape[2] - 1
    for i in range(n_u):
        for c in range(n_c):
            D[i, c, 0] = 1.0 if i == c else 0.0
    for k in range(order):
        for i in range(n_u):
            for c in range(n_c):
                D[i, c, k + 1] = 0.0
        for e in range(entries.shape[0]):
            kind = kinds[mode, e]
            if kind == 0:
                continue
            i, m = entries[e, 0], entries[e, 1]
            if m >= n_u:
                D[i, m, k + 1] += C[n_u + e, k]
            elif kind == 1:
                a = C[n_u + e, 0]
                for c in range(n_c):
                    D[i, c, k + 1] += a * D[m, c, k]
            else:
                for c in range(n_c):
                    s = 0.0
                    for j in range(k + 1):
                        s += C[n_u + e, j] * D[m, c, k - j]
                    D[i, c, k + 1] += s
        r = 1.0 / (k + 1)
        for i in range(n_u):
            for c in range(n_c):
                D[i, c, k + 1] *= r


@device
def excess(C, D, n_u, powers):
    """The last two terms of every series against the largest of its first ones: the worst of them."""
    n_c, order = D.shape[1], D.shape[2] - 1
    half, worst = order // 2, 0.0
    high, low = powers[order], powers[order - 1]
    for i in range(n_u):
        top = 0.0
        for k in range(half):
            top = max(top, fabs(C[i, k]) * powers[k])
        last = fabs(C[i, order]) * high + fabs(C[i, order - 1]) * low
        if top > 0.0:
            worst = max(worst, last / top)
        top, last = 0.0, 0.0
        for c in range(n_u):
            for k in range(half):
                top = max(top, fabs(D[i, c, k]) * powers[k])
            last = max(last, fabs(D[i, c, order]) * high + fabs(D[i, c, order - 1]) * low)
        worst = max(worst, last / top)
        for c in range(n_u, n_c):
            top = 0.0
            for k in range(half):
                top = max(top, fabs(D[i, c, k]) * powers[k])
            last = fabs(D[i, c, order]) * high + fabs(D[i, c, order - 1]) * low
            if top > 0.0:
                worst = max(worst, last / top)
        if not (last < inf):
            return inf
    return worst


@device
def step_for(C, D, n_u, remaining, guess, powers):
    """A step on which all series have converged, at most ``remaining``; negative where there is none."""
    order = D.shape[2] - 1
    h = min(guess, remaining)
    for attempt in range(60):
        powers[0] = 1.0
        for k in range(order):
            powers[k + 1] = powers[k] * h
        worst = excess(C, D, n_u, powers)
        if not (worst < inf):
            return -1.0
        # after four attempts a step may be shorter than it could be, but not longer
        if worst <= ACCURACY and (h >= remaining or worst > 1e-3 * ACCURACY or attempt >= 4):
            return h
        factor = 10.0 if worst <= 0.0 else min(10.0, 0.97 * (ACCURACY / worst) ** (1.0 / order))
        h = min(h * factor, remaining)
    return -1.0


@device
def sum_series(D, i, c, h):
    """D[i, c] at h."""
    v = D[i, c, D.shape[2] - 1]
    for k in range(D.shape[2] - 2, -1, -1):
        v = v * h + D[i, c, k]
    return v


@device
def step_end(C, D, entries, kinds, mode, n_u, s, u, X):
    """State and matrix at s from the step's begin; returns the integral of the divergence up to there."""
    order = D.shape[2] - 1
    divergence = 0.0
    for e in range(entries.shape[0]):
        if entries[e, 0] == entries[e, 1] and kinds[mode, e] != 0:
            v = 0.0
            for k in range(order - 1, -1, -1):
                v = v * s + C[n_u + e, k] / (k + 1)
            divergence += v * s
    for i in range(n_u):
        v = C[i, order]
        for k in range(order - 1, -1, -1):
            v = v * s + C[i, k]
        u[i] = v
        for c in range(D.shape[1]):
            X[i, c] = sum_series(D, i, c, s)
    return divergence


@device
def march_one(jet, mode, t0, tau, entries, kinds, n_u, u, q, total, work, guess):
    """March u over the time tau; ``total`` (n_u, columns) is multiplied up. Returns (status, integral of div f)."""
    C, W, D, X, Y, _, powers = work[:7]
    n_c, order = D.shape[1], D.shape[2] - 1
    for i in range(n_u):
        for c in range(n_c):
            total[i, c] = 1.0 if i == c else 0.0
    done, divergence = 0.0, 0.0
    sign = 1.0 if tau >= 0.0 else -1.0
    length = fabs(tau)
    for _ in range(MOST_STEPS):
        remaining = length - done
        if remaining <= 0.0:
            return OK, divergence, guess
        jet(mode, order, t0 + sign * done, u, q, C, W)
        fundamental(C, entries, kinds, mode, n_u, D)
        h = step_for(C, D, n_u, remaining, guess, powers)
        if not (h > 1e-15 * length):
            return DIVERGED, divergence, guess
        if h < remaining:
            guess = h
            h = remaining / float(int(remaining / h) + 1)  # equal steps to the end, were all alike
        s = sign * h
        divergence += step_end(C, D, entries, kinds, mode, n_u, s, u, X)
        for i in range(n_u):
            for c in range(n_c):
                v = X[i, c] if c >= n_u else 0.0
                for j in range(n_u):
                    v += X[i, j] * total[j, c]
                Y[i, c] = v
        for i in range(n_u):
            for c in range(n_c):
                total[i, c] = Y[i, c]
        done = length if h >= remaining else done + h
    return (OK if done >= length else NO_CONVERGENCE), divergence, guess


@device
def put(z, n, n_p, u, q):
    """The first n numbers of z as the states u, and as the memory behind the n_p parameters in q."""
    n_u = u.shape[0]
    for i in range(n):
        if i < n_u:
            u[i] = z[i]
        else:
            q[n_p + i - n_u] = z[i]


@kernel(
    types.void(
        _i1, _i2, _i2, _i1, _f1, _f1, _f2, _f1, _f2, _f3, _f3, _f2, _f2, _f1, _i1, WORK
    )
)
def march_legs(
    functions, entries, kinds, modes, t0, tau, z0, values, z, phi, p, f_begin, f_end, divergence, status, work
):
    """Legs one after the other: state at the end, dz/dz0, dz/dp, the field at both ends, integral of div f, status.

    ``functions``: addresses of the jet, the field and the switch (see ``pointers``)."""
    jet, field = jet_at(functions[0]), field_at(functions[1])
    total, u, q = work[5], work[7], work[8]
    n_u, n_p, n = u.shape[0], values.shape[0], z0.shape[1]
    guess = inf
    for j in range(n_p):
        q[j] = values[j]
    for leg in range(modes.shape[0]):
        mode = modes[leg]
        put(z0[leg], n, n_p, u, q)
        for i in range(n_u, n):
            f_begin[leg, i], f_end[leg, i] = 0.0, 0.0
        field(mode, t0[leg], u, q, f_begin[leg])
        if guess == inf or guess == 0.0:  # a leg of no length says nothing of the next
            guess = fabs(tau[leg])
        status[leg], divergence[leg], guess = march_one(
            jet, mode, t0[leg], tau[leg], entries, kinds, n_u, u, q, total, work, guess
        )
        field(mode, t0[leg] + tau[leg], u, q, f_end[leg])
        for i in range(n):
            z[leg, i] = u[i] if i < n_u else z0[leg, i]
            for c in range(n):
                phi[leg, i, c] = total[i, c] if i < n_u else (1.0 if i == c else 0.0)
            for c in range(n, total.shape[1]):
                p[leg, i, c - n] = total[i, c] if i < n_u else 0.0


@kernel(types.int64(_i1, _i, _i, _i, _i, _i, _f, _f1, _f1,
                    _f1, _f1, _f1, _f1, WORK))  # fmt: skip
def cross(functions, k, source, target, n_rows, row, t, z, values, timing, scale, out, result, work):
    """Saltation of transition k at (t, z): its matrix and parameter columns, and all they are made of.

    ``row``: the row of the condition that is zero, or -1: the one nearest to zero. ``timing`` = dt/dp where the
    transition happens at a given phase (no rows). ``out`` is filled by ``switch``; ``result`` gets f_before (n),
    f_after (n), the saltation matrix (n, n), the parameter columns (n, n_active), dt/dz (n), dt/dp (n_active).
    Returns the row."""
    field, switch = field_at(functions[1]), switch_at(functions[2])
    u, q = work[7], work[8]
    n, n_u, n_p, n_a = z.shape[0], u.shape[0], values.shape[0], timing.shape[0]
    for j in range(n_p):
        q[j] = values[j]
    for i in range(n):
        result[i], result[n + i] = 0.0, 0.0
    put(z, n, n_p, u, q)
    switch(k, t, u, q, out)
    field(source, t, u, q, result)
    put(out, n, n_p, u, q)
    field(target, t, u, q, result[n : n + n_u])
    r_z, r_t = n, n + n * n
    r_p = r_t + n
    rows = r_p + n * n_a
    width = 2 + n + n_a
    if n_rows > 0 and row < 0:
        best = inf
        for r in range(n_rows):
            at = rows + r * width
            size = 0.0
            for i in range(n):
                size += fabs(out[at + 1 + i]) * scale[i]
            distance = fabs(out[at]) / size if size > 0.0 else inf
            if row < 0 or distance < best:
                row, best = r, distance
    at_s = 2 * n
    at_p = at_s + n * n
    at_tz = at_p + n * n_a
    at_tp = at_tz + n
    if n_rows > 0:
        at = rows + row * width
        rate = out[at + 1 + n]
        for i in range(n):
            rate += out[at + 1 + i] * result[i]
        for i in range(n):
            result[at_tz + i] = -out[at + 1 + i] / rate
        for a in range(n_a):
            result[at_tp + a] = -out[at + 2 + n + a] / rate
    else:
        for i in range(n):
            result[at_tz + i] = 0.0
        for a in range(n_a):
            result[at_tp + a] = timing[a]
    for i in range(n):
        slip = out[r_t + i] - result[n + i]  # R_z f- + R_t - f+
        for j in range(n):
            slip += out[r_z + i * n + j] * result[j]
        for j in range(n):
            result[at_s + i * n + j] = out[r_z + i * n + j] + slip * result[at_tz + j]
        for a in range(n_a):
            result[at_p + i * n_a + a] = out[r_p + i * n_a + a] + slip * result[at_tp + a]
    return row
