"""Smooth motion in one mode with its first variations, and what a transition does to them.

A segment is marched by Taylor series. On every step the matrix X of the step begins afresh: the identity in the columns
of the states, zero in those of the memory and of the active parameters; its series follows from those of the Jacobians'
entries, X_(k+1) = (sum_j A_j X_(k-j) + B_k) / (k + 1). So its error can be judged without units, and the steps'
matrices are multiplied up. (Along a march, ``following``, it begins with a frame that is kept orthonormal.)

Small changes are those of the N = n + n_active numbers (states, memory, active parameters).
"""

from __future__ import annotations

from math import fabs, inf, sqrt
from typing import Any, NamedTuple

from numba import types

from nonsmooth.kernels.compile.cache import device, kernel
from nonsmooth.kernels.compile.lanes import FOUR, load, plus, store
from nonsmooth.kernels.compile.pointers import function_at
from nonsmooth.kernels.hybrid.codes import DIVERGED, NO_CONVERGENCE, OK
from nonsmooth.kernels.hybrid.kept import Segments
from nonsmooth.kernels.hybrid.records import type_of
from nonsmooth.kernels.series.taylor import fill_powers
from nonsmooth.kernels.tangent.agreement import fits
from nonsmooth.kernels.tangent.frame import NEAR, ON_SURFACE, add_product, saltation

ORDER = 24  # of the series of an orbit's legs
ACCURACY = 1e-17  # of the last two terms of a series against its largest one, there
MOST_STEPS = 100_000  # in one leg
SLIGHT = 1e-6  # of the largest number: what is smaller need not be known better

_i, _f = types.int64, types.float64
_f1, _f2, _f3, _i1, _i2 = _f[::1], _f[:, ::1], _f[:, :, ::1], _i[::1], _i[:, ::1]
JET = types.FunctionType(types.void(_i, _i, _f, _f1, _f1, _f2, _f2, _f3))
FIELD = types.FunctionType(types.void(_i, _f, _f1, _f1, _f1))
jet_at, field_at, switch_at = function_at(JET), function_at(FIELD), function_at(FIELD)


class Equations(NamedTuple):
    """A system's equations and those of its small changes (see ``system.variations``)."""

    functions: Any  # addresses of the jet, the field and the switch (see ``pointers``)
    entries: Any  # (entries, 2) row and column of each entry of the Jacobians
    kinds: Any  # (modes, entries) 0: zero in this mode, 1: constant, 2: varying
    transitions: Any  # (transitions, 4) source, target, rows of the condition, the number by which ``switch`` knows it


class Steps(NamedTuple):
    """Working memory of a Taylor step with small changes."""

    C: Any  # (n_u + entries + n_u, order + 1) series of the states and the entries, sizes of the small changes
    D: Any  # (order + 1, N, columns in whole blocks) series of the small changes, zero in columns without one
    W: Any  # scratch of the jet
    X: Any  # (n_u, N) small changes at the end of a step
    Y: Any  # (n_u, N), two rows at least, scratch
    total: Any  # (n_u, N) products of X
    powers: Any  # (order + 1,) of a step
    u: Any  # (n_u,)
    q: Any  # parameters, then memory
    accuracy: Any  # of the last two terms of a series against its largest one


class Crossing(NamedTuple):
    """The effect of the transitions of one instant on small changes."""

    step: Any  # (N, N) saltation matrix of all of them
    reset: Any  # (N, N) derivative of the last one's map
    matrix: Any  # (N, N) scratch
    fields: Any  # (3, N) vector field before and after it, derivative of its map in time
    t_z: Any  # (N,) derivative of the instant


EQUATIONS = type_of(Equations, _i1, _i2, _i2, _i2)
STEPS = type_of(Steps, _f2, _f3, *[_f2] * 4, *[_f1] * 3, _f)
SEGMENTS = type_of(Segments, _f2, _f3, _f3, _f2, _f2, _f1, _i1)
CROSSING = type_of(Crossing, *[_f2] * 4, _f1)


@device
def excess(C, D, n_u, columns, powers, tops):
    """The last two terms of every series against the largest of its first ones: the worst of them.

    Small changes of one number are judged together in the columns of the states, and alone in the others; what is less
    than ``SLIGHT`` of the largest of its kind, as that. ``tops``: room for a row of small changes."""
    order = C.shape[1] - 1
    half, worst, largest = order // 2, 0.0, 0.0
    high, low = powers[order], powers[order - 1]
    for c in range(n_u, columns):
        tops[1, c] = 0.0
    for i in range(n_u):
        for k in range(half):
            largest = max(largest, fabs(C[i, k]) * powers[k])
            for c in range(n_u, columns):
                tops[1, c] = max(tops[1, c], fabs(D[k, i, c]) * powers[k])
    for i in range(n_u):
        top, last = SLIGHT * largest, 0.0
        for k in range(half):
            size = fabs(C[i, k]) * powers[k]
            top = size if size > top else top
        last = fabs(C[i, order]) * high + fabs(C[i, order - 1]) * low
        if not (last < inf):
            return inf
        if top > 0.0:
            worst = max(worst, last / top)
        for c in range(columns):
            tops[0, c] = fabs(D[0, i, c]) if c < n_u else max(SLIGHT * tops[1, c], fabs(D[0, i, c]))
        for k in range(1, half):
            for c in range(columns):
                size = fabs(D[k, i, c]) * powers[k]
                tops[0, c] = size if size > tops[0, c] else tops[0, c]
        top, last = 0.0, 0.0
        for c in range(columns):
            top = max(top, tops[0, c])
            last = max(last, fabs(D[order, i, c]) * high + fabs(D[order - 1, i, c]) * low)
            if c >= n_u - 1:
                if not (last < inf):
                    return inf
                if top > 0.0:
                    worst = max(worst, last / top)
                top, last = 0.0, 0.0
    return worst


@device
def step_for(C, D, n_u, columns, remaining, guess, powers, accuracy, tops):
    """A step on which all series have converged, at most ``remaining``; negative where there is none."""
    order = C.shape[1] - 1
    h = min(guess, remaining)
    for _ in range(60):
        fill_powers(h, order, powers)
        worst = excess(C, D, n_u, columns, powers, tops)
        if not (worst < inf):
            return -1.0
        if worst <= accuracy and (h >= remaining or worst > 1e-3 * accuracy):
            return h
        factor = 10.0 if worst <= 0.0 else min(10.0, 0.97 * (accuracy / worst) ** (1.0 / order))
        h = min(h * factor, remaining)
        if worst > 0.0 and factor > 0.5:  # .97^order is room for the term before the last
            fill_powers(h, order, powers)
            return h
    return -1.0


@device
def step_end(C, D, equations, mode, order, s, u, X):
    """State and small changes at s from the step's begin; returns the integral of the divergence up to there."""
    entries, kinds = equations.entries, equations.kinds
    n_u, columns, rows, width = X.shape[0], X.shape[1], D.shape[1], D.shape[2]
    divergence = 0.0
    for e in range(entries.shape[0]):
        if entries[e, 0] == entries[e, 1] and kinds[mode, e] != 0:
            v = C[n_u + e, 0]
            if kinds[mode, e] == 2:
                v = 0.0
                for k in range(order - 1, -1, -1):
                    v = v * s + C[n_u + e, k] / (k + 1)
            divergence += v * s
    for i in range(n_u):
        v = C[i, order]
        for k in range(order - 1, -1, -1):
            v = v * s + C[i, k]
        u[i] = v
        for c in range(0, width, FOUR):
            x = load(D, (order * rows + i) * width + c)
            for k in range(order - 1, -1, -1):
                x = plus(load(D, (k * rows + i) * width + c), s, x)
            store(D, (order * rows + i) * width + c, x)
        for c in range(columns):
            X[i, c] = D[order, i, c]
    return divergence


@device
def step_along(jet, field, mode, t, remaining, sign, compared, equations, work, guess):
    """One step of state and small changes (of ``D[0]``), into ``u`` and ``X``: (its length, at most ``remaining``; the
    integral of div f; a guess of the next). Length 0: none. ``compared``: the series are held against the equations."""
    C, D, X, u = work.C, work.D, work.X, work.u
    n_u, n_c, order = X.shape[0], X.shape[1], C.shape[1] - 1
    jet(mode, order, t, u, work.q, C, work.W, D)
    h = step_for(C, D, n_u, n_c, remaining, guess, work.powers, work.accuracy, work.Y)
    if not h > 0.0:
        return 0.0, 0.0, guess
    if h < remaining:
        guess = h
        h = remaining / float(int(remaining / h) + 1)  # equal steps to the end, were all alike
    while compared and not fits(field, mode, t, sign * h, work):
        h *= 0.5
        guess = h
        if not (h > 1e-15 * remaining):
            return 0.0, 0.0, guess
    return h, step_end(C, D, equations, mode, order, sign * h, u, X), guess


@device
def march_one(jet, field, mode, t0, tau, equations, work, guess):
    """March u over the time tau; ``total`` is multiplied up. Returns (status, integral of div f, next guess)."""
    X, Y, total = work.X, work.Y, work.total
    n_u, n_c = X.shape
    curved = False
    for e in range(equations.entries.shape[0]):
        curved = curved or equations.kinds[mode, e] == 2
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
        for i in range(n_c):
            for c in range(n_c):
                work.D[0, i, c] = 1.0 if i == c else 0.0
        h, part, guess = step_along(jet, field, mode, t0 + sign * done, remaining, sign, curved, equations, work, guess)
        if not (h > 1e-15 * length):
            return DIVERGED, divergence, guess
        divergence += part
        for i in range(n_u):
            for c in range(n_c):
                Y[i, c] = X[i, c] if c >= n_u else 0.0
        add_product(X, total, n_u, n_c, Y)
        for i in range(n_u):
            for c in range(n_c):
                total[i, c] = Y[i, c]
        done = length if h >= remaining else done + h
    return (OK if done >= length else NO_CONVERGENCE), divergence, guess


@device
def put(z, n, u, q):
    """The first n numbers of z as the states u, and as the memory at the end of q."""
    n_u = u.shape[0]
    for i in range(n):
        if i < n_u:
            u[i] = z[i]
        else:
            q[q.shape[0] - n + i] = z[i]


@kernel(types.void(EQUATIONS, _i1, _f1, _f1, _f2, _f1, SEGMENTS, STEPS))
def march_legs(equations, modes, t0, tau, z0, values, ends, work):
    """Segments one after the other: state at the end, dz/dz0, dz/dp, field at both ends, integral of div f, status."""
    jet, field = jet_at(equations.functions[0]), field_at(equations.functions[1])
    total, u, q = work.total, work.u, work.q
    n_u, n = u.shape[0], z0.shape[1]
    guess = inf
    for j in range(values.shape[0]):
        q[j] = values[j]
    for leg in range(modes.shape[0]):
        mode = modes[leg]
        put(z0[leg], n, u, q)
        for i in range(n_u, n):
            ends.f_begin[leg, i], ends.f_end[leg, i] = 0.0, 0.0
        field(mode, t0[leg], u, q, ends.f_begin[leg])
        if guess == inf or guess == 0.0:  # a leg of no length says nothing of the next
            guess = fabs(tau[leg])
        ends.status[leg], ends.divergence[leg], guess = march_one(
            jet, field, mode, t0[leg], tau[leg], equations, work, guess
        )
        field(mode, t0[leg] + tau[leg], u, q, ends.f_end[leg])
        for i in range(n):
            ends.z[leg, i] = u[i] if i < n_u else z0[leg, i]
            for c in range(n):
                ends.Phi[leg, i, c] = total[i, c] if i < n_u else (1.0 if i == c else 0.0)
            for c in range(n, total.shape[1]):
                ends.P[leg, i, c - n] = total[i, c] if i < n_u else 0.0


@device
def jump_at(k, t, n, equations, seen, out, work):
    """Transition k at the state in ``work``: both fields and the derivative of its map; that state is moved on."""
    field, switch = field_at(equations.functions[1]), switch_at(equations.functions[2])
    f, R, u, q = seen.fields, seen.reset, work.u, work.q
    both = seen.t_z.shape[0]
    n_a, r_z, r_t = both - n, n, n + n * n
    for i in range(both):
        f[0, i], f[1, i], f[2, i] = 0.0, 0.0, 0.0
    switch(equations.transitions[k, 3], t, u, q, out)
    field(equations.transitions[k, 0], t, u, q, f[0])
    put(out, n, u, q)
    field(equations.transitions[k, 1], t, u, q, f[1])
    for i in range(both):
        for c in range(both):
            R[i, c] = 1.0 if i == c else 0.0
        if i < n:
            f[2, i] = out[r_t + i]
            for c in range(n):
                R[i, c] = out[r_z + i * n + c]
            for c in range(n_a):
                R[i, n + c] = out[r_t + n + i * n_a + c]


@device
def instant_of(n_rows, row, scale, timing, seen, out):
    """Derivative of the instant of a transition whose ``out`` and field before are known, to ``t_z``.

    ``row``: the row of the condition that is zero, or -1: the one nearest to zero, of several that are zero the one
    that changes fastest. ``timing``: dt/dp where there are no rows. Returns the row and |h'| / (|h_z| |f|), 1 without
    rows."""
    t_z, f = seen.t_z, seen.fields[0]
    n, n_a = scale.shape[0], timing.shape[0]
    if n_rows == 0:
        for i in range(n):
            t_z[i] = 0.0
        for c in range(n_a):
            t_z[n + c] = timing[c]
        return row, 1.0
    rows, width = n + n * n + n + n * n_a, 2 + n + n_a
    given, best, steep, rate, speed = row, inf, 0.0, 0.0, 0.0
    for i in range(n):
        speed += f[i] * f[i]
    for r in range(n_rows):
        if given >= 0 and r != given:
            continue
        at = rows + r * width
        size, across, change = 0.0, 0.0, out[at + 1 + n]
        for i in range(n):
            h_z = out[at + 1 + i]
            size += fabs(h_z) * scale[i]
            change += h_z * f[i]
            across += h_z * h_z
        steepness = fabs(change) / sqrt(across * speed) if across * speed > 0.0 else inf
        distance = fabs(out[at]) / size if size > 0.0 else inf
        if distance <= NEAR:
            distance = -min(steepness, 1.0)
        if row < 0 or r == given or distance < best:
            row, best, steep, rate = r, distance, steepness, change
    at = rows + row * width
    for i in range(n):
        t_z[i] = -out[at + 1 + i] / rate
    for c in range(n_a):
        t_z[n + c] = -out[at + 2 + n + c] / rate
    return row, steep


@device
def meet_again(n_rows, scale, seen, out):
    """The instant of a transition that the motion would have met at this instant by itself: that is its own."""
    t_z, S, f, n = seen.t_z, seen.step, seen.fields, scale.shape[0]
    first, own = seen.matrix[0], seen.scratch
    for c in range(n):
        first[c] = t_z[c]
    row, steep = instant_of(n_rows, -1, scale, out[:0], seen, out)
    at = n + n * n + n + max(row, 0) * (2 + n)
    size, rate, change = 0.0, out[at + 1 + n], out[at + 1 + n]
    for i in range(n):
        h_z = out[at + 1 + i]
        size += fabs(h_z) * scale[i]
        rate += h_z * f[0, i]
        change += h_z * f[3, i]
    met = n_rows > 0 and fabs(out[at]) <= ON_SURFACE * size and change * rate > 0.0
    for c in range(n):
        own[c] = 0.0
        for j in range(n):
            own[c] += t_z[j] * S[j, c]
    for c in range(n):
        t_z[c] = own[c] if met else first[c]
    return steep if met else inf


@device
def begin(seen):
    """No transition of the instant yet."""
    for i in range(seen.step.shape[0]):
        for c in range(seen.step.shape[0]):
            seen.step[i, c] = 1.0 if i == c else 0.0


@device
def add(seen):
    """One more transition of the instant: the saltation matrix becomes that of all."""
    f, n = seen.fields, seen.t_z.shape[0]
    saltation(seen.reset, f[2], f[0], f[1], seen.t_z, n, seen.step, seen.matrix)


@kernel(types.int64(EQUATIONS, _i, _i, _f, _f1, _f1, _f1, _f1, CROSSING, _f1, STEPS))
def cross(equations, k, row, t, z, values, timing, scale, seen, out, work):
    """Transition k at (t, z), into ``seen``, by the row that is zero (-1: the nearest to zero). Returns the row.

    ``timing`` = dt/dp where the transition happens at a given phase (no rows). ``out`` is filled by ``switch``."""
    n = z.shape[0]
    for j in range(values.shape[0]):
        work.q[j] = values[j]
    put(z, n, work.u, work.q)
    jump_at(k, t, n, equations, seen, out, work)
    row, _ = instant_of(equations.transitions[k, 2], row, scale, timing, seen, out)
    begin(seen)
    add(seen)
    return row


@kernel(types.void(CROSSING))
def follow(seen):
    """A transition at the instant of those whose saltation matrix stands in ``step`` already."""
    add(seen)
