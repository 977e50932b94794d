"""The stepper of the exact flow: segments of linear modes with harmonic forcing and landing.

A segment is one step of the mode, or its part up to the first crossing, section return or stop. ``work.w`` holds
(u_1, ..., u_n, 1, cos k_1 w t, sin k_1 w t, ...); times count from the start of the forcing period.
"""

from math import cos, fabs, sin

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import FIRED, MODE, NO_END, SOURCE, TIME, TRIES
from nonsmooth.kernels.hybrid.records import FORM, TABLES, WORK
from nonsmooth.kernels.linear.build import build
from nonsmooth.kernels.linear.limits import flat, pass_on, sign_after
from nonsmooth.kernels.linear.polynomial import NEVER, classify
from nonsmooth.kernels.linear.search import FUNCTIONAL, SIDE, holds_throughout, search
from nonsmooth.kernels.linear.tables import NODES, STATES, states_of, width_of
from nonsmooth.kernels.linear.values import NODE, at_ends, bound_at, dense, noise, slope_of, turn, value_of, whole_step

STEPPER = FORM, TABLES, WORK  # the types of this stepper's records: model, tables, work

AT_ONCE = 1e-13  # of a node spacing: rounding of a root
ROOT = 1e-8  # of the same: that of one condition, found once with others and once alone, which its rate makes large
STEPS_AT_REST = 1000  # without a return, before a state without forcing may count as an equilibrium
RATE_AT_REST = 1e-15  # of the terms of a rate
SCALE_OF_LIMIT = 1e-9  # the scale of a state, of the size beyond which it has diverged
SAME = 1e-9  # of a node spacing: the section is met by the transition that is so close


@inline
def set_phase(n, m, work, s):
    """Harmonics of the forcing at the time s in the period."""
    w, rates = work.w, work.rates
    for h in range((m - n - 1) >> 1):
        w[n + 1 + 2 * h] = cos(rates[h] * s)
        w[n + 2 + 2 * h] = sin(rates[h] * s)


@inline
def wrap_phase(tables, work, mode, s):
    """Harmonics of the forcing at a time s shorter than a step of the mode, from its table: no drift over periods."""
    n, m = states_of(tables.field), width_of(tables.field)
    w, rates, rot = work.w, work.rates, tables.rot
    spacing = tables.info[mode, 1]
    node = min(int(s / spacing + 0.5), NODES)
    local = s - node * spacing
    for h in range((m - n - 1) >> 1):
        c, s_ = turn(rates[h] * local, rot[mode, node, 2 * h], rot[mode, node, 2 * h + 1])
        w[n + 1 + 2 * h] = c
        w[n + 2 + 2 * h] = s_


@once
def prepare(i, form, motion, tables, work):
    """Tables of point i, and where the motion is."""
    n, m, w, own = states_of(tables.field), width_of(tables.field), work.w, motion.u.shape[0]
    build(i, form, tables, work)
    for j in range(own):
        w[j] = motion.u[j]
    for j in range(own, n):
        w[j] = motion.memory[j - own]
    w[n] = 1.0
    set_phase(n, m, work, motion.clock[0])


@once
def start_on_section(form, section, tables, work):
    """The sign of the section's functional where a run begins."""
    work.found[SIDE] = sign_after(tables, work, work.tally[MODE], section.indicator)


@once
def next_stop(i, form, net, section, goal, work):
    """Time of the next time-triggered transition of the mode, and that transition (-1: none)."""
    period, s, mode = form.period[i], work.memo[TIME], work.tally[MODE]
    stop = NO_END
    which = -1
    for k in range(net.mode_start[mode], net.mode_start[mode + 1]):
        t = net.mode_list[k]
        if net.at[t] >= 0.0:
            r = net.at[t] * period
            if r <= s:
                r += period
            if r < stop:
                stop = r
                which = t
    return stop, which


@inline
def blocked(tables, work, mode, rows, lo, hi, h, w1, root):
    """Return the first of the rows lo..hi that certainly stays <= 0 for a time h, behind which w is w1; -1: none.

    The functional ``root`` is zero there (-1: of none is that known)."""
    w, zero = work.w, work.zero
    found = -1
    for r in range(lo, hi):
        f = rows[r, 0]
        sign = float(rows[r, 1])
        g0, s0, g1, s1 = at_ends(tables, mode, f, w, w1)
        g0, s0, g1, s1 = sign * g0, sign * s0, sign * g1, sign * s1
        if f < zero.shape[0] and zero[f] != 0:  # what it is not zero by is rounding, all the time
            g1 -= g0
            g0 = 0.0
            if zero[f] >= 2:
                s0 = 0.0
        if f == root:
            g1 = 0.0
        if classify(g0, s0, g1, s1, h, bound_at(tables, work.row, mode, f, w)) == NEVER:
            if holds_throughout(work, rows, r):
                continue
            found = r
            break
    return found


@inline
def begins_with(rows, lo, hi, r):
    """Return whether the first of the rows lo..hi is the condition of row r (-1: none)."""
    return r >= 0 and lo < hi and rows[lo, 0] == rows[r, 0] and rows[lo, 1] == rows[r, 1]


@once
def first_open(tables, net, work, mode):
    """The place in the mode's list of the first transition that may fire on the step from w to w1; -1: none may."""
    place, low = -1, -1
    for k in range(net.mode_start[mode], net.mode_start[mode + 1]):
        lo, hi = net.row_start[net.mode_list[k]], net.row_start[net.mode_list[k] + 1]
        if begins_with(net.rows, lo, hi, low):
            continue
        low = blocked(tables, work, mode, net.rows, lo, hi, tables.info[mode, 0], work.w1, -1)
        if low < 0:
            place = k - net.mode_start[mode]
            break
    return place


@once
def stride(tables, net, work, mode, s, whole, target, period, returns, most, patience):
    """Whole steps without crossings, past section phases, as long as ``returns`` < ``most``; ``patience`` of them.

    Returns (s, whole, returns, first, patience left); w1 then stands at the end of the next step, on which the mode's
    transition at the place ``first`` may fire, or none (-1; the step would be one return too many)."""
    n, m = states_of(tables.field), width_of(tables.field)
    w, w1 = work.w, work.w1
    step = tables.info[mode, 0]
    whole_step(tables, work, mode)
    first = 0
    while patience > 0:
        first = first_open(tables, net, work, mode)
        if first >= 0:
            break
        patience -= 1
        after = s + step
        if (s < target and target <= after) or (s < target + period and target + period <= after):
            if returns + 1 >= most:
                break
            returns += 1
        first = 0
        s = after
        for j in range(m):
            w[j] = w1[j]
        if s >= period:
            s -= period
            whole += 1.0
            wrap_phase(tables, work, mode, s)
            lost = False
            for r in range(n):
                lost = lost or not fabs(w[r]) < 1e300
            if lost:
                break
        pass_on(tables, work, mode)
        whole_step(tables, work, mode)
    return s, whole, returns, first, patience


@once
def steps_at_a_stride(i, form, net, section):
    """Return whether whole steps may be made at a stride: nothing but a crossing can end one."""
    strides = section.indicator < 0 and form.period[i] < NO_END
    for k in range(net.at.shape[0]):
        strides = strides and net.at[k] < 0.0
    return strides


@inline
def vanishes(tables, mode, f, w):
    """Return whether functional f is zero at w within rounding."""
    return fabs(value_of(tables, mode, f, w)) <= noise(tables, mode, f, tables.info[mode, 0], w)


@once
def leg(i, form, net, section, goal, tables, work, r_max, ready, first):
    """March one step of the mode, or less: to r_max, or to the first crossing or section return.

    w1 stands at the end of the whole step (``ready``: it does so already). Of the mode's transitions only those from
    place ``first`` on may fire on it (-1: none may, and nothing else happens).
    ``end`` stands at the segment's end where that is shorter (the third number returned tells). Returns (time marched,
    transition or -1, whole step or not, section direction or 0).
    """
    m = width_of(tables.field)
    end, there, found, rows = work.end, work.there, work.found, net.rows
    mode = work.tally[MODE]
    found[NODE] = -1
    step = tables.info[mode, 0]
    if first < 0:
        return step, -1, True, 0
    if not ready:
        whole_step(tables, work, mode)
    best = min(step, r_max)
    fired = -1
    crossed = 0
    functional = -1
    low = -1
    n_rows = rows.shape[0]
    start = net.mode_start[mode]
    n_own = net.mode_start[mode + 1] - start
    n_all = n_own  # a motion that stays on the section's surface (SIDE 0) does not pass it
    if section.indicator >= 0 and found[SIDE] != 0 and (section.mode < 0 or section.mode == mode):
        n_all += 2
    for k in range(first, n_all):
        t = -1
        sense = 0
        if k < n_own:
            t = net.mode_list[start + k]
            lo = net.row_start[t]
            hi = net.row_start[t + 1]
        else:
            sense = 1 - 2 * (k - n_own)
            lo = n_rows - 2 + k - n_own
            hi = lo + 1
        if lo == hi or section.rising * sense < 0:
            continue
        if fired >= 0 or crossed != 0:  # what counts still must happen before
            if begins_with(rows, lo, hi, low):
                continue
            low = blocked(tables, work, mode, rows, lo, hi, best, end, functional)
            if low >= 0:
                continue
        tau = search(tables, work, mode, rows, lo, hi, sense * found[SIDE] > 0, best)
        if sense != 0 and tau >= 0.0 and fired >= 0 and best - tau < SAME * tables.info[mode, 1]:
            if functional == section.indicator or vanishes(tables, mode, section.indicator, end):
                found[SIDE] = -sense
                continue  # the transition there passes the section
        if fired >= 0 and sense == 0 and begins_with(rows, lo, hi, net.row_start[fired]):
            near = ROOT if functional == rows[lo, 0] else AT_ONCE
            if tau >= best - near * tables.info[mode, 1]:  # the same root: what was declared first comes first
                continue
        if tau >= 0.0 and (tau < best or (fired < 0 and crossed == 0 and tau <= best)):
            best = tau
            fired = t
            crossed = sense
            functional = found[FUNCTIONAL]
            for j in range(m):
                end[j] = there[j]
    work.tally[FIRED] = functional
    whole = fired < 0 and crossed == 0 and r_max >= step
    if not whole and functional < 0:
        dense(tables, work, mode, best, end)
    return best, fired, whole, crossed


@once
def time_scale(i, since, form, tables, work):
    """The time beside which crossings are close to each other: a step, no longer than the period or all time so far."""
    return min(tables.info[work.tally[MODE], 0], form.period[i] if form.period[i] < NO_END else work.memo[TIME] + since)


@once
def arrive_at(t, since, full, wrapped, form, net, tables, work):
    """State and phase at the end of a segment. Returns its transition."""
    m = width_of(tables.field)
    w, w1, end = work.w, work.w1, work.end
    for j in range(m):
        w[j] = w1[j] if full else end[j]
    if wrapped:
        wrap_phase(tables, work, work.tally[MODE], work.memo[TIME])
    pass_on(tables, work, work.tally[MODE])
    return t


@once
def met(t, fired, form, net, section, tables, work):
    """Direction in which transition t, whose functional ``fired`` has crossed, meets the section; 0: it does not.

    It does where the section's functional comes to zero with it. The direction is that of the arrival or, where the
    functional stays zero, of the departure: an impact does both."""
    sense, f, source = 0, section.indicator, work.tally[SOURCE]
    if fired == f:
        for k in range(net.row_start[t], net.row_start[t + 1]):
            if net.rows[k, 0] == fired:
                sense = net.rows[k, 1]
    if sense == 0 and vanishes(tables, source, f, work.before):
        if slope_of(tables, source, f, work.before) * work.found[SIDE] < 0.0:
            sense = -work.found[SIDE]
    if section.rising * sense < 0:
        back = work.zero[f] != 0 and sign_after(tables, work, work.tally[MODE], f) == section.rising
        sense = section.rising if back else 0
    return sense


@once
def touch_section(section, work):
    """The section's indicator is zero just now."""
    work.zero[section.indicator] = 1


@once
def note_side(t, sense, section, tables, work):
    """The sign of the section's functional where the next segment begins; 0 as long as the motion stays on it."""
    mode = work.tally[MODE]
    if t >= 0:
        work.found[SIDE] = sign_after(tables, work, mode, section.indicator)
    elif sense != 0:
        work.found[SIDE] = sense
    elif work.found[SIDE] != 0:
        value = value_of(tables, mode, section.indicator, work.w)
        if value == 0.0 and not flat(tables, mode, section.indicator, work.w, work):
            value = -slope_of(tables, mode, section.indicator, work.w)  # it comes from the other side
        if value != 0.0:
            work.found[SIDE] = 1 if value > 0.0 else -1


@once
def at_rest(form, section, goal, tables, work):
    """Return whether a state without forcing no longer moves, so that no section is met again: its rates are rounding,
    many steps after the last return."""
    n, m, w, mode = states_of(tables.field), width_of(tables.field), work.w, work.tally[MODE]
    if form.period[0] < NO_END or work.tally[TRIES] <= STEPS_AT_REST:
        return False
    for i in range(n):
        rate, size = 0.0, 0.0
        for j in range(m):
            term = tables.field[mode, i, j] * w[j]
            rate += term
            size += fabs(term)
            if j < goal.limit.shape[0]:
                size += fabs(tables.field[mode, i, j]) * SCALE_OF_LIMIT * goal.limit[j]
        if fabs(rate) > RATE_AT_REST * size:
            return False
    return True


@once
def state_at(tau, form, tables, work, out):
    """The state at any instant of the segment."""
    dense(tables, work, work.tally[MODE], tau, out)


@once
def memory_at(k, own, form, work):
    """The k-th value in memory, of a system with so many states of its own."""
    return work.w[own + k]


@once
def put_state(motion, work):
    """Write the state to the motion."""
    own = motion.u.shape[0]
    for j in range(own):
        motion.u[j] = work.w[j]
    for j in range(motion.memory.shape[0]):
        motion.memory[j] = work.w[own + j]


@once
def bounded(work, limit):
    """Finite and below the limits of divergence."""
    within = True
    for r in range(STATES if STATES > 0 else limit.shape[0]):
        within = within and fabs(work.w[r]) < limit[r]
    return within


@once
def may_pause(work):
    """All that is known stands in the arrays."""
    return True


@once
def doubtful(work):
    """Crossings are found with certainty."""
    return False
