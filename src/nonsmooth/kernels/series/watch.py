"""Observations made while a step's polynomials are at hand: extremes and touches."""

from math import fabs

import nonsmooth.kernels.hybrid.codes as place
from nonsmooth.kernels.compile.cache import once
from nonsmooth.kernels.hybrid.codes import DONE, MODE, TOUCHES
from nonsmooth.kernels.hybrid.records import asked_before
from nonsmooth.kernels.series.crossing import NOISE
from nonsmooth.kernels.series.generated import values_of
from nonsmooth.kernels.series.polynomial import (
    DOWN,
    NONE,
    dense,
    first_crossing,
    largest,
    load,
    row_bounds,
    shift,
    strip,
)
from nonsmooth.kernels.series.step import degree_of
from nonsmooth.kernels.series.taylor import dense_states


@once
def widen(a, b, form, tables, work, kept):
    """Extend the extremes by a step, when it is over; rows that cannot exceed the old ones cost a bound."""
    if work.tally[place.OPEN_STEP] == 1 or not (b > a):
        return
    C, n, mode, poly, top, bottom = work.C, work.w.shape[0], work.tally[MODE], work.a, kept.high, kept.low
    m = degree_of(form)
    for row in range(form.kinds.shape[0]):
        if form.kinds[row] < 1 or (row < n and form.lacking[mode, row] == 1):
            continue
        _, low, high = row_bounds(C, row, 1.0, m, work.powers)
        if form.kinds[row] == 2 and low == high == 0.0:
            continue
        if high > top[row]:
            top[row] = largest(poly, load(C, row, 1.0, m, work.powers, poly), top[row], work.stack)
        if low < bottom[row]:
            bottom[row] = -largest(poly, load(C, row, -1.0, m, work.powers, poly), -bottom[row], work.stack)
    if form.corners == 1:
        widen_corners(m, form, work, kept)


@once
def widen_corners(m, form, work, kept):
    """Outputs with a corner have no polynomial: sampled five times on the step."""
    n, h = work.w.shape[0], work.memo[place.PART]
    values = values_of(form)
    for j in range(5):
        dense_states(work.C, m, n, 0.25 * j * h, work.dense)
        values(work.tally[MODE], work.memo[place.BASE] + 0.25 * j * h, work.dense, work.q, work.vals)
        for row in range(n, form.kinds.shape[0]):
            if form.kinds[row] == 0:
                kept.high[row] = max(kept.high[row], work.vals[row - n])
                kept.low[row] = min(kept.low[row], work.vals[row - n])


@once
def finish(form, tables, work, kept):
    """Extremes of the rows that repeat a state."""
    for row in range(work.w.shape[0], form.kinds.shape[0]):
        if form.kinds[row] < 0:
            kept.high[row] = kept.high[-1 - form.kinds[row]]
            kept.low[row] = kept.low[-1 - form.kinds[row]]


@once
def log_touches(step, form, net, log, tables, work):
    """Log every local maximum <= 0 of an armed row on the step.

    ``work.rise`` is the sign of each row's slope at the end of the step before (0: just after a jump). A slope of
    rounding falls: where motion turns as a step ends, the maximum belongs to that step and not to what follows."""
    C, n, powers, rows, rise = work.C, work.w.shape[0], work.powers, net.rows, work.rise
    a, d, stack, found, u, scale = work.a, work.d, work.stack, work.found, work.dense, work.scale
    m = degree_of(form)
    mode, t, h, count = work.tally[MODE], work.memo[DONE], work.memo[place.PART], work.tally[TOUCHES]
    for j in range(net.mode_start[mode], net.mode_start[mode + 1]):
        for r in range(net.row_start[net.mode_list[j]], net.row_start[net.mode_list[j] + 1]):
            i, sign = rows[r, 0], rows[r, 1]
            if asked_before(net, mode, j, i, sign):
                continue
            mr = load(C, n + i, float(sign), m, powers, a)
            cursor, before, begun = 0.0, rise[r], False
            for _ in range(mr):
                terms = 0.0
                for k in range(mr):
                    d[k] = (k + 1) * a[k + 1]
                    terms += fabs(d[k])
                for k in range(mr, 5):
                    d[k] = 0.0
                md = mr - 1 if mr > 5 else 4
                if begun:
                    before = 0
                    if cursor > 0.0:
                        shift(d, md, cursor, 1.0 - cursor, d)
                        d[0] = 0.0
                d[0] -= NOISE * terms
                md = strip(d, md)
                if md < 0:
                    rise[r] = 0
                    break
                x = first_crossing(d, md, DOWN, before, 0.0, stack, found)
                rise[r] = found[1]
                if x == NONE:
                    break
                cursor, begun = cursor + x * (1.0 - cursor), True
                v = dense(a, mr, cursor)
                if v <= NOISE * scale[i] and count < log.touch_time.shape[0]:
                    dense_states(C, m, n, cursor * h, u)
                    log.touch_time[count], log.touch_indicator[count] = t + cursor * h, i
                    log.touch_gap[count] = max(-v, 0.0)
                    for k in range(n):
                        log.touch_u[count, k] = u[k]
                    count += 1
                if cursor >= 1.0:
                    break
    work.tally[TOUCHES] = count
