"""Growth of small changes along a recorded trajectory of any system: what Lyapunov exponents are.

The trajectory comes in pieces: smooth motion from a recorded state to the next sample or crossing, and the transitions
at its end. On each Taylor step the frame Q is multiplied by the step's matrix X (see ``legs``), at transitions by their
saltation, and made orthonormal again; the lengths that are divided out are summed as logarithms.
"""

from math import fabs, inf, log, sqrt

from numba import types

from .cache import device, kernel
from .codes import DIVERGED, NO_CONVERGENCE, OK
from .legs import MOST_STEPS, WORK, field_at, fundamental, jet_at, put, step_end, step_for, switch_at

__all__ = ["grow"]

SINGULAR = 1e-13  # a pivot below this part of its row's size is that of a matrix without full rank

_i, _f = types.int64, types.float64
_f1, _f2, _i1, _i2 = _f[::1], _f[:, ::1], _i[::1], _i[:, ::1]


@device
def upright(Q, c):
    """Column c of Q without its parts along the columns before, taken out twice; its length."""
    n = Q.shape[0]
    for _ in range(2):
        for d in range(c):
            dot = 0.0
            for i in range(n):
                dot += Q[i, d] * Q[i, c]
            for i in range(n):
                Q[i, c] -= dot * Q[i, d]
    length = 0.0
    for i in range(n):
        length += Q[i, c] * Q[i, c]
    return sqrt(length)


@device
def orthonormal(Q, growth, singular):
    """Gram-Schmidt on the columns of Q, twice; ``growth`` gains the logarithms of their lengths.

    ``singular``: a transition without full rank came before, so that a column may have vanished: it has no growth but
    minus infinity, and any direction that is left goes on in its place."""
    n, k = Q.shape
    for c in range(k):
        before = 0.0
        for i in range(n):
            before += Q[i, c] * Q[i, c]
        length = upright(Q, c)
        if singular and length <= 1e-11 * max(sqrt(before), 1e-300):
            growth[c] = -inf
            best, which = -1.0, 0
            for i in range(n):  # the unit vector farthest from the columns before
                rest = 1.0
                for d in range(c):
                    rest -= Q[i, d] * Q[i, d]
                if rest > best:
                    best, which = rest, i
            for i in range(n):
                Q[i, c] = 1.0 if i == which else 0.0
            length = upright(Q, c)
        else:
            growth[c] += log(length)
        for i in range(n):
            Q[i, c] /= length


@device
def log_determinant(S, A):
    """log|det S|, minus infinity where S has not full rank (A: scratch)."""
    n = S.shape[0]
    total = 0.0
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, fabs(S[i, j]))
        if size == 0.0:
            return -inf
        total += log(size)
        for j in range(n):
            A[i, j] = S[i, j] / size
    for c in range(n):
        p = c
        for i in range(c + 1, n):
            if fabs(A[i, c]) > fabs(A[p, c]):
                p = i
        if fabs(A[p, c]) <= SINGULAR:
            return -inf
        total += log(fabs(A[p, c]))
        for j in range(c, n):
            A[c, j], A[p, j] = A[p, j], A[c, j]
        for i in range(c + 1, n):
            factor = A[i, c] / A[c, c]
            for j in range(c, n):
                A[i, j] -= factor * A[c, j]
    return total


@device
def frame_along(jet, mode, t0, tau, entries, kinds, n_u, u, q, Q, Y, scale, growth, work, guess):
    """March u and the frame (in units of ``scale``) over the time tau: (status, integral of div f, next guess)."""
    C, W, D, X = work[:4]
    powers = work[6]
    n, k, order = Q.shape[0], Q.shape[1], D.shape[2] - 1
    done, divergence = 0.0, 0.0
    for _ in range(MOST_STEPS):
        remaining = tau - done
        if remaining <= 0.0:
            return OK, divergence, guess
        jet(mode, order, t0 + done, u, q, C, W)
        fundamental(C, entries, kinds, mode, n_u, D)
        h = step_for(C, D, n_u, remaining, guess, powers)
        if not (h > 1e-15 * tau):
            return DIVERGED, divergence, guess
        if h < remaining:
            guess = h
        divergence += step_end(C, D, entries, kinds, mode, n_u, h, u, X)
        for i in range(n_u):
            for c in range(k):
                Y[i, c] = 0.0
            for j in range(n):
                x = X[i, j] * scale[j] / scale[i]
                for c in range(k):
                    Y[i, c] += x * Q[j, c]
        for i in range(n_u):
            for c in range(k):
                Q[i, c] = Y[i, c]
        orthonormal(Q, growth, False)
        done = tau if h >= remaining else done + h
    return NO_CONVERGENCE, divergence, guess


@kernel(
    types.int64(
        _i1, _i2, _i2, _i2, _i1, _f1, _f1, _f2, _i1, _i1, _i1, _f2, _f1, _f1, _f2, _f2, _f2, _f2, _f2, _f1, _f1, _f1,
        _f1, WORK,
    )
)  # fmt: skip
def grow(
    functions, entries, kinds, transitions, modes, t0, tau, z0, unit, first_jump, jumps, before, values, scale,
    Q, Y, S, A, growth, divergence, determinant, out, rates, work,
):  # fmt: skip
    """The pieces of a trajectory one after the other, with the frame Q (n, columns). Returns a status.

    Piece m runs in ``modes[m]`` from ``z0[m]`` at ``t0[m]`` for ``tau[m]``; at its end stand the transitions
    ``jumps[first_jump[m] : first_jump[m + 1]]``, the first of them taken from the state ``before[m]``. ``growth``,
    ``divergence`` and ``determinant`` (log|det S|) are summed in the rows ``unit[m]``. ``transitions``: source, target,
    number of rows. ``rates``: the least |h'| / (|h_z| |f|), the largest distance between the end of a piece and the
    record (relative to the state and its scale), and scratch (3 n)."""
    jet, field, switch = jet_at(functions[0]), field_at(functions[1]), switch_at(functions[2])
    u, q = work[7], work[8]
    n, n_u, n_p, columns = z0.shape[1], u.shape[0], values.shape[0], Q.shape[1]
    guess = inf
    for j in range(n_p):
        q[j] = values[j]
    for m in range(modes.shape[0]):
        row = unit[m]
        put(z0[m], n, n_p, u, q)
        if guess == inf and tau[m] > 0.0:
            guess = tau[m]
        status, part, guess = frame_along(
            jet, modes[m], t0[m], tau[m], entries, kinds, n_u, u, q, Q, Y, scale, growth[row], work, guess
        )
        if status != OK:
            return status
        divergence[row] += part
        crossed = first_jump[m + 1] > first_jump[m]
        if crossed or m + 1 < modes.shape[0]:
            recorded = before[m] if crossed else z0[m + 1]
            for i in range(n_u):
                rates[1] = max(rates[1], fabs(u[i] - recorded[i]) / (fabs(recorded[i]) + scale[i]))
        if first_jump[m + 1] == first_jump[m]:
            continue
        t = t0[m] + tau[m]
        f_minus, f_plus, t_z = rates[2 : 2 + n], rates[2 + n : 2 + 2 * n], rates[2 + 2 * n : 2 + 3 * n]
        for i in range(n):
            f_minus[i], f_plus[i] = 0.0, 0.0
            for c in range(n):
                S[i, c] = 1.0 if i == c else 0.0
        put(before[m], n, n_p, u, q)
        for at in range(first_jump[m], first_jump[m + 1]):
            k = jumps[at]
            switch(k, t, u, q, out)
            field(transitions[k, 0], t, u, q, f_minus)
            if at == first_jump[m]:
                for i in range(n):
                    t_z[i] = 0.0
                best = inf
                for r in range(transitions[k, 2]):
                    place = 2 * n + n * n + r * (2 + n)
                    size, rate, norm, speed = 0.0, out[place + 1 + n], 0.0, 0.0
                    for i in range(n):
                        size += fabs(out[place + 1 + i]) * scale[i]
                        rate += out[place + 1 + i] * f_minus[i]
                        norm += out[place + 1 + i] * out[place + 1 + i]
                        speed += f_minus[i] * f_minus[i]
                    if fabs(out[place]) / size < best:
                        best = fabs(out[place]) / size
                        for i in range(n):
                            t_z[i] = -out[place + 1 + i] / rate
                        distance = fabs(rate) / sqrt(norm * speed) if speed > 0.0 else inf
                if best < inf:
                    rates[0] = min(rates[0], distance)
            put(out, n, n_p, u, q)
            field(transitions[k, 1], t, u, q, f_plus)
            for i in range(n):
                slip = out[n + n * n + i] - f_plus[i]
                for j in range(n):
                    slip += out[n + i * n + j] * f_minus[j]
                for c in range(n):
                    A[i, c] = slip * t_z[c]
                    for j in range(n):
                        A[i, c] += out[n + i * n + j] * S[j, c]
            for i in range(n):
                for c in range(n):
                    S[i, c] = A[i, c]
        for i in range(n):
            for c in range(n):
                S[i, c] *= scale[c] / scale[i]
        size = log_determinant(S, A)
        determinant[row] += size
        for i in range(n):
            for c in range(columns):
                Y[i, c] = 0.0
                for j in range(n):
                    Y[i, c] += S[i, j] * Q[j, c]
        for i in range(n):
            for c in range(columns):
                Q[i, c] = Y[i, c]
        orthonormal(Q, growth[row], size == -inf)
    return OK
