"""One trajectory with its samples, crossings and touches, by the exact flow."""

from .cache import device, kernel
from .codes import CHATTER, DIVERGED, LOG_FULL, OK, TOO_MANY_CROSSINGS
from .linear_layout import _INTEGERS, _LINEAR, _MATRIX, _NET, _SCRATCH, _VECTOR, BURST, MOST_CROSSINGS, SHORT
from .linear_march import bounded, jump, leg, mark_zeros, next_holding, set_phase, settle, trigger, wrap_phase
from .linear_polynomial import critical_points, curvature_at, horner
from .linear_search import compose, dense, to_node
from .linear_tables import HARMONICS, NODES, ONE, STATES, M, build


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
                    for j in range(STATES):
                        compose(tay, mode, n_i + j, wn, scr, 1)
                        touch_u[n, j] = horner(scr, 1, local)
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
    crossings in a burst.
    """
    n_i = ia.shape[1]
    w, w1, wn, wp, wq, end, there = (
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], vectors[5], vectors[6],
    )  # fmt: skip
    zero = integers[0:n_i]
    found = integers[n_i : n_i + 4]
    T = period[0]
    for h in range(HARMONICS):
        rates[h] = multiples[h] * omega[0]
    if integers[2 * n_i + 4] != 1:
        build(0, A, b, c, s_, rates, T, ia, ib, ic, is_, oa, ob, oc, os_, prop, rot, fun, tay, field, info, row)
        integers[2 * n_i + 4] = 1
    s = clock[0]
    whole = clock[1]
    mode = counters[0]
    for j in range(STATES):
        w[j] = u[j]
    w[ONE] = 1.0
    set_phase(w, s, rates)
    code = OK
    mark_zeros(fun, info, mode, w, zero)
    if counters[1] == 0:
        mode, code = settle(fun, tay, info, mode, w, transitions, rows, row_start, mode_start, mode_list, zero)
        counters[1] = 1
    n_s = progress[0]
    n_c = progress[1]
    n_t = progress[2]
    base = whole * T + s if T < 1e300 else s
    since = 1e300  # time since the last crossing
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
            for j in range(STATES):
                sample_u[n_s, j] = wp[j]
            sample_mode[n_s] = mode
            sample_segment[n_s] = n_c
            n_s += 1
        n_t = log_touches(
            step, base, prop, rot, fun, tay, info, mode, n_i, w, rows, row_start, mode_start, mode_list,
            wn, points, scr, touch_time, touch_indicator, touch_u, touch_gap, n_t,
        )  # fmt: skip
        short = since + step < SHORT * info[mode, 0]
        since = 0.0 if t >= 0 else since + step
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
                for j in range(STATES):
                    u_before[n_c, j] = w[j]
                mode = jump(0, t, fired if jumps == 0 else -1, fun, info, w, wn, transitions, ra, rb, rc, rs, zero)
                for j in range(STATES):
                    u_after[n_c, j] = w[j]
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
            for j in range(STATES):
                sample_u[n_s, j] = w[j]
            sample_mode[n_s] = mode
            sample_segment[n_s] = n_c
            n_s += 1
    for j in range(STATES):
        u[j] = w[j]
    clock[0] = s
    clock[1] = whole
    clock[2] = T if T < 1e300 else 0.0
    counters[0] = mode
    progress[0] = n_s
    progress[1] = n_c
    progress[2] = n_t
    return code
