"""A frame of directions that follows a trajectory: kept orthonormal, its growth as the lengths that are divided out.

The one place where these lengths, the determinant of a transition and the derivative of transitions at one instant
are computed. Directions are the columns of Q (n, columns), in units of the states' scales.
"""

from math import fabs, inf, log, sqrt

from nonsmooth.kernels.compile.cache import inline

SINGULAR = 1e-13  # a pivot below this part of its row's size is that of a matrix without full rank


@inline
def upright(Q, n, c):
    """Column c of Q without its parts along the columns before, taken out twice; its length."""
    for _ in range(2 if c > 0 else 0):
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


@inline
def orthonormal(Q, n, columns, lengths, singular):
    """Gram-Schmidt on the columns of Q, twice; ``lengths`` are multiplied by what they had become.

    ``singular``: a transition without full rank came before, so that a column may have vanished: its length is zero for
    good, and any direction that is left goes on in its place."""
    for c in range(columns):
        before = 0.0
        for i in range(n):
            before += Q[i, c] * Q[i, c]
        length = upright(Q, n, c)
        if (singular and length <= 1e-11 * sqrt(before)) or length == 0.0:
            lengths[c] = 0.0
            best, which = -1.0, 0
            for i in range(n):  # the unit vector farthest from the columns before
                rest = 1.0
                for d in range(c):
                    rest -= Q[i, d] * Q[i, d]
                if rest > best:
                    best, which = rest, i
            for i in range(n):
                Q[i, c] = 1.0 if i == which else 0.0
            length = upright(Q, n, c)
        else:
            lengths[c] *= length
        for i in range(n):
            Q[i, c] /= length


@inline
def put_away(lengths, columns, growth):
    """Move the logarithms of the lengths to ``growth``: minus infinity for one that was lost."""
    for c in range(columns):
        growth[c] += log(lengths[c]) if lengths[c] > 0.0 else -inf
        lengths[c] = 1.0


@inline
def straighten(Q, n, columns, lengths, singular, ended, growth):
    """Make the frame orthonormal; its lengths go to ``growth`` where the unit of time has ended, or before they
    overflow."""
    orthonormal(Q, n, columns, lengths, singular)
    away = ended
    for c in range(columns):
        away = away or not (1e-100 < lengths[c] < 1e100)
    if away:
        put_away(lengths, columns, growth)


@inline
def multiply(X, Q, n, columns, scratch):
    """Q = X Q, for X in units of the scales."""
    for c in range(columns):
        for r in range(n):
            total = X[r, 0] * Q[0, c]
            for j in range(1, n):
                total += X[r, j] * Q[j, c]
            scratch[r] = total
        for r in range(n):
            Q[r, c] = scratch[r]


@inline
def log_determinant(S, n, A):
    """log|det S|, minus infinity where S has not full rank (A: scratch)."""
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


@inline
def saltation(R, R_t, f_minus, f_plus, t_z, n, S, A):
    """One more transition of an instant: S = R S + (R f- + R_t - f+) t_z (A: scratch).

    S begins as the identity; ``t_z`` is the derivative of the instant in the state before the first transition."""
    for i in range(n):
        slip = R_t[i] - f_plus[i]
        for j in range(n):
            slip += R[i, j] * f_minus[j]
        for c in range(n):
            A[i, c] = slip * t_z[c]
            for j in range(n):
                A[i, c] += R[i, j] * S[j, c]
    for i in range(n):
        for c in range(n):
            S[i, c] = A[i, c]
