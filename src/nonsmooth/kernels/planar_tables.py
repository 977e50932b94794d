"""Tables of one parameter point of a planar piecewise-linear system with harmonic forcing.

In a mode u' = A u + b + sum_h (c_h cos k_h w t + s_h sin k_h w t). With w = (x, v, 1, cos k_1 w t, sin k_1 w t,
...) this is w' = M w, whose flow exp(M tau) needs no eigenvectors: singular, defective and resonant matrices are
no special case. ``build`` sums the Taylor series of the upper two rows of exp(M tau) at 33 equidistant nodes of
a step that is a quarter of the mode's fastest period.

The planar files become one generated module for each number of harmonics (``planar_module``), so that
every inner loop has constant bounds. Arrays (M columns of w, functionals = indicators, two states, affine outputs):
    prop[mode, node, 2, M]         rows of x and v at the node, to be applied to w at the step's start
    rot[mode, node, 2 H + 1]       cos and sin of k_h w tau
    fun[mode, functional, 2 M + 6] row of the value, row of the slope, then k0, k1, k2 (and scratch): on a step that
                                   starts at (x, v) the fourth derivative is below k0 |x - x_eq| + k1 |v - v_eq| + k2
    tay[mode, functional, M, 8]    columns of the normalised Taylor coefficients of the functional: coefficient k
                                   at w is the sum over j of tay[mode, f, j, k] w[j]
    field[mode, 2, M]              rows of x' and v'
    info[mode, 4]                  step, node spacing, x_eq, v_eq
"""

from math import cos, fabs, sin, sqrt

from .cache import device, inline

HARMONICS = 1
M = 3 + 2 * HARMONICS
NODES = 32
TERMS = 26
GROUP = 8  # nodes up to here, and its multiples, by their own series
FEWER_TERMS = 18  # enough within the first GROUP nodes
DEGREE = 7  # of the Taylor polynomials: within 3/4 of a node spacing the remainder is below 1e-16 of the amplitude
STEP_ANGLE = 1.5707963267948966  # 2 pi / 4: longer is faster, but the polynomials of degree 7 would not reach
FREE_STEP = 1.0  # a mode without a time scale of its own moves on polynomials: any step is exact


@device
def fastest_rate(a00, a01, a10, a11, forcing):
    """The largest |eigenvalue| of the 2x2 matrix, or the fastest forcing frequency where that is larger."""
    half = 0.5 * (a00 + a11)
    det = a00 * a11 - a01 * a10
    disc = half * half - det
    rate = fabs(half) + sqrt(disc) if disc >= 0.0 else sqrt(fabs(det))
    return max(rate, forcing)


@inline
def times_generator(row, k, field, mode, rates, scale):
    """row[k + 1] = scale * row[k] M, for the generator M of the mode."""
    for j in range(M):
        row[k + 1, j] = scale * (row[k, 0] * field[mode, 0, j] + row[k, 1] * field[mode, 1, j])
    for h in range(HARMONICS):
        rate = scale * rates[h]
        row[k + 1, 3 + 2 * h] += rate * row[k, 4 + 2 * h]
        row[k + 1, 4 + 2 * h] -= rate * row[k, 3 + 2 * h]


@device
def fill_mode(i, mode, A, b, c, s, rates, period, field, info):
    """The upper two rows of M; step, node spacing and equilibrium (the origin where the matrix is singular)."""
    for r in range(2):
        field[mode, r, 0] = A[i, mode, r, 0]
        field[mode, r, 1] = A[i, mode, r, 1]
        field[mode, r, 2] = b[i, mode, r]
        for h in range(HARMONICS):
            field[mode, r, 3 + 2 * h] = c[i, mode, h, r]
            field[mode, r, 4 + 2 * h] = s[i, mode, h, r]
    a00 = A[i, mode, 0, 0]
    a01 = A[i, mode, 0, 1]
    a10 = A[i, mode, 1, 0]
    a11 = A[i, mode, 1, 1]
    forcing = 0.0
    for h in range(HARMONICS):
        forcing = max(forcing, rates[h])
    rate = fastest_rate(a00, a01, a10, a11, forcing)
    if rate > 0.0:
        step = STEP_ANGLE / rate
    elif period < 1e300:
        step = period / 8.0
    else:
        step = FREE_STEP
    if period < 1e300:  # at most one end of a period on a step, also where nothing but transitions depends on time
        step = min(step, 0.3 * period)
    det = a00 * a11 - a01 * a10
    info[mode, 0] = step
    info[mode, 1] = step / NODES
    info[mode, 2] = 0.0
    info[mode, 3] = 0.0
    if fabs(det) > 1e-9 * (fabs(a00) * fabs(a11) + fabs(a01) * fabs(a10)):
        info[mode, 2] = -(a11 * b[i, mode, 0] - a01 * b[i, mode, 1]) / det
        info[mode, 3] = -(a00 * b[i, mode, 1] - a10 * b[i, mode, 0]) / det


@device
def fill_propagators(mode, field, rates, spacing, prop, rot, row):
    """Rows of exp(M tau) at the nodes: by Horner's rule from the smallest term in the first ``GROUP`` nodes and at its
    multiples, elsewhere as the product of two of these."""
    for r in range(2):
        for j in range(M):
            row[0, j] = 1.0 if j == r else 0.0
        for k in range(TERMS):
            times_generator(row, k, field, mode, rates, 1.0 / (k + 1))
        for node in range(NODES + 1):
            if node > GROUP and node % GROUP != 0:
                continue
            terms = TERMS if node >= GROUP else FEWER_TERMS
            tau = node * spacing
            for j in range(M):
                prop[mode, node, r, j] = row[terms, j]
            for k in range(terms - 1, -1, -1):
                for j in range(M):
                    prop[mode, node, r, j] = prop[mode, node, r, j] * tau + row[k, j]
    for node in range(NODES + 1):
        first = node % GROUP
        base = node - first
        if first == 0 or base == 0:
            for h in range(HARMONICS):
                angle = rates[h] * node * spacing
                rot[mode, node, 2 * h] = cos(angle)
                rot[mode, node, 2 * h + 1] = sin(angle)
            continue
        for h in range(HARMONICS):
            c, s = rot[mode, base, 2 * h], rot[mode, base, 2 * h + 1]
            c1, s1 = rot[mode, first, 2 * h], rot[mode, first, 2 * h + 1]
            rot[mode, node, 2 * h] = c * c1 - s * s1
            rot[mode, node, 2 * h + 1] = s * c1 + c * s1
        for r in range(2):
            e0 = prop[mode, base, r, 0]
            e1 = prop[mode, base, r, 1]
            for j in range(M):
                prop[mode, node, r, j] = e0 * prop[mode, first, 0, j] + e1 * prop[mode, first, 1, j]
            prop[mode, node, r, 2] += prop[mode, base, r, 2]
            for h in range(HARMONICS):
                c1, s1 = rot[mode, first, 2 * h], rot[mode, first, 2 * h + 1]
                ec, es = prop[mode, base, r, 3 + 2 * h], prop[mode, base, r, 4 + 2 * h]
                prop[mode, node, r, 3 + 2 * h] += ec * c1 + es * s1
                prop[mode, node, r, 4 + 2 * h] += es * c1 - ec * s1


@device
def bound_of(row, k, mode, every, prop, rot, x_eq, v_eq, out, at):
    """Largest |entries| over each ``every``-th node of row[k] exp(M tau): into out[at:at+3] (x, v, all the rest)."""
    b0 = row[k, 0]
    b1 = row[k, 1]
    most0 = most1 = most = 0.0
    for node in range(0, NODES + 1, every):
        e0 = b0 * prop[mode, node, 0, 0] + b1 * prop[mode, node, 1, 0]
        e1 = b0 * prop[mode, node, 0, 1] + b1 * prop[mode, node, 1, 1]
        rest = fabs(
            b0 * prop[mode, node, 0, 2] + b1 * prop[mode, node, 1, 2] + row[k, 2] + e0 * x_eq + e1 * v_eq
        )
        for h in range(HARMONICS):
            bc = row[k, 3 + 2 * h]
            bs = row[k, 4 + 2 * h]
            cos_ = rot[mode, node, 2 * h]
            sin_ = rot[mode, node, 2 * h + 1]
            ec = b0 * prop[mode, node, 0, 3 + 2 * h] + b1 * prop[mode, node, 1, 3 + 2 * h] + bc * cos_ + bs * sin_
            es = b0 * prop[mode, node, 0, 4 + 2 * h] + b1 * prop[mode, node, 1, 4 + 2 * h] - bc * sin_ + bs * cos_
            rest += sqrt(ec * ec + es * es)
        most0 = max(most0, fabs(e0))
        most1 = max(most1, fabs(e1))
        most = max(most, rest)
    out[at] = most0
    out[at + 1] = most1
    out[at + 2] = most


@device
def fill_functional(mode, f, field, rates, info, prop, rot, fun, tay, row):
    """Taylor rows, slope row and fourth-derivative bound of the functional whose value row stands in fun[mode, f]."""
    for j in range(M):
        row[0, j] = fun[mode, f, j]
    scale = 1.0
    for k in range(DEGREE + 1):
        for j in range(M):
            tay[mode, f, j, k] = scale * row[k, j]
        times_generator(row, k, field, mode, rates, 1.0)
        scale /= k + 1
    for j in range(M):
        fun[mode, f, M + j] = row[1, j]
    at = 2 * M
    bound_of(row, 4, mode, 1, prop, rot, info[mode, 2], info[mode, 3], fun[mode, f], at)
    bound_of(row, 5, mode, 4, prop, rot, info[mode, 2], info[mode, 3], fun[mode, f], at + 3)
    for j in range(3):  # between two nodes the entries move by at most half a spacing times their slope
        fun[mode, f, at + j] += 0.7 * info[mode, 1] * fun[mode, f, at + 3 + j]


@device
def build(i, A, b, c, s, rates, period, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row):
    """Fill the tables for parameter point ``i``."""
    n_i = ia.shape[1]
    for mode in range(A.shape[1]):
        fill_mode(i, mode, A, b, c, s, rates, period, field, info)
        fill_propagators(mode, field, rates, info[mode, 1], prop, rot, row)
        for f in range(fun.shape[1]):
            for j in range(M):
                fun[mode, f, j] = 0.0
            if f < n_i:
                fun[mode, f, 0] = ia[i, f, 0]
                fun[mode, f, 1] = ia[i, f, 1]
                fun[mode, f, 2] = ib[i, f]
                for h in range(HARMONICS):
                    fun[mode, f, 3 + 2 * h] = ic[i, f, h]
                    fun[mode, f, 4 + 2 * h] = is_[i, f, h]
            elif f < n_i + 2:
                fun[mode, f, f - n_i] = 1.0
            else:
                o = f - n_i - 2
                fun[mode, f, 0] = oa[i, o, mode, 0]
                fun[mode, f, 1] = oa[i, o, mode, 1]
                fun[mode, f, 2] = ob[i, o, mode]
                for h in range(HARMONICS):
                    fun[mode, f, 3 + 2 * h] = oc[i, o, mode, h]
                    fun[mode, f, 4 + 2 * h] = os_[i, o, mode, h]
            fill_functional(mode, f, field, rates, info, prop, rot, fun, tay, row)
