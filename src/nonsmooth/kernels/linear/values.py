"""States on a step of the exact flow, and the values of functionals (indicators, states, outputs) there.

At any of 33 nodes of a step the state is one product with a propagator, and a functional beside a node a Taylor
polynomial of degree 7 (remainder below 1e-16 of the amplitude over 3/4 of a node spacing of 0.05 rad, 4e-18 over half
of it). Many states that move with few others each go by the series of the whole step instead (``linear.bands``).
"""

from math import fabs

from nonsmooth.kernels.compile.cache import inline
from nonsmooth.kernels.linear.bands import STEEP, along, by_series, expand
from nonsmooth.kernels.linear.polynomial import horner
from nonsmooth.kernels.linear.sums import at, composed, ends_of, propagated, row_of, sizes_of, spread_of
from nonsmooth.kernels.linear.tables import DEGREE, NODES, STATES, states_of, width_of

EPS = 2.3e-16
# In ``work.found``: the node whose w stands in ``work.wn``, with the Taylor coefficients of the states in the first
# rows of ``work.scr`` (-2 - node: without them, -1: none).
NODE = 1


@inline
def row_place(tables, mode, f):
    """The place of functional f's rows in the memory of ``tables.fun``."""
    return (mode * tables.fun.shape[1] + f) * tables.fun.shape[2]


@inline
def some_at(tables, mode, f, which):
    """The address of a list of the functional's columns (``tables.some``)."""
    some = tables.some
    return at(some, ((mode * some.shape[1] + f) * 2 + which) * some.shape[3])


@inline
def row_at(tables, mode, f, first, w):
    """The row of functional f that begins at a place of fun, at w. (The states come last, being known later.)"""
    fun, n, m = tables.fun, states_of(tables.field), width_of(tables.field)
    if STATES == 0:
        return row_of(at(fun, row_place(tables, mode, f) + first), some_at(tables, mode, f, 1), at(w, 0), n, m)
    total = fun[mode, f, first + n]
    for j in range(n + 1, m):
        total += fun[mode, f, first + j] * w[j]
    for j in range(n - 1, -1, -1):
        total += fun[mode, f, first + j] * w[j]
    return total


@inline
def value_of(tables, mode, f, w):
    """Functional f at w."""
    return row_at(tables, mode, f, 0, w)


@inline
def slope_of(tables, mode, f, w):
    """Slope of functional f along the mode at w."""
    return row_at(tables, mode, f, width_of(tables.field), w)


@inline
def at_ends(tables, mode, f, w, w1):
    """Value and slope of functional f at w, then at w1."""
    if STATES == 0:
        row, n, m = at(tables.fun, row_place(tables, mode, f)), states_of(tables.field), width_of(tables.field)
        return ends_of(row, some_at(tables, mode, f, 1), at(w, 0), at(w1, 0), n, m)
    g0, s0 = value_of(tables, mode, f, w), slope_of(tables, mode, f, w)
    return g0, s0, value_of(tables, mode, f, w1), slope_of(tables, mode, f, w1)


@inline
def bound_at(tables, row, mode, f, w):
    """Bound on the fourth derivative of functional f on the step that starts at w."""
    fun, info, n, m = tables.fun, tables.info, states_of(tables.field), width_of(tables.field)
    if STATES == 0:
        if by_series(tables, mode):
            return bound_by_series(tables, row, mode, f)
        return spread_of(at(fun, row_place(tables, mode, f) + 2 * m), at(w, 0), at(info, mode * (n + 2) + 2), n)
    total = fun[mode, f, 2 * m + n]
    for j in range(n - 1, -1, -1):
        total += fun[mode, f, 2 * m + j] * fabs(w[j] - info[mode, 2 + j])
    return total


@inline
def bound_by_series(tables, row, mode, f):
    """The same from those on w itself."""
    n, m = states_of(tables.field), width_of(tables.field)
    steep = at(row, STEEP * row.shape[1])
    return sizes_of(at(tables.fun, row_place(tables, mode, f)), some_at(tables, mode, f, 1), steep, n, n + 1, m)


@inline
def rounding(tables, mode, f, first, w):
    """Below this the row fun[mode, f, first:] is zero within rounding at w."""
    n, m = states_of(tables.field), width_of(tables.field)
    if STATES == 0:
        row = at(tables.fun, row_place(tables, mode, f) + first)
        return 16.0 * EPS * sizes_of(row, some_at(tables, mode, f, 1), at(w, 0), n, n, m)
    total = 0.0
    for j in range(m):
        total += fabs(tables.fun[mode, f, first + j] * w[j])
    return 16.0 * EPS * total


@inline
def noise(tables, mode, f, step, w):
    """Below this functional f is zero at w within rounding, and that of the step which led there."""
    return rounding(tables, mode, f, 0, w) + 0.25 * step * rounding(tables, mode, f, width_of(tables.field), w)


@inline
def to_node(tables, row, mode, node, w, out):
    """w at a node of the step, from w at its start."""
    rot, prop, n, m = tables.rot, tables.prop, states_of(tables.field), width_of(tables.field)
    if STATES == 0:
        if by_series(tables, mode):
            along(row, node / NODES, m, out)
            return
        filled = prop.shape[3]
        propagated(at(prop, (mode * (NODES + 1) + node) * m * filled), filled, at(w, 0), n, m, at(out, 0))
    else:
        for r in range(n):
            total = prop[mode, node, n, r]
            for j in range(n + 1, m):
                total += prop[mode, node, j, r] * w[j]
            for j in range(n - 1, -1, -1):
                total += prop[mode, node, j, r] * w[j]
            out[r] = total
    out[n] = 1.0
    for h in range((m - n - 1) >> 1):
        c = rot[mode, node, 2 * h]
        s = rot[mode, node, 2 * h + 1]
        out[n + 1 + 2 * h] = w[n + 1 + 2 * h] * c - w[n + 2 + 2 * h] * s
        out[n + 2 + 2 * h] = w[n + 2 + 2 * h] * c + w[n + 1 + 2 * h] * s


@inline
def whole_step(tables, work, mode):
    """w at the end of the step, into ``work.w1``; with what the step's instants and bounds are found from."""
    if STATES == 0:
        if by_series(tables, mode):
            expand(tables, work, mode)
    to_node(tables, work.row, mode, NODES, work.w, work.w1)


@inline
def compose(tables, mode, f, wn, scr, row):
    """Taylor coefficients of functional f at a node where w is ``wn``, into a row of scr."""
    tay = tables.tay
    if STATES == 0:
        place = (mode * tay.shape[1] + f) * tay.shape[2] * (DEGREE + 1)
        composed(at(tay, place), some_at(tables, mode, f, 0), at(wn, 0), at(scr, row * (DEGREE + 1)))
    else:
        n, m = states_of(tables.field), width_of(tables.field)
        for k in range(DEGREE + 1):
            total = tay[mode, f, n, k]
            for j in range(n + 1, m):
                total += tay[mode, f, j, k] * wn[j]
            for j in range(n - 1, -1, -1):
                total += tay[mode, f, j, k] * wn[j]
            scr[row, k] = total


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
    n = states_of(tables.field)
    if work.found[NODE] != node:
        at_node(tables, work, mode, node)
        for r in range(n):
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
    n, m = states_of(tables.field), width_of(tables.field)
    if STATES == 0:
        if by_series(tables, mode):
            along(work.row, tau / tables.info[mode, 0], m, out)
            return
    spacing = tables.info[mode, 1]
    wn, scr, rates = work.wn, work.scr, work.rates
    node = work.found[NODE] if work.found[NODE] >= 0 else -2 - work.found[NODE]
    if node < 0 or fabs(tau - node * spacing) > 0.75 * spacing:
        node = min(int(tau / spacing + 0.5), NODES)
    place(tables, work, mode, node)
    local = tau - node * spacing
    for r in range(n):
        out[r] = horner(scr, r, local)
    out[n] = 1.0
    for h in range((m - n - 1) >> 1):
        c, s = turn(rates[h] * local, wn[n + 1 + 2 * h], wn[n + 2 + 2 * h])
        out[n + 1 + 2 * h] = c
        out[n + 2 + 2 * h] = s
