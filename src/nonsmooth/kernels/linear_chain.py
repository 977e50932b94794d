"""The points of a sweep one after the other, by the exact flow."""

from .cache import inline, kernel
from .codes import CHATTER, DIVERGED, NO_CONVERGENCE, OK, TOO_MANY_CROSSINGS
from .linear_extremes import find_twins, finish, include, widen
from .linear_layout import (
    _INTEGERS,
    _LINEAR,
    _MATRIX,
    _NET,
    _SCRATCH,
    _TABLE,
    _VECTOR,
    BURST,
    MOST_CROSSINGS,
    MOST_STEPS,
    SHORT,
)  # fmt: skip
from .linear_march import bounded, jump, leg, next_holding, set_phase, settle, sign_after, stride, trigger, wrap_phase
from .linear_search import dense, value_of
from .linear_tables import HARMONICS, ONE, STATES, M, build


@inline
def stroboscopic_hit(s, s1, target, period):
    """Time after s at which the section phase is met within (s, s1], or -1; judged on the clock: none counts twice."""
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

    ``plan`` = section functional (-1: stroboscopic), direction, mode, after, every, extremes wanted. The kept window
    reaches from the last transient return (or the start) to the last kept one; its end is where a carried state goes
    on.
    """
    n_i = ia.shape[1]
    w, w1, wn, wp, wq, end, there, before = (
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5], vectors[6], vectors[7],
    )  # fmt: skip
    zero = integers[0:n_i]
    found = integers[n_i : n_i + 4]
    twin = integers[n_i + 4 : 2 * n_i + 4]
    surface, direction, surface_mode, after, every, extremes = plan[0], plan[1], plan[2], plan[3], plan[4], plan[5]
    w[ONE] = 1.0
    # whole steps at a stride: only where nothing but a crossing can end a step
    strides = surface < 0 and period[first] < 1e300
    for k in range(at.shape[0]):
        strides = strides and at[k] < 0.0
    for i in range(first, last):
        for h in range(HARMONICS):
            rates[h] = multiples[h] * omega[i]
        T = period[i]
        if integers[2 * n_i + 4] != i + 1:
            build(i, A, b, c, s_, rates, T, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
            integers[2 * n_i + 4] = i + 1
        find_twins(fun, n_i, twin)
        target = phase * T
        s = 0.0
        whole = 0.0
        mode = 0
        if carry != 0:
            for j in range(STATES):
                w[j] = u[j]
            mode = counters[0]
            whole = clock[1]
            # carried at equal phase of the forcing, also where its frequency changes
            s = clock[0] / clock[2] * T if clock[2] > 0.0 else clock[0]
        else:
            for j in range(STATES):
                w[j] = starts[i, j]
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
        mode, code = settle(fun, tay, info, mode, w, transitions, rows, row_start, mode_start, mode_list, zero)
        if surface >= 0:  # a start on the section is no return
            found[3] = sign_after(fun, tay, mode, w, surface, zero)
        crossings[i] = 0
        contacts[i] = 0
        elapsed[i] = 0.0
        returns = 0
        passes = 0
        n_here = 0
        burst = 0
        waited = 0.0
        tries = 0
        since = 1e300  # time since the last crossing
        closed = False
        while code == OK and returns < transient + keep:
            # where extremes are wanted, every step of the kept window must be seen
            ready = strides and (returns < transient or extremes == 0)
            clear = False
            if ready:
                counted = returns
                began, turns = s, whole
                s, whole, returns, clear = stride(
                    prop, rot, fun, info, mode, rates, w, w1, rows, row_start, mode_start, mode_list, zero,
                    s, whole, target, T, returns, transient if returns < transient else 0,
                )  # fmt: skip
                if returns > counted:
                    n_here = 0
                if s != began or whole != turns:
                    since = 1e300
                    if returns >= transient:
                        elapsed[i] += (whole - turns) * T + (s - began)
            wait, timed = (1e300, -1) if strides else trigger(mode, s, T, mode_start, mode_list, at)
            if clear:
                step, t, full, crossed = info[mode, 0], -1, True, 0
                found[1] = -1
            else:
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
            late = False  # a transition at the section's own phase comes first: a run that ends here goes on behind it
            if surface < 0:
                r = stroboscopic_hit(s, s1, target, T)
                if r >= step and t >= 0 and t == timed:
                    late = True
                elif r >= 0.0:
                    r = min(r, step)
                    returns += 1
                    n_here = 0
                    if is_open:
                        k = returns - transient - 1
                        dense(prop, rot, tay, info, mode, n_i, rates, w, r, wn, scr, found, wp)
                        for j in range(STATES):
                            section[i, k, j] = wp[j]
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
            if is_open and extremes != 0:
                widen(
                    i, a, b_, prop, rot, fun, tay, info, mode, w, w1, n_i, twin, maximum, minimum, i_max, i_min,
                    o_max, o_min, wn, wq, scr, points,
                )  # fmt: skip
            if is_open:
                elapsed[i] += b_ - a
            if closed:
                s = target
                for j in range(STATES):
                    w[j] = section[i, keep - 1, j]
                break
            waited += step
            tries += 1
            short = since + step < SHORT * info[mode, 0]
            since = 0.0 if t >= 0 else since + step
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
                for j in range(STATES):
                    before[j] = w[j]
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
                        mode = jump(
                            i, nxt, fired if jumps == 0 else -1, fun, info, w, wn, transitions, ra, rb, rc, rs, zero
                        )
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
                    tries = 0
                    n_here = 0
                    if passes % every == 0:
                        returns += 1
                        if returns > transient:
                            k = returns - transient - 1
                            for j in range(STATES):
                                section[i, k, j] = w[j] if after != 0 else before[j]
                            section_mode[i, k] = mode if after != 0 else before_mode
                            section_time[i, k] = (whole * T if T < 1e300 else 0.0) + s
            if late and code == OK:
                s = target
                returns += 1
                n_here = 0
                if returns > transient:
                    k = returns - transient - 1
                    for j in range(STATES):
                        section[i, k, j] = w[j]
                    section_mode[i, k] = mode
                    section_time[i, k] = whole * T + target
            if surface >= 0:
                if t >= 0:
                    found[3] = sign_after(fun, tay, mode, w, surface, zero)
                elif crossed != 0:
                    found[3] = crossed
                else:
                    value = value_of(fun, mode, surface, w)
                    if value != 0.0:
                        found[3] = 1 if value > 0.0 else -1
            if surface >= 0 and (waited > t_max or tries > MOST_STEPS) and code == OK:
                code = NO_CONVERGENCE
        finish(i, fun, n_i, twin, maximum, minimum, i_max, i_min)
        status[i] = code
        if code == OK:
            for j in range(STATES):
                u[j] = w[j]
            clock[0] = s
            clock[1] = whole
            clock[2] = T if T < 1e300 else 0.0
            counters[0] = mode
