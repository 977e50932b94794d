"""States on a step of the exact flow, and the values of functionals (indicators, states, outputs) there.

At any of 33 nodes of a step the state is one product with a propagator, and a functional beside a node a Taylor
polynomial of degree 7 (remainder below 1e-16 of the amplitude over 3/4 of a node spacing of 0.05 rad, 4e-18 over half
of it). Many states that move with few others each go by the series of the whole step instead (``linear.bands``).
"""

from math import fabs

from nonsmooth.kernels.compile.cache import inline
from nonsmooth.kernels.compile.lanes import sum_columns, sum_rows, sum_some_rows
from nonsmooth.kernels.compile.long_sums import dot, sizes, spread
from nonsmooth.kernels.linear.bands import STEEP, along, expand
from nonsmooth.kernels.linear.polynomial import horner
from nonsmooth.kernels.linear.tables import BANDED, HARMONICS, MANY, NODES, ONE, STATES, WAVE, M

EPS = 2.3e-16
FEW = 8  # states of a condition that are summed one by one
# In ``work.found``: the node whose w stands in ``work.wn``, with the Taylor coefficients of the states in the first
# rows of ``work.scr`` (-2 - node: without them, -1: none).
NODE = 1


@inline
def sum_few(total, tables, mode, f, at, w):
    """``total`` and the states' part of a functional's value (at = 0) or slope (M): one by one where they are few."""
    fun, some = tables.fun, tables.some
    count = some[mode, f, 1, 0]
    if count > FEW:
        return dot(total, fun[mode, f], at, w, STATES)
    for q in range(1, count + 1):
        j = some[mode, f, 1, q]
        total += fun[mode, f, at + j] * w[j]
    return total


@inline
def value_of(tables, mode, f, w):
    """Functional f at w. (Here and below the states come last: they are known later than the harmonics.)"""
    fun = tables.fun
    total = fun[mode, f, ONE]
    for j in range(WAVE, M):
        total += fun[mode, f, j] * w[j]
    if STATES >= MANY:
        return sum_few(total, tables, mode, f, 0, w)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, j] * w[j]
    return total


@inline
def slope_of(tables, mode, f, w):
    """Slope of functional f along the mode at w."""
    fun = tables.fun
    total = fun[mode, f, M + ONE]
    for j in range(WAVE, M):
        total += fun[mode, f, M + j] * w[j]
    if STATES >= MANY:
        return sum_few(total, tables, mode, f, M, w)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, M + j] * w[j]
    return total


@inline
def bound_at(tables, row, mode, f, w):
    """Bound on the fourth derivative of functional f on the step that starts at w."""
    fun, info = tables.fun, tables.info
    if BANDED:
        if tables.lines[mode, 0, 0] > 0:
            return bound_by_series(tables, row, mode, f)
    total = fun[mode, f, 2 * M + STATES]
    if STATES >= MANY:
        return spread(total, fun[mode, f], 2 * M, w, info[mode], STATES)
    for j in range(STATES - 1, -1, -1):
        total += fun[mode, f, 2 * M + j] * fabs(w[j] - info[mode, 2 + j])
    return total


@inline
def bound_by_series(tables, row, mode, f):
    """The same from those on w itself."""
    fun, some = tables.fun, tables.some
    total = 0.0
    for j in range(WAVE, M):
        total += fabs(fun[mode, f, j]) * row[STEEP, j]
    count = some[mode, f, 1, 0]
    if count > FEW:
        return sizes(total, fun[mode, f], 0, row[STEEP], STATES)
    for q in range(1, count + 1):
        j = some[mode, f, 1, q]
        total += fabs(fun[mode, f, j]) * row[STEEP, j]
    return total


@inline
def rounding(tables, mode, f, at, w):
    """Below this the row fun[mode, f, at:] is zero within rounding at w."""
    total = 0.0
    if STATES >= MANY:
        for q in range(1, tables.some[mode, f, 1, 0] + 1):
            j = tables.some[mode, f, 1, q]
            total += fabs(tables.fun[mode, f, at + j] * w[j])
        for j in range(STATES, M):
            total += fabs(tables.fun[mode, f, at + j] * w[j])
    else:
        for j in range(M):
            total += fabs(tables.fun[mode, f, at + j] * w[j])
    return 16.0 * EPS * total


@inline
def to_node(tables, row, mode, node, w, out):
    """w at a node of the step, from w at its start."""
    rot = tables.rot
    if BANDED:
        if tables.lines[mode, 0, 0] > 0:
            along(row, node / NODES, out)
            return
    for h in range(HARMONICS):
        c = rot[mode, node, 2 * h]
        s = rot[mode, node, 2 * h + 1]
        out[WAVE + 2 * h] = w[WAVE + 2 * h] * c - w[WAVE + 1 + 2 * h] * s
        out[WAVE + 1 + 2 * h] = w[WAVE + 1 + 2 * h] * c + w[WAVE + 2 * h] * s
    sum_columns(out, tables.prop, mode, node, w, STATES, M)
    out[ONE] = 1.0


@inline
def whole_step(tables, work, mode):
    """w at the end of the step, into ``work.w1``; with what the step's instants and bounds are found from."""
    if BANDED:
        if tables.lines[mode, 0, 0] > 0:
            expand(tables, work, mode)
    to_node(tables, work.row, mode, NODES, work.w, work.w1)


@inline
def compose(tables, mode, f, wn, scr, row):
    """Taylor coefficients of functional f at a node where w is ``wn``, into a row of scr."""
    if STATES >= MANY:
        sum_some_rows(scr, row, tables.tay, mode, f, wn, tables.some[mode, f, 0])
    else:
        sum_rows(scr, row, tables.tay, mode, f, wn, STATES, M)


@inline
def at_node(tables, work, mode, node):
    """w at a node of the step, into ``work.wn``."""
    found = work.found
    if found[NODE] != node and found[NODE] != -2 - node:
        to_node(tables, work.row, mode, node, work.w, work.wn)
        found[NODE] = -2 - node


@inline
def place(tables, work, mode, node):
    """w at a node of the step, and there the Taylor coefficients of the states (the first rows of scr)."""
    if work.found[NODE] != node:
        at_node(tables, work, mode, node)
        for r in range(STATES):
            compose(tables, mode, work.zero.shape[0] + r, work.wn, work.scr, r)
        work.found[NODE] = node


@inline
def turn(angle, c, s):
    """Cosine and sine of a phase whose cosine and sine are c and s, after a small angle (below 0.1)."""
    a2 = angle * angle
    ca = 1.0 - a2 * (0.5 - a2 * (1.0 / 24 - a2 * (1.0 / 720 - a2 * (1.0 / 40320))))
    sa = angle * (1.0 - a2 * (1.0 / 6 - a2 * (1.0 / 120 - a2 * (1.0 / 5040 - a2 * (1.0 / 362880)))))
    return c * ca - s * sa, s * ca + c * sa


@inline
def dense(tables, work, mode, tau, out):
    """w at any instant of the step."""
    if BANDED:
        if tables.lines[mode, 0, 0] > 0:
            along(work.row, tau / tables.info[mode, 0], out)
            return
    spacing = tables.info[mode, 1]
    wn, scr, rates = work.wn, work.scr, work.rates
    node = work.found[NODE] if work.found[NODE] >= 0 else -2 - work.found[NODE]
    if node < 0 or fabs(tau - node * spacing) > 0.75 * spacing:
        node = min(int(tau / spacing + 0.5), NODES)
    place(tables, work, mode, node)
    local = tau - node * spacing
    for r in range(STATES):
        out[r] = horner(scr, r, local)
    out[ONE] = 1.0
    for h in range(HARMONICS):
        c, s = turn(rates[h] * local, wn[WAVE + 2 * h], wn[WAVE + 1 + 2 * h])
        out[WAVE + 2 * h] = c
        out[WAVE + 1 + 2 * h] = s
