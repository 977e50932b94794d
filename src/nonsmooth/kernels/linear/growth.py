"""Steps of a frame of small changes along the exact flow: a segment multiplies it by exp(A tau), from the tables of the
segment itself, a transition by its saltation (``tangent.frame``)."""

from math import fabs, inf, sqrt

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import MODE
from nonsmooth.kernels.linear.bands import by_series, carry
from nonsmooth.kernels.linear.tables import DEGREE, NODES, STATES, states_of, width_of
from nonsmooth.kernels.linear.values import slope_of, value_of
from nonsmooth.kernels.tangent.frame import NEAR, ON_SURFACE, multiply, saltation

SEGMENTS_APART = 4  # in each of them ratios of lengths change by less than exp(pi): so short are steps


@once
def anchor_frame(seen, work):
    """The frame is orthonormal here; segments are carried over at once."""
    if STATES == 0:
        seen.sums[4] = 0.0


@once
def frame_has_moved(ended, crossed, form, goal, seen, work):
    """Every segment moves it; of many states, which are dear to keep apart, ``SEGMENTS_APART`` go together."""
    moved = True
    if STATES == 0:
        seen.sums[4] += 1.0
        moved = ended or seen.sums[4] >= SEGMENTS_APART
        if moved:
            seen.sums[4] = 0.0
    return moved


@inline
def shape_of(seen):
    """The number of states, and that of directions."""
    return states_of(seen.step), STATES if STATES > 0 else seen.frame.shape[1]


@once
def carry_frame(step, goal, seen, tables, work):
    """Carry the frame over the segment: X = exp(A tau), from the nearest node and the Taylor rows of the states.

    (Of many states with few entries by its columns' own series.)"""
    n = states_of(tables.field)
    prop, tay, X, scale = tables.prop, tables.tay, seen.step, seen.scale
    mode, n_i = work.tally[MODE], work.zero.shape[0]
    for r in range(n):
        seen.sums[0] += tables.field[mode, r, r] * step
    if STATES == 0:
        if by_series(tables, mode):
            carry(tables, work, mode, step / tables.info[mode, 0], scale, seen.frame)
            return
    spacing, full = tables.info[mode, 1], step == tables.info[mode, 0]
    node = NODES if full else min(int(step / spacing + 0.5), NODES)
    local = step - node * spacing
    for r in range(n):
        for c in range(n):
            X[r, c] = prop[mode, node, c, r] if full else 0.0
    if not full:
        for r in range(n):
            for q in range(n):
                a = 0.0
                for k in range(DEGREE, -1, -1):
                    a = a * local + tay[mode, n_i + r, q, k]
                for c in range(n):
                    X[r, c] += a * prop[mode, node, c, q]
    for r in range(n):
        for c in range(n):
            X[r, c] *= scale[c] / scale[r]
    multiply(X, seen.frame, n, shape_of(seen)[1], seen.matrix)


@inline
def slope_along(field, mode, w, out):
    """The vector field at w."""
    n, m = states_of(field), width_of(field)
    for r in range(n):
        total = 0.0
        for j in range(m):
            total += field[mode, r, j] * w[j]
        out[r] = total


@once
def approach_transition(mode, fired, seen, tables, work):
    """Derivative of the instant of a crossing in the state, and how steeply the surface is met."""
    n = states_of(tables.field)
    t_z, S, f = seen.t_z, seen.step, seen.fields
    slope_along(tables.field, mode, work.w, f[3])
    for r in range(n):
        t_z[r] = 0.0
        for c in range(n):
            S[r, c] = 1.0 if r == c else 0.0
    if fired >= 0:
        rate = slope_of(tables, mode, fired, work.w)
        across, speed = 0.0, 0.0
        for j in range(n):
            h = tables.fun[mode, fired, j]
            t_z[j] = -h / rate
            across += h * h
            speed += f[3, j] * f[3, j]
        if across * speed > 0.0:
            seen.sums[3] = min(seen.sums[3], fabs(rate) / sqrt(across * speed))


@once
def meet_again(t, mode, net, seen, tables, before):
    """The instant of a transition that the motion would have met at this instant by itself: that is its own."""
    n, t_z, S, f, own = states_of(tables.field), seen.t_z, seen.step, seen.fields, seen.scratch
    chosen, rate, near = -1, 0.0, ON_SURFACE
    for k in range(net.row_start[t], net.row_start[t + 1]):
        row, size, change = net.rows[k, 0], 0.0, slope_of(tables, mode, net.rows[k, 0], before)
        for j in range(n):
            size += fabs(tables.fun[mode, row, j]) * seen.scale[j]
        off = fabs(value_of(tables, mode, row, before)) / size if size > 0.0 else inf
        if off <= near and (off < near or fabs(change) > fabs(rate)):
            chosen, rate, near = row, change, max(off, NEAR)
    change = rate
    for j in range(n):
        change += tables.fun[mode, chosen, j] * (f[3, j] - f[0, j]) if chosen >= 0 else 0.0
    if change * rate > 0.0:
        seen.sums[5] += 1.0
        for c in range(n):
            own[c] = 0.0
            for j in range(n):
                own[c] -= tables.fun[mode, chosen, j] / rate * S[j, c]
        for c in range(n):
            t_z[c] = own[c]


@once
def saltate(i, t, jumps, mode, form, net, seen, tables, work):
    """Saltation of a transition, from the mode in which it was taken to ``mode``."""
    n = states_of(tables.field)
    before, f, R = work.wp, seen.fields, seen.reset
    slope_along(tables.field, work.tally[MODE], before, f[0])
    slope_along(tables.field, mode, work.w, f[1])
    if jumps > 0:
        meet_again(t, work.tally[MODE], net, seen, tables, before)
    for r in range(n):
        f[2, r] = 0.0
        for c in range(n):
            R[r, c] = 1.0 if r == c else 0.0
        if net.transitions[t, 1] != 0:
            map_ = net.transitions[t, 3]
            for c in range(n):
                R[r, c] = form.ra[i, map_, r, c]
            for h in range(form.rc.shape[2]):
                f[2, r] += work.rates[h] * (
                    form.rs[i, map_, h, r] * before[n + 1 + 2 * h] - form.rc[i, map_, h, r] * before[n + 2 + 2 * h]
                )
    saltation(R, f[2], f[0], f[1], seen.t_z, n, seen.step, seen.matrix)
    if t < seen.taken.shape[0]:
        seen.taken[t] += 1
