"""Steps of many states that move with few others each: the Taylor series of a whole step.

The coefficients w, M w, M^2 w / 2, ... take the entries of M that are not zero, where a propagator is full: less
arithmetic, and a hundredth of the memory to be read, which counts where many modes are visited in turn. They give w at
every instant of the step, and a bound on its fourth derivative. Entries are multiplied diagonal by diagonal
(``tables.bands``, listed in ``tables.lines``), because a diagonal's lie behind each other and go in vectors: masses in
a row have five. A mode with too many of them has none in the list, and moves by its propagators.
"""

from math import fabs

from nonsmooth.kernels.compile.cache import device
from nonsmooth.kernels.compile.lanes import add_products
from nonsmooth.kernels.linear.tables import HARMONICS, MANY, ONE, STATES, WAVE, M

ORDER = 24  # of the series: (pi / 2)^25 / 25! is 5e-21
STEEP = ORDER + 1  # the row of ``work.row`` behind the coefficients: bounds on the fourth derivatives of w
WORTH = 3  # a series may take so many times the multiplications of a propagator, which is read from far away


@device
def fill_bands(mode, tables):
    """List the diagonals of a mode's matrix and the columns of its forcing, where a series is worth it."""
    field, bands, lines = tables.field, tables.bands, tables.lines
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
            bands[mode, count, r] = field[mode, r, r + offset]
    lines[mode, 0, 0] = count
    for j in range(ONE, M):
        moved = 0
        for r in range(STATES):
            bands[mode, STATES + j, r] = field[mode, r, j]
            moved = 1 if moved != 0 or field[mode, r, j] != 0.0 else 0
        lines[mode, STATES + j, 0] = moved


@device
def add_column(row, k, bands, mode, j, factor):
    """row[k] += factor times the forcing's column j."""
    for r in range(STATES):
        row[k, r] += factor * bands[mode, STATES + j, r]


@device
def next_coefficients(tables, mode, row, k):
    """row[k + 1] = M row[k] / (k + 1), for the states."""
    bands, lines = tables.bands, tables.lines
    for r in range(STATES):
        row[k + 1, r] = 0.0
    for d in range(1, lines[mode, 0, 0] + 1):
        add_products(row, k + 1, bands, mode, d, lines[mode, d, 0], lines[mode, d, 1], lines[mode, d, 2])
    for j in range(ONE if k == 0 else WAVE, M):
        if lines[mode, STATES + j, 0] != 0:
            add_column(row, k + 1, bands, mode, j, row[k, j])
    scale = 1.0 / (k + 1)
    for r in range(STATES):
        row[k + 1, r] *= scale


@device
def expand(tables, work, mode):
    """Taylor coefficients of w on the step that begins there, into ``work.row``, and bounds (``STEEP``)."""
    row, w, rates, step = work.row, work.w, work.rates, tables.info[mode, 0]
    for j in range(M):
        row[0, j] = w[j]
    row[0, ONE] = 1.0
    for k in range(ORDER):
        next_coefficients(tables, mode, row, k)
        row[k + 1, ONE] = 0.0
        for h in range(HARMONICS):
            rate = rates[h] / (k + 1)
            row[k + 1, WAVE + 2 * h] = -rate * row[k, WAVE + 1 + 2 * h]
            row[k + 1, WAVE + 1 + 2 * h] = rate * row[k, WAVE + 2 * h]
    for j in range(M):
        row[STEEP, j] = 0.0
    for k in range(ORDER, 3, -1):
        factor = float(k * (k - 1) * (k - 2) * (k - 3))
        for j in range(M):
            row[STEEP, j] = step * row[STEEP, j] + factor * fabs(row[k, j])


@device
def along(row, tau, out):
    """w at any instant of the step, from its Taylor coefficients."""
    for j in range(M):
        out[j] = row[ORDER, j]
    for k in range(ORDER - 1, -1, -1):
        for j in range(M):
            out[j] = tau * out[j] + row[k, j]


@device
def carry(tables, work, mode, tau, scale, X):
    """The columns of X, in units ``scale`` of the states, along the motion for a time within a step."""
    row, w = work.row, work.wn
    for c in range(X.shape[1]):
        for r in range(STATES):
            row[0, r] = scale[r] * X[r, c]
        for j in range(STATES, M):
            row[0, j] = 0.0
        for k in range(ORDER):
            for j in range(STATES, M):
                row[k + 1, j] = 0.0
            next_coefficients(tables, mode, row, k)
        along(row, tau, w)
        for r in range(STATES):
            X[r, c] = w[r] / scale[r]
