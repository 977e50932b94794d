"""True extremes of states, indicators and outputs over the kept window of a trajectory.

A step that certainly does not leave the extremes so far costs a dozen multiplications per functional; else the step
is halved down to two node spacings, where the polynomial's critical points decide.
"""

from .cache import device, inline
from .linear_polynomial import NEVER, THIRD, classify, critical_points, horner
from .linear_search import bound_at, compose, slope_of, to_node, value_of
from .linear_tables import NODES, ONE, STATES, M


@device
def locate_maximum(prop, rot, fun, tay, info, mode, w, f, sign, a, b, best, wn, wq, scr, points):
    """The larger of ``best`` and the maximum of sign * functional over [a, b] of the step, piece by piece."""
    spacing = info[mode, 1]
    bound = bound_at(fun, info, mode, f, w)
    size = NODES // 4
    node = min(int(a / spacing) // size * size, NODES - size)
    while node < NODES and node * spacing <= b:
        to_node(prop, rot, mode, node, w, wn)
        to_node(prop, rot, mode, node + size, w, wq)
        g0 = sign * value_of(fun, mode, f, wn) - best
        g1 = sign * value_of(fun, mode, f, wq) - best
        s0 = sign * slope_of(fun, mode, f, wn)
        s1 = sign * slope_of(fun, mode, f, wq)
        if classify(g0, s0, g1, s1, size * spacing, bound) != NEVER:
            if size > 2:
                size //= 2
                continue
            to_node(prop, rot, mode, node + 1, w, wn)
            compose(tay, mode, f, wn, scr, 0)
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
def exceeds(fun, info, mode, f, w, w1, lowest, highest):
    """Whether functional f may leave [lowest, highest] on the step from w to w1: (below, above)."""
    g0 = value_of(fun, mode, f, w)
    g1 = value_of(fun, mode, f, w1)
    h = info[mode, 0]
    b1 = g0 + h * slope_of(fun, mode, f, w) * THIRD
    b2 = g1 - h * slope_of(fun, mode, f, w1) * THIRD
    c1 = 0.25 * (g0 + 3.0 * b1)
    c2 = 0.5 * (b1 + b2)
    c3 = 0.25 * (3.0 * b2 + g1)
    h2 = h * h
    wide = bound_at(fun, info, mode, f, w) * h2 * h2 * (1.0 / 144.0)
    below = min(min(min(g0, g1), min(c1, c3)), c2 - wide) < lowest
    above = max(max(max(g0, g1), max(c1, c3)), c2 + wide) > highest
    return below, above


@inline
def extreme_slot(f, n_i, maximum, minimum, i_max, i_min, o_max, o_min):
    """Where the extremes of functional f are kept."""
    if f < n_i:
        return i_max, i_min, f
    if f < n_i + STATES:
        return maximum, minimum, f - n_i
    return o_max, o_min, f - n_i - STATES


@inline
def widen(
    i, a, b, prop, rot, fun, tay, info, mode, w, w1, n_i, twin, maximum, minimum, i_max, i_min, o_max, o_min,
    wn, wq, scr, points,
):  # fmt: skip
    """Extend the extremes of point i by the piece [a, b] of a leg that starts at w."""
    for f in range(fun.shape[1]):
        if f < n_i and twin[f] >= 0:
            continue  # a state but for a constant: see ``finish``
        hi, lo, k = extreme_slot(f, n_i, maximum, minimum, i_max, i_min, o_max, o_min)
        below, above = exceeds(fun, info, mode, f, w, w1, lo[i, k], hi[i, k])
        if above:
            hi[i, k] = locate_maximum(
                prop, rot, fun, tay, info, mode, w, f, 1.0, a, b, hi[i, k], wn, wq, scr, points
            )
        if below:
            lo[i, k] = -locate_maximum(
                prop, rot, fun, tay, info, mode, w, f, -1.0, a, b, -lo[i, k], wn, wq, scr, points
            )


@inline
def find_twins(fun, n_i, twin):
    """Indicators that are a state but for a constant, and which: their extremes follow from the state's."""
    for f in range(n_i):
        twin[f] = -1
        for k in range(STATES):
            same = fun[0, f, k] == 1.0
            for j in range(M):
                same = same and (j == k or j == ONE or fun[0, f, j] == 0.0)
            if same:
                twin[f] = k


@inline
def finish(i, fun, n_i, twin, maximum, minimum, i_max, i_min):
    """Extremes of the indicators that are a state but for a constant."""
    for f in range(n_i):
        if twin[f] >= 0:
            i_max[i, f] = maximum[i, twin[f]] + fun[0, f, ONE]
            i_min[i, f] = minimum[i, twin[f]] + fun[0, f, ONE]


@device
def include(i, fun, mode, w, n_i, maximum, minimum, i_max, i_min, o_max, o_min):
    """Extend the extremes of point i by the instant w."""
    for f in range(fun.shape[1]):
        hi, lo, k = extreme_slot(f, n_i, maximum, minimum, i_max, i_min, o_max, o_min)
        value = value_of(fun, mode, f, w)
        hi[i, k] = max(hi[i, k], value)
        lo[i, k] = min(lo[i, k], value)
