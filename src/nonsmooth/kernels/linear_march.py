"""One leg of a trajectory and what happens at its end: jumps, after-limits, start rules.

A leg is one step of the mode, or its part up to the first crossing, section return or stop. ``w`` holds
(u_1, ..., u_n, 1, cos k_1 w t, sin k_1 w t, ...), ``s`` is the time since the start of the forcing period.

``transitions`` rows: target, has reset, is contact. ``rows`` rows: functional, sign, strict; the last two belong to
the Poincare section (rising, falling). ``mode_start``/``mode_list``: outgoing transitions of a mode in declared order.
"""

from math import cos, fabs, isfinite, sin

from .cache import device, inline
from .codes import BEYOND_STOP, OK
from .linear_search import NEVER, bound_at, classify, dense, search, slope_of, to_node, turn, value_of
from .linear_tables import HARMONICS, NODES, ONE, STATES, WAVE, M

EPS = 2.3e-16


@inline
def set_phase(w, s, rates):
    """Harmonics of the forcing at the time s in the period."""
    for h in range(HARMONICS):
        w[WAVE + 2 * h] = cos(rates[h] * s)
        w[WAVE + 1 + 2 * h] = sin(rates[h] * s)


@inline
def wrap_phase(w, s, mode, info, rot, rates):
    """Harmonics of the forcing at a time s shorter than a step of the mode, from its table: no drift over periods."""
    spacing = info[mode, 1]
    node = min(int(s / spacing + 0.5), NODES)
    local = s - node * spacing
    for h in range(HARMONICS):
        c, s_ = turn(rates[h] * local, rot[mode, node, 2 * h], rot[mode, node, 2 * h + 1])
        w[WAVE + 2 * h] = c
        w[WAVE + 1 + 2 * h] = s_


@inline
def rounding(fun, mode, f, at, w):
    """Below this the row fun[mode, f, at:] is zero within rounding at w."""
    total = 0.0
    for j in range(M):
        total += fabs(fun[mode, f, at + j] * w[j])
    return 16.0 * EPS * total


@inline
def flat(fun, mode, f, w):
    """Whether the slope of functional f is zero within rounding at w."""
    return fabs(slope_of(fun, mode, f, w)) <= rounding(fun, mode, f, M, w)


@inline
def mark_zeros(fun, info, mode, w, zero):
    """Which indicators are zero within rounding at w (1), or zero with a slope that is (2): where a stick ends.

    At a crossing w carries the rounding of the step that led there: it decides where an indicator has no constant
    part, such as that of a stop at x = 0."""
    step = 0.0
    for k in range(info.shape[0]):
        step = max(step, info[k, 0])
    for f in range(zero.shape[0]):
        noise = rounding(fun, mode, f, 0, w) + 0.25 * step * rounding(fun, mode, f, M, w)
        zero[f] = 1 if fabs(value_of(fun, mode, f, w)) <= noise else 0
        if zero[f] != 0 and flat(fun, mode, f, w):
            zero[f] = 2


@device
def sign_of_derivatives(tay, mode, f, w):
    """Sign of the first derivative of functional f, from the second to the fourth, that is not zero."""
    for k in range(2, 5):
        total = tay[mode, f, ONE, k]
        size = fabs(total)
        for j in range(M):
            if j != ONE:
                total += tay[mode, f, j, k] * w[j]
                size += fabs(tay[mode, f, j, k] * w[j])
        if fabs(total) > 64.0 * EPS * size:
            return 1 if total > 0.0 else -1
    return 0


@inline
def sign_after(fun, tay, mode, w, f, zero):
    """Sign (-1, 0, 1) of functional f just after w along the mode: its value's, or its first non-zero derivative's."""
    if f >= zero.shape[0] or zero[f] == 0:
        return 1 if value_of(fun, mode, f, w) > 0.0 else -1
    if not flat(fun, mode, f, w):
        return 1 if slope_of(fun, mode, f, w) > 0.0 else -1
    return sign_of_derivatives(tay, mode, f, w)


@inline
def next_holding(fun, tay, mode, w, rows, row_start, mode_start, mode_list, zero):
    """The first outgoing transition (in declared order) whose rows all hold just after w, or -1."""
    for k in range(mode_start[mode], mode_start[mode + 1]):
        t = mode_list[k]
        lo = row_start[t]
        hi = row_start[t + 1]
        holds = lo < hi
        for r in range(lo, hi):
            sign = sign_after(fun, tay, mode, w, rows[r, 0], zero) * rows[r, 1]
            if sign < 0 or (sign == 0 and rows[r, 2] != 0):
                holds = False
                break
        if holds:
            return t
    return -1


@device
def settle(fun, tay, info, mode, w, transitions, rows, row_start, mode_start, mode_list, zero):
    """Start rule: transitions without a reset that already hold are taken, each mode at most once.

    Returns (mode, status): BEYOND_STOP where one with a reset holds."""
    visited = 1 << mode
    for _ in range(64):
        mark_zeros(fun, info, mode, w, zero)
        t = next_holding(fun, tay, mode, w, rows, row_start, mode_start, mode_list, zero)
        if t < 0:
            return mode, OK
        if transitions[t, 1] != 0:
            return mode, BEYOND_STOP
        if (visited >> transitions[t, 0]) & 1:
            return mode, OK
        mode = transitions[t, 0]
        visited |= 1 << mode
    return mode, OK


@inline
def jump(i, t, fired, fun, info, w, wn, transitions, ra, rb, rc, rs, zero):
    """Take transition t (its functional ``fired`` has just crossed; -1: a time trigger). Returns the new mode.

    What has crossed is zero, also behind a reset that leaves it where it was."""
    mode = transitions[t, 0]
    if transitions[t, 1] != 0:
        off = fabs(value_of(fun, mode, fired, w)) if fired >= 0 else 0.0
        for r in range(STATES):
            wn[r] = rb[i, t, r]
            for j in range(STATES):
                wn[r] += ra[i, t, r, j] * w[j]
            for h in range(HARMONICS):
                wn[r] += rc[i, t, h, r] * w[WAVE + 2 * h] + rs[i, t, h, r] * w[WAVE + 1 + 2 * h]
        for r in range(STATES):
            w[r] = wn[r]
        if fired >= 0 and fabs(value_of(fun, mode, fired, w)) > 2.0 * off:
            fired = -1
    mark_zeros(fun, info, mode, w, zero)
    if fired >= 0:
        zero[fired] = 2 if flat(fun, mode, fired, w) else 1
    return mode


@inline
def trigger(mode, s, period, mode_start, mode_list, at):
    """Time to the next time-triggered transition of the mode, and that transition (-1: none)."""
    wait = 1e300
    which = -1
    for k in range(mode_start[mode], mode_start[mode + 1]):
        t = mode_list[k]
        if at[t] >= 0.0:
            r = at[t] * period - s
            if r <= 0.0:
                r += period
            if r < wait:
                wait = r
                which = t
    return wait, which


@inline
def clear_step(fun, info, mode, w, w1, rows, row_start, mode_start, mode_list, zero):
    """Whether no transition can fire on the whole step from w to w1: each has a row that certainly stays <= 0."""
    clear = True
    for k in range(mode_start[mode], mode_start[mode + 1]):
        t = mode_list[k]
        blocked = False
        for r in range(row_start[t], row_start[t + 1]):
            f = rows[r, 0]
            sign = float(rows[r, 1])
            g0 = sign * value_of(fun, mode, f, w)
            if zero[f] != 0:
                g0 = 0.0
            g1 = sign * value_of(fun, mode, f, w1)
            s0 = sign * slope_of(fun, mode, f, w)
            s1 = sign * slope_of(fun, mode, f, w1)
            if zero[f] == 2:
                s0 = 0.0
            if classify(g0, s0, g1, s1, info[mode, 0], bound_at(fun, info, mode, f, w)) == NEVER:
                blocked = True
                break
        if not blocked:
            clear = False
            break
    return clear


@inline
def stride(
    prop, rot, fun, info, mode, rates, w, w1, rows, row_start, mode_start, mode_list, zero, s, whole, target, period,
    returns, most,
):  # fmt: skip
    """Whole steps without crossings, past section phases, as long as ``returns`` < ``most``.

    Returns (s, whole, returns, clear); w1 then stands at the end of the step that is not clear, or that would be one
    return too many (``clear``: no transition on it)."""
    step = info[mode, 0]
    to_node(prop, rot, mode, NODES, w, w1)
    clear = False
    while clear_step(fun, info, mode, w, w1, rows, row_start, mode_start, mode_list, zero):
        after = s + step
        if (s < target and target <= after) or (s < target + period and target + period <= after):
            if returns + 1 >= most:
                clear = True
                break
            returns += 1
        s = after
        for j in range(M):
            w[j] = w1[j]
        if s >= period:
            s -= period
            whole += 1.0
            wrap_phase(w, s, mode, info, rot, rates)
            lost = False
            for r in range(STATES):
                lost = lost or not fabs(w[r]) < 1e300
            if lost:
                break
        for f in range(zero.shape[0]):
            zero[f] = 0
        to_node(prop, rot, mode, NODES, w, w1)
    return s, whole, returns, clear


@inline
def leg(
    prop, rot, fun, tay, info, mode, n_i, rates, w, r_max, rows, row_start, mode_start, mode_list,
    surface, direction, surface_mode, zero, w1, wn, wp, wq, scr, points, end, there, found, ready,
):  # fmt: skip
    """March one step of the mode, or less: to r_max, or to the first crossing or section return.

    w1 stands at the end of the whole step (``ready``: it does so already), ``end`` at the leg's end where that is
    shorter (the third number returned tells). Returns (time marched, transition or -1, whole step or not, section
    direction or 0). ``found[0]`` is the functional that crossed, ``found[3]`` the sign of the section's functional
    when the leg begins.
    """
    if not ready:
        to_node(prop, rot, mode, NODES, w, w1)
    found[1] = -1
    step = info[mode, 0]
    best = min(step, r_max)
    fired = -1
    crossed = 0
    functional = -1
    n_rows = rows.shape[0]
    start = mode_start[mode]
    n_own = mode_start[mode + 1] - start
    n_all = n_own + 2 if surface >= 0 and (surface_mode < 0 or surface_mode == mode) else n_own
    for k in range(n_all):
        t = -1
        sense = 0
        if k < n_own:
            t = mode_list[start + k]
            lo = row_start[t]
            hi = row_start[t + 1]
        else:
            sense = 1 - 2 * (k - n_own)
            lo = n_rows - 2 + k - n_own
            hi = lo + 1
        if lo == hi or direction * sense < 0:
            continue
        tau = search(
            prop, rot, fun, tay, info, mode, n_i, rates, w, w1, rows, lo, hi, zero, sense * found[3] > 0, best,
            wn, wp, wq, scr,
            points, found, there,
        )  # fmt: skip
        if tau >= 0.0 and (tau < best or (fired < 0 and crossed == 0 and tau <= best)):
            best = tau
            fired = t
            crossed = sense
            functional = found[0]
            for j in range(M):
                end[j] = there[j]
    found[0] = functional
    whole = fired < 0 and crossed == 0 and r_max >= step
    if not whole and functional < 0:
        dense(prop, rot, tay, info, mode, n_i, rates, w, best, wn, scr, found, end)
    return best, fired, whole, crossed


@inline
def bounded(w, limit):
    """Finite and below the limits of divergence."""
    within = True
    for r in range(STATES):
        within = within and isfinite(w[r]) and fabs(w[r]) < limit[r]
    return within
