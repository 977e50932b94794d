"""The hybrid loop: one trajectory through legs and transitions, over a stepper and an observer.

The *stepper* (``linear_march`` and what it stands on) knows the flow: it prepares the tables of a point, marches a leg
to its first crossing, lands there, takes transitions and says which conditions hold just after. The *observer*
(``sections``, ``record`` or ``growth``, joined behind this file) says how far to go and looks at each leg and each
transition. Everything else is here: start rule, triggers, transitions of one instant in declared order, guards of
chatter, the clock.

All that a run knows beside its state stands in ``work.tally`` and ``work.memo``: it may pause and go on.
"""

from .cache import inline
from .codes import CHATTER, DIVERGED, OK, PAUSED, TOO_MANY_CROSSINGS
from .linear_march import (
    bounded,
    jump,
    leg,
    mark_zeros,
    next_holding,
    set_phase,
    settle,
    sign_after,
    trigger,
    wrap_phase,
)
from .linear_search import FUNCTIONAL, NODE, SIDE
from .linear_tables import ONE, STATES, M, build, hide_lacking
from .run_places import (
    BEGUN,
    BURST,
    BURST_LENGTH,
    JUMPS,
    MODE,
    MOST_CROSSINGS,
    PERIODS,
    SHORT,
    SINCE,
    TIME,
)


@inline
def begin(i, form, net, section, motion, tables, work):
    """Tables, state and mode where a run begins, by the start rule. Returns a status."""
    build(i, form, tables, work)
    hide_lacking(net, tables, work)
    w, tally, memo = work.w, work.tally, work.memo
    for k in range(tally.shape[0]):
        tally[k] = 0
    for k in range(memo.shape[0]):
        memo[k] = 0.0
    tally[BEGUN] = 1
    memo[TIME], memo[PERIODS], memo[SINCE] = motion.clock[0], motion.clock[1], 1e300
    for j in range(STATES):
        w[j] = motion.u[j]
    w[ONE] = 1.0
    set_phase(work, memo[TIME])
    mode, code = motion.counters[0], OK
    mark_zeros(tables, work, mode)
    if motion.counters[1] == 0:
        mode, code = settle(i, form, tables, net, work, mode)
    if section.indicator >= 0:  # a start on the section is no return
        work.found[SIDE] = sign_after(tables, work, mode, section.indicator)
    tally[MODE] = mode
    return code


@inline
def land(i, step, crossed, full, form, tables, work):
    """End a leg: state, clock and phase of the forcing. Returns (a period has ended, closely behind a crossing)."""
    w, w1, end, memo, zero = work.w, work.w1, work.end, work.memo, work.zero
    mode, T = work.tally[MODE], form.period[i]
    short = memo[SINCE] + step < SHORT * tables.info[mode, 0]
    memo[SINCE] = 0.0 if crossed else memo[SINCE] + step
    for j in range(M):
        w[j] = w1[j] if full else end[j]
    s = memo[TIME] + step
    wrapped = s >= T
    if wrapped:
        s -= T
        memo[PERIODS] += 1.0
        wrap_phase(tables, work, mode, s)
    memo[TIME] = s
    for f in range(zero.shape[0]):
        zero[f] = 0
    return wrapped, short


@inline
def transit(i, t, short, form, net, section, goal, seen, tables, work):
    """Transition t and those that hold just after it, at the same instant. Returns (status, section direction)."""
    found, tally = work.found, work.tally
    mode, code, sense = tally[MODE], OK, 0
    source, fired = mode, found[FUNCTIONAL]
    if section.indicator >= 0 and fired == section.indicator:
        for k in range(net.row_start[t], net.row_start[t + 1]):
            if net.rows[k, 0] == fired:
                sense = net.rows[k, 1]
    approach(mode, fired, seen, tables, work)
    jumps = 0
    while t >= 0:
        if jumps > net.mode_start.shape[0] + 1:  # modes + 3 of them at one instant, as by series
            code = CHATTER
            break
        mode = jump(i, t, fired if jumps == 0 else -1, form, tables, net, work)
        cross(i, t, mode, jumps, form, net, goal, seen, tables, work)
        tally[MODE] = mode
        jumps += 1
        t = next_holding(tables, net, work, mode)
    depart(jumps, seen, work)
    tally[JUMPS] += jumps
    tally[BURST] = tally[BURST] + 1 if short else 0
    if tally[BURST] > BURST_LENGTH:
        code = CHATTER
    elif tally[JUMPS] > MOST_CROSSINGS:
        code = TOO_MANY_CROSSINGS
    # a section that lies on the surface just crossed
    if sense != 0 and section.rising * sense >= 0:
        if section.mode < 0 or section.mode == (mode if section.after != 0 else source):
            return code, sense
    return code, 0


@inline
def march(i, form, net, section, goal, motion, seen, tables, work):
    """Point i until its goal is reached. Returns a status: PAUSED and LOG_FULL ask to be called again.

    ``work`` then holds where it stands; ``leave`` writes that to the motion."""
    w, tally, memo, found = work.w, work.tally, work.memo, work.found
    code = OK
    if tally[BEGUN] == 0:
        code = begin(i, form, net, section, motion, tables, work)
        open_window(i, form, section, seen, tables, work)
    T = form.period[i]
    patience = goal.patience
    strides = may_stride(i, form, net, section)
    while code == OK and not reached(goal, work):
        patience -= 1
        code = PAUSED if patience < 0 else room(seen, work)
        if code != OK:
            break
        mode = tally[MODE]
        ready, clear = False, False
        if strides:
            ready, clear, patience = hurry(i, form, net, section, goal, seen, tables, work, patience)
        wait, timed = 1e300, -1
        if not strides:
            wait, timed = trigger(net, mode, memo[TIME], T)
        rest = remaining(goal, work)
        if clear:
            step, t, full, sense = tables.info[mode, 0], -1, True, 0
            found[NODE] = -1
        else:
            step, t, full, sense = leg(tables, net, work, section, mode, min(wait, rest), ready)
        if t < 0 and sense == 0 and timed >= 0 and step >= wait:
            t = timed
            found[FUNCTIONAL] = -1
        state = observe(i, step, full, t >= 0 and t == timed, form, net, section, goal, seen, tables, work)
        if state == CLOSED:
            break
        wrapped, short = land(i, step, t >= 0, full, form, tables, work)
        mark(i, wrapped, step >= rest and t < 0, t >= 0, step, form, goal, seen, work)
        if section.indicator >= 0:
            for j in range(STATES):
                work.before[j] = w[j]
        if t >= 0:
            code, sense = transit(i, t, short, form, net, section, goal, seen, tables, work)
        elif sense != 0:
            work.zero[section.indicator] = 1
        if not bounded(w, goal.limit):
            code = DIVERGED
        code = arrive(i, code, mode, t, sense, state, form, section, goal, seen, tables, work)
    return code


@inline
def leave(i, form, motion, work):
    """Write where a run stands to the motion."""
    T = form.period[i]
    for j in range(STATES):
        motion.u[j] = work.w[j]
    motion.clock[0] = work.memo[TIME]
    motion.clock[1] = work.memo[PERIODS]
    motion.clock[2] = T if T < 1e300 else 0.0
    motion.counters[0] = work.tally[MODE]
    work.tally[BEGUN] = 0
