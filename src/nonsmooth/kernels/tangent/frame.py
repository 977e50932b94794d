"""A frame of directions that follows a trajectory: kept orthonormal, its growth as the lengths that are divided out.

The one place where these lengths, the determinant of a transition and the derivative of transitions at one instant
are computed. Directions are the columns of Q (n, columns), in units of the states' scales.
"""

from math import fabs, inf, log, sqrt

from nonsmooth.kernels.compile.cache import inline

ENOUGH = 0.25  # of the square of a length: where as much is left no part along others is
NEAR = 1e-13  # of the size of an indicator, or of the terms of a change: it is zero
ON_SURFACE = 1e-9  # of an indicator's size: nearer to a surface than this is on it
SINGULAR = 1e-13  # a row smaller than this, or a pivot below this part of its row's size: a matrix without full rank
LOST = 1e-11  # behind it a column shorter than this part of what it was has vanished


@inline
def squared(Q, n, c):
    """The square of the length of column c."""
    total = 0.0
    for i in range(n):
        total += Q[i, c] * Q[i, c]
    return total


@inline
def upright(Q, n, c, dots):
    """Column c of Q without its parts along the columns before, taken out twice where little is left; its length.

    Sums run along the rows, whose numbers lie behind each other (``dots``: scratch)."""
    length, whole = squared(Q, n, c), c - c % 4
    for _ in range(2 if c > 0 else 0):
        before = length
        for d in range(c):
            dots[d] = 0.0
        for i in range(n):
            for d in range(c):
                dots[d] += Q[i, c] * Q[i, d]
        for i in range(n):
            one, two, three, four = 0.0, 0.0, 0.0, 0.0
            for d in range(0, whole, 4):
                one += dots[d] * Q[i, d]
                two += dots[d + 1] * Q[i, d + 1]
                three += dots[d + 2] * Q[i, d + 2]
                four += dots[d + 3] * Q[i, d + 3]
            for d in range(whole, c):
                one += dots[d] * Q[i, d]
            Q[i, c] -= (one + two) + (three + four)
        length = squared(Q, n, c)
        if length > ENOUGH * before:
            break
    return sqrt(length)


@inline
def orthonormal(Q, n, columns, lengths, singular, scratch):
    """Gram-Schmidt on the columns of Q; ``lengths`` are multiplied by what they had become.

    ``singular``: columns of length 1 have passed a transition without full rank, so that some may have vanished: the
    length of such a one is zero for good, and any direction that is left goes on in its place."""
    for c in range(columns):
        before = max(squared(Q, n, c), 1.0)
        length = upright(Q, n, c, scratch)
        if (singular and length <= LOST * sqrt(before)) or length == 0.0:
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
            length = upright(Q, n, c, scratch)
        else:
            lengths[c] *= length
        for i in range(n):
            Q[i, c] /= length


@inline
def put_away(lengths, columns, growth):
    """Move the logarithms of the lengths to ``growth``: minus infinity for one that was lost."""
    for c in range(columns):
        growth[c] += -inf if lengths[c] == 0.0 else log(lengths[c])  # NaN of a transition that is met at no speed
        lengths[c] = 1.0


@inline
def straighten(Q, n, columns, lengths, singular, ended, growth, scratch):
    """Make the frame orthonormal; its lengths go to ``growth`` where the unit of time has ended, or before they
    overflow."""
    orthonormal(Q, n, columns, lengths, singular, scratch)
    away = ended
    for c in range(columns):
        away = away or not (1e-100 < lengths[c] < 1e100)
    if away:
        put_away(lengths, columns, growth)


@inline
def add_product(X, Q, n, columns, A):
    """A = A + X Q, row by row: what transitions do has few entries."""
    for r in range(n):
        for j in range(n):
            if X[r, j] != 0.0:
                for c in range(columns):
                    A[r, c] += X[r, j] * Q[j, c]


@inline
def multiply(X, Q, n, columns, A):
    """Q = X Q, for X in units of the scales (A: scratch)."""
    for r in range(n):
        for c in range(columns):
            A[r, c] = 0.0
    add_product(X, Q, n, columns, A)
    for r in range(n):
        for c in range(columns):
            Q[r, c] = A[r, c]


@inline
def log_determinant(S, n, A):
    """log|det S|, minus infinity where S, in units of the scales, has not full rank (A: scratch)."""
    total = 0.0
    for i in range(n):
        size = 0.0
        for j in range(n):
            size = max(size, fabs(S[i, j]))
        if size <= SINGULAR:
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
            for j in range(c, n if factor != 0.0 else c):
                A[i, j] -= factor * A[c, j]
    return total


@inline
def saltation(R, R_t, f_minus, f_plus, t_z, n, S, A):
    """One more transition of an instant: S = R S + (R f- + R_t - f+) t_z (A: scratch).

    S begins as the identity; ``t_z`` is the derivative of the instant in the state before the first transition."""
    for i in range(n):
        slip, size = R_t[i] - f_plus[i], fabs(R_t[i]) + fabs(f_plus[i]) + fabs(f_minus[i])
        for j in range(n):
            slip += R[i, j] * f_minus[j]
            size += fabs(R[i, j] * f_minus[j])
        for c in range(n):  # where nothing changes it does not matter when
            A[i, c] = slip * t_z[c] if fabs(slip) > NEAR * size else 0.0
    add_product(R, S, n, n, A)
    for i in range(n):
        for c in range(n):
            S[i, c] = A[i, c]
