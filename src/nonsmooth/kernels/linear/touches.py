"""Touches on a segment of the exact flow."""

from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.places import DONE, MODE, TOUCHES
from nonsmooth.kernels.linear.polynomial import critical_points, curvature_at, horner
from nonsmooth.kernels.linear.tables import NODES
from nonsmooth.kernels.linear.values import compose, to_node


@once
def log_touches(step, form, net, seen, tables, work):
    """Append the local maxima of the mode's armed rows that stay <= 0 within (0, step) of a segment; none where there
    is no room for those of one (``spare``)."""
    wn, scr, points = work.wn, work.scr, work.points
    mode, base = work.tally[MODE], work.memo[DONE]
    spacing, n = tables.info[mode, 1], work.tally[TOUCHES]
    nodes = NODES if seen.spare > 0 else 0
    for node in range(1, nodes, 2):  # pieces of two spacings, with their polynomial in the middle
        if (node - 1) * spacing >= step:
            break
        to_node(tables, work.row, mode, node, work.w, wn)
        for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
            t = net.mode_list[j]
            for r in range(net.row_start[t], net.row_start[t + 1]):
                if n + 1 >= seen.touch_time.shape[0]:
                    break
                f = net.rows[r, 0]
                sign = float(net.rows[r, 1])
                compose(tables, mode, f, wn, scr, 0)
                count = critical_points(scr, 0, -spacing, spacing, points)
                for k in range(count):
                    local = points[k]
                    value = sign * horner(scr, 0, local)
                    tau = node * spacing + local
                    if tau <= 0.0 or tau >= step or value > 0.0 or sign * curvature_at(scr, 0, local) > 0.0:
                        continue
                    seen.touch_time[n] = base + tau
                    seen.touch_indicator[n] = f
                    seen.touch_gap[n] = -value
                    for s in range(seen.touch_u.shape[1]):
                        compose(tables, mode, work.zero.shape[0] + s, wn, scr, 1)
                        seen.touch_u[n, s] = horner(scr, 1, local)
                    n += 1
    work.tally[TOUCHES] = n
