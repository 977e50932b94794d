"""Touches on a segment of the exact flow."""

from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.codes import DONE, MODE, TOUCHES
from nonsmooth.kernels.hybrid.records import asked_before
from nonsmooth.kernels.linear.polynomial import critical_points, curvature_at, horner, monotone
from nonsmooth.kernels.linear.tables import NODES
from nonsmooth.kernels.linear.values import at_ends, bound_at, compose, to_node

BESIDE = 1e-6  # of a node spacing: as near behind the end of a piece a maximum belongs to it


@once
def log_touches(step, form, net, seen, tables, work):
    """Append the local maxima of the mode's armed rows that stay <= 0 within (0, step) of a segment; none where there
    is no room for those of one (``spare``)."""
    mode = work.tally[MODE]
    last = net.mode_start[mode + 1] if seen.spare > 0 else 0
    for j in range(net.mode_start[mode], last):
        for r in range(net.row_start[net.mode_list[j]], net.row_start[net.mode_list[j] + 1]):
            if not asked_before(net, mode, j, net.rows[r, 0], net.rows[r, 1]):
                log_maxima(net.rows[r, 0], float(net.rows[r, 1]), step, mode, seen, tables, work)


@once
def log_maxima(f, sign, step, mode, seen, tables, work):
    """Those of sign * functional: a piece on which it is not certainly monotone is halved, down to two spacings, with
    the polynomial in the middle. A maximum just behind an end, where motion turns in a transition, belongs to the piece
    before."""
    w, wn, wp, wq, scr, points, spacing = work.w, work.wn, work.wp, work.wq, work.scr, work.points, tables.info[mode, 1]
    bound = bound_at(tables, work.row, mode, f, w)
    node, size, n = 0, NODES, work.tally[TOUCHES]
    while node < NODES and node * spacing < step and n + 1 < seen.touch_time.shape[0]:
        if size < NODES:
            to_node(tables, work.row, mode, node, w, wp)
            to_node(tables, work.row, mode, node + size, w, wq)
        g0, s0, g1, s1 = at_ends(tables, mode, f, w if size == NODES else wp, work.w1 if size == NODES else wq)
        if not monotone(g0, s0, g1, s1, size * spacing, bound):
            if size > 2:
                size //= 2
                continue
            lo, hi = -spacing, min(spacing, step - (node + 1) * spacing)
            lo, hi = lo + BESIDE * spacing, hi + BESIDE * spacing
            to_node(tables, work.row, mode, node + 1, w, wn)
            compose(tables, mode, f, wn, scr, 0)
            count = critical_points(scr, 0, lo, hi, points) if lo < hi else 0
            for k in range(count):
                value = sign * horner(scr, 0, points[k])
                if value <= 0.0 and sign * curvature_at(scr, 0, points[k]) <= 0.0:
                    seen.touch_time[n] = work.memo[DONE] + (node + 1) * spacing + points[k]
                    seen.touch_indicator[n] = f
                    seen.touch_gap[n] = -value
                    for s in range(seen.touch_u.shape[1]):
                        compose(tables, mode, work.zero.shape[0] + s, wn, scr, 1)
                        seen.touch_u[n, s] = horner(scr, 1, points[k])
                    n += 1
        node += size
        while size < NODES // 2 and node % (2 * size) == 0:
            size *= 2
    work.tally[TOUCHES] = n
