"""The equations of systems whose modes are made when they are visited: one text for all of them, with numbers for what
the generated text of a model has as formulas.

They read as the functions of a model (``legs.JET``, ``FIELD``): q is the packed system (``system.derived.packed``), in
which a mode has a block of rows over w = (u, 1, cos k_1 w t, sin k_1 w t, ...) and a transition one of its map. At its
head stand the numbers of states, harmonics, active parameters, conditions and modes, by how much each parameter's
derivative of a field stands behind it, the harmonics' rates, their derivatives in each active parameter, and the places
of the blocks: of the fields of all modes, of their conditions, of all transitions."""

from math import cos, sin

from numba import types

from nonsmooth.kernels.compile.cache import device, inline, kernel
from nonsmooth.kernels.compile.lanes import FOUR, load, plus, store, times

_i, _f = types.int64, types.float64
_f1, _f2, _f3 = _f[::1], _f[:, ::1], _f[:, :, ::1]
RATES = 6  # where the harmonics' rates begin


@inline
def sizes(q):
    """Numbers of states, harmonics and active parameters of a packed system."""
    return int(q[0]), int(q[1]), int(q[2])


@inline
def block(q, kind, k):
    """The place where a block begins: of a mode's field (kind 0), of a mode's conditions (1), of a transition (2): the
    number of its conditions, by how much each parameter's derivative stands behind each of them, and behind its map,
    where the map stands, and where the conditions do."""
    return int(q[RATES + int(q[1]) * (1 + int(q[2])) + kind * int(q[4]) + k])


@device
def waves(q, n, harmonics, t, order, W):
    """Series of the cosines and sines of the harmonics, two rows for each."""
    for h in range(harmonics):
        rate = q[RATES + h]
        W[2 * h, 0], W[2 * h + 1, 0] = cos(rate * t), sin(rate * t)
        for k in range(order):
            W[2 * h, k + 1] = -rate * W[2 * h + 1, k] / (k + 1)
            W[2 * h + 1, k + 1] = rate * W[2 * h, k] / (k + 1)


@inline
def term(q, row, n, harmonics, C, W, k):
    """Coefficient k of a row along the series of the states and the waves."""
    total = q[row + n] if k == 0 else 0.0
    for j in range(n):
        if q[row + j] != 0.0:
            total += q[row + j] * C[j, k]
    for h in range(2 * harmonics):
        if q[row + n + 1 + h] != 0.0:
            total += q[row + n + 1 + h] * W[h, k]
    return total


@inline
def term_of_rates(q, row, n, harmonics, p, t, W, k):
    """Coefficient k of what the change of the harmonics' rates with active parameter p does to a row."""
    total = 0.0
    for h in range(harmonics):
        rate = q[RATES + harmonics * (1 + p) + h]
        if rate != 0.0:
            cosine, sine = t * W[2 * h, k], t * W[2 * h + 1, k]
            if k > 0:
                cosine += W[2 * h, k - 1]
                sine += W[2 * h + 1, k - 1]
            total += rate * (q[row + n + 2 + 2 * h] * cosine - q[row + n + 1 + 2 * h] * sine)
    return total


@device
def states_along(q, field, n, width, harmonics, order, u, C, W):
    """Series of the states by the rows of a field."""
    for i in range(n):
        C[i, 0] = u[i]
    for k in range(order):
        for i in range(n):
            C[i, k + 1] = term(q, field + i * width, n, harmonics, C, W, k) / (k + 1)


@kernel(types.void(_i, _i, _f, _f1, _f1, _f2, _f2))
def path(mode, order, t, u, q, C, W):
    """Series of the states, then of the conditions; those that are not asked for in the mode are NaN."""
    n, harmonics, _ = sizes(q)
    width, field, first = n + 1 + 2 * harmonics, block(q, 0, mode), block(q, 1, mode)
    waves(q, n, harmonics, t, order, W)
    states_along(q, field, n, width, harmonics, order, u, C, W)
    for i in range(int(q[3])):
        row = first + i * width
        for k in range(order + 1):
            C[n + i, k] = term(q, row, n, harmonics, C, W, k)


@kernel(types.void(_i, _i, _f, _f1, _f1, _f2, _f2, _f3))
def jet(mode, order, t, u, q, C, W, D):
    """Series of the states, the diagonal of the Jacobian, and in D those of the small changes from ``D[0]``."""
    n, harmonics, active = sizes(q)
    width, first, numbers, columns = n + 1 + 2 * harmonics, block(q, 0, mode), D.shape[1], D.shape[2]
    waves(q, n, harmonics, t, order, W)
    states_along(q, first, n, width, harmonics, order, u, C, W)
    for i in range(n):
        C[n + i, 0] = q[first + i * width + i]
    for k in range(order):
        share = 1.0 / (k + 1)
        for i in range(n):
            row = first + i * width
            for p in range(active):
                change = term(q, row + (1 + p) * int(q[5]), n, harmonics, C, W, k)
                W[2 * harmonics + p, 0] = change + term_of_rates(q, row, n, harmonics, p, t, W, k)
            for c in range(0, columns, FOUR):
                x = times(0.0, load(D, c))
                for j in range(n):
                    if q[row + j] != 0.0:
                        x = plus(x, q[row + j], load(D, (k * numbers + j) * columns + c))
                for p in range(active):
                    x = plus(x, W[2 * harmonics + p, 0], load(D, (n + p) * columns + c))
                store(D, ((k + 1) * numbers + i) * columns + c, times(share, x))


@inline
def value(q, row, n, harmonics, t, u):
    """The value of a row."""
    total = q[row + n]
    for j in range(n):
        total += q[row + j] * u[j]
    for h in range(harmonics):
        cosine, sine = q[row + n + 1 + 2 * h], q[row + n + 2 + 2 * h]
        if cosine != 0.0 or sine != 0.0:
            angle = q[RATES + h] * t
            total += cosine * cos(angle) + sine * sin(angle)
    return total


@inline
def change_of_waves(q, row, n, harmonics, t, rates, time):
    """The change of a row by that of its harmonics' angles: rates that stand at a place of q, times a time."""
    total = 0.0
    for h in range(harmonics):
        cosine, sine = q[row + n + 1 + 2 * h], q[row + n + 2 + 2 * h]
        if cosine != 0.0 or sine != 0.0:
            angle = q[RATES + h] * t
            total += time * q[rates + h] * (sine * cos(angle) - cosine * sin(angle))
    return total


@kernel(types.void(_i, _f, _f1, _f1, _f1))
def field(mode, t, u, q, du):
    """The vector field of a mode."""
    n, harmonics, _ = sizes(q)
    width, first = n + 1 + 2 * harmonics, block(q, 0, mode)
    for i in range(n):
        du[i] = value(q, first + i * width, n, harmonics, t, u)


@kernel(types.void(_i, _f, _f1, _f1, _f1))
def switch(transition, t, u, q, out):
    """State behind a transition, its derivatives in states, time and active parameters; of each condition the value and
    the same derivatives, the time's before the parameters'."""
    n, harmonics, active = sizes(q)
    width, first = n + 1 + 2 * harmonics, block(q, 2, transition)
    rows, stride, stride_of_map, place = int(q[first]), int(q[first + 1]), int(q[first + 2]), int(q[first + 3])
    at = n + n * n + n + n * active
    for i in range(n):
        row = place + i * width
        out[i] = value(q, row, n, harmonics, t, u)
        for j in range(n):
            out[n + i * n + j] = q[row + j]
        out[n + n * n + i] = change_of_waves(q, row, n, harmonics, t, RATES, 1.0)
        for p in range(active):
            of_p = value(q, row + (1 + p) * stride_of_map, n, harmonics, t, u)
            of_p += change_of_waves(q, row, n, harmonics, t, RATES + harmonics * (1 + p), t)
            out[n + n * n + n + i * active + p] = of_p
    for r in range(rows):
        row = int(q[first + 4 + r])
        out[at] = value(q, row, n, harmonics, t, u)
        for j in range(n):
            out[at + 1 + j] = q[row + j]
        out[at + 1 + n] = change_of_waves(q, row, n, harmonics, t, RATES, 1.0)
        for p in range(active):
            of_p = value(q, row + (1 + p) * stride, n, harmonics, t, u)
            out[at + 2 + n + p] = of_p + change_of_waves(q, row, n, harmonics, t, RATES + harmonics * (1 + p), t)
        at += 2 + n + active
