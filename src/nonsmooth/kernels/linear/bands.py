"""Steps of many states that move with few others each: the Taylor series of a whole step.

The terms w, h M w, h^2 M^2 w, ... for a step h take the entries of M that are not zero, where a propagator is full:
less arithmetic, and a hundredth of the memory to be read, which counts where many modes are visited in turn. They give
w at every instant of the step, w(x h) = sum_k x^k / k! h^k M^k w, and a bound on its fourth derivative. Entries are
multiplied diagonal by diagonal (h times them in ``tables.bands``, listed in ``tables.lines``), because a diagonal's lie
behind each other and go in vectors: masses in a row have five. A mode with too many of them has none in the list, and
moves by its propagators.
"""

from nonsmooth.kernels.compile.cache import device, inline
from nonsmooth.kernels.linear.sums import add_products, at, sum_sizes, sum_terms
from nonsmooth.kernels.linear.tables import states_of, width_of

BANDED = 32  # states from which on few entries make a series shorter than a propagator
LINE = 8  # entries that a diagonal costs before its first
ORDER = 22  # of the series: (pi / 2)^23 / 23! is 1e-18
STEEP = ORDER + 1  # the row of ``work.row`` behind the terms: bounds on the fourth derivatives of w
WORTH = 3  # a series may take so many times the multiplications of a propagator, which is read from far away


@inline
def by_series(tables, mode):
    """Return whether the mode moves by the series of its whole step (asked only where the number of states varies)."""
    return tables.lines[mode, 0, 0] > 0


@device
def fill_bands(mode, tables):
    """List the diagonals of a mode's matrix and the columns of its forcing, where a series costs less."""
    n, m = states_of(tables.field), width_of(tables.field)
    field, bands, lines, step = tables.field, tables.bands, tables.lines, tables.info[mode, 0]
    count, total = 0, 0
    for offset in range(1 - n, n):
        first, last = n, 0
        for r in range(max(0, -offset), min(n, n - offset)):
            if field[mode, r, r + offset] != 0.0:
                first, last = min(first, r), r + 1
        if first >= last:
            continue
        total += last - first + LINE
        if total * ORDER > WORTH * n * m:
            count = 0
            break
        count += 1
        lines[mode, count, 0], lines[mode, count, 1], lines[mode, count, 2] = offset, first, last
        for r in range(first, last):
            bands[mode, count, r] = step * field[mode, r, r + offset]
    lines[mode, 0, 0] = count
    for j in range(n, m):
        first, last = n, 0
        for r in range(n):
            bands[mode, n + j, r] = step * field[mode, r, j]
            if field[mode, r, j] != 0.0:
                first, last = min(first, r), r + 1
        lines[mode, n + j, 1], lines[mode, n + j, 2] = first, last


@device
def next_term(tables, mode, row, k):
    """row[k + 1] = h M row[k], for the states."""
    n, m = states_of(tables.field), width_of(tables.field)
    bands, lines = tables.bands, tables.lines
    for r in range(n):
        row[k + 1, r] = 0.0
    for d in range(1, lines[mode, 0, 0] + 1):
        factors, from_ = at(bands, (mode * (n + m) + d) * n), at(row, k * row.shape[1] + lines[mode, d, 0])
        add_products(at(row, (k + 1) * row.shape[1]), factors, from_, lines[mode, d, 1], lines[mode, d, 2])
    for j in range(n if k == 0 else n + 1, m):
        for r in range(lines[mode, n + j, 1], lines[mode, n + j, 2]):
            row[k + 1, r] += bands[mode, n + j, r] * row[k, j]


@device
def expand(tables, work, mode):
    """Terms of the series on the step that begins at w, into ``work.row``, and bounds (``STEEP``)."""
    n, m = states_of(tables.field), width_of(tables.field)
    harmonics = (m - n - 1) >> 1
    row, w, rates, step = work.row, work.w, work.rates, tables.info[mode, 0]
    for j in range(m):
        row[0, j] = w[j]
    row[0, n] = 1.0
    for k in range(1, ORDER + 1):
        next_term(tables, mode, row, k - 1)
        row[k, n] = 0.0
        for h in range(harmonics):
            turn_by = step * rates[h]
            row[k, n + 1 + 2 * h] = -turn_by * row[k - 1, n + 2 + 2 * h]
            row[k, n + 2 + 2 * h] = turn_by * row[k - 1, n + 1 + 2 * h]
    sum_sizes(at(row, STEEP * row.shape[1]), at(row, 0), row.shape[1], 4, ORDER, m)
    quick = 1.0 / (step * step * step * step)
    for j in range(m):
        row[STEEP, j] *= quick


@device
def along(row, x, m, out):
    """w at a part x of the step, from the terms of its series."""
    sum_terms(at(out, 0), at(row, 0), row.shape[1], 0, ORDER, x, m)


@device
def carry(tables, work, mode, x, scale, X):
    """The columns of X, in units ``scale`` of the states, along the motion for a part x of a step."""
    n, m = states_of(tables.field), width_of(tables.field)
    row, w = work.row, work.wn
    for c in range(X.shape[1]):
        for r in range(n):
            row[0, r] = scale[r] * X[r, c]
        for k in range(ORDER):
            for j in range(n, m):
                row[k, j] = 0.0
            next_term(tables, mode, row, k)
        along(row, x, m, w)
        for r in range(n):
            X[r, c] = w[r] / scale[r]
