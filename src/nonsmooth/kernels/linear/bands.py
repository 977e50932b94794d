"""Steps of many states that move with few others each: the Taylor series of a whole step.

The terms w, h M w, h^2 M^2 w, ... for a step h take the entries of M that are not zero, where a propagator is full:
less arithmetic, and a hundredth of the memory to be read, which counts where many modes are visited in turn. They give
w at every instant of the step, w(x h) = sum_k x^k / k! h^k M^k w, and a bound on its fourth derivative. Entries are
multiplied diagonal by diagonal (h times them in ``tables.bands``, listed in ``tables.lines``), because a diagonal's lie
behind each other and go in vectors: masses in a row have five. A mode with too many of them has none in the list, and
moves by its propagators.
"""

from nonsmooth.kernels.compile.cache import device
from nonsmooth.kernels.compile.long_sums import add_products, sum_terms
from nonsmooth.kernels.linear.tables import HARMONICS, MANY, ONE, STATES, WAVE, M

ORDER = 22  # of the series: (pi / 2)^23 / 23! is 1e-18
STEEP = ORDER + 1  # the row of ``work.row`` behind the terms: bounds on the fourth derivatives of w
WORTH = 3  # a series may take so many times the multiplications of a propagator, which is read from far away


@device
def fill_bands(mode, tables):
    """List the diagonals of a mode's matrix and the columns of its forcing, where a series costs less."""
    field, bands, lines, step = tables.field, tables.bands, tables.lines, tables.info[mode, 0]
    count, total = 0, 0
    for offset in range(1 - STATES, STATES):
        first, last = STATES, 0
        for r in range(max(0, -offset), min(STATES, STATES - offset)):
            if field[mode, r, r + offset] != 0.0:
                first, last = min(first, r), r + 1
        if first >= last:
            continue
        total += last - first + MANY
        if total * ORDER > WORTH * STATES * M:
            count = 0
            break
        count += 1
        lines[mode, count, 0], lines[mode, count, 1], lines[mode, count, 2] = offset, first, last
        for r in range(first, last):
            bands[mode, count, r] = step * field[mode, r, r + offset]
    lines[mode, 0, 0] = count
    for j in range(ONE, M):
        first, last = STATES, 0
        for r in range(STATES):
            bands[mode, STATES + j, r] = step * field[mode, r, j]
            if field[mode, r, j] != 0.0:
                first, last = min(first, r), r + 1
        lines[mode, STATES + j, 1], lines[mode, STATES + j, 2] = first, last


@device
def next_term(tables, mode, row, k):
    """row[k + 1] = h M row[k], for the states."""
    bands, lines = tables.bands, tables.lines
    for r in range(STATES):
        row[k + 1, r] = 0.0
    for d in range(1, lines[mode, 0, 0] + 1):
        add_products(row, k + 1, bands, mode, d, lines[mode, d, 0], lines[mode, d, 1], lines[mode, d, 2])
    for j in range(ONE if k == 0 else WAVE, M):
        for r in range(lines[mode, STATES + j, 1], lines[mode, STATES + j, 2]):
            row[k + 1, r] += bands[mode, STATES + j, r] * row[k, j]


@device
def expand(tables, work, mode):
    """Terms of the series on the step that begins at w, into ``work.row``, and bounds (``STEEP``)."""
    row, w, rates, step = work.row, work.w, work.rates, tables.info[mode, 0]
    for j in range(M):
        row[0, j] = w[j]
    row[0, ONE] = 1.0
    for k in range(1, ORDER + 1):
        next_term(tables, mode, row, k - 1)
        row[k, ONE] = 0.0
        for h in range(HARMONICS):
            turn_by = step * rates[h]
            row[k, WAVE + 2 * h] = -turn_by * row[k - 1, WAVE + 1 + 2 * h]
            row[k, WAVE + 1 + 2 * h] = turn_by * row[k - 1, WAVE + 2 * h]
    sum_terms(row[STEEP], row, 4, ORDER, 1.0, 1, M)
    quick = 1.0 / (step * step * step * step)
    for j in range(M):
        row[STEEP, j] *= quick


@device
def along(row, x, out):
    """w at a part x of the step, from the terms of its series."""
    sum_terms(out, row, 0, ORDER, x, 0, M)


@device
def carry(tables, work, mode, x, scale, X):
    """The columns of X, in units ``scale`` of the states, along the motion for a part x of a step."""
    row, w = work.row, work.wn
    for c in range(X.shape[1]):
        for r in range(STATES):
            row[0, r] = scale[r] * X[r, c]
        for k in range(ORDER):
            for j in range(STATES, M):
                row[k, j] = 0.0
            next_term(tables, mode, row, k)
        along(row, x, w)
        for r in range(STATES):
            X[r, c] = w[r] / scale[r]
