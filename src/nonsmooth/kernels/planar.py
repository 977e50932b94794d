"""The exact flow of planar (two-state) piecewise-linear systems with harmonic forcing: the two kernels.

``chain`` runs the points of a sweep one after the other; ``record`` marches one trajectory and logs samples,
crossings and touches. The numerics are in planar_tables (propagators), planar_search (crossings, extremes) and
planar_march (legs, jumps); ``planar_module`` joins the four files.
"""

import numpy as np

from .cache import device, inline, kernel
from .codes import CHATTER, DIVERGED, LOG_FULL, NO_CONVERGENCE, OK, TOO_MANY_CROSSINGS
from .planar_march import bounded, jump, leg, next_holding, set_phase, settle, stride, trigger, wrap_phase
from .planar_search import (
    WIDTH, compose, critical_points, curvature_at, dense, exceeds, horner, locate_maximum, to_node, value_of,
)  # fmt: skip
from .planar_tables import DEGREE, HARMONICS, NODES, TERMS, M, build

MOST_CROSSINGS = 1000  # within one section return
BURST = 50  # crossings in a row at intervals below SHORT of the mode's step end a run as chatter
SHORT = 1e-11

_VECTOR, _INTEGERS = "float64[::1], ", "int64[::1], "
_MATRIX, _TABLE, _BLOCK = "float64[:,::1], ", "float64[:,:,::1], ", "float64[:,:,:,::1], "
_LINEAR = (
    _BLOCK + _TABLE + _BLOCK * 2 + _INTEGERS + _VECTOR * 2  # A, b, c, s, multiples, omega, period
    + _TABLE + _MATRIX + _TABLE * 2  # ia, ib, ic, is
    + (_BLOCK + _TABLE + _BLOCK * 2) * 2  # oa, ob, oc, os, ra, rb, rc, rs
)  # fmt: skip
_NET = "int64[:,::1], int64[:,::1], " + _INTEGERS * 3 + _VECTOR  # transitions, rows, row and mode starts, list, at
_SCRATCH = _BLOCK + _TABLE * 2 + _BLOCK + _TABLE + _MATRIX * 4 + _VECTOR * 2 + "int64[::1]"


def scratch(n_modes, n_indicators, n_outputs, n_rows):
    """Work arrays for one thread: prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers."""
    n_f = n_indicators + 2 + n_outputs
    return (
        np.zeros((n_modes, NODES + 1, 2, M)), np.zeros((n_modes, NODES + 1, 2 * HARMONICS + 1)),
        np.zeros((n_modes, n_f, 2 * M + 6)), np.zeros((n_modes, n_f, M, DEGREE + 1)), np.zeros((n_modes, 2, M)),
        np.zeros((n_modes, 4)), np.zeros((TERMS + 1, M)), np.zeros((7, M)), np.zeros((n_rows + 3, WIDTH)),
        np.zeros(4), np.zeros(HARMONICS), np.zeros(2 * n_indicators + 2, dtype=np.int64),
    )  # fmt: skip


@inline
def extreme_slot(f, n_i, maximum, minimum, i_max, i_min, o_max, o_min):
    """Where the extremes of functional f are kept."""
    if f < n_i:
        return i_max, i_min, f
    if f < n_i + 2:
        return maximum, minimum, f - n_i
    return o_max, o_min, f - n_i - 2


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
        for k in range(2):
            same = fun[0, f, k] == 1.0 and fun[0, f, 1 - k] == 0.0
            for j in range(3, M):
                same = same and fun[0, f, j] == 0.0
            if same:
                twin[f] = k


@inline
def finish(i, fun, n_i, twin, maximum, minimum, i_max, i_min):
    """Extremes of the indicators that are a state but for a constant."""
    for f in range(n_i):
        if twin[f] >= 0:
            i_max[i, f] = maximum[i, twin[f]] + fun[0, f, 2]
            i_min[i, f] = minimum[i, twin[f]] + fun[0, f, 2]


@device
def include(i, fun, mode, w, n_i, maximum, minimum, i_max, i_min, o_max, o_min):
    """Extend the extremes of point i by the instant w."""
    for f in range(fun.shape[1]):
        hi, lo, k = extreme_slot(f, n_i, maximum, minimum, i_max, i_min, o_max, o_min)
        value = value_of(fun, mode, f, w)
        hi[i, k] = max(hi[i, k], value)
        lo[i, k] = min(lo[i, k], value)


@inline
def stroboscopic_hit(s, s1, target, period):
    """Time after s at which the section phase is met within (s, s1], or -1. Judged on the clock, so none counts twice."""
    if s < target and target <= s1:
        return target - s
    if s < target + period and target + period <= s1:
        return target + period - s
    return -1.0


@kernel(
    "void(int64, int64, int64, " + _MATRIX + _VECTOR * 2 + _INTEGERS + _LINEAR + _NET
    + "float64, " + _INTEGERS + "float64, int64, int64, " + _VECTOR
    + _TABLE + _MATRIX * 6 + _INTEGERS * 2 + _VECTOR + _MATRIX + "int64[:,::1], " + _INTEGERS + _SCRATCH + ")"
)  # fmt: skip
def chain(
    first, last, carry, starts,
    u, clock, counters,
    A, b, c, s_, multiples, omega, period, ia, ib, ic, is_, oa, ob, oc, os_, ra, rb, rc, rs,
    transitions, rows, row_start, mode_start, mode_list, at,
    phase, plan, t_max, transient, keep, limit,
    section, maximum, minimum, i_max, i_min, o_max, o_min,
    crossings, contacts, elapsed, section_time, section_mode, status,
    prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers,
):  # fmt: skip
    """Run points first <= i < last: ``transient`` section returns, then ``keep`` more, stored.

    ``plan`` = section functional (-1: stroboscopic), direction, mode, after, every. The kept window reaches from
    the last transient return (or the start) to the last kept one; its end is where a carried state goes on.
    """
    n_i = ia.shape[1]
    w, w1, wn, wp, wq, end, there = (
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5], vectors[6],
    )  # fmt: skip
    zero = integers[0:n_i]
    found = integers[n_i : n_i + 2]
    twin = integers[n_i + 2 : 2 * n_i + 2]
    surface, direction, surface_mode, after, every = plan[0], plan[1], plan[2], plan[3], plan[4]
    w[2] = 1.0
    # whole steps at a stride: only where nothing but a crossing can end a step
    strides = surface < 0 and period[first] < 1e300
    for k in range(at.shape[0]):
        strides = strides and at[k] < 0.0
    for i in range(first, last):
        for h in range(HARMONICS):
            rates[h] = multiples[h] * omega[i]
        T = period[i]
        build(i, A, b, c, s_, rates, T, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
        find_twins(fun, n_i, twin)
        target = phase * T
        s = 0.0
        whole = 0.0
        mode = 0
        if carry != 0:
            w[0] = u[0]
            w[1] = u[1]
            mode = counters[0]
            whole = clock[1]
            # carried at equal phase of the forcing, also where its frequency changes
            s = clock[0] / clock[2] * T if clock[2] > 0.0 else clock[0]
        else:
            w[0] = starts[i, 0]
            w[1] = starts[i, 1]
        for k in range(maximum.shape[1]):
            maximum[i, k] = -1e300
            minimum[i, k] = 1e300
        for k in range(i_max.shape[1]):
            i_max[i, k] = -1e300
            i_min[i, k] = 1e300
        for k in range(o_max.shape[1]):
            o_max[i, k] = -1e300
            o_min[i, k] = 1e300
        set_phase(w, s, rates)
        mode, code = settle(fun, tay, mode, w, transitions, rows, row_start, mode_start, mode_list, zero)
        crossings[i] = 0
        contacts[i] = 0
        elapsed[i] = 0.0
        returns = 0
        passes = 0
        n_here = 0
        burst = 0
        waited = 0.0
        closed = False
        while code == OK and returns < transient + keep:
            ready = strides and returns < transient
            if ready:
                counted = returns
                s, whole, returns = stride(
                    prop, rot, fun, info, mode, rates, w, w1, rows, row_start, mode_start, mode_list, zero,
                    s, whole, target, T, returns, transient,
                )  # fmt: skip
                if returns > counted:
                    n_here = 0
            wait, timed = (1e300, -1) if strides else trigger(mode, s, T, mode_start, mode_list, at)
            step, t, full, crossed = leg(
                prop, rot, fun, tay, info, mode, n_i, rates, w, wait, rows, row_start, mode_start, mode_list,
                surface, direction, surface_mode, zero, w1, wn, wp, wq, scr, points, end, there, found,
                ready,
            )  # fmt: skip
            if t < 0 and crossed == 0 and timed >= 0 and step >= wait:
                t = timed
                found[0] = -1
            s1 = s + step
            a = 0.0
            b_ = step
            is_open = returns >= transient
            if surface < 0:
                r = stroboscopic_hit(s, s1, target, T)
                if r >= 0.0:
                    r = min(r, step)
                    returns += 1
                    n_here = 0
                    if is_open:
                        k = returns - transient - 1
                        dense(prop, rot, tay, info, mode, n_i, rates, w, r, wn, scr, found, wp)
                        section[i, k, 0] = wp[0]
                        section[i, k, 1] = wp[1]
                        section_mode[i, k] = mode
                        turn = whole if s < target and target <= s1 else whole + 1.0
                        section_time[i, k] = turn * T + target
                        if returns == transient + keep:
                            closed = True
                            b_ = r
                            whole = turn
                    elif returns == transient:
                        is_open = True
                        a = r
            if is_open:
                widen(
                    i, a, b_, prop, rot, fun, tay, info, mode, w, w1, n_i, twin, maximum, minimum, i_max, i_min,
                    o_max, o_min, wn, wq, scr, points,
                )  # fmt: skip
                elapsed[i] += b_ - a
            if closed:
                s = target
                w[0] = section[i, keep - 1, 0]
                w[1] = section[i, keep - 1, 1]
                break
            waited += step
            short = step < SHORT * info[mode, 0]
            for j in range(M):
                w[j] = w1[j] if full else end[j]
            s = s1
            if s >= T:
                s -= T
                whole += 1.0
                wrap_phase(w, s, mode, info, rot, rates)
                if not bounded(w, limit):
                    code = DIVERGED
            for f in range(n_i):
                zero[f] = 0
            if t >= 0 or crossed != 0:
                fired = found[0]
                before0 = w[0]
                before1 = w[1]
                before_mode = mode
                jumps = 0
                sense = 0
                if t < 0:
                    zero[surface] = 1
                else:
                    if surface >= 0:
                        for k in range(row_start[t], row_start[t + 1]):
                            if rows[k, 0] == fired:
                                sense = rows[k, 1]
                    nxt = t
                    while nxt >= 0:  # and those that hold just after it, at the same instant
                        if jumps > mode_start.shape[0]:
                            code = CHATTER
                            break
                        mode = jump(i, nxt, fired if jumps == 0 else -1, fun, w, wn, transitions, ra, rb, rc, rs, zero)
                        jumps += 1
                        if is_open:
                            crossings[i] += 1
                            contacts[i] += transitions[nxt, 2]
                            include(i, fun, mode, w, n_i, maximum, minimum, i_max, i_min, o_max, o_min)
                        nxt = next_holding(fun, tay, mode, w, rows, row_start, mode_start, mode_list, zero)
                    n_here += jumps
                    burst = burst + 1 if short else 0
                    if burst > BURST:
                        code = CHATTER
                    elif n_here > MOST_CROSSINGS:
                        code = TOO_MANY_CROSSINGS
                    # a section that lies on the surface just crossed
                    if surface >= 0 and fired == surface and sense != 0 and direction * sense >= 0:
                        if surface_mode < 0 or surface_mode == (mode if after != 0 else before_mode):
                            crossed = sense
                if not bounded(w, limit):
                    code = DIVERGED
                if crossed != 0:
                    passes += 1
                    waited = 0.0
                    n_here = 0
                    if passes % every == 0:
                        returns += 1
                        if returns > transient:
                            k = returns - transient - 1
                            section[i, k, 0] = w[0] if after != 0 else before0
                            section[i, k, 1] = w[1] if after != 0 else before1
                            section_mode[i, k] = mode if after != 0 else before_mode
                            section_time[i, k] = (whole * T if T < 1e300 else 0.0) + s
            if surface >= 0 and waited > t_max and code == OK:
                code = NO_CONVERGENCE
        finish(i, fun, n_i, twin, maximum, minimum, i_max, i_min)
        status[i] = code
        if code == OK:
            u[0] = w[0]
            u[1] = w[1]
            clock[0] = s
            clock[1] = whole
            clock[2] = T if T < 1e300 else 0.0
            counters[0] = mode


@device
def log_touches(
    b, base, prop, rot, fun, tay, info, mode, n_i, w, rows, row_start, mode_start, mode_list, wn, points, scr,
    touch_time, touch_indicator, touch_u, touch_gap, n,
):  # fmt: skip
    """Append the local maxima of the mode's armed rows that stay <= 0 within (0, b) of a leg. Returns the new count."""
    spacing = info[mode, 1]
    for j in range(mode_start[mode], mode_start[mode + 1]):
        t = mode_list[j]
        for r in range(row_start[t], row_start[t + 1]):
            f = rows[r, 0]
            sign = float(rows[r, 1])
            for node in range(1, NODES, 2):  # pieces of two spacings, with their polynomial in the middle
                if (node - 1) * spacing >= b or n >= touch_time.shape[0]:
                    break
                to_node(prop, rot, mode, node, w, wn)
                compose(tay, mode, f, wn, scr, 0)
                count = critical_points(scr, 0, -spacing, spacing, points)
                for k in range(count):
                    local = points[k]
                    value = sign * horner(scr, 0, local)
                    tau = node * spacing + local
                    if tau <= 0.0 or tau >= b or value > 0.0 or sign * curvature_at(scr, 0, local) > 0.0:
                        continue
                    touch_time[n] = base + tau
                    touch_indicator[n] = f
                    touch_gap[n] = -value
                    for r_ in range(2):
                        compose(tay, mode, n_i + r_, wn, scr, 1)
                        touch_u[n, r_] = horner(scr, 1, local)
                    n += 1
    return n


@kernel(
    "int64(" + _VECTOR * 2 + _INTEGERS + _LINEAR + _NET + "float64, " + _VECTOR + _INTEGERS + _VECTOR
    + _MATRIX + _INTEGERS * 2 + _VECTOR + _INTEGERS + _MATRIX * 2 + _VECTOR + _INTEGERS + _MATRIX + _VECTOR
    + _SCRATCH + ")"
)  # fmt: skip
def record(
    u, clock, counters,
    A, b, c, s_, multiples, omega, period, ia, ib, ic, is_, oa, ob, oc, os_, ra, rb, rc, rs,
    transitions, rows, row_start, mode_start, mode_list, at,
    until, samples, progress, limit,
    sample_u, sample_mode, sample_segment,
    crossing_time, crossing_transition, u_before, u_after,
    touch_time, touch_indicator, touch_u, touch_gap,
    prop, rot, fun, tay, field, info, row, vectors, scr, points, rates, integers,
):  # fmt: skip
    """March to the time ``until``; log samples, crossings, touches. LOG_FULL asks to be called again.

    ``counters`` = mode, settled. ``progress`` = samples, crossings and touches so far, crossings in this period,
    crossings in a burst. The zero flags in ``integers`` are part of what a second call goes on from.
    """
    n_i = ia.shape[1]
    w, w1, wn, wp, wq, end, there = (
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5], vectors[6],
    )  # fmt: skip
    zero = integers[0:n_i]
    found = integers[n_i : n_i + 2]
    T = period[0]
    for h in range(HARMONICS):
        rates[h] = multiples[h] * omega[0]
    build(0, A, b, c, s_, rates, T, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
    s = clock[0]
    whole = clock[1]
    mode = counters[0]
    w[0] = u[0]
    w[1] = u[1]
    w[2] = 1.0
    set_phase(w, s, rates)
    code = OK
    if counters[1] == 0:
        mode, code = settle(fun, tay, mode, w, transitions, rows, row_start, mode_start, mode_list, zero)
        counters[1] = 1
    n_s = progress[0]
    n_c = progress[1]
    n_t = progress[2]
    base = whole * T + s if T < 1e300 else s
    while code == OK and base < until:
        if n_c + 64 > crossing_time.shape[0] or n_t + 64 > touch_time.shape[0]:
            code = LOG_FULL
            break
        wait, timed = trigger(mode, s, T, mode_start, mode_list, at)
        rest = until - base
        step, t, full, _ = leg(
            prop, rot, fun, tay, info, mode, n_i, rates, w, min(wait, rest), rows, row_start, mode_start, mode_list,
            -1, 0, -1, zero, w1, wn, wp, wq, scr, points, end, there, found, False,
        )  # fmt: skip
        if t < 0 and timed >= 0 and step >= wait:
            t = timed
            found[0] = -1
        while n_s < samples.shape[0] and samples[n_s] - base < step:
            dense(prop, rot, tay, info, mode, n_i, rates, w, max(samples[n_s] - base, 0.0), wn, scr, found, wp)
            sample_u[n_s, 0] = wp[0]
            sample_u[n_s, 1] = wp[1]
            sample_mode[n_s] = mode
            sample_segment[n_s] = n_c
            n_s += 1
        n_t = log_touches(
            step, base, prop, rot, fun, tay, info, mode, n_i, w, rows, row_start, mode_start, mode_list,
            wn, points, scr, touch_time, touch_indicator, touch_u, touch_gap, n_t,
        )  # fmt: skip
        short = step < SHORT * info[mode, 0]
        for j in range(M):
            w[j] = w1[j] if full else end[j]
        s += step
        if s >= T:
            s -= T
            whole += 1.0
            wrap_phase(w, s, mode, info, rot, rates)
            progress[3] = 0
        elif T > 1e300 and t < 0:
            progress[3] = 0
        base = until if (step >= rest and t < 0) else (whole * T + s if T < 1e300 else s)
        for f in range(n_i):
            zero[f] = 0
        if t >= 0:
            fired = found[0]
            jumps = 0
            while t >= 0:
                if jumps > mode_start.shape[0]:
                    code = CHATTER
                    break
                crossing_time[n_c] = base
                crossing_transition[n_c] = t
                u_before[n_c, 0] = w[0]
                u_before[n_c, 1] = w[1]
                mode = jump(0, t, fired if jumps == 0 else -1, fun, w, wn, transitions, ra, rb, rc, rs, zero)
                u_after[n_c, 0] = w[0]
                u_after[n_c, 1] = w[1]
                n_c += 1
                jumps += 1
                t = next_holding(fun, tay, mode, w, rows, row_start, mode_start, mode_list, zero)
            progress[3] += jumps
            progress[4] = progress[4] + 1 if short else 0
            if progress[4] > BURST:
                code = CHATTER
            elif progress[3] > MOST_CROSSINGS:
                code = TOO_MANY_CROSSINGS
        if not bounded(w, limit):
            code = DIVERGED
    if code == OK:
        while n_s < samples.shape[0] and samples[n_s] <= until:
            sample_u[n_s, 0] = w[0]
            sample_u[n_s, 1] = w[1]
            sample_mode[n_s] = mode
            sample_segment[n_s] = n_c
            n_s += 1
    u[0] = w[0]
    u[1] = w[1]
    clock[0] = s
    clock[1] = whole
    clock[2] = T if T < 1e300 else 0.0
    counters[0] = mode
    progress[0] = n_s
    progress[1] = n_c
    progress[2] = n_t
    return code
