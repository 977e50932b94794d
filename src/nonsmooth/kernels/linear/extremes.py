"""True extremes of states, indicators and outputs over the kept window of a trajectory.

A step that certainly does not leave the extremes so far costs a dozen multiplications per functional; else the step
is halved down to two node spacings, where the polynomial's critical points decide.
"""

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.places import MODE
from nonsmooth.kernels.linear.polynomial import NEVER, THIRD, classify, critical_points, horner
from nonsmooth.kernels.linear.tables import NODES, states_of
from nonsmooth.kernels.linear.values import at_ends, bound_at, compose, to_node, value_of


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
def extremes_of(f, n, n_i, kept):
    """Maxima and minima in which those of functional f are kept, and its column there."""
    if f < n_i:
        return kept.i_max, kept.i_min, f
    if f < n_i + n:
        return kept.maximum, kept.minimum, f - n_i
    return kept.o_max, kept.o_min, f - n_i - n


@once
def widen(i, a, b, form, tables, work, kept):
    """Extend the extremes of point i by the piece [a, b] of a segment."""
    n = states_of(tables.field)
    n_i, mode = work.zero.shape[0], work.tally[MODE]
    for f in range(tables.fun.shape[1]):
        if f < n_i and work.twin[f] >= 0:
            continue  # a state but for a constant: see ``finish``
        if n_i + kept.maximum.shape[1] <= f < n_i + n:  # memory
            continue
        hi, lo, k = extremes_of(f, n, n_i, kept)
        below, above = exceeds(tables, work.row, mode, f, work.w, work.w1, lo[i, k], hi[i, k])
        for side in range(2):
            if above if side == 0 else below:
                sign = 1.0 if side == 0 else -1.0
                found = sign * locate_maximum(tables, work, mode, f, sign, a, b, hi[i, k] if side == 0 else -lo[i, k])
                if side == 0:
                    hi[i, k] = found
                else:
                    lo[i, k] = found


@once
def finish(i, form, tables, work, kept):
    """Extremes of the indicators that are a state but for a constant."""
    n = states_of(tables.field)
    for f in range(work.zero.shape[0]):
        if work.twin[f] >= 0:
            kept.i_max[i, f] = kept.maximum[i, work.twin[f]] + tables.fun[0, f, n]
            kept.i_min[i, f] = kept.minimum[i, work.twin[f]] + tables.fun[0, f, n]


@once
def include(i, mode, form, tables, work, kept):
    """Extend the extremes of point i by the present instant."""
    n = states_of(tables.field)
    n_i = work.zero.shape[0]
    for f in range(tables.fun.shape[1]):
        if n_i + kept.maximum.shape[1] <= f < n_i + n:  # memory
            continue
        hi, lo, k = extremes_of(f, n, n_i, kept)
        value = value_of(tables, mode, f, work.w)
        hi[i, k] = max(hi[i, k], value)
        lo[i, k] = min(lo[i, k], value)
