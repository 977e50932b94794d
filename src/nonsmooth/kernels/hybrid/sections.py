"""Section returns of a run: its kept points, with extremes and counts of the kept window.

Of ``transient`` + ``keep`` returns the last ones are kept. The window reaches from the last transient return (or the
start) to the last kept one; its end is where a carried state goes on.
"""

from math import floor, inf

from nonsmooth.kernels.compile.cache import inline, once
from nonsmooth.kernels.hybrid.codes import (
    CLOSED,
    JUMPS,
    LATE,
    LOOKED,
    MODE,
    MOST_STEPS,
    NO_CONVERGENCE,
    NO_END,
    NOTED_AT,
    NOTED_CONTACTS,
    NOTED_CROSSINGS,
    NOTED_MODE,
    NOTED_TIME,
    OK,
    OPEN_RUN,
    PASSES,
    PERIODS,
    REPEATS_WITHIN,
    RETURNS,
    SINCE,
    TIME,
    TRIES,
    WAITED,
)
from nonsmooth.kernels.hybrid.kept import Kept
from nonsmooth.kernels.linear.extremes import widen
from nonsmooth.kernels.linear.stepper import at_rest, memory_at, note_side, state_at, stride


@once
def stroboscopic_hit(s, s1, target, period):
    """Time after s at which the section phase is met within (s, s1], or -1; judged on the clock: none counts twice."""
    if s < target and target <= s1:
        return target - s
    if s < target + period and target + period <= s1:
        return target + period - s
    return -1.0


@inline
def window_of(kept, row):
    """The arrays of one run."""
    return Kept(
        kept.section[row],
        kept.high[row],
        kept.low[row],
        kept.crossings[row : row + 1],
        kept.contacts[row : row + 1],
        kept.elapsed[row : row + 1],
        kept.section_time[row],
        kept.section_mode[row],
        kept.status[row : row + 1],
    )


@once
def open_returns(seen):
    """Begin extremes and counts of a run."""
    for k in range(seen.high.shape[0]):
        seen.high[k], seen.low[k] = -inf, inf
    seen.crossings[0] = 0
    seen.contacts[0] = 0
    seen.elapsed[0] = 0.0


@once
def returns_watched(section, goal, work):
    """Return whether extremes on the segment are wanted."""
    return section.extremes != 0 and work.tally[RETURNS] >= goal.transient


@once
def next_is_edge(section, goal, work):
    """Return whether the next pass of the section opens or closes the kept window."""
    if (work.tally[PASSES] + 1) % section.every != 0:
        return False
    returns = work.tally[RETURNS] + 1
    return returns == goal.transient or returns == goal.transient + goal.keep


@once
def hurry(i, form, net, section, goal, seen, tables, work, patience):
    """Whole steps without crossings, where extremes need not be seen. Returns (w1 stands at the end of the step that is
    next, the place of the first transition that may fire on it or -1, patience left)."""
    tally, memo = work.tally, work.memo
    returns = tally[RETURNS]
    if not (returns < goal.transient or section.extremes == 0):
        return False, 0, patience
    T = form.period[i]
    began, turns = memo[TIME], memo[PERIODS]
    s, whole, counted, first, patience = stride(
        tables,
        net,
        work,
        tally[MODE],
        began,
        turns,
        section.phase * T,
        T,
        returns,
        goal.transient if returns < goal.transient else 0,
        patience,
    )
    if counted > returns:
        tally[RETURNS] = counted
        tally[JUMPS], tally[TRIES] = 0, 0
    if s != began or whole != turns:
        memo[SINCE] = 1e300
        if counted >= goal.transient:
            seen.elapsed[0] += (whole - turns) * T + (s - began)
        memo[TIME], memo[PERIODS] = s, whole
    return True, first, patience


@inline
def keep_point(k, u, mode, time, seen):
    """The k-th kept point of the section."""
    for j in range(seen.section.shape[1]):
        seen.section[k, j] = u[j]
    seen.section_mode[k] = mode
    seen.section_time[k] = time


@once
def observe_returns(i, step, stop, triggered, form, section, goal, seen, tables, work):
    """Returns at a phase of the forcing on the segment, and extremes of its part in the kept window.

    CLOSED: the last return, where the run ends. LATE: a transition at the section's own phase comes first; a run that
    ends here goes on behind it."""
    tally, memo = work.tally, work.memo
    s, T = memo[TIME], form.period[i]
    is_open = tally[RETURNS] >= goal.transient
    a, b, state = 0.0, step, OPEN_RUN
    if section.indicator < 0:
        target = section.phase * T
        after = stop if stop >= 0.0 else s + step
        r = stroboscopic_hit(s, after, target, T)
        if r >= step and triggered:
            state = LATE
        elif r >= 0.0:
            r = min(r, step)
            tally[RETURNS] += 1
            tally[JUMPS], tally[TRIES] = 0, 0
            if is_open:
                state_at(r, form, tables, work, work.wp)
                turn = memo[PERIODS] if s < target and target <= after else memo[PERIODS] + 1.0
                keep_point(tally[RETURNS] - goal.transient - 1, work.wp, tally[MODE], turn * T + target, seen)
                if tally[RETURNS] >= goal.transient + goal.keep:
                    state, b = CLOSED, r
                    memo[PERIODS] = turn
            elif tally[RETURNS] == goal.transient:
                is_open, a = True, r
    if is_open:
        if section.extremes != 0:
            widen(a, b, form, tables, work, seen)
        seen.elapsed[0] += b - a
    if state == CLOSED:
        memo[TIME] = section.phase * T
        for j in range(seen.section.shape[1]):
            work.w[j] = seen.section[goal.keep - 1, j]
    return state


@once
def mark_return(step, work):
    """Count a segment."""
    work.memo[WAITED] += step
    work.tally[TRIES] += 1


@once
def count_transition(t, net, goal, seen, work):
    """Count a transition in the kept window."""
    if work.tally[RETURNS] >= goal.transient:
        seen.crossings[0] += 1
        seen.contacts[0] += net.transitions[t, 2]


@once
def arrive_at_section(i, code, source, t, sense, state, form, section, goal, seen, tables, work):
    """Returns at the end of a segment: on a surface, or behind a transition at the section's phase. Gives a status."""
    tally, memo, T = work.tally, work.memo, form.period[i]
    mode = tally[MODE]
    if sense != 0:
        tally[PASSES] += 1
        tally[TRIES] = 0
        tally[JUMPS] = 0
        memo[WAITED] = 0.0
        if tally[PASSES] % section.every == 0:
            tally[RETURNS] += 1
            if tally[RETURNS] > goal.transient:
                after = section.after != 0 or t < 0
                time = (memo[PERIODS] * T if T < NO_END else 0.0) + memo[TIME]
                where = work.w if after else work.before
                keep_point(tally[RETURNS] - goal.transient - 1, where, mode if after else source, time, seen)
    if state == LATE and code == OK:
        memo[TIME] = section.phase * T
        tally[RETURNS] += 1
        tally[JUMPS], tally[TRIES] = 0, 0
        if tally[RETURNS] > goal.transient:
            keep_point(tally[RETURNS] - goal.transient - 1, work.w, mode, memo[PERIODS] * T + memo[TIME], seen)
    if section.indicator >= 0:
        note_side(t, sense, section, tables, work)
        waited = memo[WAITED] >= section.t_max * (1.0 - 1e-12)
        if code == OK and (waited or memo[WAITED] > 1e100 or at_rest(form, section, goal, tables, work)):
            code = NO_CONVERGENCE
    if code == OK and tally[TRIES] > MOST_STEPS:
        code = NO_CONVERGENCE
    return code


@once
def note_place(form, seen, work):
    """Note where a run stands, and what it has counted."""
    tally, n = work.tally, work.w.shape[0]
    tally[NOTED_AT], tally[NOTED_MODE], work.memo[NOTED_TIME] = tally[RETURNS] + 1, tally[MODE], work.memo[TIME]
    tally[NOTED_CROSSINGS], tally[NOTED_CONTACTS] = seen.crossings[0], seen.contacts[0]
    for j in range(work.before.shape[0]):
        work.before[j] = work.w[j] if j < n else memory_at(j - n, n, form, work)


@once
def is_noted(form, work):
    """Return whether a run stands at the place noted, bit for bit."""
    tally, n = work.tally, work.w.shape[0]
    same = tally[MODE] == tally[NOTED_MODE] and work.memo[TIME] == work.memo[NOTED_TIME]
    for j in range(work.before.shape[0]):
        same = same and work.before[j] == (work.w[j] if j < n else memory_at(j - n, n, form, work))
    return same


@once
def leave_out(i, form, section, goal, seen, work):
    """Leave out what repeats itself bit for bit, but for its last repetition: of the returns that are not kept, then of
    those that are.

    Behind the first transition after a return the whole place of the run is compared with one that was noted at most
    ``REPEATS_WITHIN`` returns before. What is kept of the returns left out is what was kept a repetition before."""
    tally, returns = work.tally, work.tally[RETURNS]
    if tally[LOOKED] == returns + 1 or returns >= goal.transient + goal.keep:
        return
    tally[LOOKED] = returns + 1
    lag, is_open = returns + 1 - tally[NOTED_AT], returns >= goal.transient
    if tally[NOTED_AT] == 0 or (is_open and tally[NOTED_AT] <= goal.transient):
        note_place(form, seen, work)
    elif is_noted(form, work):
        turns = (goal.transient + (goal.keep if is_open else 0) - returns - 1) // lag
        if is_open:
            T, first = form.period[i], returns - goal.transient
            for k in range(first, first + turns * lag):
                turn = floor(seen.section_time[k - lag] / T - section.phase + 0.5) + lag
                keep_point(k, seen.section[k - lag], seen.section_mode[k - lag], turn * T + section.phase * T, seen)
            seen.crossings[0] += turns * (seen.crossings[0] - tally[NOTED_CROSSINGS])
            seen.contacts[0] += turns * (seen.contacts[0] - tally[NOTED_CONTACTS])
            seen.elapsed[0] += turns * lag * T
        tally[RETURNS] += turns * lag
        tally[LOOKED] += turns * lag
        work.memo[PERIODS] += turns * lag
    elif lag >= REPEATS_WITHIN:
        note_place(form, seen, work)
