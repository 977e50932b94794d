"""True extremes of states, indicators and outputs over the kept window of a trajectory.

A step that certainly does not leave the extremes so far costs a dozen multiplications per functional; else the step
is halved down to two node spacings, where the polynomial's critical points decide.
"""

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import MODE
from nonsmooth.kernels.linear.polynomial import NEVER, THIRD, classify, critical_points, horner
from nonsmooth.kernels.linear.tables import NODES, states_of
from nonsmooth.kernels.linear.values import at_ends, bound_at, compose, to_node


@once
def locate_maximum(tables, work, mode, f, sign, a, b, best):
    """The larger of ``best`` and the maximum of sign * functional over [a, b] of the step, piece by piece."""
    spacing = tables.info[mode, 1]
    w, wn, wq, scr, points = work.w, work.wn, work.wq, work.scr, work.points
    bound = bound_at(tables, work.row, mode, f, w)
    size = NODES // 4
    node = min(int(a / spacing) // size * size, NODES - size)
    while node < NODES and node * spacing <= b:
        to_node(tables, work.row, mode, node, w, wn)
        to_node(tables, work.row, mode, node + size, w, wq)
        g0, s0, g1, s1 = at_ends(tables, mode, f, wn, wq)
        g0, s0, g1, s1 = sign * g0 - best, sign * s0, sign * g1 - best, sign * s1
        if classify(g0, s0, g1, s1, size * spacing, bound) != NEVER:
            if size > 2:
                size //= 2
                continue
            to_node(tables, work.row, mode, node + 1, w, wn)
            compose(tables, mode, f, wn, scr, 0)
            lo = max(a - (node + 1) * spacing, -spacing)
            hi = min(b - (node + 1) * spacing, spacing)
            if lo <= hi:
                n = critical_points(scr, 0, lo, hi, points)
                best = max(best, sign * horner(scr, 0, lo), sign * horner(scr, 0, hi))
                for k in range(n):
                    best = max(best, sign * horner(scr, 0, points[k]))
        node += size
        while size < NODES // 4 and node % (2 * size) == 0:
            size *= 2
    return best


@inline
def exceeds(tables, row, mode, f, w, w1, lowest, highest):
    """Return whether functional f may leave [lowest, highest] on the step from w to w1: (below, above)."""
    g0, s0, g1, s1 = at_ends(tables, mode, f, w, w1)
    h = tables.info[mode, 0]
    b1 = g0 + h * s0 * THIRD
    b2 = g1 - h * s1 * THIRD
    c1 = 0.25 * (g0 + 3.0 * b1)
    c2 = 0.5 * (b1 + b2)
    c3 = 0.25 * (3.0 * b2 + g1)
    h2 = h * h
    wide = bound_at(tables, row, mode, f, w) * h2 * h2 * (1.0 / 144.0)
    below = min(min(min(g0, g1), min(c1, c3)), c2 - wide) < lowest
    above = max(max(max(g0, g1), max(c1, c3)), c2 + wide) > highest
    return below, above


@inline
def kept_row(f, n, n_i, own):
    """The row in which the extremes of functional f are kept (states, indicators, outputs); -1: memory has none."""
    if f < n_i:
        return own + f
    if f < n_i + n:
        return f - n_i if f < n_i + own else -1
    return own + f - n


@once
def widen(a, b, form, tables, work, kept):
    """Extend the extremes by the piece [a, b] of a segment; what is passed through at one instant has none."""
    if not (b > a):
        return
    n, high, low = states_of(tables.field), kept.high, kept.low
    n_i, mode = work.zero.shape[0], work.tally[MODE]
    for f in range(tables.fun.shape[1]):
        if f < n_i and work.twin[f] >= 0:
            continue  # a state but for a constant: see ``finish``
        k = kept_row(f, n, n_i, kept.section.shape[1])
        if k < 0:
            continue
        below, above = exceeds(tables, work.row, mode, f, work.w, work.w1, low[k], high[k])
        for side in range(2):
            if above if side == 0 else below:
                sign = 1.0 if side == 0 else -1.0
                found = sign * locate_maximum(tables, work, mode, f, sign, a, b, high[k] if side == 0 else -low[k])
                if side == 0:
                    high[k] = found
                else:
                    low[k] = found


@once
def finish(form, tables, work, kept):
    """Extremes of the indicators that are a state but for a constant."""
    n, own = states_of(tables.field), kept.section.shape[1]
    for f in range(work.zero.shape[0]):
        if work.twin[f] >= 0:
            kept.high[own + f] = kept.high[work.twin[f]] + tables.fun[0, f, n]
            kept.low[own + f] = kept.low[work.twin[f]] + tables.fun[0, f, n]
