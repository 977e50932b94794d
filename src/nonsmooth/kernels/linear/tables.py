"""Tables of one parameter point of a piecewise-linear system with harmonic forcing, for any number of states.

In a mode u' = A u + b + sum_h (c_h cos k_h w t + s_h sin k_h w t). With w = (u_1, ..., u_n, 1, cos k_1 w t,
sin k_1 w t, ...) this is w' = M w, whose flow exp(M tau) needs no eigenvectors: singular, defective and resonant
matrices are no special case. ``build.build`` sums the Taylor series of the upper n rows of exp(M tau) at 33 equidistant
nodes of a step that is a quarter of the mode's fastest period.

These files become two modules (``assembly``): one in which the numbers of states and harmonics are constants, so
that every inner loop has constant bounds, and one for all other numbers, which are then those of the tables. With n
states, the last of them memory, and h harmonics w has m = n + 1 + 2 h entries: w[n] = 1, w[n + 1 + 2 h] a cosine, w[n +
2 + 2 h] its sine. Arrays (functionals = indicators, states, affine outputs):
    prop[mode, node, m, n]         columns of the states' rows at the node, to be applied to w at the step's start; n
                                   is filled up to whole vectors where it varies
    rot[mode, node, 2 H + 1]       cos and sin of k_h w tau
    fun[mode, functional, 2 (m + n + 1)]  row of the value, row of the slope, then k_1, ..., k_n, k: on a step that
                                   starts at u the fourth derivative is below sum_j k_j |u_j - u_eq_j| + k; last
                                   (before it scratch) the sums of value and slope row without signs
    tay[mode, functional, m, 8]    columns of the normalised Taylor coefficients of the functional: coefficient k
                                   at w is the sum over j of tay[mode, f, j, k] w[j]
    field[mode, n, m]              rows of u'
    info[mode, 2 + n]              step, node spacing, u_eq
    bands[mode, n + m, n]          of many states with few entries, which have no propagators: from place 1 on the
                                   diagonals of A, from 2 n on the columns of what is not a state; see ``bands``
    lines[mode, n + m, 3]          how many diagonals (0: propagators); of each its offset, its first row and the row
                                   behind its last; of each column these two
    some[mode, functional, 2, m + 1]  where n varies: how many columns of the Taylor rows are not zero, and which; and
                                   of the states in value and slope
"""

from math import cos, fabs, sin, sqrt

from nonsmooth.kernels.compile.cache import device, inline
from nonsmooth.kernels.linear.sums import at, dot

STATES = 2  # 0: as many as the tables have
HARMONICS = 1
VECTORS = 0  # read by the compiler (``compile.target``): loops are short here, and long ones stand in ``sums``
NODES = 32
TERMS = 26
GROUP = 8  # nodes up to here, and its multiples, by their own series
FEWER_TERMS = 18  # enough within the first GROUP nodes
DEGREE = 7  # of the Taylor polynomials: within 3/4 of a node spacing the remainder is below 1e-16 of the amplitude
STEP_ANGLE = 1.5707963267948966  # 2 pi / 4: longer is faster, but the polynomials of degree 7 would not reach
FREE_STEP = 1.0  # a mode without a time scale of its own moves on polynomials: any step is exact


@inline
def states_of(table):
    """The number of states, by a table whose second index counts them."""
    return STATES if STATES > 0 else table.shape[1]


@inline
def width_of(field):
    """The length of w."""
    return STATES + 1 + 2 * HARMONICS if STATES > 0 else field.shape[2]


@inline
def sizes_at(n, m):
    """The place in fun of the sums of value and slope row without signs."""
    return 2 * (n + m)


@device
def fastest_rate(A, row):
    """The largest |eigenvalue| of two states; of more a bound on it (``row`` is scratch)."""
    n = states_of(A)
    if n == 2:
        half = 0.5 * (A[0, 0] + A[n - 1, n - 1])
        det = A[0, 0] * A[n - 1, n - 1]
        det -= A[0, n - 1] * A[n - 1, 0]
        disc = half * half - det
        return fabs(half) + sqrt(disc) if disc >= 0.0 else sqrt(fabs(det))
    return balanced_norm(A, row)


@device
def balanced_norm(A, row):
    """The largest sum of a row of |A| after a scaling of the states that makes each row as large as its column.

    What only leads one way can be scaled away altogether."""
    n = states_of(A)
    for r in range(n):
        for j in range(n):
            row[r, j] = fabs(A[r, j])
    for _ in range(4):
        for k in range(n):
            across = -row[k, k]
            down = -row[k, k]
            for j in range(n):
                across += row[k, j]
                down += row[j, k]
            kept = row[k, k]
            factor = sqrt(across / down) if across > 0.0 and down > 0.0 else 0.0
            for j in range(n):
                row[k, j] = row[k, j] / factor if factor > 0.0 else 0.0
                row[j, k] *= factor
            row[k, k] = kept
    largest = 0.0
    for r in range(n):
        total = 0.0
        for j in range(n):
            total += row[r, j]
        largest = max(largest, total)
    return largest


@device
def find_equilibrium(A, b, row, info):
    """The solution of A u + b = 0 into info[2:], by elimination in ``row``; the origin where A is singular."""
    n = states_of(A)
    for r in range(n):
        info[2 + r] = 0.0
        moved = b[r] != 0.0
        for j in range(n):
            row[r, j] = A[r, j]
            moved = moved or A[r, j] != 0.0
        row[r, n] = -b[r]
        if not moved:  # memory, or a state that the mode lacks
            row[r, r] = 1.0
    for k in range(n):
        best = k
        size = 0.0
        for r in range(k, n):
            if fabs(row[r, k]) > fabs(row[best, k]):
                best = r
        for j in range(n):
            size = max(size, fabs(A[best, j]))
        if not (fabs(row[best, k]) > 1e-9 * size):
            return
        for j in range(k, n + 1):
            kept = row[k, j]
            row[k, j] = row[best, j]
            row[best, j] = kept
        for r in range(k + 1, n):
            factor = row[r, k] / row[k, k]
            for j in range(k, n + 1):
                row[r, j] -= factor * row[k, j]
    for k in range(n - 1, -1, -1):
        total = row[k, n]
        for j in range(k + 1, n):
            total -= row[k, j] * info[2 + j]
        info[2 + k] = total / row[k, k]


@inline
def times_generator(row, k, field, mode, rates, scale):
    """row[k + 1] = scale * row[k] M, for the generator M of the mode."""
    n, m = states_of(field), width_of(field)
    harmonics = (m - n - 1) >> 1
    if STATES > 0:
        for j in range(m):
            total = row[k, 0] * field[mode, 0, j]
            for r in range(1, n):
                total += row[k, r] * field[mode, r, j]
            row[k + 1, j] = scale * total
    else:
        for j in range(m):
            row[k + 1, j] = 0.0
        for r in range(n):
            factor = scale * row[k, r]
            if factor != 0.0:
                for j in range(m):
                    row[k + 1, j] += factor * field[mode, r, j]
    for h in range(harmonics):
        rate = scale * rates[h]
        row[k + 1, n + 1 + 2 * h] += rate * row[k, n + 2 + 2 * h]
        row[k + 1, n + 2 + 2 * h] -= rate * row[k, n + 1 + 2 * h]


@device
def fill_mode(i, given, mode, form, tables, rates, row):
    """The states' rows of M; step, node spacing and equilibrium (the origin where the matrix is singular).

    ``given`` is the mode's place in ``form``."""
    n, m = states_of(tables.field), width_of(tables.field)
    harmonics = (m - n - 1) >> 1
    field, info, period = tables.field, tables.info, form.period[i]
    for r in range(n):
        for j in range(n):
            field[mode, r, j] = form.A[i, given, r, j]
        field[mode, r, n] = form.b[i, given, r]
        for h in range(harmonics):
            field[mode, r, n + 1 + 2 * h] = form.c[i, given, h, r]
            field[mode, r, n + 2 + 2 * h] = form.s[i, given, h, r]
    rate = fastest_rate(form.A[i, given], row)
    for h in range(harmonics):
        rate = max(rate, rates[h])
    if rate > 0.0:
        step = STEP_ANGLE / rate
    elif period < 1e300:
        step = period / 8.0
    else:
        step = FREE_STEP
    if period < 1e300:  # at most one end of a period on a step, also where nothing but transitions depends on time
        step = min(step, 0.3 * period)
    info[mode, 0] = step
    info[mode, 1] = step / NODES


@device
def fill_turns(mode, rates, spacing, rot):
    """Cosines and sines of the forcing's phase at the nodes."""
    for node in range(NODES + 1):
        for h in range(HARMONICS if STATES > 0 else rates.shape[0]):
            angle = rates[h] * node * spacing
            rot[mode, node, 2 * h] = cos(angle)
            rot[mode, node, 2 * h + 1] = sin(angle)


@device
def fill_propagators(mode, field, rates, spacing, prop, rot, row):
    """Rows of exp(M tau) at the nodes: by Horner's rule from the smallest term in the first ``GROUP`` nodes and at its
    multiples, elsewhere as the product of two of these."""
    n, m = states_of(field), width_of(field)
    harmonics = (m - n - 1) >> 1
    for r in range(n):
        for j in range(m):
            row[0, j] = 1.0 if j == r else 0.0
        for k in range(TERMS):
            times_generator(row, k, field, mode, rates, 1.0 / (k + 1))
        for node in range(NODES + 1):
            if node > GROUP and node % GROUP != 0:
                continue
            terms = TERMS if node >= GROUP else FEWER_TERMS
            tau = node * spacing
            for j in range(m):
                total = row[terms, j]
                for k in range(terms - 1, -1, -1):
                    total = total * tau + row[k, j]
                prop[mode, node, j, r] = total
    for node in range(NODES + 1):
        first = node % GROUP
        base = node - first
        if first == 0 or base == 0:
            continue
        for j in range(m):
            for r in range(n):
                prop[mode, node, j, r] = prop[mode, base, 0, r] * prop[mode, first, j, 0]
            for q in range(1, n):
                for r in range(n):
                    prop[mode, node, j, r] += prop[mode, base, q, r] * prop[mode, first, j, q]
        for r in range(n):
            prop[mode, node, n, r] += prop[mode, base, n, r]
            for h in range(harmonics):
                c1, s1 = rot[mode, first, 2 * h], rot[mode, first, 2 * h + 1]
                ec, es = prop[mode, base, n + 1 + 2 * h, r], prop[mode, base, n + 2 + 2 * h, r]
                prop[mode, node, n + 1 + 2 * h, r] += ec * c1 + es * s1
                prop[mode, node, n + 2 + 2 * h, r] += es * c1 - ec * s1


@inline
def column(n, row, k, prop, mode, node, j):
    """Entry j of row[k] exp(M tau) at a node, without what the harmonics of row[k] add."""
    if STATES == 0:
        place = ((mode * (NODES + 1) + node) * prop.shape[2] + j) * prop.shape[3]
        return dot(at(row, k * row.shape[1]), at(prop, place), n)
    total = row[k, 0] * prop[mode, node, j, 0]
    for r in range(1, n):
        total += row[k, r] * prop[mode, node, j, r]
    return total


@device
def bound_of(row, k, mode, every, tables, out, at):
    """Largest |entries| over each ``every``-th node of row[k] exp(M tau) into out[at:]: of each state, of the rest."""
    n, m = states_of(tables.field), width_of(tables.field)
    harmonics = (m - n - 1) >> 1
    prop, rot = tables.prop, tables.rot
    for j in range(n + 1):
        out[at + j] = 0.0
    for node in range(0, NODES + 1, every):
        rest = column(n, row, k, prop, mode, node, n) + row[k, n]
        for j in range(n):
            entry = column(n, row, k, prop, mode, node, j)
            out[at + j] = max(out[at + j], fabs(entry))
            rest += entry * tables.info[mode, 2 + j]
        rest = fabs(rest)
        for h in range(harmonics):
            bc = row[k, n + 1 + 2 * h]
            bs = row[k, n + 2 + 2 * h]
            cos_ = rot[mode, node, 2 * h]
            sin_ = rot[mode, node, 2 * h + 1]
            ec = column(n, row, k, prop, mode, node, n + 1 + 2 * h) + bc * cos_ + bs * sin_
            es = column(n, row, k, prop, mode, node, n + 2 + 2 * h) - bc * sin_ + bs * cos_
            rest += sqrt(ec * ec + es * es)
        out[at + n] = max(out[at + n], rest)
